// large_stack.h -- runs deep recursions over programs without overflowing the caller's stack.
//
// A pipeline of a thousand stages nests its statements a few thousand deep, sums of a hundred
// thousand terms are legal, and every pass recurses over them. The call runs on a thread of its own
// with 1 GB of stack (address space; only the used depth is touched), and returns or throws like a
// direct call. Calls inside such a thread run directly. If the system refuses so large a stack,
// smaller ones are tried, and finally the caller's own.
#pragma once

#include <functional>

namespace retrograde {

void run_on_large_stack(const std::function<void()>& task);

}  // namespace retrograde
