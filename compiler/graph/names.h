// names.h -- names of Funcs and parameters, unique in the process; and of implicit variables.
#pragma once

#include <string>
#include <vector>

namespace retrograde::graph {

// `wanted` when no entity of this process has that name yet, else a fresh one that begins with it.
// Characters that a C identifier cannot hold become underscores.
std::string claim_name(const std::string& wanted);
// The same for names that callers of compiled code see: `wanted` itself unless a Func has it.
std::string claim_parameter_name(const std::string& wanted);

// Without the numbers that make names unique: blur for blur$3, r.x for r$4.x.
std::string without_numbers(const std::string& name);

// The loop of one iteration around all others of a stage.
inline constexpr const char* outermost_loop = "__outermost";

// The placeholder "_" and what it stands for, dimension by dimension: "_0", "_1" ...
inline bool is_placeholder(const std::string& name) { return name == "_"; }
std::string implicit_name(int n);
std::vector<std::string> implicit_names(int count);
int implicit_index(const std::string& name);  // -1: not implicit

}  // namespace retrograde::graph
