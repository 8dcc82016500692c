// large_stack.h -- runs deep recursions over programs without overflowing the caller's stack.
//
// A pipeline of a thousand stages nests its statements a few thousand deep, and every pass recurses over them. The call
// runs on a thread of its own with a stack of 1 GB of address space (touched only as deep as needed) and returns or
// throws as a direct call would. Calls from inside such a thread run directly.
#pragma once

#include <functional>

namespace retrograde::ir {

void run_on_large_stack(const std::function<void()>& task);

}  // namespace retrograde::ir
