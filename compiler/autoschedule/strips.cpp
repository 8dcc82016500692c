#include "autoschedule/strips.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>

#include "autoschedule/cost_estimate.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/only_reader.h"
#include "autoschedule/read_window.h"
#include "autoschedule/running_sums.h"
#include "autoschedule/stored_reads.h"
#include "frontend/language/func.h"
#include "frontend/schedule/loop_level.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t unknown_extent = 1024;                          // of rows and columns of an image
constexpr int64_t enough_strips = 2 * planning::reference_tasks;  // each is a task
constexpr size_t most_members = 8;
// What several of a group read, as a sum reads all steps of a chain, and a part of such a sum. If it did not join, no Func behind
// it would either, and the images of all would be held until the group has run: so it may have more
// company, and rows that wait for the last reader in a cache farther away.
// So may a group with sums: what these read of many planes, a strip at a time, stays in such a cache at
// least.
constexpr size_t most_with_shared = 32;
constexpr double shared_window_bytes = planning::third_cache_bytes / 4;
constexpr double least_rows = 8, rows_a_halo = 8;
// More take longer than the way to memory: matrix products and convolutions over many channels live
// by their tiles over rows.
constexpr double most_shared_reads = 64;

// How a Func's dimension moves with the loops of the last of its group.
struct Along {
  std::optional<size_t> loop;  // a dimension of the last; none: the same for all of its iterations
  double scale = 0, low = 0, high = 0;
  double kept = 0;  // the lowest that a reader takes in an iteration that computes the highest
  std::set<size_t> unknown;  // dimensions of the last that move it as data say

  bool is_same_element() const { return loop && scale == 1 && low == high; }
  double size() const { return high - low + 1; }
  // In storage that wraps around after a power of two.
  double rows_kept() const { return std::exp2(std::ceil(std::log2(high - kept + 1))); }
};
using Windows = std::vector<Along>;  // of the dimensions of a Func

// The loops of the last Func of a group, by dimension.
struct StripLoops {
  size_t row = 0;               // which is cut into strips
  std::vector<size_t> outside;  // of the strips
  int64_t rows = 0;             // of a strip
};

// Whether something is computed, or is to be, in the loops of a Func.
bool has_guests(const FuncContents& f) {
  if (!f.copied_inputs.empty()) return true;
  const auto is_guest = [&](const Expr& e) {
    const auto* call = e.as<Call>();
    const FuncPtr callee = call && call->call_type == CallType::Func ? func_of(*call) : nullptr;
    if (!callee) return false;
    const graph::LoopLevel& level = callee->schedule.compute_level;
    return (level.kind == graph::LoopLevel::Kind::At && level.func == f.name) ||
           callee->wrappers.contains(f.name);
  };
  for (int s = 0; s < f.stage_count(); ++s) {
    for (const Expr& root : roots_with_inlined(f.stage(s))) {
      if (any_node(root, is_guest)) return true;
    }
  }
  return false;
}

// Over a domain of so many iterations, known here, to the element that the pure variables say.
bool is_sum_of_rows(const FuncContents& f) {
  if (f.made || f.is_extern() || f.is_pure() || f.args.size() < 2) return false;
  const bool are_sums = std::ranges::all_of(f.updates, [&](const Definition& update) {
    bool stays = !read_elsewhere(f, update).defined();
    for (size_t d = 0; d < f.args.size(); ++d) stays &= is_pure_position(f, update, d);
    return stays && std::ranges::all_of(update.rvars, [](const ReductionVariable& r) {
             return as_const_int(simplify(r.extent)).has_value();
           });
  });
  return are_sums && !has_guests(f);
}

// Of an element, what a tile over several values of these dimensions loads once for all of them.
double reads_shared_along(const FuncContents& f, const std::vector<size_t>& dimensions) {
  double total = 0;
  for (const Definition& update : f.updates) {
    double reads = 0;
    std::unordered_set<const ExprNode*> seen;
    graph::walk(update, [&](const Expr& e) {
      if (!seen.insert(e.get()).second) return false;
      const auto* call = e.as<Call>();
      const bool loads = call && call->call_type != CallType::Operator;
      const bool is_shared = loads && std::ranges::any_of(dimensions, [&](size_t d) {
                               return is_split(update, f.args[d]) && !uses_variable(e, f.args[d]);
                             });
      if (is_shared) ++reads;
      return true;
    });
    total += reads * terms_of(update, 1);
  }
  return total;
}

