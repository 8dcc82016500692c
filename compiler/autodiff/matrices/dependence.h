// dependence.h -- computes which elements of one Func an element of another may depend on.
//
//   f(y) = g(e(y)),  g(z) reads source(d(z))      =>      {y -> x : x = d(e(y))}
//
// The relation is a superset, proven from the definitions. Reads are composed from stage to stage as integer relations
// (isl). The branches of a select count where its condition allows; a reduction counts for its whole domain. An index
// that isl cannot represent, because it depends on data or a parameter, may have any value. If updates read elements of
// their own Func other than the one written, all elements that agree in the remaining dimensions depend on each other.
//
// For the pattern of the Jacobian this is applied to the graph of tangents, in which all constants have dropped out.
// The graph of the primal would give too large a pattern.
#pragma once

#include <isl/cpp.h>

#include "analysis/interval.h"
#include "autodiff/inversion/isl_bridge.h"
#include "graph/function.h"

namespace retrograde::autodiff {

class Dependence {
 public:
  // `source` is any Func that `f` may depend on. Throws Unsupported if an extern stage lies between, and isl::exception
  // if a part of the search takes more than `operations`.
  Dependence(const FuncPtr& f, const FuncPtr& source, unsigned long operations = isl_operations);

  // {element of f -> element of source}, without parameters. Empty if f does not depend on it.
  const isl::map& map() const { return map_; }
  // The same, restricted to elements inside of boxes; ends that are not constant are ignored.
  isl::map inside(const Box& of_f, const Box& of_source) const;
  IslContext& context() { return context_; }

 private:
  IslContext context_;
  isl::map map_;
};

}  // namespace retrograde::autodiff
