#include "lower/loops/choice_reads.h"

#include <set>
#include <unordered_set>
#include <utility>

#include "ir/build.h"

namespace retrograde::lower {

namespace {

// Choices in one expression, and their nesting depth; conditions of choices beyond either limit count as true.
constexpr int most_choices = 64, deepest_choice = 4;

bool is_choice(const Expr& e) { return e.as<Select>() || as_op(e, Op::if_then_else); }

bool reads_funcs(const Expr& e) {
  return any_node(e, [](const Call& call) { return call.call_type == CallType::Func; });
}

// Whether the operator accepts arbitrary operands if its result is unused. Promises do not, as they may be checked.
bool is_plain_operator(const Call& call) {
  if (call.call_type != CallType::Operator) return false;
  const OpClass cls = op_info(call.op).cls;
  const bool promises = call.is_op(Op::promise_clamped, Op::unsafe_promise_clamped);
  return cls == OpClass::Pure || (cls == OpClass::Marker && !promises);
}

// The walk over one expression.
class ChoiceReads {
 public:
  ChoiceReads(EnclosingConditions& enclosing, FunctionRef<void(const std::string&)> read)
      : enclosing_(enclosing), read_(read) {}

  // `choice`: the number of the innermost choice around; 0: none.
  void visit(const Expr& e, int choice = 0, int depth = 0) {
    if (seen_.contains({e.get(), 0}) || !seen_.insert({e.get(), choice}).second) return;
    if (const auto* select = e.as<Select>())
      return visit_choice(select->condition, select->when_true, select->when_false, choice, depth);
    const auto* call = e.as<Call>();
    if (call && call->is_op(Op::if_then_else))
      return visit_choice(call->args[0], call->args[1], call->args[2], choice, depth);
    const auto* let = e.as<ir::Let>();
    if (let) let_names_.insert(let->name);
    const bool is_plain = !let && (!call || is_plain_operator(*call));
    if (call && call->call_type == CallType::Func) read_(call->name);
    if (let) {
      enclosing_.outside_of_choices([&] { visit(let->value); });
      return visit(let->body, choice, depth);
    }
    for_each_child(e, [&](const Expr& child) {
      if (is_plain) return visit(child, choice, depth);
      enclosing_.outside_of_choices([&] { visit(child); });
    });
  }

 private:
  void visit_choice(const Expr& condition, const Expr& a, const Expr& b, int choice, int depth) {
    visit(condition, choice, depth);
    const bool is_too_much = ++choices_ > most_choices || depth >= deepest_choice;
    const AtLoops at_loops =
        !is_too_much && reads_funcs(a) && reads_funcs(b) ? AtLoops::Range : AtLoops::Forget;
    for (const bool holds : {true, false}) {
      const Expr where =
          is_too_much ? const_true() : without_parts_of(usable_where(condition, holds), let_names_);
      const int inner = is_const_true(where) ? choice : ++arms_;
      enclosing_.under(where, at_loops, [&] { visit(holds ? a : b, inner, depth + 1); });
    }
  }

  EnclosingConditions& enclosing_;
  FunctionRef<void(const std::string&)> read_;
  std::set<std::pair<const ExprNode*, int>> seen_;
  std::unordered_set<std::string> let_names_;
  int choices_ = 0, arms_ = 0;
};

}  // namespace

void visit_reads(const Expr& e, EnclosingConditions& enclosing,
                 FunctionRef<void(const std::string&)> read) {
  enclosing.around_expression([&] {
    if (any_node(e, [](const Expr& node) { return is_choice(node); }))
      return ChoiceReads(enclosing, read).visit(e);
    walk(e, [&](const Call& call) {
      if (call.call_type == CallType::Func) read(call.name);
    });
  });
}

}  // namespace retrograde::lower