// Of an element.
double operations_of_all_stages(const FuncContents& f) {
  double total = 0;
  for (int s = 0; s < f.stage_count(); ++s) {
    total += terms_of(f.stage(s), 1) *
             operations_of_values(roots_with_inlined(f.stage(s)), [](const Call&) { return 1.0; });
  }
  return total;
}

class Group {
 public:
  Group(FuncPtr last, const SizeEstimate& sizes) : last_(std::move(last)), sizes_(sizes) {
    for (size_t d = 0; d < last_->args.size(); ++d) own_.push_back({d, 1, 0, 0, 0, {}});
  }

  const FuncPtr& last() const { return last_; }
  const std::vector<FuncPtr>& members() const { return members_; }
  const StripLoops& loops() const { return *loops_; }
  // The dimensions of a member that move with the loops which are cut: it computes an element of each
  // at a time.
  std::vector<size_t> cut_of(const FuncContents& member) const {
    return cut_dimensions(windows_.at(&member), *loops_);
  }

  // Whether it has joined: all of its reads are by Funcs of this group.
  bool join(const FuncPtr& f, const std::vector<StoredRead>& reads) {
    const auto windows = windows_of(*f, reads);
    const bool is_shared = reads.size() > 1 || is_running_sum(*f, *reads[0].reader);
    const bool is_large = is_shared || has_sums() || !f->is_pure();
    if (!windows || members_.size() >= (is_large ? most_with_shared : most_members)) return false;
    windows_[f.get()] = *windows;
    members_.push_back(f);
    const auto loops = loops_of_all(is_large ? shared_window_bytes
                                             : static_cast<double>(sizes_.machine().task_bytes()));
    if (loops && pays(*f, *windows, *loops) &&
        reads_shared_along(*f, cut_dimensions(*windows, *loops)) <= most_shared_reads) {
      loops_ = loops;
      return true;
    }
    members_.pop_back();
    windows_.erase(f.get());
    return false;
  }

 private:
  bool has_sums() const {
    return std::ranges::any_of(members_, [](const FuncPtr& f) { return !f->is_pure(); });
  }
  const Windows& of(const FuncContents& f) const {
    return &f == last_.get() ? own_ : windows_.at(&f);
  }

  std::optional<Windows> windows_of(const FuncContents& f,
                                    const std::vector<StoredRead>& reads) const {
    std::optional<Windows> all;
    for (const StoredRead& by : reads) {
      for (const Expr& call : by.calls) {
        const auto windows = windows_of(*call.as<Call>(), *by.reader, by.stage);
        if (!windows || (all && !widen(*all, *windows))) return std::nullopt;
        if (!all) all = windows;
      }
    }
    return all && is_one_to_one(*all) && f.args.size() == all->size() ? all : std::nullopt;
  }
  std::optional<Windows> windows_of(const Call& call, const FuncContents& reader, int stage) const {
    Windows result;
    for (const Expr& arg : call.args) {
      const auto along = along_of(arg, reader, reader.stage(stage), of(reader));
      if (!along) return std::nullopt;
      result.push_back(*along);
    }
    return result;
  }
  // Of an index in a reader, whose own dimensions move as `outer` says.
  static std::optional<Along> along_of(const Expr& index, const FuncContents& reader,
                                       const Definition& stage, const Windows& outer) {
    const auto window = read_window(index, reader, stage);
    if (!window) return moved_by_data(index, reader, outer);
    Along along{std::nullopt, 0, window->low, window->high, window->low, {}};
    if (window->loop.empty()) return along;
    const auto d = std::find(reader.args.begin(), reader.args.end(), window->loop);
    const Along& by = outer[static_cast<size_t>(d - reader.args.begin())];
    const double scale = window->scale;
    if (scale <= 0) return std::nullopt;
    return Along{by.loop,
                 by.scale * scale,
                 by.low * scale + window->low,
                 by.high * scale + window->high,
                 by.high * scale + window->low,
                 by.unknown};
  }
  static Along moved_by_data(const Expr& index, const FuncContents& reader, const Windows& outer) {
    Along along;
    for (size_t d = 0; d < outer.size(); ++d) {
      if (!uses_variable(index, reader.args[d])) continue;
      along.unknown.insert(outer[d].unknown.begin(), outer[d].unknown.end());
      if (outer[d].loop) along.unknown.insert(*outer[d].loop);
    }
    return along;
  }
  static bool widen(Windows& all, const Windows& by) {
    for (size_t d = 0; d < all.size(); ++d) {
      if (all[d].loop != by[d].loop || all[d].scale != by[d].scale) return false;
      all[d].unknown.insert(by[d].unknown.begin(), by[d].unknown.end());
      all[d].low = std::min(all[d].low, by[d].low);
      all[d].high = std::max(all[d].high, by[d].high);
      all[d].kept = std::min(all[d].kept, by[d].kept);
    }
    return true;
  }
  static bool is_one_to_one(const Windows& windows) {
    std::unordered_set<size_t> seen;
    return std::all_of(windows.begin(), windows.end(), [&](const Along& along) {
      return !along.loop || seen.insert(*along.loop).second;
    });
  }

