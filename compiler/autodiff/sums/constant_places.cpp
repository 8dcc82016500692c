#include "autodiff/sums/constant_places.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "autodiff/sums/distinct_nodes.h"
#include "autodiff/sums/gather_places.h"
#include "autodiff/sums/running_sums.h"
#include "autodiff/sums/taps.h"
#include "autoschedule/machine/reference.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "transform/cost_estimate.h"

namespace retrograde::autodiff {

namespace {

// The number of values of one sum: they should fit into vector registers.
constexpr size_t most_values = 16;
// Sums share an iteration if that saves this share of their operations.
constexpr double least_share = 0.2;
// Assumed numbers: the iterations of a loop of unknown extent, and the terms of a scatter to one element.
constexpr double unknown_iterations = 4096, unknown_meetings = 8;

std::vector<bool> fixed_dimensions(const Gather& g) {
  return numbered(g.lhs.size(), [&](size_t d) { return !g.pure[d] && is_const(g.lhs[d]); });
}

template <class List>
List without(const std::vector<bool>& fixed, const List& list) {
  List result;
  for (size_t d = 0; d < list.size(); ++d) {
    if (!fixed[d]) result.push_back(list[d]);
  }
  return result;
}

// The contributions to places that may share a sum, in the order of the program.
struct Group {
  std::vector<bool> fixed;
  std::vector<std::vector<Expr>> indices;
  std::vector<Contribution> terms;  // to the sums; components count the values of one place
  std::vector<size_t> place_of;     // for each term
  std::vector<size_t> origin;       // for each term: its number in the list

  size_t place(const std::vector<Expr>& index) {
    const auto is_it = [&](const auto& other) { return same_args(index, other); };
    const auto found = std::ranges::find_if(indices, is_it);
    const auto number = static_cast<size_t>(found - indices.begin());
    if (found == indices.end()) indices.push_back(index);
    return number;
  }
};

// Everything that must agree in one group.
std::string key_of(const Contribution& c, const std::vector<bool>& fixed, const Gather& reduced) {
  std::string key = shape_of(reduced) + (reduced.scatters ? "~" : "");
  for (const bool is_fixed : fixed) key += is_fixed ? "#" : ".";
  for (const Symbol* source : sources_of(c))
    key += "," + std::to_string(reinterpret_cast<uintptr_t>(source));
  return key;
}

class Groups {
 public:
  explicit Groups(const AdjointTarget& target) : target_(target) {}

  void add(const Contribution& c, size_t number) {
    const std::vector<bool> fixed = fixed_dimensions(c.gather);
    if (std::ranges::find(fixed, true) == fixed.end()) return;
    std::vector<Expr> index;
    Substitution here;
    for (size_t d = 0; d < fixed.size(); ++d) {
      if (!fixed[d]) continue;
      index.push_back(c.gather.lhs[d]);
      here[target_.args[d]] = c.gather.lhs[d];
    }
    Gather reduced = c.gather;
    reduced.lhs = without(fixed, c.gather.lhs);
    reduced.pure = without(fixed, c.gather.pure);
    if (reduced.predicate.defined()) reduced.predicate = substitute(reduced.predicate, here);
    const auto [open, is_new] = by_key_.try_emplace(key_of(c, fixed, reduced), groups.size());
    if (is_new) groups.push_back({fixed, {}, {}, {}, {}});
    Group& group = groups[open->second];
    const Gather& first = group.terms.empty() ? reduced : group.terms[0].gather;
    const Expr term = in_domain_of(first, reduced, substitute(c.adjoint, here));
    group.place_of.push_back(group.place(index));
    group.origin.push_back(number);
    group.terms.push_back({c.component, first, term});
  }

  std::vector<Group> groups;

