// Runs a function on a thread with a stack large enough for recursion along a long pipeline.
#pragma once

#include <functional>

namespace retrograde::oracle {

// Returns when f has; what f throws is thrown here.
void on_deep_stack(const std::function<void()>& f);

}  // namespace retrograde::oracle
