// widen.h -- copies a graph of Funcs in double, as the reference for the precision that float32 loses.
//
// Inputs become new parameters in double, so they can change by less than a float32 resolves. The fast_* functions
// become the functions that they approximate. Random numbers do not change.
//
// Optionally every computed value of every definition is multiplied by 1 + amount * u, with u in [-1, 1) drawn from the
// seed, the Func and the point. This is Parker's Monte Carlo arithmetic with one random rounding for each value of a
// Func instead of each operation.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "graph/function.h"

namespace retrograde::checks {

struct Widened {
  std::map<const Symbol*, FuncPtr> funcs;
  // Floating-point images and scalars; unbound.
  std::map<const Symbol*, std::shared_ptr<ParameterContents>> parameters;
};

struct Rounding {
  Expr amount;  // double
  Expr seed;    // int32
};

// Copies the graph in double. Throws Unsupported for C functions, extern stages, and the bits of floats.
Widened widen(const std::vector<FuncPtr>& outputs, const Rounding& rounding = {});

}  // namespace retrograde::checks