 private:
  const AdjointTarget& target_;
  std::map<std::string, size_t> by_key_;
};

double operations(const std::vector<Expr>& terms) {
  const DistinctNodes distinct(terms);
  double total = 0;
  for (const Expr& node : distinct.nodes()) total += operations_of(node);
  return total;
}

// The number of elements along these dimensions; nullopt if it is known at run time only.
std::optional<double> elements_along(const AdjointTarget& target,
                                     const std::vector<bool>& dimensions) {
  if (target.region.size() != dimensions.size()) return std::nullopt;
  double elements = 1;
  for (size_t d = 0; d < dimensions.size(); ++d) {
    const auto extent = dimensions[d] ? constant_extent(target.region[d].range()) : 1;
    if (!extent) return std::nullopt;
    elements *= static_cast<double>(*extent);
  }
  return elements;
}

// The terms of one element of a sum.
double terms_an_element(const Group& group, const AdjointTarget& target) {
  const Gather& g = group.terms[0].gather;
  double iterations = 1;
  if (g.rdom) {
    for (const ReductionVariable& r : g.rdom->vars) {
      const auto extent = as_const_int(r.extent);
      if (!extent && g.scatters) return unknown_meetings;
      iterations *= extent ? static_cast<double>(*extent) : unknown_iterations;
    }
  }
  if (!g.scatters) return iterations;
  std::vector<bool> scattered;
  for (size_t d = 0, rest = 0; d < group.fixed.size(); ++d)
    scattered.push_back(!group.fixed[d] && !g.pure[rest++]);
  const auto elements = elements_along(target, scattered);
  return elements ? iterations / std::max(*elements, 1.0) : unknown_meetings;
}

// Whether all places lie among so few elements that one definition may choose among them.
bool are_chosen(const std::vector<bool>& fixed, size_t places, const AdjointTarget& target) {
  const auto elements = elements_along(target, fixed);
  return elements && *elements <= std::max(2.0 * static_cast<double>(places), double(few_places));
}

bool is_worth_sharing(const Group& group, const AdjointTarget& target) {
  const size_t places = group.indices.size();
  if (places < 2) return false;
  std::vector<std::vector<Expr>> by_place(places);
  std::vector<Expr> all;
  for (size_t i = 0; i < group.terms.size(); ++i) {
    by_place[group.place_of[i]].push_back(group.terms[i].adjoint);
    all.push_back(group.terms[i].adjoint);
  }
  const double together = operations(all);
  const auto elements = elements_along(target, group.fixed);
  const auto count = static_cast<double>(places);
  const bool is_pointwise = group.terms[0].gather.is_pointwise();
  // Elements of the sums are stored, loaded and chosen from.
  const double loads = are_chosen(group.fixed, places, target) ? 2 * *elements : 2;
  const double cost = is_pointwise ? planning::memory_trip_operations * count : count * (1 + loads);
  const double iterations = terms_an_element(group, target);
  const auto is_worth = [&](double apart) {
    const double saved = apart - together;
    return saved >= least_share * apart && saved * iterations > cost;
  };
  if (is_pointwise && elements && *elements <= few_places)
    return is_worth(
        *elements *
        together);  // one definition computes all terms for each element (gather_places.h)
  // Each place walks the shared program, so this stops at the first places that suffice.
  double apart = 0;
  for (const std::vector<Expr>& terms : by_place) {
    apart += operations(terms);
    if (is_worth(apart)) return true;
  }
  return false;
}

// One sum for `places`, a few of those of the group.
ConstantPlaces sum_of(const Group& group, size_t begin, size_t end, const AdjointTarget& target) {
  ConstantPlaces result{group.fixed, {}, {}, {}};
  const size_t values = target.types.size();
  result.target = {target.name, without(group.fixed, target.args), {}, {}};
  if (target.region.size() == group.fixed.size())
    result.target.region = without(group.fixed, target.region);
  for (size_t place = begin; place < end; ++place) {
    result.indices.push_back(group.indices[place]);
    append(result.target.types, target.types);
  }
  for (size_t i = 0; i < group.terms.size(); ++i) {
    const size_t place = group.place_of[i];
    if (place < begin || place >= end) continue;
    Contribution term = group.terms[i];
    term.component += static_cast<int>((place - begin) * values);
    result.terms.push_back(std::move(term));
  }
  return result;
}

}  // namespace

std::vector<ConstantPlaces> take_constant_places(std::vector<Contribution>& contributions,
                                                 const AdjointTarget& target) {
  Groups found(target);
  for (size_t i = 0; i < contributions.size(); ++i) found.add(contributions[i], i);
  std::vector<ConstantPlaces> result;
  std::set<size_t> taken;
  const size_t most = std::max<size_t>(most_values / target.types.size(), 2);
  for (const Group& group : found.groups) {
    if (!is_worth_sharing(group, target)) continue;
    const size_t places = group.indices.size(), sums = (places + most - 1) / most;
    for (size_t s = 0; s < sums; ++s)  // of about equal size
      result.push_back(sum_of(group, places * s / sums, places * (s + 1) / sums, target));
    taken.insert(group.origin.begin(), group.origin.end());
  }
  if (taken.empty()) return result;
  std::vector<Contribution> others;
  for (size_t i = 0; i < contributions.size(); ++i) {
    if (!taken.contains(i)) others.push_back(contributions[i]);
  }
  contributions = std::move(others);
  return result;
}

std::vector<Contribution> contributions_of(const ConstantPlaces& places,
                                           const AdjointTarget& target,
                                           const std::vector<Expr>& sums) {
  const size_t values = target.types.size(), count = places.indices.size();
  const std::vector<Expr> args = variables_of(target.args);
  const bool chooses = are_chosen(places.fixed, count, target);
  std::vector<Contribution> result;
  for (size_t k = 0; k < values; ++k) {
    Expr chosen = make_zero(sums[k].type());
    for (size_t place = count; place-- > 0;) {
      Gather g{args, std::vector<bool>(args.size(), true), nullptr, {}, {}, false};
      std::vector<Expr> is_here;
      for (size_t d = 0, i = 0; d < args.size(); ++d) {
        if (!places.fixed[d]) continue;
        const Expr& index = places.indices[place][i++];
        is_here.push_back(args[d] == index);
        if (!chooses) g.lhs[d] = index, g.pure[d] = false;
      }
      const Expr& sum = sums[place * values + k];
      if (chooses) chosen = make_select(conjunction(is_here), sum, chosen);
      if (!chooses || place == 0)
        result.push_back({static_cast<int>(k), std::move(g), chooses ? chosen : sum});
    }
  }
  return result;
}

}  // namespace retrograde::autodiff
