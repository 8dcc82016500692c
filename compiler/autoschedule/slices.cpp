#include "autoschedule/slices.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>

#include "analysis/interval.h"
#include "frontend/language/func.h"
#include "frontend/schedule/loop_level.h"
#include "graph/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

constexpr int64_t tasks = 8;  // iterations of the outermost loop, which runs in parallel
constexpr size_t slice_dimensions =
    2;  // at least: rows alone are too little work for an allocation

// Ends that are constants; others are unknown.
Interval constant_part(const Interval& range) {
  Interval result = Interval::everything();
  if (range.min.defined() && as_const_int(simplify(range.min))) result.min = simplify(range.min);
  if (range.max.defined() && as_const_int(simplify(range.max))) result.max = simplify(range.max);
  return result;
}

// Which part of each Func others read, as far as that is constant: consumers first.
class ConstantRegions {
 public:
  ConstantRegions(const std::vector<FuncPtr>& order, const std::vector<FuncPtr>& outputs) {
    for (const FuncPtr& f : outputs) boxes_[f.get()].assign(f->args.size(), Interval::everything());
    for (auto f = order.rbegin(); f != order.rend(); ++f) {
      for (int s = 0; s < (*f)->stage_count(); ++s) note_reads(**f, (*f)->stage(s));
    }
  }
  std::optional<int64_t> extent(const FuncContents& f, size_t d) const {
    const auto found = boxes_.find(&f);
    if (found == boxes_.end() || found->second.empty() || !found->second[d].is_bounded())
      return std::nullopt;
    return as_const_int(simplify(found->second[d].max - found->second[d].min + 1));
  }

 private:
  void note_reads(const FuncContents& f, const Definition& stage) {
    Scope<Interval> scope;
    const Box& own = boxes_[&f];
    for (size_t d = 0; d < f.args.size(); ++d) {
      if (is_pure_position(f, stage, d))
        scope.push(f.args[d], own.empty() ? Interval::everything() : own[d]);
    }
    for (const ReductionVariable& r : stage.rvars)
      scope.push(r.var, constant_part({r.min, r.min + r.extent - 1}));
    walk_definition(stage, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (!call || call->call_type != CallType::Func || call->symbol.raw() == &f) return;
      Box box;
      for (const Expr& arg : call->args)
        box.push_back(constant_part(bounds_of(without_lets(arg), scope)));
      Box& all = boxes_[call->symbol.raw()];
      all = hull(all, box);
    });
  }

  std::unordered_map<const Symbol*, Box> boxes_;
};

// Without markers and clamps to constants.
Expr unclamped(const Expr& e) {
  const auto* call = e.as<Call>();
  if (call && call->call_type == CallType::Operator && op_info(call->op).cls == OpClass::Marker)
    return unclamped(call->args[0]);
  if (e.kind() != Kind::Min && e.kind() != Kind::Max) return e;
  const auto* n = e.as<Binary>();
  return is_const(n->b) ? unclamped(n->a) : is_const(n->a) ? unclamped(n->b) : e;
}

// The only stage that reads a Func.
struct Reader {
  FuncPtr func;
  int stage = 0;
  std::vector<const Call*> reads;
};

class Slicer {
 public:
  Slicer(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored)
      : order_(topological_order(outputs)), regions_(order_, outputs), outputs_(outputs) {
    for (const FuncPtr& f : stored) stored_.insert(f.get());
    for (const FuncPtr& f : order_) {
      for (const FuncPtr& callee : direct_callees(*f)) readers_[callee.get()].push_back(f);
      const bool is_block = f->made && f->made->blocks > 0;  // see default_schedule.cpp
      for (const LoopLevel& level : {f->schedule.compute_level, f->schedule.store_level}) {
        if (level.kind == LoopLevel::Kind::At && !is_block) hosts_.insert(level.func);
      }
    }
  }

  // Inside of a Func of which a user has something computed nothing moves, nor does it move itself.
  bool is_inside(const FuncPtr& f) const {
    return stored_.contains(f.get()) && !f->is_extern() && !hosts_.contains(f->name);
  }
  bool is_output(const FuncPtr& f) const {
    return std::find(outputs_.begin(), outputs_.end(), f) != outputs_.end();
  }

