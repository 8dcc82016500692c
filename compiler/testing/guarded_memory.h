// An allocator for Runnable::set_custom_allocator: behind the last byte of every block begins memory
// that may not be touched, so that the least access beyond it is a segmentation fault.
#pragma once

#include <cstddef>

namespace retrograde::fuzz {

// A block starts at a multiple of 8 bytes, as close to the forbidden page as that allows. Null when
// there is no memory. Both may be called from any thread.
void* allocate_guarded(void*, size_t bytes);
void free_guarded(void*, void* block);

}  // namespace retrograde::fuzz
