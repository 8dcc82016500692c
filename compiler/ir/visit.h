// Walking and rewriting the IR with lambdas.
//
//   match(e, [&](const ir::Select& s) {...}, [&](const ir::Binary& b) {...},
//            [&](const ir::ExprNode& n) {default});
//
// calls the lambda for the node's type, or the default, which every match states. Expressions are
// DAGs: `walk` and `Rewriter` visit a shared node once. A hand-written recursion must do the same,
// or it takes exponential time.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <unordered_set>
#include <utility>

#include "ir/expr.h"
#include "ir/node_memo.h"

namespace retrograde::ir {

// A non-owning reference to a callable; it must not outlive the callable.
template <class Signature>
class FunctionRef;
template <class R, class... Args>
class FunctionRef<R(Args...)> {
 public:
  template <class F>
  requires(!std::is_same_v<std::remove_cvref_t<F>, FunctionRef>) FunctionRef(F&& f)
      : object_(const_cast<void*>(static_cast<const void*>(std::addressof(f)))),
        call_([](void* object, Args... args) -> R {
          return (*static_cast<std::remove_reference_t<F>*>(object))(std::forward<Args>(args)...);
        }) {}
  R operator()(Args... args) const { return call_(object_, std::forward<Args>(args)...); }

 private:
  void* object_;
  R (*call_)(void*, Args...);
};

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

template <class... Fs>
decltype(auto) match(const Expr& e, Fs&&... fs) {
  Overloaded f{std::forward<Fs>(fs)...};
  const Node* node = e.get();
  switch (node->kind) {
#define RETROGRADE_EXPR(K) \
  case Kind::K:            \
    return f(*static_cast<const K*>(node));
#define RETROGRADE_BINARY(K) \
  case Kind::K:              \
    return f(*static_cast<const K*>(node));
#include "ir/kinds.def"
    default:
      return f(*static_cast<const ExprNode*>(node));
  }
}

template <class... Fs>
decltype(auto) match(const Stmt& s, Fs&&... fs) {
  Overloaded f{std::forward<Fs>(fs)...};
  const Node* node = s.get();
  switch (node->kind) {
#define RETROGRADE_STMT(K) \
  case Kind::K:            \
    return f(*static_cast<const K*>(node));
#include "ir/kinds.def"
    default:
      return f(*static_cast<const StmtNode*>(node));
  }
}

using ExprVisit = FunctionRef<void(const Expr&)>;
using StmtVisit = FunctionRef<void(const Stmt&)>;
using ExprMap = FunctionRef<Expr(const Expr&)>;
using StmtMap = FunctionRef<Stmt(const Stmt&)>;
using NameMap = FunctionRef<std::string(Kind, const std::string&)>;

// Visits the direct children in evaluation order; skips undefined optional children.
void for_each_child(const Expr& e, ExprVisit on_expr);
void for_each_child(const Stmt& s, ExprVisit on_expr, StmtVisit on_stmt);

// The node with its children replaced; the same handle when none changed.
Expr map_children(const Expr& e, ExprMap map);
Stmt map_children(const Stmt& s, ExprMap map, StmtMap map_stmt);
Stmt map_children(const Stmt& s, StmtMap map_stmt);  // replaces only the child statements
// Also replaces the name that the node binds, stores to or loads from. Names of calls are kept.
Expr map_children(const Expr& e, ExprMap map, NameMap names);
Stmt map_children(const Stmt& s, ExprMap map, StmtMap map_stmt, NameMap names);

// Visits every node once, parents before children; descends where the lambda returns true.
void walk(const Expr& e, FunctionRef<bool(const Expr&)> enter);
void walk(const Stmt& s, FunctionRef<bool(const Expr&)> enter_expr,
          FunctionRef<bool(const Stmt&)> enter_stmt);

// Whether `holds` is true for any node; false for an undefined tree.
bool any_node(const Expr& e, FunctionRef<bool(const Expr&)> holds);
bool any_node(const Stmt& s, FunctionRef<bool(const Expr&)> expr_holds,
              FunctionRef<bool(const Stmt&)> stmt_holds);
bool any_stmt(const Stmt& s, FunctionRef<bool(const Stmt&)> holds);  // ignores expressions

// Overloads with lambdas of node types, as in `match`; each is called for all nodes of its type:
//
//   walk(s, [&](const Variable& v) { names.insert(v.name); }, [&](const Let& n) {...});
//   any_node(s, [&](const Load& n) { return n.name == buffer; });
template <class F>
concept NodeVisit = !std::is_invocable_v<F&, const Expr&> && !std::is_invocable_v<F&, const Stmt&>;
template <class F>
constexpr bool visits_exprs =
#define RETROGRADE_EXPR(K) std::is_invocable_v<F&, const K&> ||
#define RETROGRADE_BINARY(K) RETROGRADE_EXPR(K)
#include "ir/kinds.def"
    false;

template <NodeVisit... Fs>
void walk(const Expr& e, Fs&&... fs) {
  walk(e, [&](const Expr& node) { return match(node, fs..., [](const ExprNode&) {}), true; });
}
template <NodeVisit... Fs>
void walk(const Stmt& s, Fs&&... fs) {
  constexpr bool exprs = (visits_exprs<Fs> || ...);
  walk(
      s,
      [&](const Expr& node) {
        if constexpr (exprs) match(node, fs..., [](const ExprNode&) {});
        return exprs;
      },
      [&](const Stmt& node) { return match(node, fs..., [](const StmtNode&) {}), true; });
}
template <NodeVisit... Fs>
bool any_node(const Expr& e, Fs&&... fs) {
  const auto holds = [](const ExprNode&) { return false; };
  return any_node(e, [&](const Expr& node) -> bool { return match(node, fs..., holds); });
}
template <NodeVisit... Fs>
bool any_node(const Stmt& s, Fs&&... fs) {
  constexpr bool exprs = (visits_exprs<Fs> || ...);
  const auto no_stmt = [](const StmtNode&) { return false; };
  const auto stmt_holds = [&](const Stmt& node) -> bool { return match(node, fs..., no_stmt); };
  if constexpr (!exprs) return any_stmt(s, stmt_holds);
  const auto no_expr = [](const ExprNode&) { return false; };
  return any_node(
      s, [&](const Expr& node) -> bool { return match(node, fs..., no_expr); }, stmt_holds);
}

// A context-free rewriting, memoised by node identity. Derive and override `rewrite` for the kinds
// of interest, ending in `return children(e)`. Call the object itself on children to recurse.
class Rewriter {
 public:
  virtual ~Rewriter() = default;
  Expr operator()(const Expr& e);
  Stmt operator()(const Stmt& s) { return s.defined() ? rewrite(s) : s; }

