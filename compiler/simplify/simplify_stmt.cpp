// Statements: loop bounds, conditions and asserts are known inside the code that they guard.
#include <algorithm>
#include <list>

#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplifier.h"

namespace retrograde::simplification {

Stmt Simplifier::operator()(const Stmt& s) {
  if (!s.defined()) return s;
  return match(
      s, [&](const LetStmt&) { return let_stmt(s); }, [&](const For& n) { return loop(s, n); },
      [&](const Launch& n) { return launch(n); },
      [&](const IfThenElse& n) { return branches(s, n); },
      [&](const Block& n) { return block(s, n); },
      [&](const Store& n) { return write(s, n.predicate); },
      [&](const Allocate& n) { return allocate(n, children(s)); },
      [&](const Provide& n) { return write(s, n.predicate); },
      [&](const Assert& n) {
        const Expr condition = (*this)(n.condition);
        if (is_const_true(condition)) return Stmt();
        const Expr error = (*this)(n.error);
        return condition.same_as(n.condition) && error.same_as(n.error)
                   ? s
                   : make_assert(condition, error);
      },
      [&](const Evaluate& n) {
        Expr value = (*this)(n.value);
        if (!has_effect(value)) return Stmt();
        return value.same_as(n.value) ? s : make_evaluate(std::move(value));
      },
      [&](const StmtNode&) { return children(s); });
}

Stmt Simplifier::children(const Stmt& s) {
  return map_children(
      s, [this](const Expr& e) { return (*this)(e); },
      [this](const Stmt& child) { return (*this)(child); });
}

Stmt Simplifier::let_stmt(const Stmt& s) {
  const auto* n = s.as<LetStmt>();
  const Expr value = (*this)(n->value);
  const bool trivial = is_trivial_value(value);
  const Binding binding(*this, n->name, value, value, trivial ? value : Expr());
  Stmt body = (*this)(n->body);
  if (trivial) return body;
  if (value.same_as(n->value) && body.same_as(n->body)) return s;
  if (!body.defined()) return has_effect(value) ? make_evaluate(value) : Stmt();
  return make_let(n->name, value, std::move(body));
}

// for (x, min, 0) {..} => nothing; for (x, min, 1) {..} => let x = min in {..}
Stmt Simplifier::loop(const Stmt& s, const For& n) {
  const Expr min = (*this)(n.min), extent = (*this)(n.extent);
  if (is_const_true(less(Kind::LE, extent, make_zero(extent.type())))) return {};
  // Loops over blocks and threads keep their shape.
  if (is_const_int(extent, 1) && !is_gpu(n.runs))
    return let_stmt(Stmt(make_node<LetStmt>(n.name, min, n.body)));
  Stmt body;
  ++loops_around_;
  {
    const Binding binding(*this, n.name, min, sub(add(min, extent), make_one(min.type())), Expr());
    // Inside, the loop runs at least once.
    const ScopedCondition runs(*this, less(Kind::LT, make_zero(extent.type()), extent));
    body = (*this)(n.body);
  }
  --loops_around_;
  if (min.same_as(n.min) && extent.same_as(n.extent) && body.same_as(n.body)) return s;
  return make_for(n.name, min, extent, n.runs, std::move(body), n.partition);
}

Stmt Simplifier::launch(const Launch& n) {
  std::vector<Expr> blocks = mapped(n.blocks, [&](const Expr& count) { return (*this)(count); });
  Expr shared_bytes = (*this)(n.shared_bytes);
  const Expr zero = 0;
  std::list<Binding> indices;
  for (int d = 0; d < 3; ++d) {
    const auto i = static_cast<size_t>(d);
    indices.emplace_back(*this, thread_index(n.name, d), zero, Expr(n.threads[i] - 1), Expr());
    indices.emplace_back(*this, block_index(n.name, d), zero, sub(blocks[i], Expr(1)), Expr());
  }
  ++loops_around_;
  Stmt body = (*this)(n.body);
  --loops_around_;
  return make_launch(n.name, std::move(blocks), n.threads, std::move(shared_bytes),
                     std::move(body));
}

// The statements after an assert may rely on it, to the end of the block.
Stmt Simplifier::block(const Stmt& s, const Block& n) {
  const ScopedCondition scope(*this, Expr());
  std::vector<Stmt> stmts;
  bool changed = false;
  for (const Stmt& child : n.stmts) {
    stmts.push_back((*this)(child));
    changed |= !stmts.back().same_as(child);
    if (const auto* check = stmts.back().as<Assert>()) {
      facts_.assume(check->condition);
      memo_.clear();
    }
  }
  return changed ? make_block(std::move(stmts)) : s;
}

Stmt Simplifier::branches(const Stmt& s, const IfThenElse& n) {
  Expr condition = (*this)(n.condition);
  if (const std::optional<bool> known = facts_.decided(condition))
    condition = make_const(Bool(), int64_t{*known});
  if (is_const(condition)) return (*this)(is_const_true(condition) ? n.when_true : n.when_false);
  Stmt when_true, when_false;
  {
    const ScopedCondition holds(*this, condition);
    when_true = (*this)(n.when_true);
  }
  if (n.when_false.defined()) {
    const ScopedCondition fails(*this, negate(condition));
    when_false = (*this)(n.when_false);
  }
  if (condition.same_as(n.condition) && when_true.same_as(n.when_true) &&
      when_false.same_as(n.when_false))
    return s;
  return make_if(condition, std::move(when_true), std::move(when_false));
}

namespace {

// Allocations up to this size may lie on the stack, at their maximum size (codegen/statements.cpp).
constexpr int64_t most_stack_bytes = int64_t{16} << 10;

}  // namespace

// An upper bound on the number of elements; larger than any allocation when unknown.
int64_t Simplifier::most_elements(const Expr& count) {
  if (const auto* product = count.as<Mul>()) {
    const int64_t a = most_elements(product->a), b = most_elements(product->b);
    return a <= most_stack_bytes && b <= most_stack_bytes ? a * b : INT64_MAX;
  }
  const auto* cast = count.as<Cast>();
  const Expr& value = cast && is_index_type(cast->value.type()) ? cast->value : count;
  if (!is_index_type(value.type())) return INT64_MAX;
  return std::max<int64_t>(facts_.upper_bound(sum_of(value)), 0);
}

// allocate a[min(n, 8)] => allocate a[8]: a small block of constant size costs nothing and may stay
// in registers; one of run-time size is allocated in each iteration of the loops around it.
Stmt Simplifier::allocate(const Allocate& n, const Stmt& simplified) {
  const auto* a = simplified.defined() ? simplified.as<Allocate>() : nullptr;
  if (!a || is_const(a->elements) || n.memory == MemoryType::Heap || loops_around_ == 0)
    return simplified;
  const int64_t most = most_elements(a->elements);
  if (most > most_stack_bytes / (a->type.bytes() * a->type.lanes())) return simplified;
  return make_allocate(a->name, a->type, a->memory, make_const(a->elements.type(), most), a->body,
                       a->offset);
}

// For a Store or Provide.
Stmt Simplifier::write(const Stmt& s, const Expr& predicate) {
  if (predicate.defined() && is_const_false((*this)(predicate))) return {};
  return children(s);
}

}  // namespace retrograde::simplification
