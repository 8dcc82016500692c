#include "lower/in_full.h"

namespace retrograde::lower {

using namespace ir;

Expr in_full(const Expr& e, const Substitution& lets) {
  Substitution needed;
  walk(e, [&](const Variable& v) {
    const auto value = lets.find(v.name);
    if (value != lets.end() && !needed.count(v.name)) needed[v.name] = in_full(value->second, lets);
  });
  return needed.empty() ? e : substitute(e, needed);
}

}  // namespace retrograde::lower
