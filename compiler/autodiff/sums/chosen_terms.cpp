#include "autodiff/sums/chosen_terms.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <string>

#include "autodiff/sums/distinct_nodes.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

constexpr int64_t most_terms = 4;     // of a loop that is written out
constexpr size_t largest_sum = 2000;  // nodes of all its terms

// Whether a constant remains of the condition once the value of the variable is known.
bool is_decided_by(const Expr& condition, const std::string& var) {
  return uses_variable(condition, var) && !any_node(condition, [&](const Expr& e) {
           const auto* variable = e.as<Variable>();
           const auto* call = e.as<Call>();
           return (variable && variable->name != var) ||
                  (call && call->call_type != CallType::Operator);
         });
}

// The number of the loop that can be written out.
std::optional<size_t> chosen_loop(const Contribution& c) {
  const Gather& g = c.gather;
  for (size_t i = 0; g.rdom && i < g.rdom->vars.size(); ++i) {
    const ReductionVariable& r = g.rdom->vars[i];
    const auto extent = as_const_int(r.extent);
    const auto moves = [&](const Expr& e) { return uses_variable(e, r.var); };
    const bool is_short = extent && *extent >= 1 && *extent <= most_terms && is_const(r.min);
    // A scatter keeps a loop, and a condition its domain.
    const bool is_free = !r.numbers_points && std::ranges::none_of(g.lhs, moves) &&
                         !(g.predicate.defined() && moves(g.predicate)) &&
                         (g.rdom->vars.size() > 1 || !g.scatters);
    if (is_short && is_free && chooses_by(c.adjoint, r.var) &&
        DistinctNodes({c.adjoint}).nodes().size() * static_cast<size_t>(*extent) <= largest_sum)
      return i;
  }
  return std::nullopt;
}

Contribution written_out(const Contribution& c, size_t loop) {
  const Gather& g = c.gather;
  const ReductionVariable r = g.rdom->vars[loop];
  Contribution result = c;
  Substitution others;  // the variables of a domain of their own
  result.gather.rdom = nullptr;
  if (g.rdom->vars.size() > 1) {
    std::vector<ReductionVariable> vars = g.rdom->vars;
    vars.erase(vars.begin() + static_cast<std::ptrdiff_t>(loop));
    result.gather.rdom = make_domain(vars);
    for (const ReductionVariable& other : vars)
      others[other.var] = loop_variable(result.gather.rdom, other.var);
  }
  Expr sum;
  for (int64_t i = 0; i < *as_const_int(r.extent); ++i) {
    const Expr term =
        substitute(chosen_term(c.adjoint, r.var, r.min + static_cast<int>(i)), others);
    if (!is_zero(term)) add_term(sum, term);
  }
  result.adjoint = sum.defined() ? sum : make_zero(c.adjoint.type());
  if (g.predicate.defined()) result.gather.predicate = substitute(g.predicate, others);
  for (Expr& place : result.gather.lhs) place = substitute(place, others);
  return result;
}

}  // namespace

bool chooses_by(const Expr& term, const std::string& var) {
  return any_node(term, [&](const Select& choice) { return is_decided_by(choice.condition, var); });
}

Expr chosen_term(const Expr& term, const std::string& var, const Expr& value) {
  return rewrite(term, [&](const Expr& e, const std::function<Expr(const Expr&)>& recurse) -> Expr {
    const auto* variable = e.as<Variable>();
    if (variable) return variable->name == var ? value : e;
    const auto* choice = e.as<Select>();
    if (choice && is_decided_by(choice->condition, var)) {
      const Expr condition = simplify(substitute(choice->condition, var, value));
      if (is_const_true(condition)) return recurse(choice->when_true);
      if (is_const_false(condition)) return recurse(choice->when_false);
    }
    const Expr mapped = map_children(e, recurse);
    const auto* product = as_op(mapped, Op::strong_mul);
    if (product && is_zero(product->args[0])) return make_zero(mapped.type());
    const auto* sum = mapped.type().is_float() ? mapped.as<Add>() : nullptr;
    if (sum && is_zero(sum->a)) return sum->b;
    if (sum && is_zero(sum->b)) return sum->a;
    return mapped;
  });
}

void write_out_choices(std::vector<Contribution>& contributions) {
  for (Contribution& c : contributions) {
    while (const auto loop = chosen_loop(c)) c = written_out(c, *loop);
  }
  std::erase_if(contributions, [](const Contribution& c) { return is_zero(c.adjoint); });
}

}  // namespace retrograde::autodiff
