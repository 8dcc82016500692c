// random_loops.h -- random legal loop directives for one stage.
#pragma once

#include <string>
#include <vector>

#include "graph/directives/schedule_log.h"
#include "testing/choices.h"

namespace retrograde::fuzz {

constexpr int unknown_extent = -1;

struct Loop {
  std::string name;
  int extent = unknown_extent;  // if constant
  int dimension = -1;           // the dimension, if it is the own loop of a pure variable
  bool is_reduction = false;
  bool is_independent = true;  // iterations may run concurrently
  bool is_original = true;
  ForType type = ForType::Serial;
};
using Loops = std::vector<Loop>;  // innermost first

// Constraints on the directives of a stage.
struct StageContext {
  bool is_update = false;
  // For outputs: the extents of each dimension over all runs. Empty for other Funcs.
  std::vector<std::vector<int>> output_extents;
  bool is_associative = false;  // an update that may be made atomic, reordered and factored
  bool may_specialize = true;
};

// The final loops of a stage: the general ones, then those of each specialization.
using LoopVariants = std::vector<Loops>;

// The current loops of a stage.
Loops loops_of(const graph::FuncContents& f, int stage);

// Whether an update combines each element with an expression that does not read the Func, by an operator that is
// exactly associative and commutative.
bool is_associative_update(const graph::FuncContents& f, int stage);

// Generates fresh loop names.
struct LoopNames {
  int count = 0;
  std::string fresh(const std::string& stem) { return stem + std::to_string(++count); }
};

// The parameter that conditions of specializations compare with, and its value.
struct Selector {
  Expr parameter;
  int value = 0;
};

// Draws directives for a stage with these loops, and appends them to the log.
LoopVariants schedule_loops(Loops loops, const StageContext& context, const Selector& selector,
                            const ScheduleLog::Entry& place, Choices& random, LoopNames& names,
                            ScheduleLog& log);

}  // namespace retrograde::fuzz
