// Which operation of a definition made a value that is not finite.
#pragma once

#include <string>
#include <vector>

#include "frontend/func.h"

namespace retrograde::checks {

// The first in the order of evaluation of value `value` of f at a place, as text; in f's own
// precision, or as it is. Empty when f has updates, when all are finite, or when there are very
// many.
std::string culprit(const Func& f, int value, const std::vector<int>& at);

}  // namespace retrograde::checks
