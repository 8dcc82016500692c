#include "frontend/race.h"

#include <unordered_set>

#include "frontend/associative_update.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

// e == scale * var + (something free of all reduction variables), scale a constant that is not
// zero.
bool is_injective_in(const Expr& e, const std::string& var,
                     const std::unordered_set<std::string>& rvars) {
  if (!uses_any_variable(e, rvars)) return false;
  if (const Variable* v = e.as<Variable>()) return v->name == var;
  const auto free_of_rvars = [&](const Expr& part) { return !uses_any_variable(part, rvars); };
  const auto one_side = [&](const Expr& a, const Expr& b) {
    return (is_injective_in(a, var, rvars) && free_of_rvars(b)) ||
           (free_of_rvars(a) && is_injective_in(b, var, rvars));
  };
  if (const Add* add = e.as<Add>()) return one_side(add->a, add->b);
  if (const Sub* sub = e.as<Sub>()) return one_side(sub->a, sub->b);
  if (const Mul* mul = e.as<Mul>()) {
    const auto nonzero = [](const Expr& factor) { return as_const_int(factor).value_or(0) != 0; };
    return (nonzero(mul->b) && is_injective_in(mul->a, var, rvars)) ||
           (nonzero(mul->a) && is_injective_in(mul->b, var, rvars));
  }
  return false;
}

// Calls b that see other points of the Func than the one at hand.
bool reads_only_at(const FuncContents& f, const Definition& update, size_t dimension) {
  bool result = true;
  std::unordered_set<const ExprNode*> seen;
  for_each_expr(update, [&](const Expr& root) {
    walk(root, [&](const Expr& e) {
      if (!seen.insert(e.get()).second) return false;
      const Call* call = e.as<Call>();
      if (call && call->call_type == CallType::Func && call->symbol.raw() == &f) {
        result = result && equal(call->args[dimension], update.args[dimension]);
      }
      return result;
    });
  });
  return result;
}

}  // namespace

bool can_prove_race_free(const FuncContents& f, const Definition& update, const std::string& rvar) {
  std::unordered_set<std::string> rvars;
  for (const ReductionVariable& r : update.rvars) rvars.insert(r.var);
  for (size_t d = 0; d < update.args.size(); d++) {
    if (is_injective_in(update.args[d], rvar, rvars) && reads_only_at(f, update, d)) return true;
  }
  return false;
}

bool can_prove_commutative(const FuncContents& f, const Definition& update) {
  const AssociativityProof proof = prove_associative(f, update);
  return proof.op && proof.op->commutative && !proof.op->breaks_ties;
}

}  // namespace retrograde::ir
