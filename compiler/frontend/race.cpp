#include "frontend/race.h"

#include <unordered_set>

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

bool calls_self(const Expr& root, const FuncContents& f) {
  bool found = false;
  if (!root.defined()) return false;
  walk(root, [&](const Expr& e) {
    const Call* call = e.as<Call>();
    found = found || (call && call->call_type == CallType::Func && call->symbol.raw() == &f);
    return !found;
  });
  return found;
}

bool is_self_at_same_point(const Expr& e, const FuncContents& f, const Definition& update,
                           int value_index) {
  const Call* call = e.as<Call>();
  if (!call || call->call_type != CallType::Func || call->symbol.raw() != &f) return false;
  if (call->value_index != value_index) return false;
  for (size_t d = 0; d < update.args.size(); d++) {
    if (!equal(call->args[d], update.args[d])) return false;
  }
  return true;
}

bool is_associative(Kind kind) {
  return kind == Kind::Add || kind == Kind::Mul || kind == Kind::Min || kind == Kind::Max ||
         kind == Kind::And || kind == Kind::Or;
}

bool is_associative(Op op) {
  return op == Op::bitwise_and || op == Op::bitwise_or || op == Op::bitwise_xor;
}

bool accumulates(const Expr& a, const Expr& b, const FuncContents& f, const Definition& update,
                 int i) {
  return (is_self_at_same_point(a, f, update, i) && !calls_self(b, f)) ||
         (is_self_at_same_point(b, f, update, i) && !calls_self(a, f));
}

bool is_accumulation(const Expr& value, const FuncContents& f, const Definition& update, int i) {
  if (is_self_at_same_point(value, f, update, i)) return true;
  if (const Sub* sub = value.as<Sub>())
    return is_self_at_same_point(sub->a, f, update, i) && !calls_self(sub->b, f);
  if (const Binary* binary = value.as<Binary>(); binary && is_associative(binary->kind)) {
    return accumulates(binary->a, binary->b, f, update, i);
  }
  const Call* call = value.as<Call>();
  if (call && call->call_type == CallType::Operator && is_associative(call->op)) {
    return accumulates(call->args[0], call->args[1], f, update, i);
  }
  return false;
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
  for (const Expr& arg : update.args) {
    if (calls_self(arg, f)) return false;
  }
  if (calls_self(update.predicate, f)) return false;
  for (size_t i = 0; i < update.values.size(); i++) {
    if (!is_accumulation(update.values[i], f, update, static_cast<int>(i))) return false;
  }
  return true;
}

}  // namespace retrograde::ir
