// Runs a function on a thread with a large stack: the generator recurses along expressions, and
// sums of a hundred thousand terms are legal. Exceptions pass through.
#pragma once

#include <functional>

namespace retrograde::codegen {
void run_on_deep_stack(const std::function<void()>& body);
}
