// interpreter.h -- the oracle of the tests: evaluates the definitions of Funcs point by point, in the declared order,
// without schedules, bounds inference or lowering.
//
//   Interpreter interpreter;
//   std::vector<Array> out = interpreter.realize(func, {{0, 0}, {64, 48}});
//
// Order: the pure definition, then the updates in turn, each over its reduction domain with the first RVar fastest. All
// loads of a point happen before its stores.
//
// Demand: a pure Func is evaluated, and memoised, at the points that are read. A Func with updates is split into slices
// along the dimensions that every definition leaves pure; slices are independent. Within a slice the domain is the
// smallest box around the requested points and those that the updates access. It is found by running the updates, and
// by running them again if they accessed points outside.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "graph/function.h"
#include "testing/array.h"

namespace retrograde::oracle {

struct InterpreterOptions {
  bool widen = false;                    // every float type becomes float64
  Rounding rounding = Rounding::Strict;  // the freedom that Value::error accounts for
  size_t max_points = size_t{1} << 24;  // limit for one Func; more is a UserError instead of a hang
  uint64_t max_operations = UINT64_MAX;  // limit for one interpreter; likewise
};

class Interpreter {
 public:
  explicit Interpreter(InterpreterOptions options = {});
  ~Interpreter();

  // Returns one Array for each value of the Func. Throws RuntimeError for an image read outside of its bounds, an
  // unbound parameter, or a failing require.
  std::vector<Array> realize(const graph::FuncPtr& func, const Region& region);
  std::vector<Array> realize(const std::vector<graph::FuncPtr>& funcs,
                             const std::vector<Region>& regions);

  // The smallest box around the elements of an image that were read so far; no extents if there are none.
  Region touched(const graph::ParameterContents& image) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace retrograde::oracle
