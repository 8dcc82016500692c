// narrow_product.h -- recognises products of 16-bit integers in 32-bit lanes, which processors
// multiply and add in pairs.
#pragma once

#include <optional>

#include "ir/expr.h"

namespace retrograde::ir {

struct NarrowProduct {
  Expr a, b;  // of int16
};

// Factors with e == int32(a) * int32(b) in each lane; a 16-bit value alone is its product with 1.
// Returns nothing when `e` is not a vector of int32 or may need wider factors.
std::optional<NarrowProduct> as_narrow_product(const Expr& e);

}  // namespace retrograde::ir