  // Of the member, the dimension that a loop of the last moves.
  static const Along* moved_by(const Windows& windows, size_t loop) {
    const auto found = std::find_if(windows.begin(), windows.end(),
                                    [&](const Along& along) { return along.loop == loop; });
    return found == windows.end() ? nullptr : &*found;
  }
  // Whether it holds for the dimension of every member that the loop moves; also that there is one.
  template <typename Holds>
  bool all_moved_by(size_t loop, Holds holds) const {
    return std::all_of(members_.begin(), members_.end(), [&](const FuncPtr& f) {
      const Windows& windows = windows_.at(f.get());
      const Along* along = moved_by(windows, loop);
      const bool is_known = std::none_of(windows.begin(), windows.end(), [&](const Along& each) {
        return each.unknown.contains(loop);
      });
      return along && is_known && holds(*along);
    });
  }

  // Rows are cut along the outermost dimension in which windows overlap, or, without one, the innermost
  // that moves all; what each iteration has for itself stays outside.
  std::optional<StripLoops> loops_of_all(double most_bytes) const {
    StripLoops loops;
    const auto anything = [](const Along&) { return true; };
    const auto same = [](const Along& along) { return along.is_same_element(); };
    for (size_t d = last_->args.size(); d-- > 1 && loops.row == 0;) {
      if (all_moved_by(d, anything) && !all_moved_by(d, same)) loops.row = d;
    }
    for (size_t d = 1; d < last_->args.size() && loops.row == 0; ++d) {
      if (all_moved_by(d, same)) loops.row = d;
    }
    if (loops.row == 0) return std::nullopt;
    int64_t tasks = 1;
    for (size_t d = 1; d < last_->args.size(); ++d) {
      if (d == loops.row || !all_moved_by(d, same)) continue;
      loops.outside.push_back(d);
      tasks *= sizes_.extent(*last_, d).value_or(1);
    }
    loops.rows = rows_of(loops.row, tasks);
    const bool fits = bytes_of_windows(loops) <= most_bytes && are_rows(loops);
    return fits ? std::optional(loops) : std::nullopt;
  }

  // The vectors of every member run along rows.
  bool are_rows(const StripLoops& loops) const {
    return std::all_of(members_.begin(), members_.end(), [&](const FuncPtr& f) {
      const Along& first = windows_.at(f.get())[0];
      return !first.loop || !is_cut_by(*first.loop, loops);
    });
  }
  static bool is_cut_by(size_t loop, const StripLoops& loops) {
    return loop == loops.row ||
           std::find(loops.outside.begin(), loops.outside.end(), loop) != loops.outside.end();
  }

  static std::vector<size_t> cut_dimensions(const Windows& windows, const StripLoops& loops) {
    std::vector<size_t> result;
    for (size_t d = 0; d < windows.size(); ++d) {
      if (windows[d].loop && is_cut_by(*windows[d].loop, loops)) result.push_back(d);
    }
    return result;
  }