 protected:
  virtual Expr rewrite(const Expr& e) { return children(e); }
  virtual Stmt rewrite(const Stmt& s) { return children(s); }
  Expr children(const Expr& e);
  Stmt children(const Stmt& s);
  // Drops memoised results; call it when the result for a node may have changed (on entering a
  // scope).
  void forget() { memo_.clear(); }

 private:
  NodeMemo<Expr> memo_;
};

// Rewriting with a lambda: f(e, recurse) returns the new node, or an undefined one to rewrite only
// the children. `recurse` rewrites a child, so `map_children(e, recurse)` is e with all children
// rewritten.
using RewriteStep =
    std::function<Expr(const Expr&, const std::function<Expr(const Expr&)>& recurse)>;
class StepRewriter : public Rewriter {
 public:
  explicit StepRewriter(RewriteStep step) : step_(std::move(step)) {}
  StepRewriter(const StepRewriter&) = delete;

 protected:
  Expr rewrite(const Expr& e) override;
  Stmt rewrite(const Stmt& s) override { return children(s); }

 private:
  const RewriteStep step_;
  const std::function<Expr(const Expr&)> recurse_ = [this](const Expr& e) { return (*this)(e); };
};
Expr rewrite(const Expr& e, RewriteStep step);
Stmt rewrite(const Stmt& s, RewriteStep step);

// Relies on unique names: no let or loop inside `e` rebinds a name of the map.
using Substitution = std::map<std::string, Expr>;
Expr substitute(const Expr& e, const Substitution& values);
Stmt substitute(const Stmt& s, const Substitution& values);
Expr substitute(const Expr& e, const std::string& name, const Expr& value);
Stmt substitute(const Stmt& s, const std::string& name, const Expr& value);

bool uses_variable(const Expr& e, const std::string& name);
bool uses_variable(const Stmt& s, const std::string& name);
bool uses_any_variable(const Expr& e, const std::unordered_set<std::string>& names);
bool has_loops(const Stmt& s, ForType runs);

// A fresh name "prefix$N", unique in the process (thread-safe). unique_name("x") may give "x$3".
std::string unique_name(const std::string& prefix);

}  // namespace retrograde::ir
