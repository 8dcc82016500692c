#include "graph/race_checks.h"

#include <unordered_set>

#include "analysis/interval.h"
#include "analysis/never_meet.h"
#include "graph/associative_update.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

using Place = std::vector<Expr>;

// Pure variables stand at their own place on both sides: two points that meet have the same ones.
MeetingPoints points_of(const Definition& update) {
  MeetingPoints points;
  for (const ReductionVariable& r : update.rvars) {
    const Expr min = cast_to(Int(32), r.min), extent = cast_to(Int(32), r.extent);
    points.variables.push_back({r.var, min, min + extent - 1});
  }
  if (update.predicate.defined()) points.conditions.push_back(update.predicate);
  return points;
}

// Where the update reads its own Func.
std::vector<Place> own_reads(const FuncContents& f, const Definition& update) {
  std::vector<Place> places;
  std::unordered_set<const ExprNode*> seen;
  for_each_expr(update, [&](const Expr& root) {
    walk(root, [&](const Expr& e) {
      if (!seen.insert(e.get()).second) return false;
      const Call* call = e.as<Call>();
      if (call && call->call_type == CallType::Func && call->symbol.raw() == &f)
        places.push_back(call->args);
      return true;
    });
  });
  return places;
}

// Whether no iteration writes where this call reads.
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
  Expr found;
  std::unordered_set<const ExprNode*> seen;
  for_each_expr(update, [&](const Expr& root) {
    walk(root, [&](const Expr& e) {
      if (found.defined() || !seen.insert(e.get()).second) return false;
      const Call* call = e.as<Call>();
      if (!call || call->call_type != CallType::Func || call->symbol.raw() != &f) return true;
      bool is_own = true;
      for (size_t d = 0; d < update.args.size(); d++)
        is_own = is_own && equal(call->args[d], update.args[d]);
      if (!is_own && !is_never_written(*call, update)) found = e;
      return true;
    });
  });
  return found;
}

bool can_prove_race_free(const FuncContents& f, const Definition& update, const std::string& rvar) {
  const MeetingPoints points = points_of(update);
  if (!can_prove_never_meet(points, rvar, update.args, update.args)) return false;
  for (const Place& read : own_reads(f, update)) {
    if (!can_prove_never_meet(points, rvar, update.args, read)) return false;
  }
  return true;
}

bool can_prove_commutative(const FuncContents& f, const Definition& update) {
  const AssociativityProof proof = prove_associative(f, update);
  return proof.op && proof.op->commutative && !proof.op->breaks_ties;
}

}  // namespace retrograde::ir
