// autoschedule_options.h -- what the built-in autoscheduler is told: which of its decisions it may
// make, what it stores and inlines, for how many threads, whether it searches.
//
//   AutoscheduleOptions options;
//   options.without = {Decision::Strips};
//   options.store = {blurred, "heavy"};
//   pipeline.auto_schedule(target, options);   // all of a pipeline, now
//   gradient.set_autoschedule(options);        // what nobody scheduled of a gradient, when compiled
//
// Whatever it is told, its schedule is legal and the results are right; Funcs that were given a
// directive keep their schedules.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace retrograde {

class Func;

// What the autoscheduler decides beyond which Funcs are computed at root, and that their rows are
// vectors and their outermost loops tasks.
enum class Decision : uint8_t {
  ScatterStrategy,  // sums at places that data decide: their layout, lanes and unrolled taps
  CutReductions,    // sums to a few elements in lanes and rows, which are tasks
  RegisterTiles,    // how many sums of a reduction are kept in registers
  LayoutStaging,  // copies of what lies apart, square tiles of transposed reads, planes that share
                  // places that data decide, sums along the rows of what they read
  JoinSweeps,     // reductions that load the same in the same loops
  Slices,         // what one Func alone reads slice by slice, in its loops
  TaskSizes,      // parallel loops beyond the outermost, where that is short
  Strips,         // chains of stencils in strips, with windows of rows
  Choices         // a copy of the body for each value of a small dimension that chooses
};
const std::vector<Decision>& all_decisions();
// In small letters: "cut_reductions".
std::string to_string(Decision decision);

// A Func of a pipeline, by itself or by its name.
struct FuncName {
  FuncName(const Func& func);
  FuncName(std::string name) : name(std::move(name)) {}
  FuncName(const char* name) : name(name) {}
  friend bool operator==(const FuncName&, const FuncName&) = default;

  std::string name;
};

struct AutoscheduleOptions {
  std::set<Decision> without = {};     // not made
  std::vector<FuncName> store = {};    // computed at root
  std::vector<FuncName> inlined = {};  // computed where they are read
  // That run at once: loops are cut into four tasks for each, 8 at least; of one thread none is
  // parallel. 0: what the MachineParams say, if these are not the generic ones; else 8 tasks.
  int threads = 0;
  // That a call takes at most, inputs and outputs too: where more would be alive at once, Funcs are
  // computed again instead of stored, as far as that goes. Sizes that are not known count as nothing.
  // 0: inputs, outputs and twice the largest Func of the program that is differentiated; and what
  // stays in the caches; and nothing is computed again that takes much longer than its way to memory.
  int64_t memory_budget = 0;
  // The rules' schedule is where a beam search begins, over what they decide, by the time that a model
  // of the machine predicts (docs/autoscheduler.md). It takes seconds, wants sizes that are known or
  // estimated, and never takes a schedule that the model says is slower. The same program, options
  // and figures of the machine have the same schedule; another machine, or number of threads, may have
  // another, and with it other last bits.
  bool search = false;
  // false: sums at places that data decide may be atomic() updates, in parallel, where that takes
  // less memory or makes the only tasks. Then bits may differ from run to run.
  bool deterministic = true;

  friend bool operator==(const AutoscheduleOptions&, const AutoscheduleOptions&) = default;
  // As parts with commas between: "without=strips+slices,store=blurred+heavy,inline=brighter,threads=4,memory=64000000,search=true,deterministic=false".
  std::string to_string() const;
  // Requires: options of the autoscheduler are parts of a name and a value; the decisions of the
  // autoscheduler have names; threads and bytes are whole numbers, 0 or more; search and deterministic
  // are true or false.
  static AutoscheduleOptions from_string(const std::string& text);
};

}  // namespace retrograde
