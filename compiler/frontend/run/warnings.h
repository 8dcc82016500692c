// warnings.h -- warnings about pipelines that are legal but probably not intended: definitions that no result needs,
// unscheduled updates of a scheduled Func, vectorized loops of one iteration. Performance notes report what is slower
// than necessary: a gradient without a schedule, or kernels whose arrays are in local memory (known once compiled).
//
//   {
//     WarningScope scope([](const std::string& warning) { log(warning); });
//     f.realize({64});  // compiles f, which reports its warnings
//   }
// Outside of scopes, warnings go to the handler of the process, if a program has set one. Halide.h sets one that
// prints; set_warning_handler({}) silences it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "frontend/run/pipeline.h"

namespace retrograde {

// One message for each finding, producers before consumers. Compiles nothing.
std::vector<std::string> warnings_of(const Pipeline& pipeline);

// While a scope exists, each compilation on this thread sends its warnings to the scope's function once.
// Nested scopes: the innermost one receives them.
class WarningScope {
 public:
  // Opens a scope whose warnings go to `tell`.
  explicit WarningScope(std::function<void(const std::string&)> tell);
  ~WarningScope();
  WarningScope(const WarningScope&) = delete;
  WarningScope& operator=(const WarningScope&) = delete;

 private:
  std::function<void(const std::string&)> tell_, outer_;
};

// Receives a warning. Must be thread-safe.
using WarningHandler = std::function<void(const std::string&)>;
// Sets the handler for warnings outside of all scopes, on every thread, and returns the previous one. A null
// handler discards them.
WarningHandler set_warning_handler(WarningHandler handler);

namespace frontend {
// With a target, also reports what is slow on it.
std::vector<std::string> warnings_of(const std::vector<FuncPtr>& outputs, bool with_hidden = true,
                                     const Target& target = {});
// Sends warnings to the enclosing scope, if there is one.
void tell_warnings(const std::vector<FuncPtr>& outputs, const Target& target);
void tell_warning(const std::string& warning);
bool has_warning_scope();
// Warns the process's handler that the last definition of the Func hides the earlier ones, unless a scope
// will receive that warning when the Func is compiled.
void warn_of_hidden_definitions(const FuncContents& f);
}  // namespace frontend

}  // namespace retrograde
