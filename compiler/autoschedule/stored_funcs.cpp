#include "autoschedule/stored_funcs.h"

#include <algorithm>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "autoschedule/choices.h"
#include "autoschedule/cost_estimate.h"
#include "autoschedule/large_bodies.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/read_estimate.h"
#include "autoschedule/running_sums.h"
#include "graph/definitions/element_values.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autoschedule {

namespace {

// Operations up to which a Func that the user left alone in a schedule by hand is inlined.
constexpr double explosion = 500;
constexpr int64_t unknown_iterations = 8;

// Beyond the first, each read computes the value again: more than a few operations, and all
// together more than it takes to bring the value to memory and back.
bool is_worth_storing(const StorageUse& use, double free_operations) {
  return use.reads > 1.5 && use.operations > free_operations &&
         (use.reads - 1) * use.operations > planning::memory_trip_operations * use.share_of_way;
}

// Each read would compute all that it chooses from.
bool is_worth_choosing_once(const StorageUse& use) {
  return use.operations * (1 - 1 / use.alternatives) > cheap;
}

// Whether an element takes others of the Func: an update writes where its reduction variables or
// data say. Inside of the loops of who reads it, all of them would be computed for each read.
bool computes_more_than_is_read(const FuncContents& f) {
  return std::any_of(f.updates.begin(), f.updates.end(), [&](const Definition& update) {
    for (size_t d = 0; d < f.args.size(); ++d) {
      if (!is_pure_position(f, update, d) && !is_const(update.args[d])) return true;
    }
    return false;
  });
}

bool is_adjoint(const FuncPtr& f) { return f->made.has_value(); }

// An adjoint whose rows are put together from others by quotient and remainder, as from the phases of a stride. Inline,
// vectors of its readers would gather.
bool interleaves_rows(const FuncContents& f) {
  if (!f.made || !f.is_pure() || f.is_extern() || f.args.empty()) return false;
  const auto divides = [&](const Expr& e) {
    return (e.kind() == Kind::Div || e.kind() == Kind::Mod) && e.type().is_int() &&
           uses_variable(e, f.args[0]);
  };
  return std::ranges::any_of(f.pure->values, [&](const Expr& value) {
    return any_node(value, [&](const Call& call) {
      return call.call_type != CallType::Operator &&
             std::ranges::any_of(call.args,
                                 [&](const Expr& index) { return any_node(index, divides); });
    });
  });
}

class StorageChooser {
 public:
  // `limits`: null where the pipeline is compiled as it is. `fixed`: null where choices stay.
  StorageChooser(const std::vector<FuncPtr>& outputs, const PlacementLimits* limits,
                 const ChosenPlaces& chosen, const FixedDimensions* fixed = nullptr)
      : outputs_(outputs),
        order_(topological_order(outputs)),
        limits_(limits),
        chosen_(chosen),
        fixed_(fixed) {}

  const std::unordered_map<const Symbol*, StorageUse>& uses() const { return uses_; }

  std::vector<FuncPtr> choose() {
    for (const FuncPtr& f : order_) count_reads(*f);
    const bool by_hand =
        !limits_ && std::any_of(order_.begin(), order_.end(), [](const FuncPtr& f) {
          return !is_adjoint(f) && has_directives(*f);
        });
    std::vector<FuncPtr> result;
    for (const FuncPtr& f : order_) {  // producers first: the cost of what is inlined is known
      uses_[f.get()].operations = operations(*f);
      uses_[f.get()].share_of_way = share_of_way(*f);
      if (has_directives(*f)) continue;
      // Who schedules the primal means an untouched primal Func to be inlined, unless that
      // explodes.
      const bool left_inline = by_hand && !is_adjoint(f);
      bool stored =
          is_worth_storing(uses_[f.get()], left_inline && f->is_pure() ? explosion : cheap);
      stored |= left_inline ? computes_more_than_is_read(*f) : is_output(*f) || !f->is_pure();
      stored |= is_worth_choosing_once(uses_[f.get()]);
      stored |= uses_[f.get()].reads > 1.5 && interleaves_rows(*f);
      stored |= is_stored_running_sum(f);
      if (limits_) {
        stored |= limits_->need_root.contains(f.get()) || limits_->levels.contains(f.get());
        stored &= !limits_->stay.contains(f.get()) || is_output(*f);  // which is at root anyway
      }
      stored |= chosen_.store.contains(f.get());
      if (stored && !limits_ && f->is_pure() && !is_output(*f))
        stored = !unbounded().contains(f.get());
      stored &= !chosen_.inlined.contains(f.get()) && !chosen_.recomputed.contains(f.get());
      if (!stored || is_block_of_one(f)) continue;
      stored_.insert(f.get());
      result.push_back(f);
    }
    count_reads_in_all();
    return result;
  }

 private:
  bool is_output(const FuncContents& f) const {
    return std::ranges::find(outputs_, &f, &FuncPtr::get) != outputs_.end();
  }

  // At root there would be no end to them.
  const std::unordered_set<const Symbol*>& unbounded() {
    if (!unbounded_) unbounded_ = unbounded_funcs(order_);
    return *unbounded_;
  }

  // Whether more adjoints of those that are stored can go once it is there.
  bool is_stored_running_sum(const FuncPtr& f) const {
    const auto found = readers_.find(f.get());
    if (found == readers_.end() || found->second.size() != 1 ||
        !is_running_sum(*f, *found->second[0].func))
      return false;
    const std::vector<FuncPtr> summed = summed_adjoints(*f);
    return std::count_if(summed.begin(), summed.end(), [&](const FuncPtr& g) {
             return !g->is_pure() || stored_.contains(g.get());
           }) >= static_cast<std::ptrdiff_t>(least_summed);
  }

