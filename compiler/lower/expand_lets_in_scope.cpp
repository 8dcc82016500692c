#include "lower/expand_lets_in_scope.h"

namespace retrograde::lower {

using namespace ir;

Expr expand_lets_in_scope(const Expr& e, const Substitution& lets) {
  Substitution needed;
  walk(e, [&](const Variable& v) {
    const auto value = lets.find(v.name);
    if (value != lets.end() && !needed.count(v.name))
      needed[v.name] = expand_lets_in_scope(value->second, lets);
  });
  return needed.empty() ? e : substitute(e, needed);
}

}  // namespace retrograde::lower
