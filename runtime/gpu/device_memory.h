// Device memory: from the driver or the caller's allocator, and kept for the next call.
//
// Work on a stream runs later than it was asked for. A block that is released may therefore be given
// again at once only to work on the stream that used it, which runs in order; for any other stream the
// device is waited for first. So the runtime knows the streams that used each of its blocks. The order
// of several streams that work on one buffer is the caller's affair, as everywhere in CUDA.
//
// A graph that was captured uses its memory whenever it is launched: blocks that a capture took are for
// this graph alone, until the unused memory is given back to the driver.
#pragma once

#include "gpu/session.h"

namespace retrograde::runtime {

// At least `bytes`, on the session's device.
int32_t allocate_block(const Session&, size_t bytes, Address&);
// Puts a block that nothing has used yet back.
void return_block(Address);

// Ends the life of a block that allocate_block gave: even where the code is not 0, it is no longer the
// caller's.
int32_t release_block(const Request&, Address);

// The block that holds an address, or null: memory that the caller wrapped.
const Block* find_live_block(const Devices&, Address);
// The context of that block, or null.
Context context_of_memory(Address);

// Says that work on the session's stream is about to use what lies at this address.
int32_t note_use(const Session&, Address);

int32_t wait_for_device(const Session&);
// Before a copy: work of other streams than the session's that uses this block is over.
int32_t wait_for_others(const Session&, Address);
// Opens a session by the caller's handlers; where the memory is of another context than theirs, in
// that one, when its work is over.
int32_t open_for_memory(Session&, Address);

// Gives unused blocks of the session's device back to the driver.
int32_t release_unused(const Session&);

}  // namespace retrograde::runtime
