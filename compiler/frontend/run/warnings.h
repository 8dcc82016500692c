// warnings.h -- what is legal in a pipeline but hardly meant: definitions that no result needs,
// updates without a schedule beside definitions that have one, loops that run once as vectors. And
// what is slower than it need be, as performance notes: a gradient that nobody scheduled; kernels whose
// arrays lie in local memory, which compiling alone finds.
//
//   {
//     WarningScope scope([](const std::string& warning) { log(warning); });
//     f.realize({64});  // compiles f: its warnings are told
//   }
// Nobody is told of them otherwise.
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

namespace frontend {
std::vector<std::string> warnings_of(const std::vector<FuncPtr>& outputs);
// To the scope around, if there is one.
void tell_warnings(const std::vector<FuncPtr>& outputs);
void tell_warning(const std::string& warning);
bool has_warning_scope();
}  // namespace frontend

}  // namespace retrograde
