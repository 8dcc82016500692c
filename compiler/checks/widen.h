// The same graph of Funcs with every float a double: the reference for what single precision loses.
//
// Inputs become new parameters in double, so that they can move by less than a float32 resolves.
// The fast_* forms become the functions that they approximate. Random numbers stay the same ones.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "frontend/function.h"

namespace retrograde::ir {

struct Widened {
  std::map<const Symbol*, FuncPtr> funcs;
  // Floating images and scalars; unbound.
  std::map<const Symbol*, std::shared_ptr<ParameterContents>> parameters;
};

// Unsupported: C functions, extern stages, and the bits of floats.
Widened widen(const std::vector<FuncPtr>& outputs);

}  // namespace retrograde::ir
