// tensor_memory.h -- tensors of PyTorch as buffers. It calls Python methods that every version of PyTorch has, and is
// not compiled against PyTorch. This is faster than DLPack or NumPy's arrays, and covers every element type.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>

#include "frontend/data/buffer.h"

namespace retrograde::python {

namespace py = pybind11;

// The memory of a CPU tensor with elements of this type, axes reversed (buffer_memory.h). The tensor must outlive the
// buffer. A tensor without elements gets a dummy address, since a null address would make the call a bounds query.
// Requires: extents and strides fit int32 (CompileError).
Runtime::Buffer<> buffer_of_tensor(py::handle tensor, Type type);

// Advises huge pages for new CPU memory. Otherwise the page faults of a large result take longer than computing it.
void use_huge_pages(uintptr_t first, size_t bytes);

// The one element of a tensor without dimensions.
ir::Scalar scalar_of_tensor(py::handle tensor, Type type);

// The element type and the sizes of a tensor, as PyTorch objects.
struct TensorKind {
  py::object dtype;
  py::tuple sizes;
};
bool is_of(py::handle tensor, const TensorKind& kind);

}  // namespace retrograde::python
