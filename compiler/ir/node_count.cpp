#include "ir/node_count.h"

#include "ir/visit.h"

namespace retrograde::ir {

bool has_at_most_nodes(const Expr& e, int most) {
  int count = 0;
  walk(e, [&](const Expr&) { return ++count <= most; });
  return count <= most;
}

bool has_at_most_nodes(const Stmt& s, int most) {
  int count = 0;
  const auto visit = [&](const auto&) { return ++count <= most; };
  walk(
      s, [&](const Expr& e) { return visit(e); }, [&](const Stmt& part) { return visit(part); });
  return count <= most;
}

}  // namespace retrograde::ir
