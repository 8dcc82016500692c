// statement_rewriter.h -- rewriting statements whose expressions stay as they are.
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

// With a lambda: step(s, all) gives the new statement, where all.children(s) is s with its parts
// rewritten, and all(part) a part of it.
template <class Step>
Stmt rewrite_statements(const Stmt& s, Step step) {
  return StatementSteps<Step>(std::move(step))(s);
}

}  // namespace retrograde::lower
