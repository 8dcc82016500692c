// Random legal loop directives for one stage.
#pragma once

#include <string>
#include <vector>

#include "testing/random_pipeline.h"
#include "testing/schedule_spec.h"

namespace retrograde::fuzz {

constexpr int unknown_extent = -1;

struct Loop {
  std::string name;             // empty: it has none
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

// The loops that the schedule of a stage has in the end: the general ones, then those of each
// specialization.
struct StageLoops {
  std::vector<Loops> variants;
};

// The loops of a stage without directives.
Loops initial_loops(const FuncSpec& func, int stage);

// Whether update `stage` combines each element with something that does not read the Func, by an
// operator that is associative and commutative bit for bit.
bool is_associative_update(const FuncSpec& func, int stage);

// Fresh names for loops.
class LoopNames {
 public:
  std::string fresh(const std::string& stem) { return stem + std::to_string(++count_); }

 private:
  int count_ = 0;
};

// Draws directives for a stage with these loops and appends them.
StageLoops schedule_loops(Loops loops, const StageContext& context, int selector, Random& random,
                          LoopNames& names, std::vector<Directive>& directives);

}  // namespace retrograde::fuzz
