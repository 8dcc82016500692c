// Generates a C++17 header that describes the arguments of compiled functions as constants. Callers use it at compile
// time: for call wrappers, or checks by static_assert.
#pragma once

#include <string>
#include <vector>

#include "aot/header.h"

namespace retrograde::aot {

std::string function_info_text(const std::string& module_name, const Target& target,
                               const std::vector<DeclaredFunction>& functions);

}  // namespace retrograde::aot
