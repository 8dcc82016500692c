// check_accesses -- see the .cpp. Target::CheckedAccesses.
#pragma once

#include <vector>

#include "ir/lowered_function.h"

namespace retrograde::lower {

Stmt check_accesses(const Stmt& s, const std::vector<ir::LoweredArgument>& args);

}  // namespace retrograde::lower
