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

// The autoscheduler's optional decisions. It always chooses which Funcs to compute at root, vectorizes their rows and
// splits their outermost loops into parallel chunks.
enum class Decision : uint8_t {
  ScatterStrategy,  // scatters at data-dependent indices: layout, vector lanes and unrolled taps
  CutReductions,    // split reductions to few elements: lanes, and rows as parallel chunks
  RegisterTiles,    // register tiling of reductions
  LayoutStaging,  // packed copies of strided operands, square tiles of transposed reads, planes that
                  // share data-dependent indices, sums along the rows of their operands
  JoinSweeps,     // fusion of the loops of reductions that load the same values
  Slices,         // Funcs with a single consumer that reads slice by slice, computed in its loops
  TaskSizes,      // parallel loops inside a short outermost loop
  Strips,         // chains of stencils in strips, with sliding windows of rows
  Choices         // one copy of the body for each value of a small dimension that selects a case
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
  // Number of threads to schedule for. Parallel loops are split into four chunks per thread, 8 at least; with
  // one thread no loop is parallel. 0: the parallelism of the MachineParams unless these are the generic
  // ones; otherwise 8 chunks.
  int threads = 0;
  // Maximum bytes alive at once in a call, inputs and outputs included. If the schedule would exceed it,
  // Funcs are recomputed instead of stored, as far as possible. Unknown sizes count as 0. 0 means: inputs,
  // outputs, twice the largest Func of the differentiated program, and everything that fits the caches; then
  // no Func is recomputed if that takes much longer than its memory round trip.
  int64_t memory_budget = 0;
  // Searches wider than the default: a beam over changes of the whole schedule, from that of the rules and from one
  // in which nothing is decided, guided by a cost model (docs/autoscheduler.md). It takes up to seconds, needs sizes
  // that are known or estimated, and never chooses a schedule that the model predicts to be slower. The result
  // depends only on the program, the options and the figures of the machine. Its last bits may differ from those of
  // the default schedule, and from those on another machine or for another number of threads.
  bool search = false;
  // false: scatters at data-dependent indices may become parallel atomic() updates, if that takes less memory
  // or is the only source of parallelism. Results may then differ in the last bits from run to run.
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
