// Node builders: variables, expressions and statements, with type checks.
#include "ir/build.h"

#include "ir/constants.h"
#include "ir/fold.h"
#include "ir/print.h"
#include "ir/scalar.h"
#include "ir/visit.h"

namespace retrograde::ir {

// ---- variables ----

Expr variable(const std::string& name, Type type, SymbolRef symbol) {
  return make_node<Variable>(type, name, std::move(symbol));
}

Expr loose_variable(const std::string& name, Type type, SymbolRef symbol) {
  Expr result = variable(name, type, std::move(symbol));
  result->has_loose_names = true;
  return result;
}

std::vector<Expr> settled(std::vector<Expr> exprs) {
  StepRewriter settle([](const Expr& part, const auto&) -> Expr {
    if (!part->has_loose_names) return part;
    const auto* v = part.as<Variable>();
    return v ? variable(v->name, v->type, v->symbol) : Expr();
  });
  for (Expr& e : exprs)
    if (has_loose_names(e)) e = settle(e);
  return exprs;
}

std::vector<Expr> variables_of(const std::vector<std::string>& names) {
  return mapped(names, [](const std::string& name) { return variable(name); });
}

// ---- binary nodes ----

namespace {

Type times_lanes(Type type, int lanes) { return type.with_lanes(type.lanes() * lanes); }

Type binary_type(Kind kind, Type operands) {
  const bool is_comparison = kind >= Kind::EQ && kind <= Kind::GE;
  return is_comparison ? Bool(operands.lanes()) : operands;
}

void match_lanes(Expr& a, Expr& b) {
  if (a.type().lanes() == b.type().lanes()) return;
  if (a.type().is_scalar())
    a = make_broadcast(std::move(a), b.type().lanes());
  else if (b.type().is_scalar())
    b = make_broadcast(std::move(b), a.type().lanes());
}

Expr new_binary(Kind kind, Type type, Expr a, Expr b) {
  switch (kind) {
#define RETROGRADE_BINARY(K) \
  case Kind::K:              \
    return new K(type, std::move(a), std::move(b));
#include "ir/kinds.def"
    default:
      internal_error(text(kind_name(kind), " is not a binary node"));
  }
}

// Whether folding to `result` would drop a loose name of the operand.
bool loses_names(const Expr& result, const Expr& operand) {
  return operand->has_loose_names && !operand.same_as(result);
}

}  // namespace

Expr binary(Kind kind, Expr a, Expr b) {
  match_lanes(a, b);
  RETROGRADE_ASSERT(a.type() == b.type(), kind_name(kind), " of ", a.type(), " and ", b.type(),
                    ": ", a, ", ", b);
  const bool logical = kind == Kind::And || kind == Kind::Or;
  RETROGRADE_ASSERT(!logical || a.type().is_bool(), kind_name(kind), " of ", a.type());
  const Type type = binary_type(kind, a.type());
  Expr folded = fold_binary(kind, type, a, b);
  if (folded.defined() && !loses_names(folded, a) && !loses_names(folded, b)) return folded;
  return new_binary(kind, type, std::move(a), std::move(b));
}

// ---- other expressions ----

Expr logical_not(Expr a) {
  RETROGRADE_ASSERT(a.type().is_bool(), "Not of ", a.type());
  if (const std::optional<Scalar> s = as_scalar(a)) return constant(eval_not(*s), a.type().lanes());
  if (const auto* inner = a.as<Not>()) return inner->a;
  return make_node<Not>(a.type(), std::move(a));
}

Expr cast_to(Type type, Expr value) {
  if (type.lanes() != value.type().lanes()) {
    RETROGRADE_ASSERT(type.is_scalar() || value.type().is_scalar(), "cast of ", value.type(),
                      " to ", type);
    if (value.type().is_scalar())
      return make_broadcast(cast_to(type.element_of(), std::move(value)), type.lanes());
    type = type.with_lanes(value.type().lanes());
  }
  if (type == value.type()) return value;
  RETROGRADE_ASSERT(!type.is_handle() && !value.type().is_handle(), "cast of ", value.type(),
                    " to ", type);
  if (Expr folded = fold_cast(type, value); folded.defined()) return folded;
  return make_node<Cast>(type, std::move(value));
}

Expr reinterpret_as(Type type, Expr value) {
  if (type == value.type()) return value;
  RETROGRADE_ASSERT(type.bits() * type.lanes() == value.type().bits() * value.type().lanes(),
                    "reinterpret ", value.type(), " as ", type);
  if (Expr folded = fold_reinterpret(type, value); folded.defined()) return folded;
  return make_node<Reinterpret>(type, std::move(value));
}

Expr make_select(Expr condition, Expr when_true, Expr when_false) {
  match_lanes(when_true, when_false);
  const int lanes = condition.type().lanes();
  if (lanes > 1 && when_true.type().is_scalar()) {
    when_true = make_broadcast(std::move(when_true), lanes);
    when_false = make_broadcast(std::move(when_false), lanes);
  }
  RETROGRADE_ASSERT(condition.type().is_bool(), "select on ", condition.type());
  RETROGRADE_ASSERT(when_true.type() == when_false.type(), "select between ", when_true.type(),
                    " and ", when_false.type());
  RETROGRADE_ASSERT(lanes == 1 || lanes == when_true.type().lanes(), "select of ", when_true.type(),
                    " on ", condition.type());
  const Expr folded = is_const_true(condition)        ? when_true
                      : is_const_false(condition)     ? when_false
                      : when_true.same_as(when_false) ? when_true
                                                      : Expr();
  const auto is_lost = [&](const Expr& e) { return loses_names(folded, e); };
  if (folded.defined() && !is_lost(condition) && !is_lost(when_true) && !is_lost(when_false))
    return folded;
  return make_node<Select>(when_true.type(), std::move(condition), std::move(when_true),
                           std::move(when_false));
}

Expr make_load(Type type, const std::string& name, Expr index, Expr predicate, SymbolRef symbol) {
  if (predicate.defined() && is_const_true(predicate)) predicate = {};
  return make_node<Load>(type, name, std::move(index), std::move(predicate), std::move(symbol));
}

Expr make_ramp(Expr base, Expr stride, int lanes) {
  RETROGRADE_ASSERT(lanes >= 1, "a ramp of ", lanes, " lanes");
  if (lanes == 1) return base;
  match_lanes(base, stride);
  RETROGRADE_ASSERT(base.type() == stride.type(), "ramp from ", base.type(), " by ", stride.type());
  return make_node<Ramp>(times_lanes(base.type(), lanes), std::move(base), std::move(stride),
                         lanes);
}

Expr make_broadcast(Expr value, int lanes) {
  RETROGRADE_ASSERT(lanes >= 1, "a broadcast to ", lanes, " lanes");
  if (const auto* inner = value.as<Broadcast>()) return splat(inner->value, inner->lanes * lanes);
  return splat(std::move(value), lanes);
}

Expr make_let(const std::string& name, Expr value, Expr body) {
  return make_node<Let>(body.type(), name, std::move(value), std::move(body));
}

Expr make_shuffle(std::vector<Expr> vectors, std::vector<int> indices) {
  RETROGRADE_ASSERT(!vectors.empty() && !indices.empty(), "an empty shuffle");
  int lanes = 0;
  for (const Expr& v : vectors) {
    RETROGRADE_ASSERT(v.type().element_of() == vectors[0].type().element_of(),
                      "a shuffle of mixed types");
    lanes += v.type().lanes();
  }
  bool identity = vectors.size() == 1 && static_cast<int>(indices.size()) == lanes;
  for (size_t i = 0; i < indices.size(); ++i) {
    RETROGRADE_ASSERT(indices[i] >= 0 && indices[i] < lanes, "shuffle index ", indices[i], " of ",
                      lanes, " lanes");
    identity &= indices[i] == static_cast<int>(i);
  }
  if (identity) return vectors[0];
  const Type type = vectors[0].type().with_lanes(static_cast<int>(indices.size()));
  return make_node<Shuffle>(type, std::move(vectors), std::move(indices));
}

Expr make_interleaved(const std::vector<Expr>& vectors) {
  const int count = static_cast<int>(vectors.size()), lanes = vectors[0].type().lanes();
  return make_shuffle(
      vectors, numbered(lanes * count, [&](int i) { return i % count * lanes + i / count; }));
}

Expr make_vector_reduce(Kind op, Expr value, int result_lanes) {
  const int lanes = value.type().lanes();
  RETROGRADE_ASSERT(result_lanes >= 1 && lanes % result_lanes == 0, "reducing ", lanes,
                    " lanes to ", result_lanes);
  if (lanes == result_lanes) return value;
  const Type type = value.type().with_lanes(result_lanes);
  return make_node<VectorReduce>(type, op, std::move(value));
}

Expr conjunction(const std::vector<Expr>& terms) {
  Expr result;
  for (const Expr& term : terms) result = result.defined() ? binary(Kind::And, result, term) : term;
  return result.defined() ? result : const_true();
}

void add_conjuncts(const Expr& e, std::vector<Expr>& conjuncts) {
  if (!e.defined()) return;
  if (const And* both = e.as<And>()) {
    add_conjuncts(both->a, conjuncts);
    add_conjuncts(both->b, conjuncts);
  } else {
    conjuncts.push_back(e);
  }
}

void add_term(Expr& sum, const Expr& term) { sum = sum.defined() ? sum + term : term; }

// ---- statements: an undefined body is the empty statement; its wrapper is empty too ----

Stmt make_let(const std::string& name, Expr value, Stmt body) {
  return body.defined() ? Stmt(make_node<LetStmt>(name, std::move(value), std::move(body)))
                        : Stmt();
}

Expr make_lets(const Lets& lets, Expr body) {
  for (size_t i = lets.size(); i-- > 0;) body = make_let(lets[i].first, lets[i].second, body);
  return body;
}

Stmt make_lets(const Lets& lets, Stmt body) {
  for (size_t i = lets.size(); i-- > 0;) body = make_let(lets[i].first, lets[i].second, body);
  return body;
}

Stmt make_assert(Expr condition, Expr error) {
  return make_node<Assert>(std::move(condition), std::move(error));
}

Stmt make_producer_consumer(const std::string& name, bool produces, Stmt body) {
  return body.defined() ? Stmt(make_node<ProducerConsumer>(name, produces, std::move(body)))
                        : Stmt();
}

Stmt make_for(const std::string& name, Expr min, Expr extent, ForType type, Stmt body,
              Partition partition) {
  if (!body.defined()) return {};
  return make_node<For>(name, std::move(min), std::move(extent), type, std::move(body), partition);
}

Stmt make_launch(const std::string& kernel, std::vector<Expr> blocks, std::vector<int> threads,
                 Expr shared_bytes, Stmt body) {
  if (!body.defined()) return {};
  return make_node<Launch>(kernel, std::move(blocks), std::move(threads), std::move(shared_bytes),
                           std::move(body));
}

Stmt make_store(const std::string& name, Expr value, Expr index, Expr predicate, SymbolRef symbol) {
  if (value.type().is_scalar()) value = make_broadcast(std::move(value), index.type().lanes());
  if (predicate.defined() && is_const_true(predicate)) predicate = {};
  return make_node<Store>(name, std::move(value), std::move(index), std::move(predicate),
                          std::move(symbol));
}

Stmt make_provide(const std::string& name, std::vector<Expr> values, std::vector<Expr> args,
                  Expr predicate) {
  if (predicate.defined() && is_const_true(predicate)) predicate = {};
  return make_node<Provide>(name, std::move(values), std::move(args), std::move(predicate));
}

Stmt make_realize(const std::string& name, std::vector<Type> types, MemoryType memory,
                  std::vector<Range> bounds, Stmt body, StorageLayout layout) {
  if (!body.defined()) return {};
  return make_node<Realize>(name, std::move(types), memory, std::move(bounds), std::move(layout),
                            std::move(body));
}

Stmt with_body(const Realize& n, Stmt body) { return with_bounds(n, n.bounds, std::move(body)); }

Stmt with_bounds(const Realize& n, std::vector<Range> bounds, Stmt body) {
  return make_realize(n.name, n.types, n.memory, std::move(bounds), std::move(body), n.layout);
}

Stmt make_allocate(const std::string& name, Type type, MemoryType memory, Expr elements, Stmt body,
                   Expr offset) {
  if (!body.defined()) return {};
  return make_node<Allocate>(name, type, memory, std::move(elements), std::move(offset),
                             std::move(body));
}

Stmt make_free(const std::string& name) { return make_node<Free>(name); }

Stmt make_block(std::vector<Stmt> stmts) {
  std::vector<Stmt> flat;
  flat.reserve(stmts.size());
  for (Stmt& s : stmts) {
    if (const auto* block = s.as<Block>()) {
      flat.insert(flat.end(), block->stmts.begin(), block->stmts.end());
    } else if (s.defined()) {
      flat.push_back(std::move(s));
    }
  }
  if (flat.empty()) return {};
  return flat.size() == 1 ? flat[0] : Stmt(make_node<Block>(std::move(flat)));
}

Stmt make_if(Expr condition, Stmt when_true, Stmt when_false) {
  if (is_const_true(condition)) return when_true;
  if (is_const_false(condition)) return when_false;
  if (!when_true.defined()) {
    return when_false.defined() ? make_if(logical_not(std::move(condition)), std::move(when_false))
                                : Stmt();
  }
  return make_node<IfThenElse>(std::move(condition), std::move(when_true), std::move(when_false));
}

Stmt with_parts(const IfThenElse& old, Expr condition, Stmt when_true, Stmt when_false) {
  const bool is_same = condition.same_as(old.condition) && when_true.same_as(old.when_true) &&
                       when_false.same_as(old.when_false);
  return is_same ? Stmt(&old)
                 : make_if(std::move(condition), std::move(when_true), std::move(when_false));
}

Stmt make_evaluate(Expr value) { return make_node<Evaluate>(std::move(value)); }

Stmt make_atomic(const std::string& name, Stmt body) {
  return body.defined() ? Stmt(make_node<Atomic>(name, std::move(body))) : Stmt();
}

Stmt make_fork(Stmt first, Stmt rest) {
  if (!first.defined()) return rest;
  return rest.defined() ? Stmt(make_node<Fork>(std::move(first), std::move(rest))) : first;
}

Stmt make_prefetch(const std::string& name, Type type, std::vector<Range> bounds,
                   SymbolRef symbol) {
  return make_node<Prefetch>(name, type, std::move(bounds), std::move(symbol));
}

}  // namespace retrograde::ir
