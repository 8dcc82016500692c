// Random legal loop directives for one stage.
#pragma once

#include <string>
#include <vector>

#include "graph/schedule_log.h"
#include "testing/choices.h"

namespace retrograde::fuzz {

constexpr int unknown_extent = -1;

struct Loop {
  std::string name;
  int extent = unknown_extent;  // when constant
  int dimension = -1;           // of a pure variable's own loop
  bool is_reduction = false;
  bool is_independent = true;  // iterations may run at the same time
  bool is_original = true;
  ForType type = ForType::Serial;
};
using Loops = std::vector<Loop>;  // innermost first

// What the directives of a stage have to respect.
struct StageContext {
  bool is_update = false;
  // Of an output: the extents of each dimension over all runs. Otherwise empty.
  std::vector<std::vector<int>> output_extents;
  bool is_associative = false;  // an update that may be atomic, reordered and factored
  bool may_specialize = true;
};

// The loops of a stage in the end: the general ones, then those of each specialization.
using LoopVariants = std::vector<Loops>;

// The loops that a stage has now.
Loops loops_of(const graph::FuncContents& f, int stage);

// Whether an update combines each element with something that does not read the Func, by an
// operator that is associative and commutative bit for bit.
bool is_associative_update(const graph::FuncContents& f, int stage);

// Fresh names for loops.
struct LoopNames {
  int count = 0;
  std::string fresh(const std::string& stem) { return stem + std::to_string(++count); }
};

// What the conditions of specializations compare with, and its value.
struct Selector {
  Expr parameter;
  int value = 0;
};

// Draws directives for the place, which has these loops, and appends them to the log.
LoopVariants schedule_loops(Loops loops, const StageContext& context, const Selector& selector,
                            const ScheduleLog::Entry& place, Choices& random, LoopNames& names,
                            ScheduleLog& log);

}  // namespace retrograde::fuzz
