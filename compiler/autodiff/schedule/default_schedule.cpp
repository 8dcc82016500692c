#include "autodiff/schedule/default_schedule.h"

#include <algorithm>
#include <optional>
#include <unordered_set>

#include "autodiff/schedule/cost_estimate.h"
#include "autodiff/schedule/cut_reductions.h"
#include "autodiff/schedule/read_estimate.h"
#include "autodiff/sweeps/regions.h"
#include "autodiff/updates/update_context.h"
#include "diagnostics/large_stack.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/copy_graph.h"
#include "graph/function.h"
#include "graph/own_reads.h"
#include "graph/wrappers.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"

namespace retrograde::ir {

bool is_touched(const FuncContents& f) {
  if (f.schedule.is_given) return true;
  for (int s = 0; s < f.stage_count(); ++s) {
    if (f.stage(s).schedule.is_given) return true;
  }
  return false;
}

namespace {

constexpr int lanes = 16;
// Operations up to which a Func that the user left alone in a schedule by hand is inlined.
constexpr double explosion = 500;
constexpr int64_t unknown_iterations = 8;

struct Use {
  double reads = 0;
  double operations = 0;  // of one value, with what is inlined into it
};

class Chooser {
 public:
  Chooser(const std::vector<FuncPtr>& outputs, const VectorUnit& unit)
      : outputs_(outputs), unit_(unit), order_(topological_order(outputs)) {}

  DefaultSchedules choose() {
    if (std::none_of(order_.begin(), order_.end(), is_adjoint)) return {};
    for (const FuncPtr& f : order_) count_reads(*f);
    bool by_hand = std::any_of(order_.begin(), order_.end(),
                               [](const FuncPtr& f) { return !is_adjoint(f) && is_touched(*f); });
    for (const FuncPtr& f : order_) {  // producers first: the cost of what is inlined is known
      uses_[f.get()].operations = operations(*f);
      if (is_touched(*f)) continue;
      // Who schedules the primal means an untouched primal Func to be inlined, unless that
      // explodes.
      bool left_inline = by_hand && !is_adjoint(f);
      bool stored =
          is_worth_storing(uses_[f.get()], left_inline && f->is_pure() ? explosion : cheap);
      stored |= left_inline ? computes_more_than_is_read(*f) : is_output(f) || !f->is_pure();
      if (stored) result_[f.get()] = stored_schedule(*f);
    }
    return std::move(result_);
  }

 private:
  static bool is_adjoint(const FuncPtr& f) { return f->made.has_value(); }
  bool is_output(const FuncPtr& f) const {
    return std::find(outputs_.begin(), outputs_.end(), f) != outputs_.end();
  }
  // Beyond the first, each read computes the value again: more than a few operations, and all
  // together more than it takes to bring the value to memory and back.
  static bool is_worth_storing(const Use& use, double free_operations) {
    return use.reads > 1.5 && use.operations > free_operations &&
           (use.reads - 1) * use.operations > way_to_memory;
  }

  // Whether an element takes others of the Func: an update writes where its reduction variables or
  // data say. Inside of the loops of who reads it, all of them would be computed for each read.
  static bool computes_more_than_is_read(const FuncContents& f) {
    return std::any_of(f.updates.begin(), f.updates.end(), [&](const Definition& update) {
      for (size_t d = 0; d < f.args.size(); ++d) {
        if (!is_pure_position(f, update, d) && !is_const(update.args[d])) return true;
      }
      return false;
    });
  }

  void count_reads(const FuncContents& f) {
    for (int s = 0; s < f.stage_count(); ++s) {
      walk_definition(f.stage(s), [&](const Expr& e) {
        const auto* call = e.as<Call>();
        if (call && call->call_type == CallType::Func && call->symbol.raw() != &f)
          uses_[call->symbol.raw()].reads += reads_an_element(*call, f, f.stage(s));
      });
    }
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
    double total = 0;
    std::unordered_set<const ExprNode*> seen;
    for (const Expr& value : stage.values) {
      walk(value, [&](const Expr& e) {
        if (!seen.insert(e.get()).second) return false;
        total += cost_of(e);
        return true;
      });
    }
    return total;
  }
  double cost_of(const Expr& e) const {
    const auto* call = e.as<Call>();
    if (!call || call->call_type != CallType::Func) return operations_of(e);
    auto found = uses_.find(call->symbol.raw());
    auto callee = std::dynamic_pointer_cast<FuncContents>(call->symbol.lock());
    bool stored = !callee || !callee->is_pure() || result_.contains(callee.get()) ||
                  callee->schedule.compute_level.kind != LoopLevel::Kind::Inlined;
    return stored || found == uses_.end() ? 1 : found->second.operations;
  }

