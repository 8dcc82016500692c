// buffer_memory.h -- arrays as Buffers and Buffers as arrays, sharing memory without copies.
//
// One axis rule holds everywhere: a[y, x] == f[x, y]. Arrays list their innermost dimension last, Funcs and
// Buffers list it first, so the axes of an array are the dimensions of a Buffer in reverse.
//
// A Buffer keeps the owner of its memory alive, and so do all views of it (cropped, sliced, ...). The owner is held by
// the deleter of the contents that the handles share.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>
#include <vector>

#include "frontend/data/buffer.h"

namespace retrograde::python {

namespace py = pybind11;

// The memory of an array as its owner describes it, axes in Python's order.
struct ArrayMemory {
  py::object owner;  // keeps the memory alive
  void* data = nullptr;
  Type type;
  std::vector<int64_t> shape;
  std::vector<int64_t> strides_bytes;
  bool read_only = false;
};

// The memory of an object with the buffer protocol, DLPack or the array interface; nullopt for other objects. Throws
// CompileError if a Buffer cannot have its elements or strides.
std::optional<ArrayMemory> array_memory(py::handle object);
Buffer<> buffer_of(const ArrayMemory& memory, const std::string& name = "");

// Gives `view`, which shares the memory of `source`, the same owner.
Buffer<> with_owner_of(const Buffer<>& source, const Buffer<>& view);
bool is_read_only(const Buffer<>& buffer);
// Throws CompileError if the buffer is read-only.
void check_writable(const Buffer<>& buffer, const std::string& asked);

// The elements of a buffer that has memory, axes in Python's order; the owner is empty.
ArrayMemory memory_of(const Buffer<>& buffer);
// The device memory of a buffer. Throws CompileError if the host's elements are newer.
ArrayMemory device_memory_of(const Buffer<>& buffer);
std::string format_of(Type type);  // format of Python's module struct; "" if it has no such type

// dlpack.cpp
std::optional<ArrayMemory> dlpack_memory(py::handle object);
py::capsule dlpack_capsule(const Buffer<>& buffer, bool versioned);

void add_buffer_protocol(py::handle buffer_class);  // buffer_export.cpp

}  // namespace retrograde::python
