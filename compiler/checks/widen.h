// widen.h -- copies a graph of Funcs with every float widened to double: the reference for the loss of single
// precision.
//
// Inputs become new parameters in double, so that they can move by less than the resolution of float32. The fast_*
// functions become the functions that they approximate. Random numbers stay the same.
//
// On request, rounding is added at random (Parker's Monte Carlo arithmetic; here once for each value of a Func instead
// of once for each operation): every computed value, in any definition, is multiplied by 1 + amount * u, with u in [-1,
// 1) drawn from the seed, the Func and the point.
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

// Throws Unsupported for C functions, extern stages, and the bits of floats.
Widened widen(const std::vector<FuncPtr>& outputs, const Rounding& rounding = {});

}  // namespace retrograde::checks