  ChosenSchedule stored_schedule(const FuncContents& f) const {
    auto scratch = std::make_shared<FuncContents>(f);
    ChosenSchedule result{f.schedule, {}};
    result.func.compute_level.kind = result.func.store_level.kind = LoopLevel::Kind::Root;
    for (int s = 0; s < f.stage_count(); ++s) {
      schedule_stage(scratch, s, scatters_in_order(f, f.stage(s)));
      result.stages.push_back(scratch->stage(s).schedule);
    }
    return result;
  }

  // Pure dimensions only: their iterations are independent whatever the stage does.
  void schedule_stage(const FuncPtr& f, int s, bool scatters) const {
    Stage stage(f, s);
    std::vector<size_t> pure;
    for (size_t d = 0; d < f->args.size(); ++d) {
      if (is_pure_position(*f, f->stage(s), d)) pure.push_back(d);
    }
    if (scatters) {
      RVar innermost(f->stage(s).rvars[0].var);
      stage.allow_race_conditions().vectorize(innermost, lanes, TailStrategy::GuardWithIf);
    }
    if (pure.empty()) return;
    if (auto d = pure[0] == 0 ? transposed_dimension(*f, f->stage(s)) : std::nullopt)
      return tile_stage(f, s, *d, pure.back());
    if (!scatters && pure[0] == 0 && tile_in_registers(f, s, pure)) return;
    Var outermost(f->args[pure.back()]);
    bool reduces = !f->stage(s).rvars.empty();
    if (pure.size() > 1 || (reduces && pure[0] != 0)) stage.parallel(outermost);
    // Few private parts may be left where the target is large.
    if (f->made && f->made->has_parts && pure.size() > 1 && pure[pure.size() - 2] != 0)
      stage.parallel(Var(f->args[pure[pure.size() - 2]]));
    if (pure[0] != 0) return;
    Var innermost(f->args[0]);
    stage.vectorize(innermost, lanes, TailStrategy::GuardWithIf);
    if (pure.size() == 1 && reduces) stage.parallel(innermost);  // of the vectors
  }

  // Whether there is a tile. Its loops stand inside of those of the reduction; those over tiles
  // outside, of the sides first, so that what the last dimensions run over stays in the cache.
  bool tile_in_registers(const FuncPtr& f, int s, const std::vector<size_t>& pure) const {
    const bool has_lanes = f->made && f->made->lanes > 0;
    const auto tile = register_tile(*f, f->stage(s), lanes, has_lanes ? 1 : 4, unit_);
    if (!tile) return false;
    Stage stage(f, s);
    std::vector<VarOrRVar> inner, outer;
    const auto cut = [&](size_t d, int64_t size) {
      const Var all(f->args[d]), part(unique_name("tile"));
      stage.split(all, all, part, Expr(static_cast<int>(size)), TailStrategy::GuardWithIf);
      inner.push_back(part);
      outer.push_back(all);
    };
    cut(0, tile->vectors * lanes);
    for (const RegisterTile::Side& side : tile->sides) cut(side.dimension, side.size);
    std::vector<VarOrRVar> order = inner;
    for (const ReductionVariable& r : f->stage(s).rvars) order.push_back(RVar(r.var));
    for (size_t d : pure) {
      const Var all(f->args[d]);
      if (std::none_of(outer.begin(), outer.end(),
                       [&](const VarOrRVar& cut) { return cut.name() == all.name(); }))
        outer.push_back(all);
    }
    order.insert(order.end(), outer.begin(), outer.end());
    stage.reorder(order);
    if (tile->vectors > 1)
      stage.vectorize(inner[0], lanes).unroll(inner[0]);
    else
      stage.vectorize(inner[0]);
    for (size_t i = 1; i < inner.size(); ++i) stage.unroll(inner[i]);
    stage.parallel(outer.back());
    if (outer.size() > 2) stage.parallel(outer[outer.size() - 2]);  // the last may be short
    return true;
  }

