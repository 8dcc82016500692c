#include "ir/atomic_update.h"

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::ir {

bool loads_from(const Expr& e, const std::string& buffer) {
  return any_node(e, [&](const Expr& node) {
    const auto* load = node.as<Load>();
    return load && load->name == buffer;
  });
}

bool is_one_word(Type type) { return !type.is_handle() && type.bits() <= 64; }

namespace {

bool is_own_load(const Expr& e, const Store& store) {
  const auto* load = e.as<Load>();
  return load && load->name == store.name && equal(load->index, store.index);
}

// The two operands of a commutative or subtracting operation; none when `e` is no such thing.
struct Operation {
  Kind kind;
  Op op = Op::none;
  Expr a, b;
  bool is_sub = false;
};
std::optional<Operation> operation(const Expr& e) {
  if (const auto* call = e.as<Call>()) {
    const bool is_bitwise =
        call->is_op(Op::bitwise_and) || call->is_op(Op::bitwise_or) || call->is_op(Op::bitwise_xor);
    if (!is_bitwise) return std::nullopt;
    return Operation{Kind::Call, call->op, call->args[0], call->args[1]};
  }
  const Kind kind = e.kind();
  const bool is_sub = kind == Kind::Sub;
  const bool known = is_sub || kind == Kind::Add || kind == Kind::Mul || kind == Kind::Min ||
                     kind == Kind::Max || kind == Kind::And || kind == Kind::Or;
  if (!known) return std::nullopt;
  const auto* node = e.as<Binary>();
  return Operation{is_sub ? Kind::Add : kind, Op::none, node->a, node->b, is_sub};
}

Expr combined(const Operation& by, const Expr& a, const Expr& b) {
  return by.op != Op::none ? call_op(by.op, {a, b}) : binary(by.kind, a, b);
}

}  // namespace

std::optional<AtomicUpdate> find_atomic_update(const Store& store) {
  const auto top = operation(store.value);
  if (!top) return std::nullopt;
  AtomicUpdate update{top->kind, top->op, {}, false};
  for (Expr e = store.value; !is_own_load(e, store);) {
    const auto step = operation(e);
    if (!step || step->kind != top->kind || step->op != top->op) return std::nullopt;
    const bool in_a = loads_from(step->a, store.name), in_b = loads_from(step->b, store.name);
    if (in_a == in_b || (in_b && step->is_sub)) return std::nullopt;
    const Expr term = in_a ? step->b : step->a;
    const bool is_first = !update.operand.defined();
    if (!is_first && store.value.type().is_float()) return std::nullopt;
    if (is_first) {
      update.operand = term;
      update.is_negated = step->is_sub;
    } else if (update.is_negated == step->is_sub) {
      update.operand = combined(*step, update.operand, term);
    } else {  // f + a - b: a - b, or -(b - a)
      update.operand = binary(Kind::Sub, update.operand, term);
    }
    e = in_a ? step->a : step->b;
  }
  return update.operand.defined() ? std::optional(update) : std::nullopt;
}

Expr updated(const AtomicUpdate& update, const Expr& old, const Expr& operand) {
  if (update.op != Op::none) return call_op(update.op, {old, operand});
  return binary(update.is_negated ? Kind::Sub : update.kind, old, operand);
}

}  // namespace retrograde::ir
