// visitor.h -- visitors and mutators of expressions as classes: derive, and override `visit` for
// the node types of interest. They exist for user programs that define such classes; the compiler
// itself uses the lambdas of visit.h.
//
//   struct Names : IRGraphVisitor {
//     using IRGraphVisitor::visit;
//     void visit(const Variable* v) override { names.insert(v->name); }
//     std::set<std::string> names;
//   };
//   Names found; e.accept(&found);
//
//   struct Doubled : IRGraphMutator {
//     using IRGraphMutator::visit;
//     Expr visit(const IntImm* n) override { return make_const(n->type, 2 * n->value); }
//   };
//   e = Doubled().mutate(e);
//
// A `visit` that is not overridden visits the children; in a mutator it rebuilds the node if a
// child changed. IRVisitor and IRMutator visit a shared node once for each use, which takes
// exponential time on heavily shared expressions; IRGraphVisitor and IRGraphMutator visit it once.
#pragma once

#include <unordered_set>
#include <vector>

#include "ir/expr.h"
#include "ir/node_memo.h"

namespace retrograde::ir {

class IRVisitor {
 public:
  virtual ~IRVisitor() = default;

 protected:
  friend class retrograde::Expr;
#define RETROGRADE_EXPR(K) virtual void visit(const K* node);
#define RETROGRADE_BINARY(K) RETROGRADE_EXPR(K)
#include "ir/kinds.def"

 private:
  friend class IRGraphVisitor;
  void visit_children(const Expr& e);
  virtual void visit_child(const Expr& e) { e.accept(this); }
};

class IRGraphVisitor : public IRVisitor {
 protected:
  // Visits the node unless it was included before.
  virtual void include(const Expr& e);

 private:
  void visit_child(const Expr& e) override { include(e); }
  std::unordered_set<const ExprNode*> seen_;
  std::vector<Expr> kept_;  // keeps nodes alive, so that their addresses stay unique
};

class IRMutator {
 public:
  virtual ~IRMutator() = default;
  // Returns the result of `visit`; an undefined expression stays undefined.
  virtual Expr mutate(const Expr& e);
  std::vector<Expr> mutate(const std::vector<Expr>& es);
  Expr operator()(const Expr& e) { return mutate(e); }

 protected:
#define RETROGRADE_EXPR(K) virtual Expr visit(const K* node);
#define RETROGRADE_BINARY(K) RETROGRADE_EXPR(K)
#include "ir/kinds.def"

 private:
  Expr rebuild(const Expr& e);
};

class IRGraphMutator : public IRMutator {
 public:
  using IRMutator::mutate;
  Expr mutate(const Expr& e) override;

 private:
  NodeMemo<Expr> memo_;
};

}  // namespace retrograde::ir