  std::optional<Reader> only_reader(const FuncPtr& f) const {
    const auto found = readers_.find(f.get());
    if (found == readers_.end() || found->second.size() != 1 || !is_inside(found->second[0]))
      return std::nullopt;
    Reader reader{found->second[0], -1, {}};
    for (int s = 0; s < reader.func->stage_count(); ++s) {
      std::vector<const Call*> reads;
      walk_definition(reader.func->stage(s), [&](const Expr& e) {
        const auto* call = e.as<Call>();
        if (call && call->call_type == CallType::Func && call->symbol.raw() == f.get())
          reads.push_back(call);
      });
      if (reads.empty()) continue;
      if (reader.stage >= 0) return std::nullopt;
      reader.stage = s;
      reader.reads = std::move(reads);
    }
    return reader.stage >= 0 ? std::optional(std::move(reader)) : std::nullopt;
  }

  // The innermost of the reader's outer loops of which each iteration reads a slice of its own.
  std::optional<std::string> loop(const FuncPtr& f, const Reader& reader) const {
    const StageLoops& loops = reader.func->stage(reader.stage).schedule;
    std::optional<std::string> result;
    size_t left = f->args.size();
    for (auto dim = loops.dims.rbegin(); dim != loops.dims.rend(); ++dim) {
      const auto extent = extent_of(reader, *dim);
      const bool is_enough = extent && *extent >= (result ? 2 : tasks);
      if (!is_enough || left <= slice_dimensions || !is_sliced(*f, reader, dim->var)) break;
      result = dim->var;
      --left;
    }
    return result;
  }

 private:
  // Of a loop over one of the reader's pure variables as it stands.
  std::optional<int64_t> extent_of(const Reader& reader, const Dim& dim) const {
    const FuncContents& g = *reader.func;
    const Definition& stage = g.stage(reader.stage);
    const auto& splits = stage.schedule.splits;
    const auto arg = std::find(g.args.begin(), g.args.end(), dim.var);
    const bool is_split = std::any_of(splits.begin(), splits.end(), [&](const Split& split) {
      return split.old_var == dim.var || split.outer == dim.var || split.inner == dim.var;
    });
    if (arg == g.args.end() || dim.is_reduction || is_split) return std::nullopt;
    const auto d = static_cast<size_t>(arg - g.args.begin());
    return is_pure_position(g, stage, d) ? regions_.extent(g, d) : std::nullopt;
  }

  // Every read has the variable as one and the same index, and in no other; along it each element is
  // computed for itself.
  static bool is_sliced(const FuncContents& f, const Reader& reader, const std::string& var) {
    std::optional<size_t> dimension;
    for (const Call* read : reader.reads) {
      for (size_t d = 0; d < read->args.size(); ++d) {
        const Expr index = without_lets(read->args[d]);
        if (!uses_variable(index, var)) continue;
        const auto* variable = unclamped(index).as<Variable>();
        if (!variable || variable->name != var || dimension.value_or(d) != d) return false;
        dimension = d;
      }
      const bool is_used = dimension && uses_variable(read->args[*dimension], var);
      if (!is_used) return false;
    }
    return dimension && std::all_of(f.updates.begin(), f.updates.end(), [&](const Definition& u) {
             return is_pure_position(f, u, *dimension);
           });
  }

  const std::vector<FuncPtr> order_;
  const ConstantRegions regions_;
  const std::vector<FuncPtr>& outputs_;
  std::unordered_set<const Symbol*> stored_;
  std::unordered_map<const Symbol*, std::vector<FuncPtr>> readers_;
  std::unordered_set<std::string> hosts_;
};

}  // namespace

void compute_in_slices(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored,
                       const std::unordered_set<const Symbol*>& but) {
  const auto may_have_slices = [&](const FuncPtr& f) {
    return f->args.size() > slice_dimensions && !f->is_extern() && !but.contains(f.get());
  };
  if (std::none_of(stored.begin(), stored.end(), may_have_slices)) return;
  const Slicer slicer(outputs, stored);  // before anything is moved
  for (const FuncPtr& f : stored) {
    if (!may_have_slices(f) || !slicer.is_inside(f) || slicer.is_output(f)) continue;
    const auto reader = slicer.only_reader(f);
    if (!reader || but.contains(reader->func.get())) continue;
    if (const auto loop = slicer.loop(f, *reader))
      Func(f).compute_at(retrograde::LoopLevel(Func(reader->func), Var(*loop), reader->stage));
  }
}

}  // namespace retrograde::ir
