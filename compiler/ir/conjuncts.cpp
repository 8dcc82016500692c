#include "ir/conjuncts.h"

namespace retrograde::ir {

void add_conjuncts(const Expr& e, std::vector<Expr>& conjuncts) {
  if (!e.defined()) return;
  if (const And* both = e.as<And>()) {
    add_conjuncts(both->a, conjuncts);
    add_conjuncts(both->b, conjuncts);
  } else {
    conjuncts.push_back(e);
  }
}

}  // namespace retrograde::ir
