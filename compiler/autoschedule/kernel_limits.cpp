#include "autoschedule/kernel_limits.h"

#include <algorithm>
#include <unordered_set>

#include "graph/definitions/own_reads.h"
#include "graph/definitions/parameter_contents.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

bool is_one_of(const FuncPtr& f, const std::vector<FuncPtr>& some) {
  return std::ranges::find(some, f) != some.end();
}

bool is_block_of_sums(const FuncContents& f) {
  return f.made && f.made->blocks > 0 && !has_directives(f);
}

bool calls_host(const Call& call) {
  if (call.call_type == CallType::Extern) return true;
  constexpr Op of_host[] = {Op::print, Op::print_when, Op::require, Op::trace, Op::runtime_call};
  return std::ranges::any_of(of_host, [&](Op op) { return call.is_op(op); });
}

// Of what a stage computes itself, each Func once.
class HostCallFinder {
 public:
  explicit HostCallFinder(const std::vector<FuncPtr>& stored) : stored_(stored) {}

  bool is_found(const Definition& definition) {
    bool found = false;
    walk_definition(definition, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      found = found || (call && is_of_host(*call));
    });
    return found;
  }

 private:
  bool is_of_host(const Call& call) {
    if (calls_host(call)) return true;
    if (call.call_type == CallType::Func) {
      const FuncPtr callee = func_of(call);
      return seen_.insert(callee.get()).second && needs_host(callee);
    }
    const auto image = std::dynamic_pointer_cast<ParameterContents>(call.symbol.lock());
    return image && image->trace.loads;
  }

  bool needs_host(const FuncPtr& f) {
    if (f->trace.loads) return true;
    const bool is_at_root = f->schedule.compute_level.kind == graph::LoopLevel::Kind::Root;
    if (is_at_root || is_one_of(f, stored_)) return false;
    // What is computed in the loops of others, or for each element with all of its updates, may need
    // memory that no thread has.
    const bool is_inlined = f->is_pure() && !f->is_extern() &&
                            f->schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
    if (!is_inlined && !is_block_of_sums(*f)) return true;
    for (int s = 0; s < f->stage_count(); ++s) {
      if (is_found(f->stage(s))) return true;
    }
    return false;
  }

  const std::vector<FuncPtr>& stored_;
  std::unordered_set<const Symbol*> seen_;
};

}  // namespace

bool can_be_kernel(const FuncPtr& f, int stage, const std::vector<FuncPtr>& stored) {
  if (f->is_extern() || f->trace.stores || f->trace.loads) return false;
  std::vector<FuncPtr> known = stored;
  known.push_back(f);  // which reads itself
  return !HostCallFinder(known).is_found(f->stage(stage));
}

FuncPtr block_read_by(const Definition& stage, const std::vector<FuncPtr>& stored) {
  FuncPtr result;
  walk_definition(stage, [&](const Expr& e) {
    const auto* call = e.as<Call>();
    const FuncPtr callee = call && call->call_type == CallType::Func ? func_of(*call) : nullptr;
    if (callee && is_block_of_sums(*callee) && !is_one_of(callee, stored)) result = callee;
  });
  return result;
}

}  // namespace retrograde::autoschedule
