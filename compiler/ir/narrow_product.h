// narrow_product.h -- products of numbers of 16 bits in 32-bit lanes, which machines add in pairs.
#pragma once

#include <optional>

#include "ir/expr.h"

namespace retrograde::ir {

struct NarrowProduct {
  Expr a, b;  // of int16
};

// Factors with e == int32(a) * int32(b), lane by lane; a number of 16 bits alone is its product
// with one. None when e is no vector of int32, or may need larger factors.
std::optional<NarrowProduct> as_narrow_product(const Expr& e);

}  // namespace retrograde::ir
