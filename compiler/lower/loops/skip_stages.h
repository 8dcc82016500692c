// skip_stages -- compute a Func only where something reads it.
#pragma once

#include <string>

#include "ir/visit.h"

namespace retrograde::lower {

// `may_skip`: whether the Func of that name may be skipped where nothing reads it.
Stmt skip_stages(const Stmt& s, FunctionRef<bool(const std::string&)> may_skip);

}  // namespace retrograde::lower
