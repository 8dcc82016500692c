// guarded_memory.h -- an allocator for Runnable::set_custom_allocator that detects accesses beyond the end of a block.
//
// A protected page follows the last byte of every block, so the smallest access beyond it is a segmentation fault.
#pragma once

#include <cstddef>

namespace retrograde::fuzz {

// A block starts at a multiple of 8 bytes, as close to the protected page as that allows. Null if there is no memory.
// Both functions may be called from any thread.
void* allocate_guarded(void*, size_t bytes);
void free_guarded(void*, void* block);

}  // namespace retrograde::fuzz
