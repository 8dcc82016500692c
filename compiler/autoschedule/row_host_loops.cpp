#include "autoschedule/row_host_loops.h"

#include <algorithm>
#include <string>
#include <vector>

#include "autoschedule/new_loop.h"
#include "autoschedule/only_reader.h"
#include "frontend/language/func.h"
#include "frontend/schedule/loop_level.h"
#include "frontend/schedule/stage.h"
#include "graph/directives/give_directive.h"

namespace retrograde::autoschedule {

namespace {

class HostMover {
 public:
  HostMover(const RowHost& host, const SizeEstimate& sizes) : host_(host), sizes_(sizes) {}

  void move() {
    cut_rows();
    for (const FuncPtr& f : host_.members) {
      if (f->schedule.compute_level.kind == graph::LoopLevel::Kind::At) continue;  // a block
      autoschedule::run_serially(f);
      Func(f).compute_at(retrograde::LoopLevel(Func(host_.host), Var(level()), 0));
    }
    const bool has_guests = std::ranges::all_of(host_.guests, has_whole_rows);
    move_into_row(host_.inside);
    if (has_guests) move_into_row(host_.shared);
    for (const FuncPtr& copy : host_.copies) join(copy);
    if (!has_guests) return;
    for (const RowGuest& guest : host_.guests) join(guest);
  }

 private:
  const RowHost& host_;
  const SizeEstimate& sizes_;
  std::vector<std::string> loops_;  // over rows, as `rows`; the first is the innermost
  size_t parallel_ = 0;             // number of them that run in parallel, outermost first

  const std::string& level() const { return loops_[0]; }

  static bool has_whole_rows(const RowGuest& guest) {
    return std::ranges::none_of(guest.loops, [&](const std::string& loop) {
      return is_split(guest.sums->updates[0], loop);
    });
  }

  void move_into_row(const std::vector<FuncPtr>& funcs) const {
    for (const FuncPtr& f : funcs) {
      autoschedule::run_serially(f);
      Func(f).compute_at(retrograde::LoopLevel(Func(host_.host), Var(level()), 0));
    }
  }

  void cut_rows() {
    const FuncPtr& host = host_.host;
    autoschedule::run_serially(host);
    Stage stage(host, 0);
    std::vector<VarOrRVar> order;
    for (const Dim& loop : std::vector<Dim>(host->pure->schedule.dims)) {
      const auto row = std::ranges::find_if(
          host_.rows, [&](const RowCoordinate& c) { return host->args[c.dimension] == loop.var; });
      if (row == host_.rows.end()) {
        order.emplace_back(Var(loop.var));
      } else if (row->divisor > 1) {
        const Var all(loop.var), part(inner_loop(*host, 0, loop.var));
        stage.split(all, all, part, static_cast<int>(row->divisor), TailStrategy::GuardWithIf);
        order.emplace_back(part);
      }
    }
    for (const RowCoordinate& row : host_.rows) {
      const std::string name = name_of_row(), old = host->args[row.dimension];
      stage.rename(Var(old), Var(name));
      order.emplace_back(Var(name));
      loops_.push_back(name);
    }
    stage.reorder(order);
    count_tasks();
    run_in_parallel(stage);
  }

  // Copies and guests share the names of the loops.
  std::string name_of_row() const {
    std::string name = "row", last;
    while (name != last) {
      last = name;
      name = new_loop(*host_.host, 0, name);
      for (const FuncPtr& copy : host_.copies) name = new_loop(*copy, 0, name);
      for (const RowGuest& guest : host_.guests) name = new_loop(*guest.sums, 1, name);
    }
    return name;
  }

  void count_tasks() {
    int64_t tasks = 1;
    for (auto row = host_.rows.rbegin(); row != host_.rows.rend(); ++row) {
      if (tasks >= std::max(enough_rows, sizes_.machine().enough_tasks)) return;
      tasks *= sizes_.extent(*host_.host, row->dimension).value_or(1) / row->divisor;
      ++parallel_;
    }
  }

  void run_in_parallel(Stage stage) const {
    for (size_t i = 0; i < parallel_; ++i) stage.parallel(Var(loops_[loops_.size() - 1 - i]));
  }

  void join(const FuncPtr& copy) const {
    Stage stage(copy, 0);
    const RowCoordinates& all = host_.coordinates.at(copy.get());
    std::vector<VarOrRVar> order;
    for (size_t i = 0; i < host_.rows.size(); ++i) {
      const auto arg = std::ranges::find(all, std::optional(host_.rows[i]));
      stage.rename(Var(copy->args[static_cast<size_t>(arg - all.begin())]), Var(loops_[i]));
      order.emplace_back(Var(loops_[i]));
    }
    stage.reorder(order);
    run_in_parallel(stage);
    stage.compute_with(Stage(host_.host, 0), Var(level()));
  }

  // A guest may have several elements in a row.
  void join(const RowGuest& guest) const {
    autoschedule::run_serially(guest.sums);
    Stage stage(guest.sums, 1);
    std::vector<VarOrRVar> order;
    for (const Dim& loop : std::vector<Dim>(guest.sums->updates[0].schedule.dims)) {
      const auto row = std::ranges::find(guest.loops, loop.var);
      if (row == guest.loops.end()) {
        order.emplace_back(loop.var, loop.is_reduction);
        continue;
      }
      const int64_t divisor = host_.rows[static_cast<size_t>(row - guest.loops.begin())].divisor;
      if (divisor == 1) continue;
      const Var all(loop.var), part(inner_loop(*guest.sums, 1, loop.var));
      stage.split(all, all, part, static_cast<int>(divisor), TailStrategy::GuardWithIf);
      order.emplace_back(part);
    }
    for (size_t i = 0; i < host_.rows.size(); ++i) {
      stage.rename(Var(guest.loops[i]), Var(loops_[i]));
      order.emplace_back(Var(loops_[i]));
    }
    stage.reorder(order);
    run_in_parallel(stage);
    stage.compute_with(Stage(host_.host, 0), Var(level()));
  }
};

}  // namespace

void move_into_rows(const RowHost& host, const SizeEstimate& sizes) {
  HostMover(host, sizes).move();
}

}  // namespace retrograde::autoschedule