  // A dimension beyond the first that runs along the rows of what a pure stage reads, while the
  // first one runs across them.
  static std::optional<size_t> transposed_dimension(const FuncContents& f,
                                                    const Definition& stage) {
    std::optional<size_t> result;
    if (!stage.rvars.empty() || f.args.size() < 2) return result;
    for_each_expr(stage, [&](const Expr& root) {
      walk(root, [&](const Expr& e) {
        const auto* call = e.as<Call>();
        if (!call || call->call_type == CallType::Operator || call->args.size() < 2) return true;
        const bool across =
            !uses_variable(call->args[0], f.args[0]) &&
            std::any_of(call->args.begin() + 1, call->args.end(),
                        [&](const Expr& arg) { return uses_variable(arg, f.args[0]); });
        for (size_t d = 1; across && d < f.args.size(); ++d) {
          if (is_pure_position(f, stage, d) && uses_variable(call->args[0], f.args[d])) result = d;
        }
        return true;
      });
    });
    return result;
  }

  // Squares, whose rows stay in the cache until their columns are read.
  static void tile_stage(const FuncPtr& f, int s, size_t dimension, size_t outermost) {
    Stage stage(f, s);
    Var x(f->args[0]), y(f->args[dimension]), xi(unique_name("column")), yi(unique_name("row"));
    stage.tile(x, y, xi, yi, lanes, lanes, TailStrategy::GuardWithIf).vectorize(xi);
    stage.parallel(Var(f->args[outermost]));
  }

  // f(places) += terms, where data decide the place along the first dimension, over a loop that is
  // worth vectors. Vectors of places and terms are computed; lowering adds them in the order of the
  // iterations (vectorize_loops.cpp), so that this is no race.
  static bool scatters_in_order(const FuncContents& f, const Definition& stage) {
    if (stage.rvars.empty() || stage.args.empty()) return false;
    auto extent = as_const_int(stage.rvars[0].extent);
    if (extent && *extent < lanes) return false;
    if (!depends_on_data(stage.args[0])) return false;
    return std::all_of(stage.values.begin(), stage.values.end(), [&](const Expr& value) {
      const auto* sum = value.as<Add>();
      return sum && is_old_value(sum->a, f, stage) && !calls(sum->b, &f);
    });
  }
  const std::vector<FuncPtr>& outputs_;
  const VectorUnit unit_;
  std::vector<FuncPtr> order_;
  std::unordered_map<const Symbol*, Use> uses_;
  DefaultSchedules result_;
};

}  // namespace

DefaultSchedules default_schedules(const std::vector<FuncPtr>& outputs, const VectorUnit& unit) {
  return Chooser(outputs, unit).choose();
}

namespace {

bool is_differentiated(const std::vector<FuncPtr>& outputs) {
  const std::vector<FuncPtr> order = topological_order(outputs);
  return std::any_of(order.begin(), order.end(),
                     [](const FuncPtr& f) { return f->made.has_value(); });
}

std::vector<FuncPtr> with_schedules(const std::vector<FuncPtr>& outputs,
                                    const DefaultSchedules& chosen) {
  const GraphCopy copy = copy_graph(outputs);
  for (const auto& [f, schedule] : chosen) {
    FuncContents& scheduled = *copy.of.at(f);
    scheduled.schedule = schedule.func;
    for (int s = 0; s < scheduled.stage_count(); ++s)
      scheduled.stage(s).schedule = schedule.stages[static_cast<size_t>(s)];
  }
  return copy.outputs;
}

}  // namespace

std::vector<FuncPtr> schedule_unscheduled(const std::vector<FuncPtr>& outputs,
                                          const VectorUnit& unit) {
  std::vector<FuncPtr> result;
  run_on_large_stack([&] {
    result = apply_wrappers(outputs);
    if (is_differentiated(result)) result = cut_reductions(result);
    const DefaultSchedules chosen = default_schedules(result, unit);
    if (!chosen.empty()) result = with_schedules(result, chosen);
  });
  return result;
}

}  // namespace retrograde::ir
