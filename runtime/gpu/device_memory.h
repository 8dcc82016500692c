// The pool of device memory. Blocks come from the driver or the caller's allocator and are kept for later calls.
//
// Work on a stream runs after the call that issued it. A released block may therefore be reused at once only by work on
// the stream that used it, which runs in order. For any other stream, the device is waited for first. So the runtime
// tracks the streams that used each of its blocks. If several streams use one buffer, ordering them is the caller's
// responsibility, as everywhere in CUDA.
//
// A captured graph uses its memory whenever it is launched. So blocks allocated during a capture are reserved for this
// graph, until unused memory is given back to the driver.
#pragma once

#include "gpu/session.h"

namespace retrograde::runtime {

// Allocates at least `bytes`, on the session's device.
int32_t allocate_block(const Session&, size_t bytes, Address&);
// Returns a block that nothing has used yet to the pool.
void return_block(Address);

// Releases a block that allocate_block returned. Even on failure, the block no longer belongs to the caller.
int32_t release_block(const Request&, Address);

// The block that contains an address; null for memory that the caller wrapped.
const Block* find_live_block(const Devices&, Address);
// The context of that block, or null.
Context context_of_memory(Address);

// Records that work on the session's stream is about to use the memory at this address.
int32_t note_use(const Session&, Address);

int32_t wait_for_device(const Session&);
// Waits, before a copy, for work on other streams that uses this block.
int32_t wait_for_others(const Session&, Address);
// Opens a session by the caller's handlers. If the memory belongs to another context, opens the session in that one,
// after waiting for its work.
int32_t open_for_memory(Session&, Address);

// Gives unused blocks of the session's device back to the driver.
int32_t release_unused(const Session&);

}  // namespace retrograde::runtime
