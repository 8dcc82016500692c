#include "autoschedule/point_loops.h"

#include <algorithm>

#include "autoschedule/loop_order.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/slices.h"
#include "frontend/language/func.h"
#include "frontend/language/rdom.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"

namespace retrograde::autoschedule {

namespace {

class PointLoops {
 public:
  PointLoops(const FuncPtr& f, size_t points, int lanes, const planning::Machine& machine,
             const SizeEstimate& sizes)
      : function_(f), f_(*f), points_(points), lanes_(lanes), machine_(machine), sizes_(sizes) {}

  void give(int index) const {
    Stage stage(function_, index);
    const Var points(f_.args[points_]), lane(inner_loop(f_, index, points.name()));
    stage.split(points, points, lane, lanes_, TailStrategy::GuardWithIf);
    std::vector<VarOrRVar> order{lane}, left;
    int64_t sums = 1;
    for (size_t d = 0; d < points_; ++d) {
      if (!is_pure_position(f_, f_.stage(index), d)) continue;
      const int64_t extent = sizes_.extent(f_, d).value_or(1);
      const Var number(f_.args[d]);
      sums *= extent;
      if (f_.stage(index).rvars.empty() || fit(sums)) {
        const Var copy(inner_loop(f_, index, number.name()));
        stage.split(number, number, copy, static_cast<int>(extent), TailStrategy::GuardWithIf)
            .unroll(copy);
        order.emplace_back(copy);
      }
      left.emplace_back(number);
    }
    for (const ReductionVariable& r : reduction_loops(f_, f_.stage(index)))
      order.emplace_back(RVar(r.var));
    order.insert(order.end(), left.begin(), left.end());
    const size_t inside = order.size();
    order.emplace_back(points);
    for (size_t d = points_ + 1; d < f_.args.size(); ++d) order.emplace_back(Var(f_.args[d]));
    stage.reorder(order).vectorize(lane);
    make_tasks(stage, {order.begin() + static_cast<long>(inside), order.end()});
    if (index > 0) stage.compute_with(Stage(function_, index - 1), points);
  }

 private:
  // Whether so many sums of a vector are kept in registers.
  bool fit(int64_t sums) const {
    return sums * lanes_ * graph::total_bytes(f_.types) <= machine_.accumulator_bytes();
  }

  // `loops`: over vectors of points, then over dimensions beyond.
  void make_tasks(Stage& stage, const std::vector<VarOrRVar>& loops) const {
    int64_t tasks = 1;
    for (size_t i = loops.size(); i-- > 0 && tasks < sizes_.machine().enough_tasks();) {
      stage.parallel(loops[i]);
      tasks *= sizes_.extent(f_, points_ + i).value_or(lanes_);
    }
  }

  const FuncPtr function_;
  const FuncContents& f_;
  const size_t points_;
  const int lanes_;
  const planning::Machine& machine_;
  const SizeEstimate& sizes_;
};

// Whether each iteration of the reader's loops over points and beyond reads elements of its own.
bool reads_own_points(const FuncContents& f, size_t points, const Reader& reader,
                      size_t points_of_reader) {
  const std::vector<std::string>& args = reader.func->args;
  if (f.args.size() - points != args.size() - points_of_reader) return false;
  for (size_t d = points; d < f.args.size(); ++d) {
    if (sliced_by(f, reader, args[points_of_reader + d - points]) != d) return false;
  }
  return true;
}

}  // namespace

void give_point_loops(const FuncPtr& f, const PointFuncs& points, int lanes,
                      const planning::Machine& machine, const SizeEstimate& sizes) {
  const size_t along = *points.points_of(*f);
  const PointLoops loops(f, along, lanes, machine, sizes);
  for (int s = 0; s < f->stage_count(); ++s) loops.give(s);
  if (!points.is_stored_along_points(*f)) return;
  std::vector<Var> order{Var(f->args[along])};
  for (size_t d = 0; d < f->args.size(); ++d) {
    if (d != along) order.emplace_back(f->args[d]);
  }
  Func(f).reorder_storage(order);
}

void compute_at_points(const std::vector<FuncPtr>& funcs, const PointFuncs& points,
                       const Readers& readers, const std::unordered_set<const Symbol*>& excluded) {
  for (const FuncPtr& f : funcs) {
    if (excluded.contains(f.get()) || !readers.is_inside(f) || readers.is_output(f)) continue;
    const auto reader = readers.only_reader(f);
    const auto of_reader = reader ? points.points_of(*reader->func) : std::nullopt;
    if (!of_reader || !reads_own_points(*f, *points.points_of(*f), *reader, *of_reader)) continue;
    run_serially(f);
    const Var loop(reader->func->args[*of_reader]);
    Func(f).compute_at(retrograde::LoopLevel(Func(reader->func), loop, reader->stage));
  }
}

}  // namespace retrograde::autoschedule
