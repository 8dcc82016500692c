// Which operation of a definition made a value that is not finite.
#pragma once

#include <string>
#include <vector>

#include "frontend/language/func.h"

namespace retrograde::checks {

// The first in the order of evaluation of value `value` of f at a place, as text; in f's own
// precision, or as it is. Of updates: with the iteration; "what its updates make of finite values"
// when all that they are given is finite; "an update" where that cannot be looked at: loops without
// constant bounds, places that are no variables, very many iterations. Otherwise empty.
std::string culprit(const Func& f, int value, const std::vector<int>& at);

}  // namespace retrograde::checks
