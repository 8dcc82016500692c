#include "autoschedule/access/plain_reduction.h"

#include <algorithm>

#include "graph/definitions/own_reads.h"
#include "ir/lets.h"
#include "ir/memory_reads.h"

namespace retrograde::planning {

using namespace graph;

namespace {

// Whether value k of the update is a sum, product, minimum or maximum of its old value and of terms that read nothing of
// the Func.
bool adds_terms(const FuncContents& f, const Definition& update, size_t k) {
  Expr value = without_lets(update.values[k]);
  const auto kind_of = [](const Expr& e) { return e.kind() == Kind::Sub ? Kind::Add : e.kind(); };
  const Kind kind = kind_of(value);
  if (kind != Kind::Add && kind != Kind::Mul && kind != Kind::Min && kind != Kind::Max)
    return false;
  while (!is_old_value(value, f, update, static_cast<int>(k))) {
    if (kind_of(value) != kind) return false;
    const auto* n = value.as<Binary>();
    const bool in_a = calls(n->a, &f);
    if (in_a == calls(n->b, &f) || (!in_a && n->kind == Kind::Sub)) return false;
    value = Expr(in_a ? n->a : n->b);
  }
  return true;
}

}  // namespace

bool is_plain_reduction(const FuncContents& f, const Definition& update) {
  if (update.rvars.empty() || point_number(update)) return false;
  const auto is_moved = [&](const Expr& arg) {
    return std::ranges::any_of(
        update.rvars, [&](const ReductionVariable& r) { return uses_variable(arg, r.var); });
  };
  if (std::ranges::any_of(update.args, is_moved)) return false;
  if (update.predicate.defined() && calls(update.predicate, &f)) return false;
  for (size_t k = 0; k < update.values.size(); ++k) {
    if (!adds_terms(f, update, k)) return false;
  }
  return true;
}

}  // namespace retrograde::planning
