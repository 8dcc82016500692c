#include "ir/lets.h"

#include "ir/visit.h"

namespace retrograde::ir {

Expr without_lets(const Expr& root) {
  if (!any_node(root, [](const Let&) { return true; })) return root;
  return rewrite(root, [](const Expr& e, const auto& recurse) {
    const auto* let = e.as<Let>();
    return let ? recurse(substitute(let->body, let->name, let->value)) : Expr();
  });
}

}  // namespace retrograde::ir
