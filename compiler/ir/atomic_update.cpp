#include "ir/atomic_update.h"

#include <unordered_map>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::ir {

bool touches_several_elements(const Stmt& update) {
  Substitution lets;
  walk(update, [&](const LetStmt& let) { lets[let.name] = substitute(let.value, lets); });
  const auto expand_lets_in_scope = [&](const Expr& index) { return substitute(index, lets); };
  std::unordered_map<std::string, Expr> stored;
  bool several = false;
  walk(update, [&](const Store& store) {
    const Expr index = expand_lets_in_scope(store.index);
    const auto first = stored.emplace(store.name, index).first;
    several |= !equal(first->second, index);
  });
  return several || any_node(update, [&](const Load& load) {
           const auto element = stored.find(load.name);
           return element != stored.end() &&
                  !equal(expand_lets_in_scope(load.index), element->second);
         });
}

bool loads_from(const Expr& e, const std::string& buffer) {
  return any_node(e, [&](const Load& load) { return load.name == buffer; });
}

bool is_one_word(Type type) { return !type.is_handle() && type.bits() <= 64; }

namespace {

bool is_own_load(const Expr& e, const Store& store) {
  const auto* load = e.as<Load>();
  return load && load->name == store.name && equal(load->index, store.index);
}

// The two operands of a commutative or subtracting operation; nothing when `e` is another
// expression.
struct Operation {
  Kind kind;
  Op op = Op::none;
  Expr a, b;
  bool is_sub = false;
};
std::optional<Operation> operation(const Expr& e) {
  if (const Call* call = as_op(e, Op::bitwise_and, Op::bitwise_or, Op::bitwise_xor))
    return Operation{Kind::Call, call->op, call->args[0], call->args[1]};
  const Kind kind = e.kind();
  const bool is_sub = kind == Kind::Sub;
  const bool known = is_sub || kind == Kind::Add || kind == Kind::Mul || kind == Kind::Min ||
                     kind == Kind::Max || kind == Kind::And || kind == Kind::Or;
  if (!known) return std::nullopt;
  const auto* node = e.as<Binary>();
  return Operation{is_sub ? Kind::Add : kind, Op::none, node->a, node->b, is_sub};
}

}  // namespace

std::optional<UpdateChain> find_update_chain(const Store& store) {
  const auto top = operation(store.value);
  if (!top) return std::nullopt;
  UpdateChain chain{top->kind, top->op, store.value, {}};
  while (!is_own_load(chain.own, store)) {
    const auto step = operation(chain.own);
    if (!step || step->kind != top->kind || step->op != top->op) return std::nullopt;
    const bool in_a = loads_from(step->a, store.name), in_b = loads_from(step->b, store.name);
    if (in_a == in_b || (in_b && step->is_sub)) return std::nullopt;
    chain.terms.push_back({in_a ? step->b : step->a, step->is_sub});
    chain.own = in_a ? step->a : step->b;
  }
  return chain;
}

std::optional<AtomicUpdate> find_atomic_update(const Store& store) {
  const auto chain = find_update_chain(store);
  if (!chain || (chain->terms.size() > 1 && store.value.type().is_float())) return std::nullopt;
  AtomicUpdate update{chain->kind, chain->op, chain->terms[0].value, chain->terms[0].is_negated};
  for (size_t i = 1; i < chain->terms.size(); ++i) {
    const auto& [value, is_negated] = chain->terms[i];
    if (is_negated != update.is_negated) {  // f + a - b: a - b, or -(b - a)
      update.operand = binary(Kind::Sub, update.operand, value);
    } else if (chain->op != Op::none) {
      update.operand = call_op(chain->op, {update.operand, value});
    } else {
      update.operand = binary(chain->kind, update.operand, value);
    }
  }
  return update;
}

Expr updated(const AtomicUpdate& update, const Expr& old, const Expr& operand) {
  if (update.op != Op::none) return call_op(update.op, {old, operand});
  return binary(update.is_negated ? Kind::Sub : update.kind, old, operand);
}

}  // namespace retrograde::ir
