#include "ir/validate_expr.h"

#include <utility>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::ir {

void ExprValidator::check(const Expr& e) {
  if (std::exchange(exits_, scope_.exits()) != scope_.exits()) checked_.clear();
  if (checked_.insert(e.get()).second) check_node(e);
}

void ExprValidator::check_node(const Expr& e) {
  match(
      e, [&](const Variable& n) { check_variable(e, n); }, [&](const Let& n) { check_let(e, n); },
      [&](const Binary& n) { check_binary(e, n); }, [&](const Select& n) { check_select(e, n); },
      [&](const Call& n) { check_call(e, n); }, [&](const Load& n) { check_load(e, n); },
      [&](const Cast& n) {
        check(n.value);
        phase_.require(n.type.lanes() == n.value.type().lanes(), e,
                       "a cast keeps the number of lanes");
      },
      [&](const Not& n) {
        check(n.a);
        phase_.require(n.type.is_bool(), e, "Not takes bool");
      },
      [&](const Ramp& n) {
        check_children(e);
        phase_.require(n.base.type() == n.stride.type(), e,
                       "base and stride of a ramp have one type");
      },
      [&](const ExprNode&) { check_children(e); });
}

void ExprValidator::check_children(const Expr& e) {
  for_each_child(e, [&](const Expr& child) { check(child); });
}

void ExprValidator::check_variable(const Expr& e, const Variable& n) const {
  if (!scope_.is_visible(n.name))
    phase_.fail(e, "every variable is bound before use: " + quoted(n.name) + " is not");
}

void ExprValidator::check_let(const Expr& e, const Let& n) {
  if (!lets_.insert(e).second) return;  // equal nodes bind their name once
  check(n.value);
  const ValidationScope::Binding binding(scope_, n.name, e);
  check(n.body);
}

void ExprValidator::check_binary(const Expr& e, const Binary& n) {
  check(n.a);
  check(n.b);
  phase_.require(n.a.type() == n.b.type(), e, "both operands have one type");
  const bool logical = n.kind == Kind::And || n.kind == Kind::Or;
  phase_.require(!logical || n.a.type().is_bool(), e, "And and Or take bool");
  const bool comparison = n.kind >= Kind::EQ && n.kind <= Kind::GE;
  const Type expected = comparison ? Bool(n.a.type().lanes()) : n.a.type();
  phase_.require(n.type == expected, e, "the type of a binary node follows from its operands");
}

void ExprValidator::check_select(const Expr& e, const Select& n) {
  check_children(e);
  phase_.require(n.when_true.type() == n.when_false.type(), e,
                 "both arms of a select have one type");
  phase_.require(n.condition.type().is_bool(), e, "the condition of a select is bool");
  const int lanes = n.condition.type().lanes();
  phase_.require(lanes == 1 || lanes == n.type.lanes(), e,
                 "the condition of a select is scalar or has the arms' lanes");
}

void ExprValidator::check_call(const Expr& e, const Call& n) {
  check_children(e);
  if (n.call_type == CallType::Operator) {
    const int arity = op_info(n.op).arity;
    phase_.require(arity < 0 || arity == static_cast<int>(n.args.size()), e,
                   "an operator takes the arguments of its arity");
    return;
  }
  if (n.call_type == CallType::Extern) return;
  if (phase_.phase() > Phase::Loops)
    phase_.fail(e, "calls of Funcs and images belong to the phase Loops");
  for (const Expr& arg : n.args) check_index(arg);
}

void ExprValidator::check_load(const Expr& e, const Load& n) {
  phase_.only_in_flat(e);
  check(n.index);
  check_index(n.index);
  phase_.require(n.index.type().lanes() == n.type.lanes(), e, "a load has the lanes of its index");
  check_predicate(e, n.predicate, n.type.lanes());
  scope_.check_alive(n.name, e);
}

void ExprValidator::check_index(const Expr& e) const {
  phase_.require(e.type().is_int_or_uint(), e, "indices are integers");
}

}  // namespace retrograde::ir
