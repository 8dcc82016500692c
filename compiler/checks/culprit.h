// culprit.h -- finds the operation of a definition that produced a value which is not finite.
#pragma once

#include <string>
#include <vector>

#include "frontend/language/func.h"

namespace retrograde::checks {

// The first such operation of value `value` of f at an element, in the order of evaluation, as text. The values are
// those of f's own precision. For updates the text includes the iteration. It is "what its updates make of finite
// values" if all operands are finite, and "an update" if the update cannot be analysed: loops without constant bounds,
// indices that are no variables, very many iterations. Otherwise empty.
std::string culprit(const Func& f, int value, const std::vector<int>& at);

}  // namespace retrograde::checks
