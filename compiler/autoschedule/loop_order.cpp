#include "autoschedule/loop_order.h"

#include <algorithm>
#include <functional>
#include <unordered_map>

#include "graph/definitions/associative_update.h"
#include "graph/definitions/own_reads.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

// Of Funcs and images, but the element itself.
void for_each_read(const Definition& update, const std::function<void(const Call&)>& visit) {
  for (const Expr& value : update.values) {
    walk(value, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      const bool reads =
          call && (call->call_type == CallType::Func || call->call_type == CallType::Image);
      if (reads && !same_args(call->args, update.args)) visit(*call);
      return true;
    });
  }
}

bool may_be_reordered(const FuncContents& f, const Definition& update) {
  const AssociativityProof proof = prove_associative(f, update);
  return proof.op && proof.op->commutative && !proof.op->breaks_ties;
}

}  // namespace

std::vector<ReductionVariable> reduction_loops(const FuncContents& f, const Definition& update) {
  std::vector<ReductionVariable> loops = update.rvars;
  if (loops.size() < 2 || !may_be_reordered(f, update)) return loops;
  std::unordered_map<std::string, size_t> farthest;  // dimension in which a variable moves
  for_each_read(update, [&](const Call& call) {
    for (const ReductionVariable& r : loops) {
      for (size_t d = 0; d < call.args.size(); ++d) {
        if (uses_variable(call.args[d], r.var)) farthest[r.var] = std::max(farthest[r.var], d);
      }
    }
  });
  std::stable_sort(loops.begin(), loops.end(),
                   [&](const ReductionVariable& a, const ReductionVariable& b) {
                     return farthest[a.var] < farthest[b.var];
                   });
  return loops;
}

size_t innermost_dimension(const Call& call) {
  const FuncPtr callee = call.call_type == CallType::Func ? func_of(call) : nullptr;
  if (!callee || callee->schedule.storage_dims.empty()) return 0;
  const auto& args = callee->args;
  const auto found = std::find(args.begin(), args.end(), callee->schedule.storage_dims[0]);
  return static_cast<size_t>(found - args.begin()) % args.size();
}

bool shifts_reads(const FuncContents& f, const Definition& update, size_t dimension) {
  const std::string& var = f.args[dimension];
  bool shifts = false;
  for_each_read(update, [&](const Call& call) {
    for (const Expr& index : call.args) {
      shifts |= uses_variable(index, var) &&
                any_node(index, [&](const Variable& v) { return v.name != var; });
    }
  });
  return shifts;
}

}  // namespace retrograde::autoschedule
