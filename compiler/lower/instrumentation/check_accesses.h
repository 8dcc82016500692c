// check_accesses -- check bounds of every load and store (Target::CheckedAccesses); described in the .cpp file.
#pragma once

#include <vector>

#include "ir/lowered_function.h"

namespace retrograde::lower {

Stmt check_accesses(const Stmt& s, const std::vector<ir::LoweredArgument>& args);

}  // namespace retrograde::lower
