// autoschedule_options.h -- options of the built-in autoscheduler: the decisions that it may make, Funcs to store or
// inline, the number of threads, a memory budget, and whether it searches.
//
//   AutoscheduleOptions options;
//   options.without = {Decision::Strips};
//   options.store = {blurred, "heavy"};
//   pipeline.auto_schedule(target, options);   // schedules all of a pipeline now
//   gradient.set_autoschedule(options);        // schedules the unscheduled Funcs of a gradient when it is compiled
//
// Options never make a schedule illegal or a result wrong. Funcs with directives keep their schedules.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace retrograde {

class Func;

// The autoscheduler's optional decisions. Without all of them it still chooses which Funcs are stored, and their vectors
// and parallel loops (docs/autoscheduler.md).
enum class Decision : uint8_t {
  ScatterStrategy,  // scatters at data-dependent indices: vector lanes; on GPUs, atomic updates
  CutReductions,    // split reductions to few elements: lanes, and rows as parallel chunks
  RegisterTiles,    // register tiling of reductions
  LayoutStaging,    // copies of operands, and the order of dimensions in memory
  JoinSweeps,       // fusion of the loops of stages that load the same values
  Slices,           // Funcs computed in the loops of their consumers; the same as Strips
  TaskSizes,        // parallel loops inside of other parallel loops
  Strips,           // Funcs computed in the loops of their consumers; the same as Slices
  Choices           // unrolled loops outside of register tiles
};
// All decisions, in the order of the enumeration.
const std::vector<Decision>& all_decisions();
// The name in lower case: "cut_reductions".
std::string to_string(Decision decision);

// A Func of a pipeline, given as a Func or by its name.
struct FuncName {
  // The name of a Func.
  FuncName(const Func& func);
  FuncName(std::string name) : name(std::move(name)) {}
  FuncName(const char* name) : name(name) {}
  // Whether the names are equal.
  friend bool operator==(const FuncName&, const FuncName&) = default;

  std::string name;  // the name
};

// Options of the built-in autoscheduler.
struct AutoscheduleOptions {
  std::set<Decision> without = {};     // decisions that it does not make
  std::vector<FuncName> store = {};    // Funcs to compute at root
  std::vector<FuncName> inlined = {};  // Funcs to inline
  // Number of threads to schedule for: four parallel chunks per thread are wanted, 8 at least; with one thread no loop
  // is parallel. 0: the parallelism of the MachineParams unless these are the generic ones; otherwise 8 chunks.
  int threads = 0;
  // Maximum bytes alive at once in a call, inputs and outputs included. If the schedule would exceed it,
  // Funcs are recomputed instead of stored, as far as possible. Unknown sizes count as 0. 0 means: inputs,
  // outputs, twice the largest Func of the differentiated program, and everything that fits the caches; then
  // the program takes at most 25 % longer to keep within it, as predicted.
  int64_t memory_budget = 0;
  // Searches wider than the default: a beam over changes of the whole schedule, guided by a cost model
  // (docs/autoscheduler.md). It takes up to seconds, needs sizes that are known or estimated, and never chooses a
  // schedule that the model predicts to be slower. The result depends only on the program, the options and the
  // figures of the machine. Its last bits may differ from those of the default schedule, and from those on another
  // machine or for another number of threads.
  bool search = false;
  // false: large scatters at data-dependent indices may become parallel atomic() updates, if that is the only source
  // of parallelism. Results may then differ in the last bits from run to run.
  bool deterministic = true;

  // Whether all options are equal.
  friend bool operator==(const AutoscheduleOptions&, const AutoscheduleOptions&) = default;
  // The options as text, separated by commas:
  // "without=strips+slices,store=blurred+heavy,inline=brighter,threads=4,memory=64000000,search=true,deterministic=false".
  std::string to_string() const;
  // Parses the text that to_string() writes.
  // Requires: options of the autoscheduler are parts of a name and a value; the decisions of the
  // autoscheduler have names; threads and bytes are whole numbers, 0 or more; search and deterministic
  // are true or false.
  static AutoscheduleOptions from_string(const std::string& text);
};

}  // namespace retrograde
