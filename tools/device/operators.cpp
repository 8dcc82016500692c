// Runs the pipelines of the differential tests as kernels; they contain every operator in every type.
#include <algorithm>
#include <chrono>
#include <limits>

#include "graph/function.h"
#include "outcome.h"
#include "retrograde/retrograde.h"
#include "worker.h"

namespace device_check {
namespace {

using namespace retrograde;

#include "differential/pipelines/common.h"
// These includes must follow the ones above.
#include "differential/pipelines/arithmetic.h"
#include "differential/pipelines/functions.h"
#include "differential/pipelines/images.h"
#include "differential/pipelines/reductions.h"
#include "differential/pipelines/updates.h"

// Maps the stage's independent loops over elements to blocks of threads, if it has any.
void make_kernel(Stage stage, const graph::FuncPtr& f) {
  std::vector<Var> free;
  for (const VarOrRVar& loop : stage.split_vars()) {
    const bool is_own = std::ranges::find(f->args, loop.name()) != f->args.end();
    if (is_own) free.emplace_back(loop.name());
  }
  const Var thread_x("thread_x"), thread_y("thread_y");
  if (free.empty()) {
    stage.gpu_single_thread();
  } else if (free.size() == 1) {
    stage.gpu_tile(free[0], thread_x, 32, TailStrategy::GuardWithIf);
  } else {
    stage.gpu_tile(free[0], free[1], thread_x, thread_y, 16, 4, TailStrategy::GuardWithIf);
  }
}

// Stores outputs and Funcs with updates; all others are computed in the kernels of their consumers.
void make_kernels(const std::vector<Func>& outputs) {
  std::vector<graph::FuncPtr> ends;
  for (const Func& f : outputs) ends.push_back(f.function());
  for (const graph::FuncPtr& f : graph::topological_order(ends)) {
    const bool is_output = std::ranges::find(ends, f) != ends.end();
    if (f->is_pure() && !is_output) continue;
    if (!is_output) Func(f).compute_root();
    for (int stage = 0; stage <= Func(f).num_update_definitions(); ++stage)
      make_kernel(Stage(f, stage), f);
  }
}

std::string run(const Built& built, const Target& target) {
  std::vector<Buffer<>> buffers;
  for (size_t i = 0; i < built.outputs.size(); ++i) {
    for (const Type& type : built.outputs[i].output_types()) {
      buffers.emplace_back(type, built.extents[i]);
      if (!built.mins.empty()) buffers.back().set_min(built.mins[i]);
    }
  }
  Pipeline(built.outputs).realize(Realization(buffers), target);
  std::string bytes;
  for (Buffer<>& buffer : buffers) bytes += bytes_of(buffer);
  return bytes;
}

}  // namespace

void run_operators(const Target& target, double seconds, RecordWriter& records) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  for (const Case& one : cases()) {
    if (std::chrono::steady_clock::now() > end) return;
    records.add(recorded(one.name, [&] {
      const Built built = one.build(false);
      make_kernels(built.outputs);
      return run(built, target);
    }));
  }
}

}  // namespace device_check
