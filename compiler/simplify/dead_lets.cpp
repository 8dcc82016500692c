// Removes lets whose names are not used. One walk from the inside out suffices: names are unique,
// so the names seen so far are all that the body uses.
#include <unordered_set>

#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplifier.h"

namespace retrograde::simplification {

namespace {

class DeadLets : public Rewriter {
 public:
  using Rewriter::operator();

 protected:
  // Handles chains of lets in a loop, not by recursion.
  Expr rewrite(const Expr& e) override {
    if (const auto* var = e.as<Variable>()) {
      used_.insert(var->name);
      return e;
    }
    if (e.kind() != Kind::Let) return children(e);
    std::vector<Expr> chain;
    Expr body = e;
    for (; body.kind() == Kind::Let; body = body.as<Let>()->body) chain.push_back(body);
    Expr result = (*this)(body);
    for (auto it = chain.rbegin(); it != chain.rend(); ++it) {
      const auto* n = it->as<Let>();
      if (!is_needed(n->name, n->value)) continue;
      Expr value = (*this)(n->value);
      const bool same = value.same_as(n->value) && result.same_as(n->body);
      result = same ? *it : make_let(n->name, std::move(value), std::move(result));
    }
    return result;
  }

  Stmt rewrite(const Stmt& s) override {
    const auto* n = s.as<LetStmt>();
    if (!n) return children(s);
    Stmt body = (*this)(n->body);
    if (!is_needed(n->name, n->value)) return body;
    Expr value = (*this)(n->value);
    if (!body.defined()) return make_evaluate(std::move(value));  // the value has an effect
    if (value.same_as(n->value) && body.same_as(n->body)) return s;
    return make_let(n->name, std::move(value), std::move(body));
  }

 private:
  bool is_needed(const std::string& name, const Expr& value) const {
    return used_.count(name) || has_effect(value);
  }
  std::unordered_set<std::string> used_;
};

}  // namespace

Expr drop_dead_lets(const Expr& e) { return DeadLets()(e); }
Stmt drop_dead_lets(const Stmt& s) { return DeadLets()(s); }

}  // namespace retrograde::simplification
