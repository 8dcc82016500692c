// Random legal schedules as plain data: where each Func is computed and stored, and the loop
// directives of each of its stages, by loop name.
#pragma once

#include <string>
#include <vector>

#include "testing/build_pipeline.h"
#include "testing/random_pipeline.h"

namespace retrograde::fuzz {

struct Directive {
  enum class Kind : uint8_t { Split, Fuse, Reorder, Vectorize, Unroll, Parallel };
  Kind kind = Kind::Split;
  // Split: old, outer, inner. Fuse: inner, outer, fused. Reorder: innermost first. Else: one loop.
  std::vector<std::string> loops;
  int factor = 0;  // Split; Vectorize, Unroll, Parallel: 0 without a split
  TailStrategy tail = TailStrategy::Auto;
};

struct StageSpec {
  std::vector<Directive> directives;
};

struct Placement {
  enum class Where : uint8_t { Default, Inline, Root, At };
  Where where = Where::Default;
  int consumer = -1, stage = 0;  // At: whose loops
  std::string compute_loop;      // At
  std::string store_loop;  // At: a loop of the consumer, "root", or empty for the compute loop
};

struct FuncScheduleSpec {
  Placement placement;
  std::vector<StageSpec> stages;  // the pure definition, then the updates
  bool bounded = false;           // an output: bound() with its exact region
};

struct ScheduleSpec {
  std::vector<FuncScheduleSpec> funcs;
};

// Everything inlined that may be, nothing else said.
ScheduleSpec default_schedule(const PipelineSpec& pipeline);
ScheduleSpec random_schedule(const PipelineSpec& pipeline, uint64_t seed);

// Gives the directives to the Funcs. UserError when one is refused.
void apply(const ScheduleSpec& schedule, const PipelineSpec& pipeline, BuiltPipeline& built);

// Reduction variable k of a stage by the name that schedules use: "r0", "r1".
std::string reduction_loop(int k);
bool is_reduction_loop(const std::string& name);

const char* tail_name(TailStrategy tail);

}  // namespace retrograde::fuzz
