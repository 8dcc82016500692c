#include "autodiff/sums/running_sums.h"

#include "autodiff/sweeps/local_derivative.h"
#include "graph/definitions/provenance.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

namespace {

constexpr size_t most_in_a_sum = 4;  // adjoints read by one running sum
constexpr size_t few_adjoints = 8;   // up to this many adjoints stay in a single sum

using Sources = std::set<const Symbol*>;

}  // namespace

Sources sources_of(const Contribution& contribution) {
  Sources result;
  walk(contribution.adjoint, [&](const Call& call) {
    const graph::Provenance* made =
        call.call_type == CallType::Func ? provenance_of(call) : nullptr;
    if (made && made->role == Role::Adjoint) result.insert(call.symbol.raw());
  });
  return result;
}

std::vector<std::vector<Contribution>> running_groups(
    const std::vector<Contribution>& contributions) {
  std::vector<std::vector<Contribution>> groups;
  Sources all, last, group;
  for (const Contribution& contribution : contributions) {
    const Sources sources = sources_of(contribution);
    const bool goes_on =
        sources == last;  // the taps of one stage stay in one group, to share an update
    if (groups.empty() || (!goes_on && group.size() >= most_in_a_sum)) {
      groups.emplace_back();
      group.clear();
    }
    groups.back().push_back(contribution);
    group.insert(sources.begin(), sources.end());
    all.insert(sources.begin(), sources.end());
    last = sources;
  }
  if (all.size() > few_adjoints) return groups;
  return {contributions};
}

}  // namespace retrograde::autodiff
