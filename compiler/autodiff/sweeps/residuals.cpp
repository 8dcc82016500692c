#include "autodiff/sweeps/residuals.h"

#include <algorithm>
#include <optional>
#include <unordered_set>

#include "autoschedule/machine/reference.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "graph/copy_graph.h"
#include "graph/directives/directive.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "transform/cost_estimate.h"
#include "transform/size_estimate.h"

namespace retrograde::autodiff {

namespace {

constexpr double least_terms = 64;  // that an element of a residual adds up
// Terms of all elements together: a call has a cost for each buffer.
constexpr double least_work = planning::launch_operations / 8;
constexpr int64_t most_bytes = planning::third_cache_bytes / 4;  // of a residual

bool is_scheduled(const FuncContents& f) {
  return has_directives(f) || !f.wrappers.empty() || !f.copied_inputs.empty();
}

class ResidualFinder {
 public:
  explicit ResidualFinder(const std::vector<FuncPtr>& outputs)
      : order_(topological_order(outputs)), forward_(outputs) {
    for (const FuncPtr& f : order_) primal_.insert(f.get());
    for (const FuncPtr& f : outputs) outputs_.insert(f.get());
  }

  bool may_find() const {
    return std::ranges::none_of(order_, [](const FuncPtr& f) { return is_scheduled(*f); }) &&
           std::ranges::any_of(order_, [&](const FuncPtr& f) { return is_dear(*f); });
  }

  std::vector<Residual> find(const std::vector<FuncPtr>& gradients) {
    const SizeEstimate backward(gradients);
    for (const FuncPtr& f : gradients) visit(f, backward);
    return std::move(found_);
  }

 private:
  const std::vector<FuncPtr> order_;  // of the forward pass
  const SizeEstimate forward_;
  std::unordered_set<const FuncContents*> primal_, outputs_, seen_;
  std::vector<Residual> found_;

  void visit(const FuncPtr& f, const SizeEstimate& backward) {
    if (!seen_.insert(f.get()).second) return;
    if (auto residual = residual_of(f, backward)) {
      found_.push_back(std::move(*residual));
      return;
    }
    for (const FuncPtr& callee : direct_callees(*f)) visit(callee, backward);
  }

  std::optional<Residual> residual_of(const FuncPtr& f, const SizeEstimate& backward) const {
    if (!primal_.contains(f.get()) || !is_dear(*f)) return std::nullopt;
    Residual residual{f, {}};
    for (size_t d = 0; d < f->args.size(); ++d) {
      const Interval here = forward_.range(*f, d), there = backward.range(*f, d);
      if (!there.is_bounded() || *as_const_int(there.min) < 0 ||
          *as_const_int(there.max) > *as_const_int(here.max))
        return std::nullopt;
      residual.extents.push_back(*as_const_int(here.max) + 1);
    }
    return residual;
  }

  // Whether the Func has few elements of many terms each, over a known region from 0.
  bool is_dear(const FuncContents& f) const {
    if (f.is_extern() || f.types.size() != 1 || !f.types[0].is_float() || outputs_.contains(&f))
      return false;
    double terms = 0, elements = 1;
    for (const Definition& update : f.updates)
      terms += update.rvars.empty() ? 0 : terms_of(update, 0);
    for (size_t d = 0; d < f.args.size(); ++d) {
      const Interval range = forward_.range(f, d);
      if (!range.is_bounded() || !is_zero(range.min)) return false;
      elements *= static_cast<double>(*as_const_int(range.max) + 1);
    }
    return terms >= least_terms && terms * elements >= least_work &&
           elements * f.types[0].bytes() <= most_bytes;
  }
};

// Redefines a Func of a copied graph as the values of an image.
void read_image(FuncContents& f, const std::shared_ptr<graph::ParameterContents>& image) {
  Definition pure;
  pure.args = variables_of(f.args);
  pure.values = {call_image(image->name, image->type, pure.args, SymbolRef(image))};
  f.updates.clear();
  f.pure = std::move(pure);
  f.pure->schedule.dims = graph::first_loops(f, *f.pure);
  f.version++;
}

}  // namespace

std::vector<Residual> residuals_of(const std::vector<FuncPtr>& outputs,
                                   const std::vector<FuncPtr>& gradients) {
  std::vector<Residual> result;
  run_on_large_stack([&] {
    ResidualFinder finder(outputs);
    if (finder.may_find()) result = finder.find(gradients);
  });
  return result;
}

bool may_have_residuals(const std::vector<FuncPtr>& outputs) {
  bool result = false;
  run_on_large_stack([&] { result = ResidualFinder(outputs).may_find(); });
  return result;
}

std::vector<FuncPtr> reading_residuals(
    const std::vector<FuncPtr>& gradients, const std::vector<FuncPtr>& residuals,
    const std::vector<std::shared_ptr<graph::ParameterContents>>& images) {
  RETROGRADE_ASSERT(residuals.size() == images.size(), "each residual has an image");
  graph::GraphCopy copy;
  run_on_large_stack([&] { copy = graph::copy_graph(gradients); });
  for (size_t i = 0; i < residuals.size(); ++i)
    read_image(*copy.of.at(residuals[i].get()), images[i]);
  return copy.outputs;
}

}  // namespace retrograde::autodiff
