// buffer_class.h -- the Python class Buffer, whose methods are bound in several files.
#pragma once

#include "binding.h"
#include "frontend/data/buffer.h"

namespace retrograde::python {

using BufferClass = Class<Buffer<>>;

void bind_buffer_elements(BufferClass& c);  // buffer_elements.cpp

}  // namespace retrograde::python
