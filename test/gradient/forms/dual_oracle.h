// The gradient of one expression by dual numbers, in higher precision than the expression's own, and a bound on the
// effect of rounding in its type.
//
// The bound comes from simulated rounding. First, each operation's value is moved at random by a few units in the last
// place of its type; the spread of the node values bounds how far the program's values are from the true ones. Then
// partials are taken at operands anywhere in that spread, and their products with tangents are moved likewise. A
// gradient with a large spread cannot be determined from the rounded values; a kink within reach adds the jump at it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "ir/expr.h"

namespace retrograde::gradient {

#if defined(__SIZEOF_FLOAT128__) && defined(RETROGRADE_HAS_QUADMATH)
using Wide = __float128;
#else
using Wide = long double;
#endif

constexpr int leaf_count = 3;
using Place = std::array<double, leaf_count>;  // x, y, z

struct TrueGradient {
  bool is_usable = false;  // finite, and no value leaves the normal range of the type
  std::array<double, leaf_count> slope{};  // rounded to double
  std::array<double, leaf_count> reach{};  // the effect of rounding
};

TrueGradient true_gradient(const Expr& e, const Place& at, uint64_t seed);

}  // namespace retrograde::gradient
