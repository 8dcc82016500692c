#include "autodiff/second_order.h"

#include "diagnostics/error.h"

namespace retrograde {

Func hessian_vector_product(const Func& loss, const AdjointInput& wrt,
                            const std::vector<Direction>& directions, Overwritten overwritten) {
  Func gradient = propagate_adjoints(loss, {.overwritten = overwritten, .wrt = {wrt}}).of(wrt);
  if (!gradient.defined()) {
    user_error(text("differentiate ", quoted(loss.name()), " twice"),
               "the input is a float that the loss depends on",
               "it has no gradient by what was given",
               "Differentiate by something that the loss depends on");
  }
  return propagate_tangents(gradient, directions)(gradient);
}

}  // namespace retrograde
