#include "graph/definitions/race_checks.h"

#include <algorithm>

#include "analysis/interval.h"
#include "analysis/never_meet.h"
#include "graph/definitions/associative_update.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::graph {

namespace {

// Pure variables keep their positions on both sides, so two conflicting points agree in them.
MeetingPoints points_of(const Definition& update) {
  MeetingPoints points;
  for (const ReductionVariable& r : update.rvars) {
    const Expr min = cast_to(Int(32), r.min), extent = cast_to(Int(32), r.extent);
    points.variables.push_back({r.var, min, min + extent - 1});
  }
  if (update.predicate.defined()) points.conditions.push_back(update.predicate);
  return points;
}

// Whether no iteration writes the element that this call reads.
bool is_never_written(const Call& call, const Definition& update) {
  Scope<Interval> domain;
  for (const ReductionVariable& r : update.rvars) {
    const Expr min = cast_to(Int(32), r.min), extent = cast_to(Int(32), r.extent);
    domain.push(r.var, {min, simplify(min + extent - 1)});
  }
  for (size_t d = 0; d < update.args.size(); d++) {
    const Interval written = bounds_of(update.args[d], domain);
    const Interval read = bounds_of(call.args[d], domain);
    if (!written.is_bounded() || !read.is_bounded()) continue;
    if (can_prove(read.max < written.min) || can_prove(read.min > written.max)) return true;
  }
  return false;
}

}  // namespace

Expr read_of_other_element(const FuncContents& f, const Definition& update) {
  for (const Expr& read : own_reads(f, update)) {
    if (!is_old_value(read, f, update) && !is_never_written(*read.as<Call>(), update)) return read;
  }
  return {};
}

bool can_prove_race_free(const FuncContents& f, const Definition& update, const std::string& rvar) {
  const MeetingPoints points = points_of(update);
  if (!can_prove_never_meet(points, rvar, update.args, update.args)) return false;
  return std::ranges::all_of(own_reads(f, update), [&](const Expr& read) {
    return can_prove_never_meet(points, rvar, update.args, read.as<Call>()->args);
  });
}

bool can_prove_commutative(const FuncContents& f, const Definition& update) {
  const AssociativityProof proof = prove_associative(f, update);
  return proof.op && proof.op->commutative && !proof.op->breaks_ties;
}

bool stores_one_value(const FuncContents& f, const Definition& update) {
  if (!own_reads(f, update).empty()) return false;
  return std::ranges::none_of(update.values, [&](const Expr& value) {
    return std::ranges::any_of(
        update.rvars, [&](const ReductionVariable& r) { return uses_variable(value, r.var); });
  });
}

}  // namespace retrograde::graph
