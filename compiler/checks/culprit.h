// culprit.h -- finds the operation of a definition that produced a value that is not finite.
#pragma once

#include <string>
#include <vector>

#include "frontend/language/func.h"

namespace retrograde::checks {

// The first operation, in evaluation order, that makes value `value` of f not finite at a point, as text;
// empty if there is none. It is evaluated in f's own precision. For updates it includes the iteration. The
// result is "what its updates make of finite values" if all operands are finite, and "an update" if the
// update cannot be examined: loops without constant bounds, coordinates that are not variables, or very many
// iterations.
std::string culprit(const Func& f, int value, const std::vector<int>& at);

}  // namespace retrograde::checks
