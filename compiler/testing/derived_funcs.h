// Funcs that directives make: wrappers, clones, intermediates of rfactor.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "testing/random_loops.h"

namespace retrograde::fuzz {

// Draws a few; all of them legal.
std::vector<DerivedFunc> random_derived_funcs(const PipelineSpec& pipeline, Random& random,
                                              LoopNames& names);

// The pipeline as compiled: derived Funcs follow the others, their users read them.
struct ExtendedPipeline {
  PipelineSpec pipeline;
  // Loops, innermost first, of stages that do not start with those of their definition.
  std::map<std::pair<int, int>, Loops> loops;
};
ExtendedPipeline extend(const PipelineSpec& pipeline, const std::vector<DerivedFunc>& derived);

}  // namespace retrograde::fuzz
