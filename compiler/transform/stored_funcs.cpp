#include "transform/stored_funcs.h"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

#include "autoschedule/machine/reference.h"
#include "graph/definitions/element_values.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "transform/cost_estimate.h"
#include "transform/graph_rewrites.h"
#include "transform/large_bodies.h"
#include "transform/placement_limits.h"
#include "transform/read_estimate.h"

namespace retrograde::transform {

namespace {

// Operations up to which a Func that the user left alone in a schedule by hand is inlined.
constexpr double explosion = 500;
constexpr int64_t unknown_iterations = 8;

// How often an element of a Func is read, and the operations to compute it, with those of what is inlined.
struct StorageUse {
  double reads = 0, operations = 0;
  double share_of_way = 1;  // to memory: narrow values are shorter on it
};

// Beyond the first, each read computes the value again: more than a few operations, and all together more than it takes to
// bring the value to memory and back.
bool is_worth_storing(const StorageUse& use, double free_operations) {
  return use.reads > 1.5 && use.operations > free_operations &&
         (use.reads - 1) * use.operations > planning::memory_trip_operations * use.share_of_way;
}

// Whether an element takes others of the Func: an update writes where its reduction variables or data say. In the loops of
// those that read it, all of them would be computed for each read.
bool computes_more_than_is_read(const FuncContents& f) {
  return std::ranges::any_of(f.updates, [&](const Definition& update) {
    for (size_t d = 0; d < f.args.size(); ++d) {
      if (!is_pure_position(f, update, d) && !is_const(update.args[d])) return true;
    }
    return false;
  });
}

class StorageChooser {
 public:
  explicit StorageChooser(const std::vector<FuncPtr>& outputs)
      : outputs_(outputs),
        order_(topological_order(outputs)),
        unbounded_(unbounded_funcs(order_)) {}

  std::vector<FuncPtr> choose() {
    for (const FuncPtr& f : order_) count_reads(*f);
    const bool by_hand = std::ranges::any_of(
        order_, [](const FuncPtr& f) { return !f->made && has_directives(*f); });
    std::vector<FuncPtr> result;
    for (const FuncPtr& f : order_) {  // producers first: the cost of what is inlined is known
      StorageUse& use = uses_[f.get()];
      use.operations = operations(*f);
      use.share_of_way = std::min(1.0, total_bytes(f->types) / 4.0);
      if (has_directives(*f)) continue;
      const bool left_inline = by_hand && !f->made;
      bool stored = is_worth_storing(use, left_inline && f->is_pure() ? explosion : cheap);
      stored |= left_inline ? computes_more_than_is_read(*f) : is_output(*f) || !f->is_pure();
      if (stored && f->is_pure() && !is_output(*f)) stored = !unbounded_.contains(f.get());
      if (!stored || is_block_of_one(*f)) continue;
      stored_.insert(f.get());
      result.push_back(f);
    }
    return result;
  }

 private:
  const std::vector<FuncPtr>& outputs_;
  const std::vector<FuncPtr> order_;
  const std::unordered_set<const Symbol*> unbounded_;  // at root there would be no end to them
  std::unordered_map<const Symbol*, StorageUse> uses_;
  std::unordered_map<const Symbol*, int> readers_;
  std::unordered_set<const FuncContents*> stored_;

  bool is_output(const FuncContents& f) const {
    return std::ranges::find(outputs_, &f, &FuncPtr::get) != outputs_.end();
  }

  // A block of a sum is computed where it is added up.
  bool is_block_of_one(const FuncContents& f) const {
    const auto readers = readers_.find(&f);
    return f.made && f.made->blocks > 0 && !is_output(f) && readers != readers_.end() &&
           readers->second == 1;
  }

  void count_reads(const FuncContents& f) {
    std::unordered_set<const Symbol*> read;
    for (int s = 0; s < f.stage_count(); ++s) {
      SeenElements seen;
      walk_definition(f.stage(s), [&](const Expr& e) {
        const auto* call = e.as<Call>();
        if (!call || call->call_type != CallType::Func || call->symbol.raw() == &f ||
            !seen.is_first(e))
          return;
        uses_[call->symbol.raw()].reads += reads_an_element(*call, f, f.stage(s));
        read.insert(call->symbol.raw());
      });
    }
    for (const Symbol* producer : read) ++readers_[producer];
  }

  // The operations of an element, when nothing is stored.
  double operations(const FuncContents& f) const {
    double total = f.is_extern() ? 0 : operations(*f.pure);
    for (const Definition& update : f.updates) {
      double iterations = 1;
      for (const ReductionVariable& r : update.rvars)
        iterations *= static_cast<double>(as_const_int(r.extent).value_or(unknown_iterations));
      total += operations(update) * iterations;
    }
    return total;
  }
  double operations(const Definition& stage) const {
    SeenElements seen;
    return operations_of_values(stage.values, [&](const Call& call) {
      const double cost = cost_of(call);
      return cost > 1 && !seen.is_first(Expr(&call)) ? 0 : cost;
    });
  }
  double cost_of(const Call& call) const {
    if (call.call_type != CallType::Func) return 1;
    const auto found = uses_.find(call.symbol.raw());
    const auto callee = std::dynamic_pointer_cast<FuncContents>(call.symbol.lock());
    const bool is_inlined = callee && callee->is_pure() && !stored_.contains(callee.get()) &&
                            callee->schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
    return !is_inlined || found == uses_.end() ? 1 : found->second.operations;
  }
};

}  // namespace

std::vector<FuncPtr> stored_by_default(const std::vector<FuncPtr>& outputs) {
  std::vector<FuncPtr> stored;
  if (is_differentiated(outputs)) stored = StorageChooser(outputs).choose();
  const std::vector<FuncPtr> large = large_bodies(outputs, stored);
  stored.insert(stored.end(), large.begin(), large.end());
  return stored;
}

}  // namespace retrograde::transform
