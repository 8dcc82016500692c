// Statements that need not run where nothing reads what they fill.
#pragma once

#include <string>
#include <unordered_set>

#include "ir/expr.h"

namespace retrograde::lower {

// Whether it does nothing but fill memory of the names, and of its own.
bool only_fills(const Stmt& s, std::unordered_set<std::string> own);

}  // namespace retrograde::lower
