#include "autodiff/sums/shared_terms.h"

#include <algorithm>
#include <map>
#include <optional>

#include "autodiff/sums/accumulation.h"
#include "autodiff/sums/distinct_nodes.h"
#include "autodiff/sums/generated_definitions.h"
#include "autodiff/sweeps/active_symbols.h"
#include "autodiff/updates/update_context.h"
#include "autoschedule/machine/reference.h"
#include "ir/build.h"
#include "transform/cost_estimate.h"

namespace retrograde::autodiff {

namespace {

// The largest number of terms stored for each iteration.
constexpr size_t most_shared_terms = 128;
// Terms are shared if that saves this share of the operations, memory round trips included.
constexpr double least_saved_share = 0.2;

// The contributions to one Func, image or parameter.
struct TermTarget {
  std::vector<size_t> leaves;  // by number
  bool is_sum = false;         // over many iterations
};

std::vector<Expr> indices_of(const Expr& leaf) {
  const auto* call = leaf.as<Call>();
  return call ? call->args : std::vector<Expr>();
}

// The number of iterations that read one element; nullopt if data decide which.
std::optional<double> iterations_that_read(const Expr& leaf, const IterationDomain& domain) {
  double iterations = 1;
  const std::vector<Expr> indices = indices_of(leaf);
  if (std::ranges::any_of(indices, depends_on_data)) return std::nullopt;
  for (const LoopVariable& v : domain.vars) {
    const bool is_used = std::ranges::any_of(
        indices, [&](const Expr& index) { return uses_variable(index, v.name); });
    if (is_used) continue;
    const auto extent = constant_extent(v.range());
    iterations *= extent ? static_cast<double>(*extent) : many_terms;
  }
  return iterations;
}

// Nodes that are shared count once.
double operations_of_terms(const std::vector<Expr>& terms) {
  return transform::operations_of_values(terms, [](const Call&) { return 1.0; });
}

class TermSharing {
 public:
  TermSharing(const IterationDomain& domain, const std::vector<LeafAdjoint>& leaves) {
    std::map<const Symbol*, size_t> by_symbol;
    for (size_t i = 0; i < leaves.size(); ++i) {
      const auto iterations = iterations_that_read(leaves[i].leaf, domain);
      const bool is_sum = iterations && *iterations >= many_terms;
      if (!iterations || (!is_sum && *iterations > 1) ||
          operations_of_terms({leaves[i].adjoint}) <= transform::cheap)
        continue;
      const auto [found, is_new] =
          by_symbol.try_emplace(symbol_of(leaves[i].leaf), targets_.size());
      if (is_new) targets_.emplace_back();
      targets_[found->second].leaves.push_back(i);
      targets_[found->second].is_sum |= is_sum;
    }
    const auto sums = std::ranges::count_if(targets_, &TermTarget::is_sum);
    if (sums == 0 || targets_.size() < 2) return;
    terms_ = with_equal_nodes_shared(mapped(leaves, &LeafAdjoint::adjoint));
    choose();
  }

  // The numbers of the leaves that read stored terms; empty if sharing does not pay.
  const std::vector<size_t>& shared() const { return shared_; }
  std::vector<Expr> shared_terms() const { return terms_of(shared_); }

 private:
  // The terms of the sums, alone or with those of what each iteration reads for itself.
  void choose() {
    std::vector<TermTarget> sums = targets_;
    std::erase_if(sums, [](const TermTarget& target) { return !target.is_sum; });
    double most = 0;
    for (const std::vector<TermTarget>& some : {sums, targets_}) {
      const double saved = saving(some);
      if (saved <= most) continue;
      most = saved;
      shared_.clear();
      for (const TermTarget& target : some) append(shared_, target.leaves);
    }
    std::ranges::sort(shared_);
  }

  std::vector<Expr> terms_of(const std::vector<size_t>& leaves) const {
    return mapped(leaves, [&](size_t i) { return terms_[i]; });
  }

  // The operations saved in each iteration; 0 if they are too few.
  double saving(const std::vector<TermTarget>& targets) const {
    std::vector<size_t> all;
    double apart = 0;
    for (const TermTarget& target : targets) {
      append(all, target.leaves);
      apart += operations_of_terms(terms_of(target.leaves));
    }
    if (targets.size() < 2 || all.size() > most_shared_terms) return 0;
    const double together = operations_of_terms(terms_of(all)) +
                            planning::memory_trip_operations * static_cast<double>(all.size());
    return apart - together >= least_saved_share * apart ? apart - together : 0;
  }

  std::vector<Expr> terms_;  // of the leaves, with equal nodes shared
  std::vector<TermTarget> targets_;
  std::vector<size_t> shared_;
};

}  // namespace

SharedAdjoints share_terms(const std::string& name, const IterationDomain& domain,
                           const std::vector<LeafAdjoint>& leaves, const Regions& regions) {
  SharedAdjoints result{nullptr, mapped(leaves, &LeafAdjoint::adjoint)};
  if (leaves.size() < 2 || !is_bounded_box(domain)) return result;
  const TermSharing sharing(domain, leaves);
  const std::vector<Expr> terms = sharing.shared_terms();
  if (terms.empty() || !reads_what_is_there(terms, domain, regions)) return result;
  result.func = define_over(domain, name, terms);
  const std::vector<Expr> reads = values_of(result.func, variables_of(names_of(domain.vars)));
  for (size_t k = 0; k < reads.size(); ++k) result.adjoints[sharing.shared()[k]] = reads[k];
  return result;
}

}  // namespace retrograde::autodiff
