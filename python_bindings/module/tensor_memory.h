// tensor_memory.h -- tensors of PyTorch as buffers, by the methods that every version of it has: nothing here is
// compiled against PyTorch. Shorter than DLPack and than NumPy's arrays, and of every element type.
#pragma once

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>

#include "frontend/data/buffer.h"

namespace retrograde::python {

namespace py = pybind11;

// The memory of a tensor whose elements have this type, of the CPU, axes reversed (buffer_memory.h). The tensor must
// stay alive as long as it is used. A tensor without elements gets an address that nobody reads: without one it would
// ask for the region that is needed (see runtime/README.md).
// Requires: extents and strides fit int32 (CompileError).
Runtime::Buffer<> buffer_of_tensor(py::handle tensor, Type type);

// Advises huge pages for new memory of the CPU, from the first byte to the last: without, each page of a large
// result is a fault, and all of them take longer than what fills it.
void use_huge_pages(uintptr_t first, size_t bytes);

// The one element of a tensor without dimensions.
ir::Scalar scalar_of_tensor(py::handle tensor, Type type);

// The element type and the sizes of a tensor, as PyTorch says them.
struct TensorKind {
  py::object dtype;
  py::tuple sizes;
};
bool is_of(py::handle tensor, const TensorKind& kind);

}  // namespace retrograde::python
