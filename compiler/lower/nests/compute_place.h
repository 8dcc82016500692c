// compute_place.h -- a place inside a loop where Funcs are computed, with the names that are bound there and their
// values.
//
// A Func that slides over a loop computes only a part of the region that an iteration needs. Code at the place refers
// to the part by name ("f.s0.y.min"). Code further out needs the complete region, so the name of a part stands for an
// interval: either all values it takes in the end, or the values within one iteration.
#pragma once

#include <string>
#include <vector>

#include "analysis/interval.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/storage/sliding_window.h"

namespace retrograde::lower {

class ComputePlace {
 public:
  explicit ComputePlace(std::vector<Loop> around) : around(std::move(around)) {}

  const std::vector<Loop> around;  // loops of the consumer, innermost first; empty at root
  Lets bindings;                   // to be bound around the place; each may use those before it

  // Binds names to the ends of the range, unless they are names or constants, and expresses the range in terms of them.
  Range bind(const std::string& name, Interval& range);
  // The same for the part that a slide computes; its ends always get names.
  Range bind_part(const std::string& name, const Slide& slide, Interval& range);

  // Registers a name that is already bound as an end of a part.
  void bind_part(const std::string& name, const Interval& whole) {
    note_part(variable(name), whole, whole);
  }

  // The box in terms of names outside of the place: over all iterations, or within one iteration.
  Box whole(const Box& box) { return expand(box, whole_); }
  Box touched(const Box& box) { return expand(box, touched_); }
  // Whether an end depends on a part of a sliding Func that may be empty.
  bool mentions_parts(const Interval& side) const;
  bool has_names() const { return !bindings.empty(); }
  // The expression with names of single values replaced by their values.
  Expr without_names(const Expr& e);

 private:
  Substitution values_;  // of names with a single value, in terms of parts and outer names
  size_t known_ = 0;     // number of bindings that values_ contains
  std::vector<std::string> parts_;          // names of ends
  std::vector<std::string> varying_parts_;  // names of ends of parts whose extent varies
  Scope<Interval> whole_, touched_;

  Expr name(const std::string& name, const Expr& value, bool always);
  void note_part(const Expr& end, const Interval& whole, const Interval& touched);
  void learn_names();
  Box expand(const Box& box, const Scope<Interval>& parts);
};

}  // namespace retrograde::lower
