#include "lower/checks/refuse_unsupported.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "graph/definitions/define.h"
#include "graph/names.h"

namespace retrograde::lower {

namespace {

bool is_memory_of_device(MemoryType memory) {
  return memory == MemoryType::GPUTexture || memory == MemoryType::LockedCache ||
         memory == MemoryType::VTCM || memory == MemoryType::AMXTile;
}

void refuse_memory_of_devices(const LoopedFunc& f) {
  if (is_memory_of_device(f.schedule.memory)) {
    unsupported(text("store ", quoted(f.name()), " in memory of a device"),
                "storage lies in memory that a CPU or a CUDA device has",
                "store_in named textures or the memory of accelerators",
                "Use MemoryType::Auto, Heap or Stack");
  }
}

// ---- contradictory schedules ----

void check_level_is_set(const LoopedFunc& f, const std::shared_ptr<LoopLevelContents>& from,
                        const char* verb) {
  if (!from || from->defined) return;
  user_error(text(verb, " ", quoted(f.name()), " at a loop level"),
             "the level is set before the pipeline is compiled", "it never was",
             "Set it: level.set(LoopLevel(f, x))");
}

// 1. Loops over blocks are outside of loops over threads. 2. Neither is inside of a vectorized loop.
void check_gpu_loops(const LoopedFunc& f, int stage, const StageLoops& schedule) {
  const Dim *blocks = nullptr, *on_gpu = nullptr;  // the last of each kind visited
  const std::string name = quoted(stage_name(*f.func, stage));
  for (const Dim& dim : schedule.dims) {  // innermost first
    if (is_gpu_thread(dim.runs) && blocks) {
      user_error(text("run GPU threads of ", name, " over ", quoted(dim.var)),
                 "blocks consist of threads",
                 text("the loop over blocks ", quoted(blocks->var), " is inside of it"),
                 text("Reorder ", quoted(dim.var), " inwards"));
    }
    if (dim.runs == ForType::Vectorized && on_gpu) {
      user_error(text("vectorize ", name, " over ", quoted(dim.var)),
                 "threads compute vectors, and no vector has threads",
                 text("the loop over threads or blocks ", quoted(on_gpu->var), " is inside of it"),
                 text("Reorder ", quoted(dim.var), " inwards"));
    }
    if (is_gpu(dim.runs)) on_gpu = &dim;
    if (dim.runs == ForType::GpuBlock) blocks = &dim;
  }
}

void check_loops(const LoopedFunc& f, int stage, const StageLoops& schedule) {
  check_gpu_loops(f, stage, schedule);
  const Dim* parallel = nullptr;
  for (const Dim& dim : schedule.dims) {  // innermost first
    if (dim.runs == ForType::Parallel) parallel = &dim;
    if (dim.runs != ForType::Vectorized || !parallel) continue;
    user_error(
        text("parallelize ", quoted(stage_name(*f.func, stage)), " over ", quoted(parallel->var)),
        "a parallel loop is not inside of a vectorized one",
        text("it is inside of the vectorized loop ", quoted(dim.var)),
        text("Reorder ", quoted(dim.var), " inwards, or keep one of the loops serial"));
  }
  for (const StageLoops& special : schedule.specializations) check_loops(f, stage, special);
}

}  // namespace

void refuse_unsupported(const Program& program) {
  for (const LoopedFunc& f : program.funcs) {
    check_level_is_set(f, f.schedule.compute_from, "compute");
    check_level_is_set(f, f.schedule.store_from, "store");
    check_level_is_set(f, f.schedule.hoist_from, "hoist the storage of");
    for (size_t s = 0; s < f.stages.size(); s++)
      check_loops(f, static_cast<int>(s), f.stages[s].schedule);
    refuse_memory_of_devices(f);
  }
}

static bool has_gpu_loops(const StageLoops& schedule) {
  return std::ranges::any_of(schedule.dims, [](const Dim& dim) { return is_gpu(dim.runs); }) ||
         std::ranges::any_of(schedule.specializations, has_gpu_loops);
}

void check_devices(const Program& program, const Target& target) {
  if (target.has_feature(Target::CUDA)) return;
  for (const LoopedFunc& f : program.funcs) {
    for (size_t s = 0; s < f.stages.size(); s++) {
      if (!has_gpu_loops(f.stages[s].schedule)) continue;
      user_error(text("run ", quoted(stage_name(*f.func, static_cast<int>(s))), " on a GPU"),
                 "the target has a GPU",
                 text("it is ", quoted(target.to_string()), ", which has none"),
                 "Add Target::CUDA to the target: get_host_target().with_feature(Target::CUDA), or "
                 "HL_JIT_TARGET=host-cuda");
    }
  }
}

void check_inlined(const FuncContents& f, const FuncPlacement& schedule) {
  const auto refuse = [&](const std::string& asked, const std::string& evidence) {
    user_error(asked, "only what is computed somewhere has storage of its own", evidence,
               text("Compute ", quoted(f.name), " at a loop or at root, or drop the directive"));
  };
  if (schedule.compute_from && !schedule.compute_from->defined) {
    user_error(text("compute ", quoted(f.name), " at a loop level"),
               "the level is set before the pipeline is compiled", "it never was",
               "Set it: level.set(LoopLevel(f, x))");
  }
  const std::string inlined = text(quoted(f.name), " is inlined into its users");
  if (schedule.memoized) refuse("memoize " + quoted(f.name), inlined);
  if (schedule.async) refuse("compute " + quoted(f.name) + " asynchronously", inlined);
  if (schedule.store_level.kind != LoopLevel::Kind::Inlined)
    refuse("store " + quoted(f.name) + " at a level", inlined);
  if (schedule.hoist_level.kind != LoopLevel::Kind::Inlined)
    refuse("hoist the storage of " + quoted(f.name), inlined);
  if (schedule.ring.defined()) refuse("keep a ring buffer of " + quoted(f.name), inlined);
  if (const LoopLevel& level = f.pure->schedule.fuse_level; level.kind == LoopLevel::Kind::At)
    refuse(text("compute ", quoted(f.name), " with ", quoted(level.func)), inlined);
  for (const StorageRule& rule : schedule.storage_rules) {
    refuse(text("lay out the storage of ", quoted(f.name), " in ", quoted(rule.var)), inlined);
  }
  for (const Dim& dim : f.pure->schedule.dims) {
    if (dim.runs == ForType::Serial) continue;
    const char* verb = is_gpu(dim.runs)                  ? "run on a GPU "
                       : dim.runs == ForType::Parallel   ? "parallelize "
                       : dim.runs == ForType::Vectorized ? "vectorize "
                                                         : "unroll ";
    user_error(text(verb, quoted(f.name), " over ", quoted(dim.var)),
               "only what is computed somewhere has loops", inlined,
               text("Compute ", quoted(f.name), " at a loop or at root, or drop the directive"));
  }
}

namespace {

void resolve(const Program& program, LoopLevel& level) {
  if (level.kind != LoopLevel::Kind::At || level.var != outermost_loop) return;
  const LoopedFunc* consumer = program.find(level.func);
  if (!consumer) return;  // reported later, where every level must be found
  level = consumer->is_output ? LoopLevel{LoopLevel::Kind::Root, "", "", -1}
                              : consumer->schedule.compute_level;
}

// Stages that share only the outermost loop, which runs once, share nothing.
void drop_fusion_at_outermost(StageLoops& schedule) {
  LoopLevel& level = schedule.fuse_level;
  if (level.kind == LoopLevel::Kind::At && level.var == outermost_loop) level = {};
}

}  // namespace

void resolve_outermost_levels(Program& program) {
  // Consumers come last, and their own levels are resolved first.
  for (auto f = program.funcs.rbegin(); f != program.funcs.rend(); ++f) {
    resolve(program, f->schedule.compute_level);
    resolve(program, f->schedule.store_level);
    resolve(program, f->schedule.hoist_level);
    for (Definition& stage : f->stages) drop_fusion_at_outermost(stage.schedule);
  }
}

}  // namespace retrograde::lower
