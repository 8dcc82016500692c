#include "autodiff/sums/gather_places.h"

#include <algorithm>

#include "autodiff/updates/update_context.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// In a dimension of few elements a fixed index becomes a condition. Then plane_adj(x, 0) and plane_adj(x, 1) are
// computed in one pass, in the pure definition, instead of an update for each.
Gather with_few_elements_pure(Gather g, const AdjointTarget& target) {
  if (g.rdom || g.scatters || target.region.size() != g.lhs.size()) return g;
  for (size_t d = 0; d < g.lhs.size(); ++d) {
    if (g.pure[d]) continue;
    auto extent = constant_extent(target.region[d].range());
    if (!extent || *extent > few_places) continue;
    Expr arg = variable(target.args[d]);
    Expr here = arg == g.lhs[d];
    g.predicate = g.predicate.defined() ? g.predicate && here : here;
    g.lhs[d] = arg;
    g.pure[d] = true;
  }
  return g;
}

// Whether `e` depends on parameters only, so that it is the same throughout the stage.
bool is_fixed_place(const Expr& e, const Gather& g, const AdjointTarget& target) {
  auto varies = [&](const std::string& name) { return uses_variable(e, name); };
  if (depends_on_data(e) || std::ranges::any_of(target.args, varies)) return false;
  return !g.rdom || std::ranges::none_of(g.rdom->vars,
                                         [&](const ReductionVariable& r) { return varies(r.var); });
}

// A piece of an inverted access may add to a single element, as image_adj(p), under a predicate that is false if p lies
// outside of the region read. Bounds inference does not see the predicate: it would require an element that the image
// does not have, or memory up to it. So the index is clamped.
Gather with_fixed_places_inside(Gather g, const AdjointTarget& target) {
  if (target.region.size() != g.lhs.size()) return g;
  for (size_t d = 0; d < g.lhs.size(); ++d) {
    const auto& [name, low, high, is_reduction] = target.region[d];
    Expr& place = g.lhs[d];
    if (g.pure[d] || !is_fixed_place(place, g, target)) continue;
    const bool is_end =
        (low.defined() && equal(place, low)) || (high.defined() && equal(place, high));
    if (is_end) continue;  // the end of a nonempty region lies inside of it
    if (high.defined() && !can_prove(place <= high)) place = simplify(min(place, high));
    if (low.defined() && !can_prove(place >= low)) place = simplify(max(place, low));
  }
  return g;
}

}  // namespace

Gather with_safe_places(const Gather& gather, const AdjointTarget& target) {
  return with_fixed_places_inside(with_few_elements_pure(gather, target), target);
}

}  // namespace retrograde::autodiff