  // Elements of sums are dear: where there are some, strips are as long as they can be.
  int64_t rows_of(size_t row, int64_t tasks) const {
    double halo = 0;  // in rows of the last
    for (const FuncPtr& f : members_) {
      const Along* along = moved_by(windows_.at(f.get()), row);
      halo = std::max(halo, (along->high - along->low) / along->scale);
    }
    const double all = static_cast<double>(sizes_.extent(*last_, row).value_or(unknown_extent));
    const int64_t strips = has_sums() ? sizes_.machine().enough_tasks() : enough_strips;
    const double most = std::max(least_rows, all * static_cast<double>(tasks) / strips);
    const double rows = has_sums() ? most : std::clamp(halo * rows_a_halo, least_rows, most);
    return static_cast<int64_t>(std::ceil(rows));
  }

  double bytes_of_windows(const StripLoops& loops) const {
    double total = 0;
    for (const FuncPtr& f : members_) {
      double bytes = 0;
      for (const Type& type : f->types) bytes += type.bytes();
      const Windows& windows = windows_.at(f.get());
      for (size_t d = 0; d < windows.size(); ++d) {
        const bool is_cut = windows[d].loop && is_cut_by(*windows[d].loop, loops);
        bytes *=
            is_cut
                ? windows[d].rows_kept()
                : static_cast<double>(sizes_.extent(*f, d).value_or(
                      windows[d].loop ? unknown_extent : static_cast<int64_t>(windows[d].size())));
      }
      total += bytes;
    }
    return total;
  }

  // What is computed twice at borders, beside the way to memory.
  bool pays(const FuncContents& f, const Windows& windows, const StripLoops& loops) const {
    const int64_t bytes = sizes_.bytes(f);
    if (bytes > 0 && bytes < sizes_.machine().near_cache_bytes()) return false;
    const Along& row = *moved_by(windows, loops.row);
    const double own = static_cast<double>(loops.rows) * row.scale;
    const double twice = std::max(0.0, row.size() - row.scale) / own;
    return operations_of_all_stages(f) * twice <
           planning::memory_trip_operations * (1 + planes_behind(f));
  }

  // A sum is not the last of a group: if it did not join, what it reads would go to memory, too. For
  // each element of the sum, so many of these.
  double planes_behind(const FuncContents& f) const {
    const auto own = static_cast<double>(sizes_.bytes(f));
    if (f.is_pure() || own <= 0) return 0;
    std::unordered_set<const Symbol*> seen;
    double bytes = 0;
    for (int s = 0; s < f.stage_count(); ++s) {
      for (const Expr& root : roots_with_inlined(f.stage(s))) {
        walk(root, [&](const Expr& e) {
          const auto* call = e.as<Call>();
          if (!call || call->call_type != CallType::Func) return true;
          const FuncPtr callee = func_of(*call);
          const bool is_behind = callee.get() != &f && is_at_root(*callee);
          if (is_behind && seen.insert(callee.get()).second)
            bytes += static_cast<double>(sizes_.bytes(*callee));
          return true;
        });
      }
    }
    return bytes / own;
  }

  const FuncPtr last_;
  const SizeEstimate& sizes_;
  Windows own_;
  std::vector<FuncPtr> members_;
  std::unordered_map<const Symbol*, Windows> windows_;
  std::optional<StripLoops> loops_;
};

