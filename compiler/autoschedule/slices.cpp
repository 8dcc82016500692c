#include "autoschedule/slices.h"

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include "autoschedule/read_estimate.h"
#include "autoschedule/running_sums.h"
#include "frontend/language/func.h"
#include "frontend/schedule/loop_level.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"

namespace retrograde::autoschedule {

namespace {

// At least; rows alone are too little work for an allocation.
constexpr size_t slice_dimensions = 2;

// Whether the loop is a part of that over another of the Func's dimensions.
bool is_part_of_another(const Definition& stage, const Dim& loop, const std::string& dimension) {
  return std::ranges::any_of(stage.schedule.splits, [&](const Split& made) {
    return made.inner == loop.var && made.old_var != dimension;
  });
}

class Slicer {
 public:
  explicit Slicer(const SizeEstimate& sizes) : sizes_(sizes) {}

  // The innermost of the reader's outer loops of which each iteration reads a slice of its own, of f and
  // of all that is computed inside of f: of these, what does not move with the loop would be computed
  // again in each iteration.
  std::optional<std::string> loop(const FuncPtr& f, const Reader& reader) const {
    const StageLoops& loops = reader.func->stage(reader.stage).schedule;
    std::optional<std::string> result;
    size_t left = f->args.size();
    for (auto dim = loops.dims.rbegin(); dim != loops.dims.rend(); ++dim) {
      const auto extent = extent_of(reader, *dim);
      const bool is_enough = extent && *extent >= (result ? 2 : sizes_.machine().enough_tasks());
      if (!is_enough || left <= slice_dimensions || !slices_all(*f, reader, dim->var)) break;
      result = dim->var;
      --left;
    }
    return result;
  }

  void moved(const FuncPtr& f, const Reader& reader) {
    inside_[reader.func.get()].emplace_back(f, reader);
  }

 private:
  bool slices_all(const FuncContents& f, const Reader& reader, const std::string& var) const {
    const auto dimension = sliced_by(f, reader, var);
    if (!dimension) return false;
    const auto found = inside_.find(&f);
    return found == inside_.end() || std::ranges::all_of(found->second, [&](const auto& member) {
             return slices_all(*member.first, member.second, f.args[*dimension]);
           });
  }

  // Of a loop over one of the reader's pure variables as it stands.
  std::optional<int64_t> extent_of(const Reader& reader, const Dim& dim) const {
    const FuncContents& g = *reader.func;
    const Definition& stage = g.stage(reader.stage);
    const auto arg = std::find(g.args.begin(), g.args.end(), dim.var);
    if (arg == g.args.end() || dim.is_reduction || is_split(stage, dim.var)) return std::nullopt;
    const auto d = static_cast<size_t>(arg - g.args.begin());
    return is_pure_position(g, stage, d) ? sizes_.extent(g, d) : std::nullopt;
  }

  const SizeEstimate& sizes_;
  // What has moved into the loops of a Func.
  std::unordered_map<const Symbol*, std::vector<std::pair<FuncPtr, Reader>>> inside_;
};

// Whether an update adds what lies in rows along another dimension, in vectors along these.
bool adds_across_rows(const FuncContents& f) {
  return std::ranges::any_of(f.updates, [&](const Definition& update) {
    return update.rvars.empty() && std::ranges::any_of(update.schedule.dims, [&](const Dim& loop) {
             return loop.runs == ForType::Vectorized && !f.args.empty() &&
                    is_part_of_another(update, loop, f.args[0]);
           });
  });
}

}  // namespace

std::optional<size_t> sliced_by(const FuncContents& f, const Reader& reader,
                                const std::string& var) {
  const auto moves = [&](const Expr& e) { return uses_variable(e, var); };
  std::optional<size_t> dimension;
  for (const Call* read : reader.reads) {
    for (size_t d = 0; d < read->args.size(); ++d) {
      const Expr index = without_lets(read->args[d]);
      if (!moves(index)) continue;
      const auto* variable = unclamped(index, moves).as<Variable>();
      if (!variable || variable->name != var || dimension.value_or(d) != d) return std::nullopt;
      dimension = d;
    }
    const bool is_used = dimension && moves(read->args[*dimension]);
    if (!is_used) return std::nullopt;
  }
  for (int s = 0; dimension && s < f.stage_count(); ++s) {
    if (!is_pure_position(f, f.stage(s), *dimension)) return std::nullopt;
  }
  return dimension;
}

void compute_in_slices(const Readers& readers, const std::vector<FuncPtr>& stored,
                       const std::unordered_set<const Symbol*>& but, const SizeEstimate& sizes) {
  // Partial sums are computed in tiles, which share what they read: once for all of them.
  const auto may_have_slices = [&](const FuncPtr& f) {
    const bool is_partial = f->made && (f->made->lanes > 0 || f->made->has_parts);
    return f->args.size() > slice_dimensions && !f->is_extern() && !is_partial &&
           !adds_across_rows(*f) && !but.contains(f.get());
  };
  Slicer slicer(sizes);
  for (const FuncPtr& f : stored) {
    if (!is_at_root(*f) || !may_have_slices(f) || !readers.is_inside(f) || readers.is_output(f))
      continue;
    const auto reader = readers.only_reader(f);
    if (!reader || !is_at_root(*reader->func) || but.contains(reader->func.get()) ||
        is_running_sum(*f, *reader->func))
      continue;
    if (const auto loop = slicer.loop(f, *reader)) {
      Func(f).compute_at(retrograde::LoopLevel(Func(reader->func), Var(*loop), reader->stage));
      slicer.moved(f, *reader);
    }
  }
}

}  // namespace retrograde::autoschedule
