// names.h -- unique names of Funcs and parameters, and names of implicit variables.
#pragma once

#include <string>
#include <vector>

namespace retrograde::graph {

// `wanted` if no Func or parameter of this process has that name, else a fresh name that begins
// with it. Characters that a C identifier cannot hold become underscores.
std::string claim_name(const std::string& wanted);
// The same for names in the interface of compiled code: `wanted` itself unless a Func has it.
std::string claim_parameter_name(const std::string& wanted);

// Removes the numbers that make names unique: blur for blur$3, r.x for r$4.x.
std::string without_numbers(const std::string& name);

// A loop of one iteration around all other loops of a stage.
inline constexpr const char* outermost_loop = "__outermost";

// The placeholder "_", and the implicit variables that it expands to, one per dimension: "_0", "_1"
// ...
inline bool is_placeholder(const std::string& name) { return name == "_"; }
std::string implicit_name(int n);
std::vector<std::string> implicit_names(int count);
int implicit_index(const std::string& name);  // -1 when it is not implicit

}  // namespace retrograde::graph