void give_strips(const Group& group, const GiveLoopsOfRows& give_rows) {
  const FuncPtr& last = group.last();
  const StripLoops& loops = group.loops();
  const auto name = [&](size_t d) { return last->args[d]; };
  const auto is_outside = [&](const std::string& var) {
    return var == name(loops.row) || std::any_of(loops.outside.begin(), loops.outside.end(),
                                                 [&](size_t d) { return var == name(d); });
  };
  run_serially(last);
  Stage stage(last, 0);
  const Var strips(name(loops.row)), row(inner_loop(*last, 0, strips.name()));
  std::vector<VarOrRVar> order;
  for (const Dim& loop : last->pure->schedule.dims) {
    if (!is_outside(loop.var)) order.push_back(Var(loop.var));
  }
  stage.split(strips, strips, row, static_cast<int>(loops.rows), TailStrategy::GuardWithIf);
  order.push_back(row);
  order.push_back(strips);
  for (size_t d : loops.outside) order.push_back(Var(name(d)));
  stage.reorder(order).parallel(strips);
  for (size_t d : loops.outside) stage.parallel(Var(name(d)));
  for (const FuncPtr& f : group.members()) {
    const std::vector<size_t> cut = group.cut_of(*f);
    const bool has_several = std::ranges::any_of(f->updates, [&](const Definition& update) {
      return std::ranges::any_of(cut, [&](size_t d) { return is_split(update, f->args[d]); });
    });
    if (has_several) give_rows(f, cut);
    run_serially(f);
    Func(f).store_at(Func(last), strips).compute_at(Func(last), row);
  }
}

class Grouping {
 public:
  // `but`: none of these, as the last of a group neither.
  Grouping(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& given,
           const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes)
      : given_(given), readers_(outputs), hosts_(outputs, given), but_(but), sizes_(sizes) {}

  // `apart`: Funcs that join no others.
  std::vector<std::unique_ptr<Group>> groups(const std::unordered_set<const Symbol*>& apart) {
    std::vector<std::unique_ptr<Group>> groups;
    group_of_.clear();
    for (auto it = given_.rbegin(); it != given_.rend(); ++it) {
      const FuncPtr& f = *it;
      if (!may_run_in_strips(f)) continue;
      const std::vector<StoredRead>& reads = readers_.of(f);
      const bool is_alone = hosts_.is_output(f) || readers_.is_hidden(f) || apart.contains(f.get());
      Group* group = is_alone ? nullptr : group_that_reads(reads);
      if (!group || !group->join(f, reads)) {
        if (!f->is_pure()) continue;
        groups.push_back(std::make_unique<Group>(f, sizes_));
        group = groups.back().get();
      }
      group_of_[f.get()] = group;
    }
    return groups;
  }

  // Running sums of the groups just made that keep others, which did not join, alive for these: more
  // than one, which is what a sum at root takes itself.
  std::unordered_set<const Symbol*> that_keep_others(
      const std::vector<std::unique_ptr<Group>>& groups) const {
    std::unordered_set<const Symbol*> result;
    for (const auto& group : groups) {
      for (const FuncPtr& f : group->members()) {
        if (!is_running_sum(*f, *readers_.of(f)[0].reader)) continue;
        const auto is_outside = [&](const FuncPtr& g) {
          const auto found = group_of_.find(g.get());
          return found == group_of_.end() || found->second != group.get();
        };
        if (std::ranges::count_if(summed_adjoints(*f), is_outside) > 1) result.insert(f.get());
      }
    }
    return result;
  }

 private:
  bool may_run_in_strips(const FuncPtr& f) const {
    return (has_plain_rows(*f) || is_sum_of_rows(*f)) && is_at_root(*f) && hosts_.is_inside(f) &&
           !but_.contains(f.get());
  }
  Group* group_that_reads(const std::vector<StoredRead>& reads) const {
    Group* only = nullptr;
    for (const StoredRead& by : reads) {
      const auto found = group_of_.find(by.reader.get());
      if (found == group_of_.end() || (only && found->second != only)) return nullptr;
      only = found->second;
    }
    return only;
  }

  const std::vector<FuncPtr>& given_;
  const StoredReads readers_;
  const Readers hosts_;
  const std::unordered_set<const Symbol*>& but_;
  const SizeEstimate& sizes_;
  std::unordered_map<const Symbol*, Group*> group_of_;
};

}  // namespace

void compute_in_strips(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& given,
                       const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes,
                       const GiveLoopsOfRows& give_rows) {
  Grouping grouping(outputs, given, but, sizes);
  auto groups = grouping.groups({});
  const auto apart = grouping.that_keep_others(groups);
  if (!apart.empty()) groups = grouping.groups(apart);
  for (const auto& group : groups) {
    if (!group->members().empty()) give_strips(*group, give_rows);
  }
}

}  // namespace retrograde::autoschedule
