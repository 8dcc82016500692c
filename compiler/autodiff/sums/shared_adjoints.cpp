// Decides which inner adjoints are shared.
//
// Contributions to one element form a group, which one iteration of a gather computes together. An inner adjoint is
// shared if two groups need it. Only the outermost shared ones are stored: the first ones on the way down from a
// contribution.
#include "autodiff/sums/shared_adjoints.h"

#include <algorithm>
#include <map>
#include <set>

#include "analysis/interval.h"
#include "autodiff/sums/distinct_nodes.h"
#include "autodiff/sums/generated_definitions.h"
#include "autoschedule/machine/reference.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "graph/function.h"
#include "ir/build.h"
#include "ir/print.h"
#include "simplify/simplify.h"
#include "transform/cost_estimate.h"

namespace retrograde::autodiff {

namespace {

// The largest number of values stored for each iteration. It keeps the memory a small multiple of that of the steps.
constexpr size_t most_kept = 8;

using Numbers = std::set<size_t>;

std::vector<Expr> adjoints_of(const std::vector<LeafAdjoint>& leaves) {
  return mapped(leaves, &LeafAdjoint::adjoint);
}

// A key of the element that a leaf reads; the values of a Tuple share it.
std::string place_of(const Expr& leaf) {
  const auto* call = leaf.as<Call>();
  if (!call) return ir::print(leaf);
  std::string place = std::to_string(reinterpret_cast<uintptr_t>(call->symbol.raw()));
  for (const Expr& arg : call->args) place += "," + ir::print(arg);
  return place;
}

class Sharing {
 public:
  Sharing(const std::vector<LeafAdjoint>& leaves, const std::vector<Expr>& seeds)
      : leaves_(leaves), distinct_(adjoints_of(leaves)), nodes_(distinct_.nodes()) {
    std::map<std::string, size_t> by_place;
    for (const LeafAdjoint& leaf : leaves) {
      auto [group, is_new] = by_place.try_emplace(place_of(leaf.leaf), groups_.size());
      if (is_new) groups_.emplace_back();
      groups_[group->second].insert(distinct_.number_of(leaf.adjoint));
    }
    find_shared(adjoints_in(seeds));
    for (const Numbers& group : groups_) {
      below(group, [&](size_t n) {
        if (is_shared_[n]) kept_.insert(n);
        return !is_shared_[n];
      });
    }
  }

  bool is_worth_it() const {
    if (kept_.empty() || kept_.size() > most_kept) return false;
    double saved = -operations(kept_, {});
    for (const Numbers& group : groups_) saved += operations(group, {}) - operations(group, kept_);
    return saved > planning::memory_trip_operations * static_cast<double>(kept_.size());
  }

  std::vector<Expr> kept() const {
    return mapped(kept_, [&](size_t n) { return nodes_[n]; });
  }

  // The adjoints of the leaves, with `reads` in place of the shared values.
  std::vector<Expr> with_reads(const std::vector<Expr>& reads) const {
    std::map<size_t, Expr> read_of;
    for (size_t n : kept_) read_of.emplace(n, reads[read_of.size()]);
    return mapped(leaves_, [&](const LeafAdjoint& leaf) {
      return rewrite(leaf.adjoint, [&](const Expr& e, const auto& recurse) -> Expr {
        auto read = read_of.find(distinct_.number_of(e));
        return read == read_of.end() ? map_children(e, recurse) : read->second;
      });
    });
  }

 private:
  // Visits each node below `roots` once; descends only where `enter` returns true.
  void below(const Numbers& roots, FunctionRef<bool(size_t)> enter) const {
    std::vector<size_t> open(roots.begin(), roots.end());
    std::vector<bool> seen(nodes_.size());
    while (!open.empty()) {
      const size_t n = open.back();
      open.pop_back();
      if (seen[n]) continue;
      seen[n] = true;
      if (!enter(n)) continue;
      for_each_child(nodes_[n], [&](const Expr& e) { open.push_back(distinct_.number_of(e)); });
    }
  }

  // The operations of one iteration that loads `loaded`.
  double operations(const Numbers& roots, const Numbers& loaded) const {
    double total = 0;
    below(roots, [&](size_t n) {
      const bool computes = !loaded.contains(n);
      total += computes ? operations_of(nodes_[n]) : 1;
      return computes;
    });
    return total;
  }

