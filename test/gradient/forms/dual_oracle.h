// Gradients of one expression by dual numbers in more digits than the expression's own, and how far
// rounding in its type may take them.
//
// What rounding may do is found by doing it. First each operation's value is moved at random by a
// few units in the last place of the type: how far the values of the nodes spread is how far the
// program's own values are from the true ones. Then partials are taken at operands anywhere in
// that spread, and their products with tangents moved likewise. A gradient that spreads is one that
// cannot be told from the rounded values; a kink within reach spreads by what it changes.
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
  std::array<double, leaf_count> reach{};  // of rounding
};

TrueGradient true_gradient(const Expr& e, const Place& at, uint64_t seed);

}  // namespace retrograde::gradient
