#include "transform/separable_sums.h"

#include <algorithm>
#include <set>
#include <string>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::transform {

namespace {

constexpr size_t most_terms = 512;

bool is_sum(const Expr& e) {
  return e.type().is_float() && (e.kind() == Kind::Add || e.kind() == Kind::Sub);
}

struct SumTerm {
  Expr value;
  bool is_subtracted = false;
};

void add_terms(const Expr& e, bool is_subtracted, std::vector<SumTerm>& terms) {
  if (terms.size() > most_terms) return;
  const auto* sum = is_sum(e) ? e.as<Binary>() : nullptr;
  if (!sum) {
    terms.push_back({e, is_subtracted});
    return;
  }
  add_terms(sum->a, is_subtracted, terms);
  add_terms(sum->b, is_subtracted != (e.kind() == Kind::Sub), terms);
}

void add_factors(const Expr& e, std::vector<Expr>& factors) {
  const auto* product = e.as<Mul>();
  if (!product) {
    factors.push_back(e);
    return;
  }
  add_factors(product->a, factors);
  add_factors(product->b, factors);
}

Expr product_of(const std::vector<Expr>& factors) {
  Expr result;
  for (const Expr& factor : factors) result = result.defined() ? result * factor : factor;
  return result;
}

bool are_equal(const std::vector<Expr>& a, const std::vector<Expr>& b) {
  return std::ranges::equal(a, b, [](const Expr& x, const Expr& y) { return equal(x, y); });
}

// Terms of a sum with the same fine factors and the same index.
struct Group {
  std::vector<Expr> fine;
  Expr index, sum;
  SumTerm first;  // as it stands in the sum
  size_t terms = 0;
};

class Grouping {
 public:
  explicit Grouping(CoarseAxis& axis) : axis_(axis) {}

  void add(const SumTerm& term) {
    std::vector<Expr> factors, coarse;
    add_factors(term.value, factors);
    Group found;
    for (const Expr& factor : factors) {
      const CoarseAxis::Dependence on = axis_.of(factor);
      const bool has_other =
          on.is_through_index() && found.index.defined() && !equal(on.index, found.index);
      if (on.is_through_index() && !has_other) found.index = on.index;
      (on.is_fine || has_other ? found.fine : coarse).push_back(factor);
    }
    std::ranges::sort(found.fine, StructuralLess());
    found.first = term;
    join(std::move(found), product_of(coarse));
  }

  bool has_common_factors() const {
    return std::ranges::any_of(groups_, [](const Group& g) { return g.terms > 1; });
  }

  Expr sum() const {
    Expr result;
    for (const Group& g : groups_) {
      const bool is_subtracted = g.terms == 1 && g.first.is_subtracted;
      const Expr value = g.terms == 1 ? g.first.value : product_of(g.fine) * g.sum;
      if (!result.defined())
        result = is_subtracted ? -value : value;
      else
        result = is_subtracted ? result - value : result + value;
    }
    return result;
  }

 private:
  void join(Group found, const Expr& coarse) {
    const auto same = std::ranges::find_if(groups_, [&](const Group& g) {
      return found.index.defined() && g.index.defined() && !found.fine.empty() &&
             equal(g.index, found.index) && are_equal(g.fine, found.fine);
    });
    const bool is_subtracted = found.first.is_subtracted;
    if (same != groups_.end()) {
      same->terms++;
      same->sum = is_subtracted ? same->sum - coarse : same->sum + coarse;
      return;
    }
    found.terms = 1;
    if (coarse.defined()) found.sum = is_subtracted ? -coarse : coarse;
    groups_.push_back(std::move(found));
  }

  CoarseAxis& axis_;
  std::vector<Group> groups_;
};

// The variables of the domain that the expression mentions.
std::set<std::string> mentioned(const Expr& e, const std::vector<ReductionVariable>& domain) {
  std::set<std::string> result;
  walk(e, [&](const Variable& v) {
    if (std::ranges::find(domain, v.name, &ReductionVariable::var) != domain.end())
      result.insert(v.name);
  });
  return result;
}

bool have_common(const std::set<std::string>& a, const std::set<std::string>& b) {
  return std::ranges::any_of(a, [&](const std::string& name) { return b.contains(name); });
}

// The factors of a product, with the reduction variables that each mentions.
struct Factor {
  Expr value;
  std::set<std::string> variables;
  bool is_outer = false, reads_grid = false;
};

// Factors that share a variable with an outer one are outer, too. False: a factor that reads the grid would be.
bool close_outer(std::vector<Factor>& factors, std::set<std::string>& outer) {
  for (bool grows = true; grows;) {
    grows = false;
    for (Factor& factor : factors) {
      if (factor.is_outer || !have_common(factor.variables, outer)) continue;
      if (factor.reads_grid) return false;
      factor.is_outer = grows = true;
      outer.insert(factor.variables.begin(), factor.variables.end());
    }
  }
  return true;
}

}  // namespace

Expr with_grouped_terms(const Expr& e, CoarseAxis& axis) {
  return rewrite(e, [&](const Expr& node, const auto&) -> Expr {
    if (is_element_read(node) || as_op(node, Op::if_then_else, Op::strict_float)) return node;
    if (!is_sum(node)) return {};
    std::vector<SumTerm> terms;
    add_terms(node, false, terms);
    if (terms.size() > most_terms) return {};
    Grouping grouping(axis);
    for (const SumTerm& term : terms) grouping.add(term);
    return grouping.has_common_factors() ? grouping.sum() : Expr();
  });
}

std::optional<SplitProduct> split_product(const Expr& product,
                                          const std::vector<ReductionVariable>& domain,
                                          CoarseAxis& axis) {
  std::vector<Expr> values;
  add_factors(product, values);
  std::vector<Factor> factors;
  std::set<std::string> outer;
  SplitProduct result;
  for (const Expr& value : values) {
    const CoarseAxis::Dependence on = axis.of(value);
    if (on.is_through_index()) {
      if (result.index.defined() && !equal(result.index, on.index)) return std::nullopt;
      result.index = on.index;
    }
    Expr own = on.is_through_index() ? axis.over_grid(value, on.index) : value;
    factors.push_back({own, mentioned(own, domain), on.is_fine, on.is_through_index()});
    if (on.is_fine) outer.insert(factors.back().variables.begin(), factors.back().variables.end());
  }
  if (!result.index.defined()) return std::nullopt;
  outer.merge(mentioned(result.index, domain));
  if (!close_outer(factors, outer)) return std::nullopt;
  std::vector<Expr> inner_factors, outer_factors;
  for (const Factor& factor : factors)
    (factor.is_outer ? outer_factors : inner_factors).push_back(factor.value);
  for (const ReductionVariable& r : domain)
    (outer.contains(r.var) ? result.outer : result.inner).push_back(r);
  if (result.inner.empty() || result.outer.empty() || outer_factors.empty()) return std::nullopt;
  result.inner_factor = product_of(inner_factors);
  result.outer_factor = product_of(outer_factors);
  return result;
}

}  // namespace retrograde::transform
