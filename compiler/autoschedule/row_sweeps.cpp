#include "autoschedule/row_sweeps.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "autoschedule/cut_reductions.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/row_readers.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/directives/give_directive.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t most_of_a_row = planning::second_cache_bytes / 2;  // bytes

// Stages in one loop, and what is computed in it for them, consumers first.
struct RowSweep {
  std::vector<RowReader> readers;
  std::vector<FuncPtr> inside;

  bool has_inside(const FuncPtr& f) const {
    return std::find(inside.begin(), inside.end(), f) != inside.end();
  }
  bool reads(const RowReader& r) const {
    return std::any_of(readers.begin(), readers.end(),
                       [&](const RowReader& other) { return other.func == r.func; });
  }
};

bool needs(const FuncPtr& f, const FuncPtr& other) {
  const std::vector<FuncPtr> order = topological_order({f});
  return f != other && std::find(order.begin(), order.end(), other) != order.end();
}

// The longest dimension but that of vectors.
std::optional<size_t> row_dimension(const FuncContents& f, const SizeEstimate& sizes) {
  std::optional<size_t> row;
  int64_t most = sizes.machine().enough_tasks() - 1;
  for (size_t d = 1; d < f.args.size(); ++d) {
    const int64_t extent = sizes.extent(f, d).value_or(0);
    if (extent <= most) continue;
    most = extent;
    row = d;
  }
  const bool fits = row && sizes.bytes(f) / most <= most_of_a_row;
  return fits ? row : std::nullopt;
}

class SweepFinder {
 public:
  SweepFinder(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
              const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes)
      : outputs_(outputs), stored_(stored), but_(but), sizes_(sizes), reads_(outputs, stored) {}

  std::vector<RowSweep> find() {
    for (auto f = stored_.rbegin(); f != stored_.rend(); ++f) {
      if (may_move(*f)) add(*f);
    }
    return std::move(sweeps_);
  }

 private:
  const std::vector<FuncPtr>&outputs_, &stored_;
  const std::unordered_set<const Symbol*>& but_;
  const SizeEstimate& sizes_;
  const StageReads reads_;
  std::vector<RowSweep> sweeps_;

  bool may_schedule(const FuncPtr& f) const {
    return !but_.contains(f.get()) && !has_directives(*f);
  }

  bool may_move(const FuncPtr& f) const {
    const bool is_output = std::find(outputs_.begin(), outputs_.end(), f) != outputs_.end();
    return !is_output && f->is_pure() && !f->is_extern() && may_schedule(f) &&
           sizes_.bytes(*f) >= sizes_.machine().last_cache_bytes();
  }

  // What is computed in the loops of another is no reader of its own.
  bool may_join(const RowReader& r) const {
    const bool has_loops = r.kind == RowReader::Kind::Parts ||
                           std::find(stored_.begin(), stored_.end(), r.func) != stored_.end();
    const bool is_free = std::none_of(sweeps_.begin(), sweeps_.end(), [&](const RowSweep& sweep) {
      return sweep.reads(r) || sweep.has_inside(r.func);
    });
    return has_loops && is_free && may_schedule(r.func) && (!r.block || may_schedule(r.block));
  }

  // The only sweep that has some of the readers; nullptr: none has.
  RowSweep* sweep_of(const std::vector<RowReader>& readers) {
    for (RowSweep& sweep : sweeps_) {
      for (const RowReader& r : readers) {
        if (sweep.reads(r) || sweep.has_inside(r.func)) return &sweep;
      }
    }
    return nullptr;
  }

  void add(const FuncPtr& f) {
    const auto row = row_dimension(*f, sizes_);
    if (!row) return;
    std::vector<RowReader> readers;
    for (const StageReads::Reading& reading : reads_.of(*f)) {
      const auto reader = row_reader(reads_, reading, *row, sizes_);
      if (!reader) return;
      readers.push_back(*reader);
    }
    RowSweep* known = sweep_of(readers);
    RowSweep sweep = known ? *known : RowSweep();
    for (const RowReader& r : readers) {
      if (sweep.has_inside(r.func) || sweep.reads(r)) continue;
      if (!may_join(r) || is_needed(sweep, r)) return;
      sweep.readers.push_back(r);
    }
    if (!is_worth_while(sweep)) return;
    sweep.inside.push_back(f);
    if (known)
      *known = std::move(sweep);
    else
      sweeps_.push_back(std::move(sweep));
  }

  static bool is_needed(const RowSweep& sweep, const RowReader& r) {
    return std::any_of(sweep.readers.begin(), sweep.readers.end(), [&](const RowReader& other) {
      return needs(r.func, other.func) || needs(other.func, r.func);
    });
  }

  // Pure Funcs alone are what strips and slices are for.
  static bool is_worth_while(const RowSweep& sweep) {
    return sweep.readers.size() > 1 &&
           std::any_of(sweep.readers.begin(), sweep.readers.end(),
                       [](const RowReader& r) { return r.kind != RowReader::Kind::Pure; });
  }
};

// Gives the stages of a sweep their loops.
class SweepScheduler {
 public:
  explicit SweepScheduler(const RowSweep& sweep) : sweep_(sweep), row_(name_of_row(sweep)) {}

