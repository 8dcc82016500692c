// fold_steps -- store only the steps of a loop over time that are still read.
#pragma once

#include <functional>
#include <string>

#include "ir/expr.h"

namespace retrograde::lower {

struct FoldStepsRules {
  // Whether the storage of the Func of that name belongs to its loops alone.
  std::function<bool(const std::string&)> may_fold;
  // Whether a loop is over a pure variable, so that its iterations are independent.
  std::function<bool(const For&)> is_pure;
};

Stmt fold_steps(const Stmt& s, const FoldStepsRules& rules);

}  // namespace retrograde::lower
