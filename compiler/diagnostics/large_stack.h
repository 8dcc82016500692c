// large_stack.h -- runs deep recursions over programs without overflowing the caller's stack.
//
// Passes are recursive. A pipeline of a thousand stages nests its statements a few thousand deep, and sums of a hundred
// thousand terms are legal. So the task runs on a thread of its own with 1 GB of stack, which is address space that is
// touched only as deep as needed. Calls from inside such a thread run directly. If the system refuses so large a stack,
// smaller ones are tried, and last the caller's own.
#pragma once

#include <functional>

namespace retrograde {

// Runs the task on a thread with a large stack, and returns or throws as a direct call would.
void run_on_large_stack(const std::function<void()>& task);

}  // namespace retrograde
