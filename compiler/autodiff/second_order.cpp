#include "autodiff/second_order.h"

#include "diagnostics/error.h"

namespace retrograde {

Func hessian_vector_product(const Func& loss, const AdjointInput& wrt,
                            const std::vector<Direction>& directions, Overwritten overwritten) {
  const Derivative first = propagate_adjoints(loss, {.overwritten = overwritten, .wrt = {wrt}});
  if (!first.has(wrt)) {
    user_error(text("differentiate ", quoted(loss.name()), " twice"),
               "the input is a float that the loss depends on", "it has no gradient by this input",
               "Differentiate by something that the loss depends on");
  }
  Func gradient = first.of(wrt);
  return propagate_tangents(gradient, directions)(gradient);
}

}  // namespace retrograde
