#include "autoschedule/row_tasks.h"

#include <algorithm>
#include <optional>

#include "autoschedule/cost_estimate.h"
#include "autoschedule/inlined_reads.h"
#include "autoschedule/machine/reference.h"
#include "autoschedule/new_loop.h"
#include "autoschedule/only_reader.h"
#include "frontend/language/func.h"
#include "frontend/schedule/stage.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"

namespace retrograde::autoschedule {

namespace {

constexpr int64_t least_piece = 64, most_piece = 512;  // vectors

// The lanes of the vectors of a stage whose only loop runs over these.
std::optional<int64_t> lanes_of_only_loop(const FuncContents& f, const Definition& stage) {
  const StageLoops& loops = stage.schedule;
  if (f.args.empty() || !stage.rvars.empty() || !is_pure_position(f, stage, 0)) return std::nullopt;
  if (loops.splits.size() != 1 || loops.splits[0].outer != f.args[0]) return std::nullopt;
  const Dim& outermost = loops.dims.back();
  const bool is_only = std::all_of(loops.dims.begin(), loops.dims.end() - 1, [](const Dim& loop) {
    return loop.runs == ForType::Vectorized || loop.runs == ForType::Unrolled;
  });
  if (!is_only || outermost.var != f.args[0] || outermost.runs != ForType::Serial)
    return std::nullopt;
  return as_const_int(loops.splits[0].factor);
}

// The operations of one element of the only loop, in all copies that are unrolled inside of it.
double operations_of_row(const FuncContents& f, const Definition& stage,
                         const SizeEstimate& sizes) {
  double copies = 1;
  for (size_t d = 1; d < f.args.size(); ++d)
    copies *= static_cast<double>(sizes.extent(f, d).value_or(1));
  return copies * operations_of_values(roots_with_inlined(stage), [](const Call&) { return 1.0; });
}

void run_in_pieces(const FuncPtr& f, int stage, const SizeEstimate& sizes) {
  const Definition& definition = f->stage(stage);
  const auto lanes = lanes_of_only_loop(*f, definition);
  const auto extent = lanes ? sizes.extent(*f, 0) : std::nullopt;
  if (!extent || read_elsewhere(*f, definition).defined()) return;
  const int64_t tasks = sizes.machine().enough_tasks(), vectors = (*extent + *lanes - 1) / *lanes;
  if (vectors < 2 * least_piece ||
      static_cast<double>(*extent) * operations_of_row(*f, definition, sizes) <
          planning::launch_operations)
    return;
  const int64_t each = std::clamp((vectors + tasks - 1) / tasks, least_piece, most_piece);
  const Var row(f->args[0]), pieces(new_loop(*f, stage, "pieces"));
  Stage(f, stage)
      .split(row, pieces, row, static_cast<int>(each), TailStrategy::GuardWithIf)
      .parallel(pieces);
}

}  // namespace

void run_rows_in_pieces(const std::vector<FuncPtr>& funcs, const SizeEstimate& sizes) {
  for (const FuncPtr& f : funcs) {
    if (!is_at_root(*f) || f->is_extern()) continue;
    for (int s = 0; s < f->stage_count(); ++s) run_in_pieces(f, s, sizes);
  }
}

}  // namespace retrograde::autoschedule
