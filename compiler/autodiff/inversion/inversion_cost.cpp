#include "autodiff/inversion/inversion_cost.h"

#include <algorithm>
#include <optional>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

std::optional<double> points_of(const IterationDomain& domain) {
  double points = 1;
  for (const LoopVariable& v : domain.vars) {
    auto extent = constant_extent(v.range());
    if (!extent) return std::nullopt;
    points *= static_cast<double>(*extent);
  }
  return points;
}

// Whether what a gather adds is the same along rows of the target, except that a predicate selects elements. Each element
// is written once anyway, and compares its place in vectors.
bool only_selects_in_row(const Gather& g, const AccessQuery& query) {
  return !g.rdom && !g.pure.empty() && g.pure[0] &&
         std::ranges::none_of(g.iteration, [&](const auto& entry) {
           return uses_variable(entry.second, query.target_args[0]);
         });
}

std::optional<double> iterations_of(const Gather& g, const AccessQuery& query) {
  double iterations = 1;
  for (size_t d = only_selects_in_row(g, query) ? 1 : 0; d < g.pure.size(); ++d) {
    if (!g.pure[d]) continue;
    auto extent = d < query.region.size() ? constant_extent(query.region[d].range()) : std::nullopt;
    if (!extent) return std::nullopt;
    iterations *= static_cast<double>(*extent);
  }
  for (const ReductionVariable& r : g.rdom ? g.rdom->vars : std::vector<ReductionVariable>{}) {
    auto extent = as_const_int(simplify(r.extent));
    if (!extent) return std::nullopt;
    iterations *= static_cast<double>(*extent);
  }
  return iterations;
}

}  // namespace

Inversion invert_or_scatter(const AccessQuery& any_query, unsigned long operations) {
  AccessQuery query = any_query;
  query.operations = operations;
  Inversion inversion = invert_access(query);
  auto points = points_of(query.domain);
  double total = 0;
  for (const Gather& g : inversion.gathers) {
    auto iterations = iterations_of(g, query);
    if (!points || !iterations) return inversion;
    total += *iterations;
  }
  if (!points || total <= dearer * *points) return inversion;
  return {{scatter_access(query)},
          text("a gather would run ", static_cast<int64_t>(total), " iterations for ",
               static_cast<int64_t>(*points), " points")};
}

}  // namespace retrograde::autodiff
