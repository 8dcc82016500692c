// dependence -- which elements of one Func can an element of another depend on?
//
//   f(y) = g(e(y)),  g(z) reads source(d(z))      =>      {y -> x : x = d(e(y))}
//
// The relation is a superset, proven from the definitions: reads are composed from stage to stage
// as integer relations (isl); the arms of a select count where its condition allows; a reduction
// counts for all of its domain. An index that isl does not follow, because data or a parameter
// decide, may be anything. Where updates read elements of their own Func other than the one that
// they write, all elements that agree in the remaining dimensions depend on each other.
// The graph of tangents of a direction shows the pattern of the Jacobian, in which everything that
// is constant has dropped out: that of the primal would show too much.
#pragma once

#include <isl/cpp.h>

#include "analysis/interval.h"
#include "autodiff/inversion/isl_bridge.h"
#include "graph/function.h"

namespace retrograde::autodiff {

class Dependence {
 public:
  // `source` is any Func that `f` may depend on. Unsupported where an extern stage lies between;
  // isl::exception where a part of the search takes more than so many operations.
  Dependence(const FuncPtr& f, const FuncPtr& source, unsigned long operations = isl_operations);

  // {element of f -> element of source}; without parameters. Empty: f does not depend on it.
  const isl::map& map() const { return map_; }
  // The same with elements inside of boxes only; ends that are no constants do not count.
  isl::map inside(const Box& of_f, const Box& of_source) const;
  IslContext& context() { return context_; }

 private:
  IslContext context_;
  isl::map map_;
};

}  // namespace retrograde::autodiff
