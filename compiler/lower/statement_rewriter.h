// statement_rewriter.h -- base class and helper for passes that rewrite statements and keep expressions.
#pragma once

#include <utility>

#include "ir/visit.h"

namespace retrograde::lower {

class StatementRewriter : public Rewriter {
 protected:
  Expr rewrite(const Expr& e) override { return e; }
};

template <class Step>
class StatementSteps : public StatementRewriter {
 public:
  explicit StatementSteps(Step step) : step_(std::move(step)) {}
  Stmt children(const Stmt& s) { return Rewriter::children(s); }

 protected:
  Stmt rewrite(const Stmt& s) override { return step_(s, *this); }

 private:
  Step step_;
};

// Rewrites statements with a lambda: step(s, all) returns the new statement. all.children(s) is s with its parts
// rewritten; all(part) is the rewritten part.
template <class Step>
Stmt rewrite_statements(const Stmt& s, Step step) {
  return StatementSteps<Step>(std::move(step))(s);
}

}  // namespace retrograde::lower
