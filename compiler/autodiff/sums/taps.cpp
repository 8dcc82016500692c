#include "autodiff/sums/taps.h"

#include <algorithm>
#include <map>

#include "autodiff/sums/generated_definitions.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/print.h"

namespace retrograde::autodiff {

std::string shape_of(const Gather& g, bool with_places) {
  Substitution canonical;
  std::string key;
  if (g.rdom) {
    for (size_t i = 0; i < g.rdom->vars.size(); ++i) {
      canonical[g.rdom->vars[i].var] = variable("rho" + std::to_string(i));
      key += ir::print(g.rdom->vars[i].min) + ":" + ir::print(g.rdom->vars[i].extent) + ";";
    }
  }
  for (size_t d = 0; d < g.lhs.size(); ++d)
    key += with_places || g.pure[d] ? ir::print(substitute(g.lhs[d], canonical)) + "," : "?,";
  if (g.predicate.defined()) key += "|" + ir::print(substitute(g.predicate, canonical));
  return key;
}

Expr in_domain_of(const Gather& to, const Gather& from, const Expr& e) {
  if (!e.defined() || !from.rdom || from.rdom == to.rdom) return e;
  Substitution names;
  for (size_t i = 0; i < from.rdom->vars.size(); ++i) {
    names[from.rdom->vars[i].var] = loop_variable(to.rdom, to.rdom->vars[i].var);
  }
  return substitute(e, names);
}

namespace {

constexpr size_t most_taps = 16;  // of one loop: a schedule may unroll it

// Contributions that can share one update definition.
struct UpdateGroup {
  Gather gather;          // of the first tap; all have its domain and predicate
  std::vector<Tap> taps;  // several only in scatters
};

std::vector<UpdateGroup> group_updates(const std::vector<Contribution>& contributions,
                                       size_t values) {
  std::vector<UpdateGroup> groups;
  std::map<std::string, size_t> index;
  for (const Contribution& c : contributions) {
    if (c.gather.is_pointwise()) continue;
    const Gather& g = c.gather;
    auto [it, is_new] = index.try_emplace(shape_of(g), groups.size());
    if (is_new) groups.push_back({g, {{g.lhs, std::vector<Expr>(values)}}});
    UpdateGroup& group = groups[it->second];
    add_term(group.taps[0].sums[static_cast<size_t>(c.component)],
             in_domain_of(group.gather, g, c.adjoint));
  }
  return groups;
}

// Merges scatters over one domain into one update over its iterations and their taps. The taps share storage,
// coordinates and common subexpressions.
std::vector<UpdateGroup> join_taps(const std::vector<UpdateGroup>& groups) {
  std::vector<UpdateGroup> joined;
  std::map<std::string, size_t> open;
  for (const UpdateGroup& group : groups) {
    if (!group.gather.scatters || !group.gather.rdom) {
      joined.push_back(group);
      continue;
    }
    auto [it, is_new] = open.try_emplace(shape_of(group.gather, false), joined.size());
    if (!is_new && joined[it->second].taps.size() >= most_taps) {
      it->second = joined.size();
      is_new = true;
    }
    if (is_new) {
      joined.push_back(group);
      continue;
    }
    UpdateGroup& all = joined[it->second];
    Tap tap = group.taps[0];
    const auto rename = [&](Expr& e) { e = in_domain_of(all.gather, group.gather, e); };
    std::ranges::for_each(tap.place, rename);
    std::ranges::for_each(tap.sums, rename);
    all.taps.push_back(std::move(tap));
  }
  return joined;
}

// The element of `values` that `tap` selects; without a select if all are equal.
Expr of_tap(const Expr& tap, const std::vector<Expr>& values) {
  Expr result = values.back();
  for (size_t i = values.size() - 1; i-- > 0;) {
    if (!equal(values[i], values.back())) {
      for (size_t j = values.size() - 1; j-- > 0;)
        result = make_select(tap == static_cast<int>(j), values[j], result);
      return result;
    }
  }
  return result;
}

Iterations over_taps(const UpdateGroup& group) {
  const Gather& g = group.gather;
  Iterations result{g, g.rdom ? g.rdom->vars : std::vector<ReductionVariable>(), false,
                    group.taps[0], g.predicate};
  if (group.taps.size() == 1) return result;
  const DomainPtr rdom = make_domain(g.rdom->vars);
  const Expr count = make_const(Int(32), static_cast<int64_t>(group.taps.size()));
  const Expr number = add_loop(rdom, "tap", make_zero(Int(32)), count);
  result.has_taps = true;
  result.rvars = rdom->vars;
  Substitution here;
  for (const ReductionVariable& r : g.rdom->vars) here[r.var] = loop_variable(rdom, r.var);
  const auto choose = [&](const auto& part) {
    return substitute(of_tap(number, mapped(group.taps, part)), here);
  };
  for (size_t d = 0; d < result.all.place.size(); ++d)
    result.all.place[d] = choose([&](const Tap& tap) { return tap.place[d]; });
  for (size_t k = 0; k < result.all.sums.size(); ++k) {
    const auto some =
        std::ranges::find_if(group.taps, [&](const Tap& tap) { return tap.sums[k].defined(); });
    if (some == group.taps.end()) continue;
    const Expr nothing = make_zero(some->sums[k].type());
    result.all.sums[k] =
        choose([&](const Tap& tap) { return tap.sums[k].defined() ? tap.sums[k] : nothing; });
  }
  if (result.predicate.defined()) result.predicate = substitute(result.predicate, here);
  return result;
}

}  // namespace

std::vector<Iterations> updates_of(const std::vector<Contribution>& contributions, size_t values) {
  return mapped(join_taps(group_updates(contributions, values)), over_taps);
}

}  // namespace retrograde::autodiff
