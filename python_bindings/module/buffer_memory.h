// buffer_memory.h -- memory of arrays as Buffers, and of Buffers as arrays, never copied.
//
// One rule at every boundary: a[y, x] == f[x, y]. Python's arrays name their innermost dimension last, Funcs and
// Buffers name it first, so the axes of an array are the dimensions of a Buffer in reverse.
//
// A Buffer keeps what owns its memory alive, and so do all Buffers that were made of it (cropped, sliced ...): the
// owner lives in the deleter of the contents that handles share.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>
#include <vector>

#include "frontend/data/buffer.h"

namespace retrograde::python {

namespace py = pybind11;

// The memory of an array as its owner describes it, axes in Python's order.
struct ArrayMemory {
  py::object owner;  // alive as long as the memory is
  void* data = nullptr;
  Type type;
  std::vector<int64_t> shape;
  std::vector<int64_t> strides_bytes;
  bool read_only = false;
};

// Of an object with the buffer protocol, DLPack or the array interface; nothing where it has none of them.
// CompileError where its elements or strides are none that a Buffer can have.
std::optional<ArrayMemory> array_memory(py::handle object);
Buffer<> buffer_of(const ArrayMemory& memory, const std::string& name = "");

// What `made` from `source` shares its memory, and so its owner.
Buffer<> with_owner_of(const Buffer<>& source, const Buffer<>& made);
bool is_read_only(const Buffer<>& buffer);
// CompileError where it is.
void check_writable(const Buffer<>& buffer, const std::string& asked);

// The elements of a buffer that has memory, axes in Python's order; the owner is empty.
ArrayMemory memory_of(const Buffer<>& buffer);
// The same of one that has memory on a device; CompileError where the host's is newer.
ArrayMemory device_memory_of(const Buffer<>& buffer);
std::string format_of(Type type);  // as module struct writes it; "" where it knows no such type

// dlpack.cpp
std::optional<ArrayMemory> dlpack_memory(py::handle object);
py::capsule dlpack_capsule(const Buffer<>& buffer, bool versioned);

void add_buffer_protocol(py::handle buffer_class);  // buffer_export.cpp

}  // namespace retrograde::python
