// stage_nest.h -- the loops of one stage: its splits, fuses and reorders turned into loop
// variables.
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

struct Loop {
  std::string var;   // as the user names it: "xo"
  std::string name;  // in the IR: "f.s0.xo"
  Expr min, extent;
  ForType runs = ForType::Serial;
  Partition partition = Partition::Auto;
  // The loop of another stage that this one runs in, which directives name; empty: it runs alone.
  std::string runs_in = {};
  Interval range() const;
  const std::string& known_as() const { return runs_in.empty() ? name : runs_in; }
};

struct StageNest {
  std::vector<Loop> loops;  // innermost first
  Substitution coordinate;  // pure or reduction variable -> its value at a point of the loops
  // The same for bounds inference: where a guard keeps the point inside, the value says so.
  Substitution guarded_coordinate;
  std::vector<Expr> guards;  // the point is in the domain iff all hold
  bool rounds_up = false;    // the loops run beyond the domain
};

// `extent_of_domain`: for each pure and reduction variable of the stage, the range it must cover.
using Domain = std::map<std::string, Range>;
StageNest build_stage_nest(const LoopedFunc& f, int stage, const Domain& domain);

// Whether the loops of a stage, over `extent` (> 0) coordinates of a pure variable, reach none
// beyond.
bool covers_exactly(const LoopedFunc& f, int stage, const std::string& var, const Expr& extent);
// Whether some stage's loops may reach further than a region along a dimension of the Func.
bool runs_beyond_regions(const LoopedFunc& f, size_t dimension);

}  // namespace retrograde::lower
