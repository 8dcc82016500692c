// Walks, with an explicit stack, so that the C++ stack does not limit their depth.
#include <algorithm>
#include <vector>

#include "ir/node_set.h"
#include "ir/visit.h"
#include "ir/walk_once.h"

namespace retrograde::ir {

namespace {

bool is_expr(const Node& node) { return node.kind < Kind::LetStmt; }

class Walker {
 public:
  Walker(NodeSet& visited, FunctionRef<bool(const Expr&)> enter_expr,
         FunctionRef<bool(const Stmt&)> enter_stmt)
      : visited_(visited), enter_expr_(enter_expr), enter_stmt_(enter_stmt) {}
  // Holds the root, because a lambda may drop the caller's handle. Nodes are immutable, so the root keeps all others.
  void run(const Expr root) { drain(root.get()); }
  void run(const Stmt root) { drain(root.get()); }

 private:
  void drain(const Node* root) {
    if (root) stack_.push_back(root);
    while (!stack_.empty()) {
      const Node* node = stack_.back();
      stack_.pop_back();
      if (!visited_.insert(node)) continue;
      const size_t first = stack_.size();
      if (is_expr(*node))
        enter(static_cast<const ExprNode*>(node));
      else
        enter(static_cast<const StmtNode*>(node));
      std::reverse(stack_.begin() + static_cast<std::ptrdiff_t>(first), stack_.end());
    }
  }
  void enter(const ExprNode* node) {
    const Expr e(node);
    if (enter_expr_(e))
      for_each_child(e, [&](const Expr& child) { stack_.push_back(child.get()); });
  }
  void enter(const StmtNode* node) {
    const Stmt s(node);
    if (!enter_stmt_(s)) return;
    for_each_child(
        s, [&](const Expr& child) { stack_.push_back(child.get()); },
        [&](const Stmt& child) { stack_.push_back(child.get()); });
  }

  NodeSet& visited_;
  FunctionRef<bool(const Expr&)> enter_expr_;
  FunctionRef<bool(const Stmt&)> enter_stmt_;
  std::vector<const Node*> stack_;
};

}  // namespace

void walk_once(const Expr& e, NodeSet& visited, FunctionRef<bool(const Expr&)> enter) {
  const auto no_stmts = [](const Stmt&) { return false; };
  Walker(visited, enter, no_stmts).run(e);
}

void walk(const Expr& e, FunctionRef<bool(const Expr&)> enter) {
  NodeSet visited;
  walk_once(e, visited, enter);
}

void walk(const Stmt& s, FunctionRef<bool(const Expr&)> enter_expr,
          FunctionRef<bool(const Stmt&)> enter_stmt) {
  NodeSet visited;
  Walker(visited, enter_expr, enter_stmt).run(s);
}

bool any_node(const Expr& e, FunctionRef<bool(const Expr&)> holds) {
  bool found = false;
  if (e.defined()) walk(e, [&](const Expr& node) { return !(found = found || holds(node)); });
  return found;
}

bool any_node(const Stmt& s, FunctionRef<bool(const Expr&)> expr_holds,
              FunctionRef<bool(const Stmt&)> stmt_holds) {
  bool found = false;
  if (!s.defined()) return false;
  walk(
      s, [&](const Expr& node) { return !(found = found || expr_holds(node)); },
      [&](const Stmt& node) { return !(found = found || stmt_holds(node)); });
  return found;
}

bool any_stmt(const Stmt& s, FunctionRef<bool(const Stmt&)> holds) {
  bool found = false;
  const auto no_exprs = [](const Expr&) { return false; };
  if (s.defined())
    walk(s, no_exprs, [&](const Stmt& node) { return !(found = found || holds(node)); });
  return found;
}

}  // namespace retrograde::ir