  static std::set<const Symbol*> adjoints_in(const std::vector<Expr>& seeds) {
    std::set<const Symbol*> result;
    for (const Expr& seed : seeds) {
      if (!seed.defined()) continue;
      walk(seed, [&](const Call& call) {
        if (provenance_of(call)) result.insert(call.symbol.raw());
      });
    }
    return result;
  }

  void find_shared(const std::set<const Symbol*>& adjoints) {
    std::vector<int> users(nodes_.size());
    for (const Numbers& group : groups_) {
      below(group, [&](size_t n) {
        ++users[n];
        return true;
      });
    }
    is_shared_.resize(nodes_.size());
    const std::vector<bool> is_adjoint = readers_of(adjoints);
    for (size_t n = 0; n < nodes_.size(); ++n)
      is_shared_[n] = users[n] > 1 && is_adjoint[n] && !is_cheap(n);
  }
  bool is_cheap(size_t root) const {
    double total = 0;
    below({root}, [&](size_t n) {
      total += operations_of(nodes_[n]);
      return total <= cheap;
    });
    return total <= cheap;
  }

  std::vector<bool> readers_of(const std::set<const Symbol*>& adjoints) const {
    std::vector<bool> result(nodes_.size());
    for (size_t n = 0; n < nodes_.size(); ++n) {
      const auto* call = nodes_[n].as<Call>();
      bool found = call && adjoints.contains(call->symbol.raw());
      for_each_child(nodes_[n], [&](const Expr& e) { found |= result[distinct_.number_of(e)]; });
      result[n] = found && nodes_[n].type().is_float();
    }
    return result;
  }

  const std::vector<LeafAdjoint>& leaves_;
  DistinctNodes distinct_;
  const std::vector<Expr>& nodes_;
  std::vector<Numbers> groups_;
  std::vector<bool> is_shared_;
  Numbers kept_;
};

bool is_inside(const Box& part, const Box& outer) {
  return std::ranges::equal(part, outer, can_prove_inside);
}

}  // namespace

bool reads_what_is_there(const std::vector<Expr>& values, const IterationDomain& domain,
                         const Regions& regions) {
  const Scope<Interval> scope = scope_of(domain.vars);
  for (const Expr& value : values) {
    for (const auto& [name, footprint] : footprints(value, scope)) {
      const Box& there = regions.of(footprint.symbol.raw());  // empty: generated by differentiation
      if (!there.empty() && !is_inside(footprint.box, there)) return false;
    }
  }
  return true;
}

bool is_bounded_box(const IterationDomain& domain) {
  return !domain.predicate.defined() && std::ranges::all_of(domain.vars, [](const LoopVariable& v) {
    return v.min.defined() && v.max.defined();
  });
}

FuncPtr define_over(const IterationDomain& domain, const std::string& name,
                    const std::vector<Expr>& values) {
  const FuncPtr f = make_func(Role::SharedValue, name);
  Substitution names;
  std::vector<Expr> args;
  for (const LoopVariable& v : domain.vars) {
    args.push_back(variable(unique_name("iteration")));
    names[v.name] = args.back();
  }
  note_traits(f, values);
  // One rewriter for all values: they share most of their nodes.
  StepRewriter renamed([&](const Expr& e, const auto&) {
    const auto* v = e.as<Variable>();
    return v ? value_or(names, v->name, {}) : Expr();
  });
  define_pure(f, args, mapped(values, renamed));
  return f;
}

SharedAdjoints share_adjoints(const std::string& name, const IterationDomain& domain,
                              const std::vector<LeafAdjoint>& leaves,
                              const std::vector<Expr>& seeds, const Regions& regions) {
  SharedAdjoints result{nullptr, adjoints_of(leaves)};
  if (leaves.size() < 2 || !is_bounded_box(domain)) return result;
  const Sharing sharing(leaves, seeds);
  if (!sharing.is_worth_it() || !reads_what_is_there(sharing.kept(), domain, regions))
    return result;
  result.func = define_over(domain, name, sharing.kept());
  result.adjoints = sharing.with_reads(values_of(result.func, variables_of(names_of(domain.vars))));
  return result;
}

}  // namespace retrograde::autodiff
