// compute_place.h -- the place inside a loop where Funcs are computed together, and what is known there of
// the regions that were given names.
//
// A Func that slides over a loop computes only a part of what an iteration needs. Code at the site
// speaks of the part by name ("f.s0.y.min"); what is allocated and computed further out must know
// the whole. So a name of a part stands for an interval: all that it covers in the end, or all that
// one iteration touches.
#pragma once

#include <string>
#include <vector>

#include "analysis/interval.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/nests/sliding_window.h"

namespace retrograde::lower {

class ComputePlace {
 public:
  explicit ComputePlace(std::vector<Loop> around) : around(std::move(around)) {}

  const std::vector<Loop> around;  // loops of the consumer, innermost first; none at root
  Lets bindings;                   // to be bound around the site, each may use those before it

  // Gives the range a name where it is no name or constant yet, and the range in terms of it.
  Range bind(const std::string& name, Interval& range);
  // The same for what a slide computes; always named.
  Range bind_part(const std::string& name, const Slide& slide, Interval& range);

  // A name that is bound already, for an end of a part.
  void bind_part(const std::string& name, const Interval& whole) {
    note_part(variable(name), whole, whole);
  }

  // Boxes in terms of what lies around the site.
  Box whole(const Box& box) { return expand(box, whole_); }
  Box touched(const Box& box) { return expand(box, touched_); }
  // Whether an end depends on what a Func that slides computes, if that may be nothing.
  bool mentions_parts(const Interval& side) const;
  bool has_names() const { return !bindings.empty(); }
  // The same value without names that stand for one.
  Expr without_names(const Expr& e);

 private:
  Substitution values_;  // of names that stand for one value, in terms of parts and outer names
  size_t known_ = 0;     // bindings that values_ has
  std::vector<std::string> parts_,
      varying_parts_;  // names of ends; those of parts whose extent varies
  Scope<Interval> whole_, touched_;

  Expr name(const std::string& name, const Expr& value, bool always);
  void note_part(const Expr& end, const Interval& whole, const Interval& touched);
  void learn_names();
  Box expand(const Box& box, const Scope<Interval>& parts);
};

}  // namespace retrograde::lower
