// warnings.h -- what is legal in a pipeline but hardly meant: definitions that no result needs,
// updates without a schedule beside definitions that have one, loops that run once as vectors. And
// what is slower than it need be, as performance notes: a gradient that nobody scheduled; kernels whose
// arrays lie in local memory, which compiling alone finds.
//
//   {
//     WarningScope scope([](const std::string& warning) { log(warning); });
//     f.realize({64});  // compiles f: its warnings are told
//   }
// Without a scope, the handler of the process is told; there is none unless a program sets one.
// Halide.h sets one that prints; set_warning_handler({}) silences it.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "frontend/run/pipeline.h"

namespace retrograde {

// A message for each finding, producers before consumers. Nothing is compiled.
std::vector<std::string> warnings_of(const Pipeline& pipeline);

// While it lives, what this thread compiles tells its warnings to `tell`, once for a compilation.
// Of several scopes the innermost is told.
class WarningScope {
 public:
  explicit WarningScope(std::function<void(const std::string&)> tell);
  ~WarningScope();
  WarningScope(const WarningScope&) = delete;
  WarningScope& operator=(const WarningScope&) = delete;

 private:
  std::function<void(const std::string&)> tell_, outer_;
};

// What is told to nobody's scope, by any thread: the handler must bear that. A null one: nobody.
// The one before comes back.
using WarningHandler = std::function<void(const std::string&)>;
WarningHandler set_warning_handler(WarningHandler handler);

namespace frontend {
// With a target, also of what is slow on it.
std::vector<std::string> warnings_of(const std::vector<FuncPtr>& outputs, bool with_hidden = true,
                                     const Target& target = {});
// To the scope around, if there is one.
void tell_warnings(const std::vector<FuncPtr>& outputs, const Target& target);
void tell_warning(const std::string& warning);
bool has_warning_scope();
// Tells the handler of the process, unless a scope is told when the Func is compiled, that the last
// definition of the Func hides those before.
void warn_of_hidden_definitions(const FuncContents& f);
}  // namespace frontend

}  // namespace retrograde
