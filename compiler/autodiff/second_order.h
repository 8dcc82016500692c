// second_order.h -- products with second derivatives: tangents of adjoints.
//
// Func hv = hessian_vector_product(loss, weights, {{weights, v}});
// // hv(i) = sum_j d2 loss / dw_i dw_j v(j)
//
// One adjoint and one tangent whatever the number of inputs. The result is an ordinary Func: its
// tangent along another direction is a product with third derivatives, and so on.
#pragma once

#include <vector>

#include "autodiff/tangents.h"

namespace retrograde {

// How the gradient of the scalar `loss` by `wrt` (its dimensions) changes along the directions,
// which may be of `wrt` itself or of other inputs: then it is a block off the diagonal.
// Errors as propagate_adjoints and propagate_tangents.
// Requires: the input is a float that the loss depends on.
Func hessian_vector_product(const Func& loss, const AdjointInput& wrt,
                            const std::vector<Direction>& directions,
                            Overwritten overwritten = Overwritten::Store);

}  // namespace retrograde
