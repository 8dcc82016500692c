#include "autoschedule/cut_scatters.h"

#include <algorithm>

#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/scatter_schedule.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/associative_update.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t near_bytes = planning::first_cache_bytes / 2;  // of a part
constexpr double least_additions = 16;                           // to an element of a part

int64_t known_extent(const ReductionVariable& r) {
  return as_const_int(simplify(r.extent)).value_or(0);
}

// The longest loop but that whose iterations lie together; nullptr: none has rows for each part.
const ReductionVariable* rows_in_parts(const Definition& update) {
  const ReductionVariable* rows = nullptr;
  for (size_t i = 1; i < update.rvars.size(); ++i) {
    const ReductionVariable& r = update.rvars[i];
    if (known_extent(r) >= planning::privatised_copies &&
        (!rows || known_extent(r) > known_extent(*rows)))
      rows = &r;
  }
  return rows;
}

bool is_worth_parts(const FuncContents& f, const SizeEstimate& sizes) {
  if (f.stage_count() != 2 || f.made || f.args.empty() || f.types.size() != 1) return false;
  const Definition& update = f.updates[0];
  if (!scatters_in_order(f, update) || !rows_in_parts(update)) return false;
  const auto row = as_const_int(update.rvars[0].extent);
  if (row && *row < planning::schedule_lanes) return false;
  double iterations = 1;
  for (const ReductionVariable& r : update.rvars)
    iterations *= static_cast<double>(known_extent(r));
  const int64_t bytes = sizes.bytes(f);
  const double elements = static_cast<double>(bytes) / f.types[0].bytes();
  if (bytes == 0 || bytes > near_bytes ||
      iterations < planning::privatised_copies * elements * least_additions)
    return false;
  const AssociativityProof proof = prove_associative(f, update);
  return proof.op && proof.op->commutative && !proof.op->breaks_ties;
}

void merge(const FuncPtr& f, const RVar& part) {
  Func(f).compute_root();
  const Var lane(f->args[0]);
  vectorize(Stage(f, 0), lane, planning::schedule_lanes, TailStrategy::GuardWithIf);
  Stage sum(f, 1);
  sum.reorder({lane, part});
  vectorize(sum, lane, planning::schedule_lanes, TailStrategy::GuardWithIf);
}

// A vector of iterations, whose elements are added in order, by those of a part.
void count_in_lanes(Stage sums, const Var& part) {
  std::vector<VarOrRVar> order;
  for (const Dim& loop : sums.function()->stage(1).schedule.dims) {
    if (loop.is_reduction) order.push_back(RVar(loop.var));
  }
  order.push_back(part);
  sums.allow_race_conditions().reorder(order).parallel(part);
  vectorize(sums, order[0], planning::schedule_lanes, TailStrategy::GuardWithIf);
}

void cut_rows(const FuncPtr& f) {
  const RVar rows(rows_in_parts(f->updates[0])->var), part(new_loop(*f, 1, "part"));
  const Var own(new_loop(*f, 1, "parts"));
  Stage update(f, 1);
  update.split(rows, rows, part, planning::privatised_copies, TailStrategy::GuardWithIf);
  Func parts = update.rfactor(part, own);
  parts.compute_root().parallel(own);
  vectorize(Stage(parts.function(), 0), Var(f->args[0]), planning::schedule_lanes,
            TailStrategy::GuardWithIf);
  count_in_lanes(Stage(parts.function(), 1), own);
  merge(f, part);
}

}  // namespace

void cut_scatters(const std::vector<FuncPtr>& outputs, const SizeEstimate& sizes,
                  const std::unordered_set<const Symbol*>& but) {
  for (const FuncPtr& f : topological_order(outputs)) {
    if (has_directives(*f) || f->is_extern() || but.contains(f.get())) continue;
    if (is_worth_parts(*f, sizes)) cut_rows(f);
  }
}

}  // namespace retrograde::autoschedule
