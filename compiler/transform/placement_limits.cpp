#include "transform/placement_limits.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <unordered_map>

#include "analysis/interval.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"

namespace retrograde::transform {

namespace {

// Which dimensions of Funcs are read at places between bounds that are known, when those of the
// outputs are: consumers first.
class KnownRegions {
 public:
  explicit KnownRegions(const std::vector<FuncPtr>& order) {
    for (const FuncPtr& f : order) known_[f.get()].assign(f->args.size(), true);
    for (auto f = order.rbegin(); f != order.rend(); ++f) {
      note_reads(**f, true);
      note_reads(**f, false);
    }
  }
  bool are_known(const FuncContents& f) const {
    const std::vector<bool>& known = known_.at(&f);
    return std::find(known.begin(), known.end(), false) == known.end();
  }

 private:
  void note_reads(const FuncContents& f, bool its_own) {
    for (int s = 0; s < f.stage_count(); ++s) {
      const Scope<Interval> scope = scope_of(f, f.stage(s));
      walk_definition(f.stage(s), [&](const Expr& e) {
        const auto* call = e.as<Call>();
        if (!call || call->call_type != CallType::Func || (call->symbol.raw() == &f) != its_own)
          return;
        std::vector<bool>& known = known_.at(call->symbol.raw());
        for (size_t d = 0; d < known.size(); ++d) {
          if (known[d]) known[d] = bounds_of(without_lets(call->args[d]), scope).is_bounded();
        }
      });
    }
  }

  Scope<Interval> scope_of(const FuncContents& f, const Definition& stage) const {
    Scope<Interval> scope;
    for (size_t d = 0; d < f.args.size(); ++d) {
      const std::string& name = f.args[d];
      if (!is_pure_position(f, stage, d)) continue;
      scope.push(name, known_.at(&f)[d]
                           ? Interval{variable(name + ".first"), variable(name + ".last")}
                           : Interval::everything());
    }
    for (const ReductionVariable& r : stage.rvars) scope.push(r.var, {r.min, r.min + r.extent - 1});
    return scope;
  }

  std::unordered_map<const Symbol*, std::vector<bool>> known_;
};

bool is_loop(const graph::LoopLevel& level) { return level.kind == graph::LoopLevel::Kind::At; }

// The Funcs inside of whose loops something is computed that each Func reads, itself aside.
std::unordered_map<const Symbol*, std::set<std::string>> levels_read(
    const std::vector<FuncPtr>& order) {
  std::unordered_map<const Symbol*, std::set<std::string>> result;
  for (const FuncPtr& f : order) {
    std::set<std::string>& levels = result[f.get()];
    for (const FuncPtr& callee : direct_callees(*f)) {
      const graph::LoopLevel& at = callee->schedule.compute_level;
      if (is_loop(at)) levels.insert(at.func);
      if (at.kind != graph::LoopLevel::Kind::Inlined) continue;
      const std::set<std::string>& inside = result[callee.get()];
      levels.insert(inside.begin(), inside.end());
    }
    levels.erase(f->name);
  }
  return result;
}

}  // namespace

std::unordered_set<const Symbol*> unbounded_funcs(const std::vector<FuncPtr>& order) {
  std::unordered_set<const Symbol*> result;
  const KnownRegions regions(order);
  for (const FuncPtr& f : order) {
    if (!regions.are_known(*f)) result.insert(f.get());
  }
  return result;
}

PlacementLimits placement_limits(const std::vector<FuncPtr>& order) {
  PlacementLimits limits;
  std::map<std::string, const Symbol*> by_name;
  for (const FuncPtr& f : order) by_name[f->name] = f.get();
  limits.stay = unbounded_funcs(order);
  const auto levels = levels_read(order);
  const auto note = [&](const graph::LoopLevel& level, std::unordered_set<const Symbol*>& where) {
    if (is_loop(level) && by_name.count(level.func)) where.insert(by_name[level.func]);
  };
  for (const FuncPtr& f : order) {
    if (!levels.at(f.get()).empty()) limits.stay.insert(f.get());
    for (const graph::LoopLevel& level :
         {f->schedule.compute_level, f->schedule.store_level, f->schedule.hoist_level})
      note(level, limits.levels);
    // Their loops run as one.
    for (int s = 0; s < f->stage_count(); ++s) note(f->stage(s).schedule.fuse_level, limits.stay);
    if (!f->extern_definition) continue;
    for (const ExternArgument& arg : f->extern_definition->args) {
      if (arg.kind == ExternArgument::Kind::Func) limits.need_root.insert(arg.func.get());
    }
  }
  return limits;
}

}  // namespace retrograde::transform
