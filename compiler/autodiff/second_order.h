// second_order.h -- Hessian-vector products: tangents of adjoints.
//
// Func hv = hessian_vector_product(loss, weights, {{weights, v}});
// // hv(i) = sum_j d2 loss / dw_i dw_j v(j)
//
// One adjoint and one tangent, whatever the number of inputs. The result is an ordinary Func: its tangent along another
// direction is a product with third derivatives, and so on.
#pragma once

#include <vector>

#include "autodiff/tangents.h"

namespace retrograde {

// The change of the gradient of the scalar `loss` by `wrt` along the directions, with the dimensions of `wrt`.
// Directions may be in `wrt` itself or in other inputs, which gives an off-diagonal block of the Hessian. Throws the
// errors of propagate_adjoints and propagate_tangents.
// Requires: the input is a float that the loss depends on.
Func hessian_vector_product(const Func& loss, const AdjointInput& wrt,
                            const std::vector<Direction>& directions,
                            Overwritten overwritten = Overwritten::Store);

}  // namespace retrograde
