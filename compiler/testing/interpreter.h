// The oracle: evaluates the definitions of Funcs point by point, in the declared order, without
// schedules, bounds inference or lowering.
//
//   Interpreter interpreter;
//   std::vector<Array> out = interpreter.realize(func, {{0, 0}, {64, 48}});
//
// Order: the pure definition, then the updates in turn, each over its reduction domain with the
// first RVar fastest; all loads of a point happen before its stores.
//
// Demand: a pure Func is evaluated at the points that are read, memoised. A Func with updates is
// cut into slices along the dimensions that every definition leaves pure: slices are independent.
// Within a slice the domain is the smallest box around what was asked for and what the updates
// touch; it is found by running them, and running them again when they reached outside.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "graph/function.h"
#include "testing/array.h"

namespace retrograde::oracle {

struct InterpreterOptions {
  bool widen = false;                    // every float type becomes float64
  Rounding rounding = Rounding::Strict;  // freedom to account for in Value::error
  size_t max_points = size_t{1} << 24;   // of one Func; more is a UserError, not a hang
  uint64_t max_operations = UINT64_MAX;  // of one interpreter; the same
};

class Interpreter {
 public:
  explicit Interpreter(InterpreterOptions options = {});
  ~Interpreter();

  // One Array for each value of the Func. RuntimeError: an image read outside of its bounds, an
  // unbound parameter, a require that fails.
  std::vector<Array> realize(const graph::FuncPtr& func, const Region& region);
  std::vector<Array> realize(const std::vector<graph::FuncPtr>& funcs,
                             const std::vector<Region>& regions);

  // The smallest box around the elements of an image that were read so far; no extents when none.
  Region touched(const graph::ParameterContents& image) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace retrograde::oracle
