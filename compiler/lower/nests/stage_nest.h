// stage_nest.h -- builds the loops of one stage from its splits, fuses and reorders.
//
//   f(x) = ...; f.split(x, xo, xi, 8)       for f.s0.xo in [0, ceil(extent / 8)):
//                                      =>     for f.s0.xi in [0, 8):
//                                               x == min(f.s0.xo * 8, extent - 8) + f.s0.xi +
//                                               f.s0.x.min
#pragma once

#include <string>
#include <vector>

#include "analysis/interval.h"
#include "ir/visit.h"
#include "lower/program.h"

namespace retrograde::lower {

using Requirements =
    std::map<std::string, Footprint>;  // the box that is read of each Func and image

struct Loop {
  std::string var;   // as the user names it: "xo"
  std::string name;  // in the IR: "f.s0.xo"
  Expr min, extent;
  ForType runs = ForType::Serial;
  Partition partition = Partition::Auto;
  // The other stage's loop that this one runs in (compute_with), which directives name; empty: it has its own loop.
  std::string runs_in = {};
  Interval range() const;
  const std::string& known_as() const { return runs_in.empty() ? name : runs_in; }
};

struct StageNest {
  std::vector<Loop> loops;  // innermost first
  Substitution coordinate;  // pure or reduction variable -> its value at a point of the loops
  // The same for bounds inference: clamped where a guard keeps the point inside.
  Substitution guarded_coordinate;
  std::vector<Expr> guards;  // the point is in the domain if and only if all hold
  bool rounds_up = false;    // the loops run beyond the domain
};

// For each pure and reduction variable of the stage, the range that the loops must cover.
using Domain = std::map<std::string, Range>;
StageNest build_stage_nest(const LoopedFunc& f, int stage, const Domain& domain);

// Whether the loops of a stage, over `extent` (> 0) coordinates of a pure variable, visit no coordinates beyond it.
bool covers_exactly(const LoopedFunc& f, int stage, const std::string& var, const Expr& extent);
// The number that divides the extent of every region along a dimension: that of align_bounds, or 1.
Expr alignment_of(const LoopedFunc& f, size_t dimension);
// Whether the loops of some stage may run beyond a region along a dimension of the Func.
bool runs_beyond_regions(const LoopedFunc& f, size_t dimension);

}  // namespace retrograde::lower
