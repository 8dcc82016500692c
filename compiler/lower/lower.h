// From a Func graph with schedules to a flat function for code generation.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "graph/function.h"
#include "ir/lowered_function.h"
#include "ir/target.h"

namespace retrograde::lower {

#ifdef RETROGRADE_VALIDATE
constexpr bool validates_passes = true;
#else
constexpr bool validates_passes = false;
#endif

struct LowerOptions {
  Target target;
  bool validate = validates_passes;  // after every pass, blaming it by name
  // Told of every pass that ran: its name, seconds, and the statement it gave, which is
  // undefined before build_loop_nests. May be empty.
  std::function<void(const std::string& pass, double seconds, const Stmt& after)> observe;
  std::string stop_after;  // name of a pass; empty: all of them
};

// `inputs`: scalars and input buffers in the order the caller wants; outputs are appended as the
// last arguments, one for each value of each output Func. Errors: UserError for illegal schedules,
// unbounded regions, recursion; see the passes. Requires: lowering stops after one of its passes.
LoweredFunction lower(const std::string& name, const std::vector<FuncPtr>& outputs,
                      const std::vector<LoweredArgument>& inputs, const LowerOptions& options);

// Runs one pass alone on `s`, a statement over the Funcs of `outputs` as the passes before it would
// leave it; undefined for build_loop_nests and the passes before it. Returns the text after the
// pass: a statement, or a graph while there is no statement. Requires: lowering stops after one of
// its passes.
std::string run_pass_alone(const std::string& name, const std::vector<FuncPtr>& outputs,
                           const Stmt& s, const Target& target);

// The inputs that `outputs` need, in first-use order.
std::vector<LoweredArgument> infer_arguments(const std::vector<FuncPtr>& outputs);

// Loops and producers as indented text, for Func::print_loop_nest.
std::string loop_nest_text(const std::vector<FuncPtr>& outputs);

// Names of the passes in order.
std::vector<std::string> pass_names();

}  // namespace retrograde::lower
