// lower_atomics -- reduce Atomic statements to the part that must be atomic, and drop those that need not be.
// In:  FlatStorage; names unique; an Atomic holds an update of one point of a Func, or of several points at once.
// Out: FlatStorage. Expressions that do not read the Func are computed before the Atomic. An Atomic with one store
//      contains only that store. Storage that no parallel loop and no Fork shares has no Atomic.
//
//   parallel for (r, 0, n) {                  parallel for (r, 0, n) {
//     atomic f {                                let t = in[r] * k
//       let t = in[r] * k                =>     atomic f { h[in[r]] = h[in[r]] + t }
//       h[in[r]] = h[in[r]] + t               }
//     }
//   }
//
// A vectorized loop whose iterations read elements that others store, which atomic(true) allows, becomes serial.
//
// Method: one walk that counts the parallel loops around; each allocation remembers the count.
// Errors: a require() that reads an element of a Tuple: it would return while holding the lock.
// Source: folklore. Tests: test/golden/lower/lower_atomics/, test/unit/lower/atomic_test.cpp.
#include "lower/statement_passes.h"

#include <unordered_map>
#include <unordered_set>

#include "diagnostics/error.h"
#include "ir/atomic_update.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

using BufferNames = std::unordered_set<std::string>;

BufferNames stored_in(const Stmt& s) {
  BufferNames names;
  walk(s, [&](const Store& store) { names.insert(store.name); });
  return names;
}

// Whether the value depends on the updated element: it reads the Func, or a let that does.
bool depends_on(const Expr& e, const BufferNames& buffers, const BufferNames& lets) {
  return any_node(
      e, [&](const Load& load) { return buffers.count(load.name) > 0; },
      [&](const Variable& variable) { return lets.count(variable.name) > 0; });
}

bool may_leave(const Stmt& s) {
  return any_node(
      s, [](const Expr& e) { return as_op(e, Op::require) != nullptr; },
      [](const Stmt& part) { return part.kind() == Kind::Assert; });
}

// The Atomic, with all computations that do not depend on the element moved in front of it.
Stmt narrowed(const Atomic& n) {
  const BufferNames buffers = stored_in(n.body);
  BufferNames dependent;
  Lets outside, inside;
  Stmt rest = n.body;
  for (; rest.defined() && rest.kind() == Kind::LetStmt; rest = rest.as<LetStmt>()->body) {
    const LetStmt* let = rest.as<LetStmt>();
    const bool stays = depends_on(let->value, buffers, dependent);
    if (stays) dependent.insert(let->name);
    (stays ? inside : outside).emplace_back(let->name, let->value);
  }
  if (!rest.defined()) return rest;
  const Store* store = rest.as<Store>();
  if (store && is_one_word(store->value.type()) && !touches_several_elements(n.body)) {
    Substitution values;
    for (const auto& [name, value] : inside) values[name] = substitute(value, values);
    return make_lets(outside, make_atomic(n.name, substitute(rest, values)));
  }
  const Stmt body = make_lets(inside, rest);
  if (may_leave(body)) {
    unsupported("update " + quoted(n.name) + " atomically",
                "the values of a Tuple are updated under a lock, which must not be left",
                "its update calls require() on what it reads of " + quoted(n.name),
                "Check the condition outside of the update");
  }
  return make_lets(outside, make_atomic(n.name, body));
}

// Recognises f[r] = f[r - 2] + g under atomic(true): an iteration reads an element that another one stores.
bool touches_other_elements(const Stmt& s) {
  return any_node(s, [](const Atomic& n) { return touches_several_elements(n.body); });
}

}  // namespace

Stmt lower_atomics(const Stmt& s) {
  int depth = 0;  // parallel loops around
  std::unordered_map<std::string, int> depth_of;
  const auto is_shared = [&](const Stmt& body) {
    for (const std::string& name : stored_in(body)) {
      if (depth > value_or(depth_of, name, 0)) return true;
    }
    return false;
  };
  return rewrite_statements(s, [&](const Stmt& node, auto& all) {
    if (const Atomic* n = node.as<Atomic>()) return is_shared(n->body) ? narrowed(*n) : n->body;
    if (const Allocate* n = node.as<Allocate>()) depth_of[n->name] = depth;
    const For* loop = node.as<For>();
    const bool is_parallel = node.kind() == Kind::Fork || (loop && runs_at_once(loop->runs));
    // Lanes would read elements before others store them, so the loop becomes serial.
    if (loop && loop->runs == ForType::Vectorized && touches_other_elements(loop->body)) {
      return all(make_for(loop->name, loop->min, loop->extent, ForType::Serial, loop->body,
                          loop->partition));
    }
    depth += is_parallel;
    Stmt result = all.children(node);
    depth -= is_parallel;
    return result;
  });
}

}  // namespace retrograde::lower