  void give() {
    std::vector<Stage> stages;
    for (const RowReader& r : in_order()) stages.push_back(stage_of(r));
    const Stage& host = stages[0];
    for (size_t i = 1; i < stages.size(); ++i) stages[i].compute_with(host, Var(row_));
    for (const FuncPtr& f : sweep_.inside) {
      Func(f).compute_at(retrograde::LoopLevel(Func(host.function()), Var(row_), host.index()));
      vectorize(Stage(f, 0), Var(f->args[0]), planning::schedule_lanes, TailStrategy::GuardWithIf);
    }
  }

 private:
  const RowSweep& sweep_;
  const std::string row_;

  static std::string name_of_row(const RowSweep& sweep) {
    std::string name = "row", last;
    while (name != last) {
      last = name;
      for (const RowReader& r : sweep.readers) name = new_loop(*r.func, r.stage, name);
    }
    return name;
  }

  // The loops of a pure Func are those that others join: nothing has to run before it.
  std::vector<RowReader> in_order() const {
    std::vector<RowReader> order = sweep_.readers;
    std::stable_partition(order.begin(), order.end(),
                          [](const RowReader& r) { return r.kind == RowReader::Kind::Pure; });
    return order;
  }

  Stage stage_of(const RowReader& r) const {
    if (r.kind == RowReader::Kind::Pure) return rows_of_pure(r);
    if (r.kind == RowReader::Kind::Parts) return rows_of_parts(r);
    const Stage sums(sum_rows(r.func, r.stage), 1);
    Stage(sums).rename(last_loop(sums), Var(row_));
    return sums;
  }

  static VarOrRVar last_loop(const Stage& stage) {
    const Dim& loop = stage.function()->stage(stage.index()).schedule.dims.back();
    return VarOrRVar(loop.var, loop.is_reduction);
  }

  Stage rows_of_pure(const RowReader& r) const {
    Stage stage(r.func, 0);
    std::vector<VarOrRVar> order;
    for (const std::string& arg : r.func->args) {
      if (arg != r.row) order.push_back(Var(arg));
    }
    order.push_back(Var(r.row));
    Func(r.func).compute_root();
    stage.reorder(order).rename(Var(r.row), Var(row_)).parallel(Var(row_));
    vectorize(stage, Var(r.func->args[0]), planning::schedule_lanes, TailStrategy::GuardWithIf);
    return stage;
  }

  // parts(lane, ..., part) is the sum of what its rows are, each of which adds up its blocks.
  Stage rows_of_parts(const RowReader& r) const {
    const Var lane(r.func->args[0]), part(r.part), step(new_loop(*r.func, 1, "step"));
    Stage sum(r.func, 1);
    Func rows = sum.rfactor(RVar(r.row), step);
    std::vector<VarOrRVar> order{lane};
    for (const Dim& loop : rows.function()->stage(1).schedule.dims) {
      const bool is_row = loop.var == step.name() || loop.var == part.name();
      if (!is_row && loop.var != lane.name())
        order.push_back(VarOrRVar(loop.var, loop.is_reduction));
    }
    rows.compute_root().parallel(Var(rows.args().back()));
    vectorize(Stage(rows.function(), 0), lane, planning::schedule_lanes, TailStrategy::Auto);
    order.push_back(Var(row_));
    rows.update().fuse(step, part, Var(row_)).reorder(order).parallel(Var(row_));
    vectorize(rows.update(), lane, planning::schedule_lanes, TailStrategy::GuardWithIf);
    compute_blocks(r.block, rows.function(), order[1]);
    add_rows(r.func, lane, part);
    return Stage(rows.function(), 1);
  }

  // Each where it is added.
  static void compute_blocks(const FuncPtr& block, const FuncPtr& rows, const VarOrRVar& at) {
    Func(block).compute_at(retrograde::LoopLevel(Func(rows), at, 1));
    const Var lane(block->args[0]);
    std::vector<VarOrRVar> order{lane};
    for (const ReductionVariable& r : block->updates[0].rvars) order.push_back(RVar(r.var));
    vectorize(Stage(block, 0), lane, planning::schedule_lanes, TailStrategy::GuardWithIf);
    Stage(block, 1).reorder(order);
    vectorize(Stage(block, 1), lane, planning::schedule_lanes, TailStrategy::GuardWithIf);
  }

  static void add_rows(const FuncPtr& parts, const Var& lane, const Var& part) {
    Func(parts).compute_root().parallel(part);
    vectorize(Stage(parts, 0), lane, planning::schedule_lanes, TailStrategy::Auto);
    Stage sum(parts, 1);
    std::vector<VarOrRVar> order{lane};
    for (const Dim& loop : parts->updates[0].schedule.dims) {
      if (loop.is_reduction) order.push_back(RVar(loop.var));
    }
    for (const std::string& arg : parts->args) {
      if (arg != lane.name()) order.push_back(Var(arg));
    }
    sum.reorder(order).parallel(part);
    vectorize(sum, lane, planning::schedule_lanes, TailStrategy::GuardWithIf);
  }
};

}  // namespace

void sweep_rows(const std::vector<FuncPtr>& outputs, std::vector<FuncPtr>& stored,
                const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes) {
  const bool has_large = std::any_of(stored.begin(), stored.end(), [&](const FuncPtr& f) {
    return f->is_pure() && sizes.bytes(*f) >= sizes.machine().last_cache_bytes();
  });
  if (!has_large) return;
  for (const RowSweep& sweep : SweepFinder(outputs, stored, but, sizes).find())
    SweepScheduler(sweep).give();
  std::erase_if(stored, [](const FuncPtr& f) { return has_directives(*f); });
}

}  // namespace retrograde::autoschedule
