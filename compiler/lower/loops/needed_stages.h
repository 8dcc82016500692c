// needed_stages.h -- finds the conditions under which Funcs are needed, for skip_stages.
#pragma once

#include <map>
#include <string>

#include "ir/visit.h"

namespace retrograde::lower {

// Names of Funcs, each with the condition under which it is needed; Funcs that are always needed are left out.
using StageGuards = std::map<std::string, Expr>;

// `may_skip`: whether the Func of that name may be skipped where nothing reads it. The method is described in
// skip_stages.cpp.
StageGuards find_stage_guards(const Stmt& s, FunctionRef<bool(const std::string&)> may_skip);

}  // namespace retrograde::lower
