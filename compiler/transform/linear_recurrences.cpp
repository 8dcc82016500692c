#include "transform/linear_recurrences.h"

#include <algorithm>
#include <cstdlib>

#include "analysis/interval.h"
#include "analysis/linear.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/markers.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::transform {

namespace {

constexpr size_t most_order = 2;

// The dimension that the reduction variable moves by one element, and in which direction.
struct Movement {
  size_t dimension = 0;
  int64_t direction = 0;
};

std::optional<Movement> movement(const Definition& update) {
  const std::string& variable = update.rvars[0].var;
  std::optional<Movement> result;
  for (size_t d = 0; d < update.args.size(); ++d) {
    if (!uses_variable(update.args[d], variable)) continue;
    const auto form = analysis::decompose(update.args[d], {variable});
    if (result || !form || form->coefficients.size() != 1 ||
        std::abs(form->coefficients[0].second) != 1)
      return std::nullopt;
    result = Movement{d, form->coefficients[0].second};
  }
  return result;
}

Expr in_double(const Expr& e) { return cast_to(Float(64), e); }

class Linear {
 public:
  Linear(const FuncContents& f, const Definition& update) : f_(f), update_(update) {}

  std::optional<LinearRecurrence> find() {
    const ReductionVariable& r = update_.rvars[0];
    LinearRecurrence result;
    const Expr value = in_steady_state(without_likely(without_lets(update_.values[0])), result);
    if (!value.defined()) return std::nullopt;
    const Interval all{simplify(r.min), simplify(r.min + r.extent - 1)};
    result.value = simplify(value, {{r.var, analysis::intersection(all, result.steady)}});
    Terms terms;
    if (!add_terms(result.value, terms) || terms.empty()) return std::nullopt;
    for (Expr& coefficient : terms)
      if (coefficient.defined()) coefficient = simplify(coefficient);
    result.coefficients = std::move(terms);
    return result;
  }

 private:
  using Terms = std::vector<Expr>;  // coefficients by number of iterations before, from 1

  bool reads_own(const Expr& e) const {
    return any_node(e, [&](const Call& call) { return graph::is_call_of(call, &f_); });
  }
  bool uses_iteration(const Expr& e) const { return uses_variable(e, update_.rvars[0].var); }

  // Takes the first arm of each select by the variable that reads the Func; undefined: there is one that holds nowhere.
  Expr in_steady_state(const Expr& e, LinearRecurrence& result) {
    bool is_found = true;
    const Expr value = rewrite(e, [&](const Expr& node, const auto& recurse) -> Expr {
      const auto* choice = node.as<Select>();
      if (!choice || !uses_iteration(choice->condition) || !reads_own(choice->when_true)) return {};
      const auto solution = analysis::solve_for(choice->condition, update_.rvars[0].var, {});
      is_found &= solution && !solution->needed.defined();
      if (is_found) result.steady = analysis::intersection(result.steady, solution->interval);
      return recurse(choice->when_true);
    });
    return is_found ? value : Expr();
  }

  // Adds the coefficients of e to the terms. False: it is not linear in the reads.
  bool add_terms(const Expr& e, Terms& terms) const {
    return add_terms(
        e, [](const Expr& own) { return own; }, terms);
  }

  using Scale = FunctionRef<Expr(const Expr&)>;

  bool add_terms(const Expr& e, Scale scale, Terms& terms) const {
    if (!reads_own(e)) return true;
    if (const Call* own = graph::as_call_of(e, &f_)) return add_read(*own, scale, terms);
    if (const auto* cast = e.as<Cast>())
      return e.type().is_float() && add_terms(cast->value, scale, terms);
    if (e.kind() == Kind::Add || e.kind() == Kind::Sub) {
      const auto* sum = e.as<Binary>();
      const auto negative = [&](const Expr& c) { return scale(-c); };
      return add_terms(sum->a, scale, terms) &&
             (e.kind() == Kind::Sub ? add_terms(sum->b, negative, terms)
                                    : add_terms(sum->b, scale, terms));
    }
    return add_terms_of_product(e, scale, terms);
  }

  bool add_terms_of_product(const Expr& e, Scale scale, Terms& terms) const {
    const auto times = [&](const Expr& factor, const Expr& own) {
      return is_coefficient(factor) &&
             add_terms(
                 own, [&](const Expr& c) { return scale(c * in_double(factor)); }, terms);
    };
    if (const auto* product = e.as<Mul>())
      return reads_own(product->a) ? times(product->b, product->a) : times(product->a, product->b);
    if (const Call* strong = as_op(e, Op::strong_mul))
      return reads_own(strong->args[0]) && times(strong->args[1], strong->args[0]);
    const auto* quotient = e.kind() == Kind::Div ? e.as<Binary>() : nullptr;
    return quotient && is_coefficient(quotient->b) &&
           add_terms(
               quotient->a, [&](const Expr& c) { return scale(c / in_double(quotient->b)); },
               terms);
  }

  bool is_coefficient(const Expr& e) const { return !reads_own(e) && !uses_iteration(e); }

  // The old value is read as it is: a coefficient of it would be one of the value that it starts from.
  bool add_read(const Call& own, Scale scale, Terms& terms) const {
    const auto before = iterations_before(update_, own.args);
    if (!before || *before < 0 || *before > static_cast<int64_t>(most_order)) return false;
    if (*before == 0) return true;
    const auto k = static_cast<size_t>(*before);
    terms.resize(std::max(terms.size(), k));
    add_term(terms[k - 1], scale(make_one(Float(64))));
    return true;
  }

  const FuncContents& f_;
  const Definition& update_;
};

}  // namespace

std::optional<int64_t> iterations_before(const Definition& update, const std::vector<Expr>& place) {
  const auto moves = movement(update);
  if (!moves) return std::nullopt;
  for (size_t d = 0; d < place.size(); ++d) {
    if (d != moves->dimension && analysis::constant_difference(update.args[d], place[d]) != 0)
      return std::nullopt;
  }
  const auto distance =
      analysis::constant_difference(update.args[moves->dimension], place[moves->dimension]);
  if (!distance) return std::nullopt;
  return *distance * moves->direction;
}

std::optional<LinearRecurrence> linear_recurrence(const FuncContents& f, const Definition& update) {
  if (update.rvars.size() != 1 || update.predicate.defined() || update.values.size() != 1 ||
      !f.types[0].is_float() || !movement(update))
    return std::nullopt;
  return Linear(f, update).find();
}

}  // namespace retrograde::transform
