#include "ir/lets.h"

#include "ir/visit.h"

namespace retrograde::ir {

namespace {

class LetRemover : public Rewriter {
 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override {
    const auto* let = e.as<Let>();
    return let ? (*this)(substitute(let->body, let->name, let->value)) : children(e);
  }
};

}  // namespace

Expr without_lets(const Expr& e) { return LetRemover()(e); }

}  // namespace retrograde::ir
