// Copies from one buffer to another, each in host or device memory.
#pragma once

#include "gpu/copies.h"
#include "gpu/residence.h"

namespace retrograde::runtime {

// Copies every element of `to` from the same coordinates of `from`. Allocates device memory for `to` if it needs some.
int32_t copy_buffer(const BufferCaller&, const halide_buffer_t* from, halide_buffer_t* to,
                    Place to_place);

}  // namespace retrograde::runtime
