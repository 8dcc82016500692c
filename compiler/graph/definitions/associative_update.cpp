#include "graph/definitions/associative_update.h"

#include "diagnostics/error.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/print.h"

namespace retrograde::graph {

namespace {

// A reference of the update to f other than to the element that it writes.
Expr other_reference(const FuncContents& f, const Definition& update) {
  Definition where;  // only coordinates and predicate
  where.args = update.args;
  where.predicate = update.predicate;
  const std::vector<Expr> reads = own_reads(f, where);
  return reads.empty() ? read_elsewhere(f, update) : reads[0];
}

}  // namespace

AssociativityProof prove_associative(const FuncContents& f, const Definition& update) {
  AssociativityProof proof;
  if (point_number(update)) {
    proof.why_not = "it updates several points at once";
    return proof;
  }
  if (const Expr other = other_reference(f, update); other.defined()) {
    proof.why_not = text("it reads ", other, ", which is not the element that it writes");
    return proof;
  }
  const auto xs = numbered(update.values.size(), [](size_t) { return unique_name("x"); });
  const auto over_xs = [&](const Expr& value) {
    return map_calls_of(value, &f, [&](const Call& call, const std::vector<Expr>&) {
      return variable(xs[call.component], call.type);
    });
  };
  return analysis::prove_associative(mapped(update.values, over_xs), xs);
}

}  // namespace retrograde::graph
