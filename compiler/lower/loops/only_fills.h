// only_fills.h -- recognises statements that only fill local memory, and may be skipped if nothing reads it.
#pragma once

#include <string>
#include <unordered_set>

#include "ir/expr.h"

namespace retrograde::lower {

// Whether the statement does nothing except store to the allocations `own` and to its own allocations.
bool only_fills(const Stmt& s, std::unordered_set<std::string> own);

}  // namespace retrograde::lower
