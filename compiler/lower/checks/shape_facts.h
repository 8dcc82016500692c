// shape_facts.h -- the names of the shapes of buffers in a generated function, "in.min.0" and so on.
//
//   let in.min.0.actual = buffer_min(in.buffer, 0)
//   let in.extent.0 = buffer_extent(in.buffer, 0)
//   let in.min.0 = 8                                   promised by in.dim(0).set_min(8)
//
// Where a fact is promised, the code below uses the promise, and a check compares it with the ".actual" fact.
#pragma once

#include <string>
#include <vector>

#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/lowered_function.h"
#include "ir/visit.h"
#include "lower/checks/buffer_constraints.h"

namespace retrograde::lower {

// The buffer as functions of the runtime take it.
Expr buffer_handle(const LoweredArgument& arg);

// The fact that the code below uses.
std::string fact_name(const LoweredArgument& arg, Metadata what, int d);
Expr fact(const LoweredArgument& arg, Metadata what, int d);
// The buffer's own value of a promised fact.
Expr actual_fact(const LoweredArgument& arg, Metadata what, int d);

class ShapeFacts {
 public:
  explicit ShapeFacts(const std::vector<LoweredArgument>& args);

  // All facts; promises come last, because they may mention others.
  Lets lets() const;

  // The expression with actual facts in the places of promised ones.
  Expr in_actual_facts(const Expr& e) const { return substitute(e, actual_); }
  // The promise in terms of actual facts. It may mention promised facts, even its own, as "a multiple of 8" does.
  BufferConstraint promise_of(const LoweredArgument& arg, int d) const;

 private:
  const std::vector<LoweredArgument>& args_;
  const Substitution actual_;  // of the names of promised facts
};

}  // namespace retrograde::lower
