#include "autodiff/updates/numbering.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

double least_product(const std::vector<Expr>& extents) {
  double product = 1;
  for (const Expr& e : extents) {
    auto extent = e.defined() ? as_const_int(simplify(e)) : std::nullopt;
    if (extent) product *= static_cast<double>(std::max<int64_t>(*extent, 0));
  }
  return product;
}

double least_iterations(const std::vector<ReductionVariable>& loops) {
  return least_product(mapped(loops, &ReductionVariable::extent));
}

void check_numbers(const UpdateContext& context, double count, const std::string& what) {
  if (count < 0x1p31) return;
  unsupported(context.asked(), text(what, " have 32-bit numbers: there may be 2147483647 at most"),
              text("it needs ", static_cast<int64_t>(std::min(count, 0x1p62))),
              "Split its loops into several updates or Funcs, each over a part; or, where its "
              "outermost loop is time, give a budget: AdjointOptions::checkpoint_states");
}

}  // namespace retrograde::autodiff
