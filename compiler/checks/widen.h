// The same graph of Funcs with every float a double: the reference for what single precision loses.
//
// Inputs become new parameters in double, so that they can move by less than a float32 resolves.
// The fast_* forms become the functions that they approximate. Random numbers stay the same ones.
//
// Rounding can be put back in, at random (Parker's Monte Carlo arithmetic; here once per value of a
// Func and not once per operation): every value that is computed, in any definition, is multiplied
// by 1 + amount * u, with u in [-1, 1) drawn from the seed, the Func and the point.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "graph/function.h"

namespace retrograde::checks {

struct Widened {
  std::map<const Symbol*, FuncPtr> funcs;
  // Floating images and scalars; unbound.
  std::map<const Symbol*, std::shared_ptr<ParameterContents>> parameters;
};

struct Rounding {
  Expr amount;  // double
  Expr seed;    // int32
};

// Unsupported: C functions, extern stages, and the bits of floats.
Widened widen(const std::vector<FuncPtr>& outputs, const Rounding& rounding = {});

}  // namespace retrograde::checks
