#include "ir/visitor.h"

#include "ir/build.h"
#include "ir/lists.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {

void Expr::accept(ir::IRVisitor* visitor) const {
  if (!defined()) return;
  switch (kind()) {
#define RETROGRADE_EXPR(K) \
  case ir::Kind::K:        \
    return visitor->visit(as<ir::K>());
#define RETROGRADE_BINARY(K) RETROGRADE_EXPR(K)
#include "ir/kinds.def"
    default:
      internal_error(text(ir::kind_name(kind()), " is no expression"));
  }
}

namespace ir {

#define RETROGRADE_EXPR(K) \
  void IRVisitor::visit(const K* node) { visit_children(node); }
#define RETROGRADE_BINARY(K) RETROGRADE_EXPR(K)
#include "ir/kinds.def"

void IRVisitor::visit_children(const Expr& e) {
  for_each_child(e, [&](const Expr& child) { visit_child(child); });
}

void IRGraphVisitor::include(const Expr& e) {
  if (!e.defined() || !seen_.insert(e.get()).second) return;
  kept_.push_back(e);
  e.accept(this);
}

Expr IRMutator::mutate(const Expr& e) {
  if (!e.defined()) return e;
  switch (e.kind()) {
#define RETROGRADE_EXPR(K) \
  case Kind::K:            \
    return visit(e.as<K>());
#define RETROGRADE_BINARY(K) RETROGRADE_EXPR(K)
#include "ir/kinds.def"
    default:
      internal_error(text(kind_name(e.kind()), " is no expression"));
  }
}

std::vector<Expr> IRMutator::mutate(const std::vector<Expr>& es) {
  return mapped(es, [&](const Expr& e) { return mutate(e); });
}

#define RETROGRADE_EXPR(K) \
  Expr IRMutator::visit(const K* node) { return rebuild(node); }
#define RETROGRADE_BINARY(K) RETROGRADE_EXPR(K)
#include "ir/kinds.def"

Expr IRMutator::rebuild(const Expr& e) {
  return map_children(e, [&](const Expr& child) { return mutate(child); });
}

Expr IRGraphMutator::mutate(const Expr& e) {
  if (!e.defined()) return e;
  return memo_.get(e, [&] { return IRMutator::mutate(e); });
}

// ---- X::make ----

namespace {

void check_operands(const char* node, std::initializer_list<Expr> operands) {
  for (const Expr& e : operands) {
    if (e.defined()) continue;
    user_error(text("make a node ", node), "operands of a node are defined", "one of them is not",
               "Give every operand a value");
  }
}

void check_one_type(const char* node, const Expr& a, const Expr& b) {
  check_operands(node, {a, b});
  if (a.type().element_of() == b.type().element_of()) return;
  user_error(text("make a node ", node), "operands of a node have one type",
             text("they are of type ", a.type(), " and ", b.type()),
             "Convert one with cast(), or write the operator, which promotes");
}

void check_condition(const char* node, const Expr& condition) {
  check_operands(node, {condition});
  if (condition.type().is_bool()) return;
  user_error(text("make a node ", node), "the condition of a node is of type bool",
             text("it is of type ", condition.type()), "Write a comparison");
}

}  // namespace

Expr IntImm::make(Type type, int64_t value) { return make_const(type, value); }
Expr UIntImm::make(Type type, uint64_t value) { return make_uint_const(type, value); }
Expr FloatImm::make(Type type, double value) { return make_const(type, value); }
Expr Variable::make(Type type, const std::string& name) { return variable(name, type); }
Expr Cast::make(Type type, Expr value) {
  check_operands("Cast", {value});
  return cast_to(type, std::move(value));
}
Expr Reinterpret::make(Type type, Expr value) {
  check_operands("Reinterpret", {value});
  return reinterpret_as(type, std::move(value));
}
template <Kind K>
Expr BinaryOf<K>::make(Expr a, Expr b) {
  if constexpr (K == Kind::And || K == Kind::Or) {
    check_condition(kind_name(K), a);
    check_condition(kind_name(K), b);
  }
  check_one_type(kind_name(K), a, b);
  return binary(K, std::move(a), std::move(b));
}
#define RETROGRADE_BINARY(K) template struct BinaryOf<Kind::K>;
#include "ir/kinds.def"
Expr Not::make(Expr a) {
  check_condition("Not", a);
  return logical_not(std::move(a));
}
Expr Select::make(Expr condition, Expr when_true, Expr when_false) {
  check_condition("Select", condition);
  check_one_type("Select", when_true, when_false);
  return make_select(std::move(condition), std::move(when_true), std::move(when_false));
}
Expr Ramp::make(Expr base, Expr stride, int lanes) {
  check_one_type("Ramp", base, stride);
  return make_ramp(std::move(base), std::move(stride), lanes);
}
Expr Broadcast::make(Expr value, int lanes) {
  check_operands("Broadcast", {value});
  return make_broadcast(std::move(value), lanes);
}
Expr Let::make(const std::string& name, Expr value, Expr body) {
  check_operands("Let", {value, body});
  return make_let(name, std::move(value), std::move(body));
}

Expr Call::make(Type type, const std::string& name, const std::vector<Expr>& args,
                CallType call_type) {
  if (call_type != CallType::Extern) {
    user_error("make a call of " + quoted(name), "a call by name alone calls a C function",
               "its call type is another",
               "Call a Func or an image with (), an operator by its own function");
  }
  for (const Expr& arg : args) check_operands("Call", {arg});
  return call_extern(name, type, args);
}
Expr Call::make(Type type, Op op, const std::vector<Expr>& args, CallType) {
  for (const Expr& arg : args) check_operands("Call", {arg});
  return call_op(op, type, args);
}

Expr Shuffle::make(const std::vector<Expr>& vectors, const std::vector<int>& indices) {
  for (const Expr& vector : vectors) check_one_type("Shuffle", vectors[0], vector);
  return make_shuffle(vectors, indices);
}
Expr Shuffle::make_interleave(const std::vector<Expr>& vectors) {
  for (const Expr& vector : vectors) check_one_type("Shuffle", vectors[0], vector);
  return make_interleaved(vectors);
}
Expr Shuffle::make_concat(const std::vector<Expr>& vectors) {
  std::vector<int> indices;
  for (const Expr& vector : vectors) {
    check_one_type("Shuffle", vectors[0], vector);
    for (int lane = 0; lane < vector.type().lanes(); lane++)
      indices.push_back(static_cast<int>(indices.size()));
  }
  return make_shuffle(vectors, indices);
}
Expr Shuffle::make_slice(Expr vector, int begin, int stride, int size) {
  check_operands("Shuffle", {vector});
  std::vector<int> indices;
  for (int i = 0; i < size; i++) indices.push_back(begin + i * stride);
  return make_shuffle({std::move(vector)}, std::move(indices));
}

}  // namespace ir
}  // namespace retrograde