  // A block of a sum is computed where it is added up: see root_loops.cpp.
  bool is_block_of_one(const FuncPtr& f) const {
    if (!f->made || f->made->blocks == 0 || is_output(*f)) return false;
    const auto found = readers_.find(f.get());
    return found != readers_.end() && found->second.size() == 1;
  }

  static double share_of_way(const FuncContents& f) {
    double bytes = 0;
    for (const Type& type : f.types) bytes += type.bytes();
    return std::min(1.0, bytes / 4);
  }

  void count_reads(const FuncContents& f) {
    std::vector<size_t> copied;
    if (fixed_ && is_output(f)) copied = chosen_dimensions(f, *fixed_, ChoicesOf::ItsOwn);
    for (int s = 0; s < f.stage_count(); ++s) {
      SeenElements seen;
      walk_definition(f.stage(s), [&](const Expr& e) {
        const auto* call = e.as<Call>();
        if (call && call->call_type == CallType::Func && call->symbol.raw() != &f &&
            seen.is_first(e)) {
          StorageUse& use = uses_[call->symbol.raw()];
          const double reads = reads_an_element(*call, f, f.stage(s), copied);
          use.reads += reads;
          if (fixed_) use.alternatives = std::max(use.alternatives, alternatives(*call, f));
          std::vector<Reader>& readers = readers_[call->symbol.raw()];  // f is the last, if any
          if (readers.empty() || readers.back().func != &f) readers.push_back({&f, 0});
          readers.back().reads += reads;
        }
      });
    }
  }

  // What is inlined is computed as often as it is read, and reads as often.
  void count_reads_in_all() {
    for (auto it = order_.rbegin(); it != order_.rend(); ++it) {  // readers first
      StorageUse& use = uses_[it->get()];
      for (const Reader& by : readers_[it->get()])
        use.reads_in_all +=
            by.reads *
            (is_inlined(*by.func) && !is_output(*by.func) ? uses_[by.func].reads_in_all : 1);
    }
  }
  bool is_inlined(const FuncContents& f) const {
    return f.is_pure() && !stored_.contains(&f) &&
           f.schedule.compute_level.kind == graph::LoopLevel::Kind::Inlined;
  }

  // Of what a Func chooses, by dimensions that the reader's loops or data move, not constants.
  double alternatives(const Call& call, const FuncContents& reader) const {
    const FuncPtr callee = func_of(call);
    double result = 1;
    for (const size_t d : chosen_dimensions(*callee, *fixed_, ChoicesOf::ItsOwn)) {
      const bool is_decided =
          std::none_of(reader.args.begin(), reader.args.end(),
                       [&](const std::string& arg) { return uses_variable(call.args[d], arg); });
      if (!is_decided) result *= static_cast<double>(fixed_->of(*callee, d)->extent);
    }
    return result;
  }

  // Of an element, when nothing is stored.
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
    auto found = uses_.find(call.symbol.raw());
    auto callee = std::dynamic_pointer_cast<FuncContents>(call.symbol.lock());
    return !callee || !is_inlined(*callee) || found == uses_.end() ? 1 : found->second.operations;
  }

  const std::vector<FuncPtr>& outputs_;
  const std::vector<FuncPtr> order_;
  const PlacementLimits* const limits_;
  const ChosenPlaces& chosen_;
  const FixedDimensions* const fixed_;
  std::unordered_map<const Symbol*, StorageUse> uses_;
  struct Reader {
    const FuncContents* func;
    double reads;  // for an element of it
  };
  std::unordered_map<const Symbol*, std::vector<Reader>> readers_;
  std::unordered_set<const FuncContents*> stored_;
  std::optional<std::unordered_set<const Symbol*>> unbounded_;
};

std::vector<FuncPtr> with_large_bodies(const std::vector<FuncPtr>& outputs,
                                       std::vector<FuncPtr> stored, const ChosenPlaces& chosen) {
  const std::vector<FuncPtr> large = large_bodies(outputs, stored);
  check_inlined_bodies(chosen, large);
  stored.insert(stored.end(), large.begin(), large.end());
  return stored;
}

}  // namespace

bool is_differentiated(const std::vector<FuncPtr>& outputs) {
  const std::vector<FuncPtr> order = topological_order(outputs);
  return std::any_of(order.begin(), order.end(), is_adjoint);
}

std::vector<FuncPtr> stored_by_default(const std::vector<FuncPtr>& outputs,
                                       const ChosenPlaces& chosen) {
  std::vector<FuncPtr> pays;
  if (is_differentiated(outputs)) pays = StorageChooser(outputs, nullptr, chosen).choose();
  return with_large_bodies(outputs, std::move(pays), chosen);
}

std::unordered_map<const Symbol*, StorageUse> uses_of_stored(const std::vector<FuncPtr>& outputs,
                                                             const ChosenPlaces& chosen) {
  StorageChooser chooser(outputs, nullptr, chosen);
  chooser.choose();
  return chooser.uses();
}

std::vector<FuncPtr> stored_in_all(const std::vector<FuncPtr>& outputs,
                                   const PlacementLimits& limits, const ChosenPlaces& chosen,
                                   const FixedDimensions* fixed) {
  return with_large_bodies(outputs, StorageChooser(outputs, &limits, chosen, fixed).choose(),
                           chosen);
}

}  // namespace retrograde::autoschedule
