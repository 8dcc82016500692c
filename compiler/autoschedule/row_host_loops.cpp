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

using Level = retrograde::LoopLevel;

class HostMover {
 public:
  HostMover(const RowHost& host, const SizeEstimate& sizes)
      : host_(host),
        sizes_(sizes),
        has_guests_(std::ranges::all_of(host.guests, has_whole_rows)),
        groups_(has_guests_ ? host.groups : std::vector<RowGroup>()) {}

  void move() {
    name_loops();
    cut_rows();
    move_members();
    move_into(row_level(), host_.inside);
    for (const FuncPtr& copy : host_.copies) join(copy);
    if (!has_guests_) return;
    move_into(shared_level(), host_.shared);
    for (const RowGuest& guest : host_.guests) {
      if (groups_.empty())
        join_rows(guest);
      else
        join_groups(guest);
    }
  }

 private:
  const RowHost& host_;
  const SizeEstimate& sizes_;
  const bool has_guests_;
  const std::vector<RowGroup> groups_;
  std::vector<std::string>
      rows_;  // loops over rows, by `RowHost::rows`; the first is the innermost
  std::vector<std::string> outer_;  // loops over groups, around these, as `groups_`
  size_t parallel_ = 0;             // number of all these that run in parallel, outermost first

  static bool has_whole_rows(const RowGuest& guest) {
    return std::ranges::none_of(guest.loops, [&](const std::string& loop) {
      return is_split(guest.sums->updates[0], loop);
    });
  }

  // ---- loops ----

  void name_loops() {
    for (size_t i = 0; i < host_.rows.size(); ++i) rows_.push_back(new_name("row"));
    for (size_t i = 0; i < groups_.size(); ++i) outer_.push_back(new_name("group"));
  }

  // Copies and guests share the names of the loops.
  std::string new_name(const std::string& wanted) const {
    std::string name = wanted, last;
    while (name != last) {
      last = name;
      name = new_loop(*host_.host, 0, name);
      for (const FuncPtr& copy : host_.copies) name = new_loop(*copy, 0, name);
      for (const RowGuest& guest : host_.guests) name = new_loop(*guest.sums, 1, name);
      for (const auto* names : {&rows_, &outer_}) {
        if (std::ranges::find(*names, name) != names->end()) name += "_";
      }
    }
    return name;
  }

  // Whether one row of this coordinate is a group, so that the loop over groups is the one over rows.
  bool is_group(size_t row) const {
    return std::ranges::find(groups_, RowGroup{row, 1}) != groups_.end();
  }

  // Outermost last.
  std::vector<std::string> loops() const {
    std::vector<std::string> result;
    for (size_t i = 0; i < rows_.size(); ++i) {
      if (!is_group(i)) result.push_back(rows_[i]);
    }
    result.insert(result.end(), outer_.begin(), outer_.end());
    return result;
  }

  Level level(const std::string& loop) const { return {Func(host_.host), Var(loop), 0}; }
  Level row_level() const { return level(loops()[0]); }
  Level shared_level() const { return groups_.empty() ? row_level() : level(outer_[0]); }

  void run_in_parallel(Stage stage) const {
    const std::vector<std::string> all = loops();
    for (size_t i = 0; i < parallel_; ++i) stage.parallel(Var(all[all.size() - 1 - i]));
  }

  // Makes the loop `old` over the rows of a coordinate those over its rows and groups.
  void cut_row(Stage& stage, const std::string& old, size_t row) const {
    const Var rows(rows_[row]);
    stage.rename(Var(old), rows);
    for (size_t i = groups_.size(); i-- > 0;) {  // outermost first
      if (groups_[i].row != row) continue;
      if (groups_[i].step == 1)
        stage.rename(rows, Var(outer_[i]));
      else
        stage.split(rows, Var(outer_[i]), rows, static_cast<int>(groups_[i].step),
                    TailStrategy::GuardWithIf);
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
    for (size_t i = 0; i < rows_.size(); ++i)
      cut_row(stage, host->args[host_.rows[i].dimension], i);
    for (const std::string& loop : loops()) order.emplace_back(Var(loop));
    stage.reorder(order);
    parallel_ = groups_.empty() ? tasks() : host_.parallel_groups;
    run_in_parallel(stage);
  }

  // Loops over rows that make enough tasks.
  size_t tasks() const {
    int64_t tasks = 1;
    size_t result = 0;
    for (auto row = host_.rows.rbegin(); row != host_.rows.rend(); ++row) {
      if (tasks >= std::max(enough_rows, sizes_.machine().enough_tasks())) break;
      tasks *= sizes_.extent(*host_.host, row->dimension).value_or(1) / row->divisor;
      ++result;
    }
    return result;
  }

  // ---- what is computed in them ----

  void move_members() const {
    for (const FuncPtr& f : host_.members) {
      if (f->schedule.compute_level.kind == graph::LoopLevel::Kind::At) continue;  // a block
      autoschedule::run_serially(f);
      Func(f).compute_at(row_level());
    }
  }

  static void move_into(const Level& level, const std::vector<FuncPtr>& funcs) {
    for (const FuncPtr& f : funcs) {
      autoschedule::run_serially(f);
      Func(f).compute_at(level);
    }
  }

  // ---- what shares them ----

  void join(const FuncPtr& copy) const {
    Stage stage(copy, 0);
    const RowCoordinates& all = host_.coordinates.at(copy.get());
    for (size_t i = 0; i < host_.rows.size(); ++i) {
      const auto arg = std::ranges::find(all, std::optional(host_.rows[i]));
      cut_row(stage, copy->args[static_cast<size_t>(arg - all.begin())], i);
    }
    std::vector<VarOrRVar> order;
    for (const std::string& loop : loops()) order.emplace_back(Var(loop));
    stage.reorder(order);
    run_in_parallel(stage);
    stage.compute_with(Stage(host_.host, 0), Var(loops()[0]));
  }

  // A guest may have several elements in a row.
  void join_rows(const RowGuest& guest) const {
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
    for (size_t i = 0; i < rows_.size(); ++i) {
      stage.rename(Var(guest.loops[i]), Var(rows_[i]));
      order.emplace_back(Var(rows_[i]));
    }
    stage.reorder(order);
    run_in_parallel(stage);
    stage.compute_with(Stage(host_.host, 0), Var(rows_[0]));
  }

  void join_groups(const RowGuest& guest) const {
    autoschedule::run_serially(guest.sums);
    Stage stage(guest.sums, 1);
    std::vector<VarOrRVar> order, shared;
    for (const Dim& loop : std::vector<Dim>(guest.sums->updates[0].schedule.dims)) {
      if (std::ranges::find(guest.loops, loop.var) == guest.loops.end())
        order.emplace_back(loop.var, loop.is_reduction);
    }
    for (size_t i = 0; i < outer_.size(); ++i) {
      const bool is_added_up = i < outer_.size() - parallel_;
      stage.rename(VarOrRVar(guest.loops[i], is_added_up), VarOrRVar(outer_[i], is_added_up));
      order.emplace_back(outer_[i], is_added_up);
    }
    stage.reorder(order);
    run_in_parallel(stage);
    Func(guest.block).compute_at(shared_level());
    stage.compute_with(Stage(host_.host, 0), Var(outer_[0]));
  }
};

}  // namespace

void move_into_rows(const RowHost& host, const SizeEstimate& sizes) {
  HostMover(host, sizes).move();
}

}  // namespace retrograde::autoschedule
