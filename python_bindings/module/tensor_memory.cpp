// tensor_memory.cpp -- reads the memory of tensors through PyTorch's Python methods.
#include "tensor_memory.h"

#include <climits>
#include <cstring>

#include "casters.h"
#include "diagnostics/error.h"
#include "huge_pages.h"
#include "numbers.h"

namespace retrograde::python {

namespace {

// An interned attribute name, which the interpreter compares by address.
struct Name {
  explicit Name(const char* text) : object(PyUnicode_InternFromString(text)) {}
  PyObject* object;
};

py::object checked(PyObject* result) {
  if (!result) throw py::error_already_set();
  return py::reinterpret_steal<py::object>(result);
}

int part(PyObject* number, const char* what) {
  const long long value = PyLong_AsLongLong(number);
  if (value == -1 && PyErr_Occurred()) throw py::error_already_set();
  if (value > INT_MAX || value < INT_MIN) {
    user_error("use the memory of a tensor as a Buffer", std::string(what) + " fit int32",
               text("one is ", value), "Split the tensor");
  }
  return static_cast<int>(value);
}

alignas(64) char nothing[64];

void* address_of(py::handle tensor) {
  static const Name data_ptr("data_ptr");
  const py::object address = checked(PyObject_CallMethodNoArgs(tensor.ptr(), data_ptr.object));
  void* data = PyLong_AsVoidPtr(address.ptr());
  if (!data && PyErr_Occurred()) throw py::error_already_set();
  return data;
}

template <class T>
T element_at(const void* address) {
  T value;
  std::memcpy(&value, address, sizeof value);
  return value;
}

}  // namespace

Runtime::Buffer<> buffer_of_tensor(py::handle tensor, Type type) {
  static const Name shape("shape"), stride("stride");
  void* const data = address_of(tensor);
  const py::object sizes = checked(PyObject_GetAttr(tensor.ptr(), shape.object));
  const py::object strides = checked(PyObject_CallMethodNoArgs(tensor.ptr(), stride.object));
  const bool fits = PyTuple_Check(sizes.ptr()) && PyTuple_Check(strides.ptr()) &&
                    PyTuple_GET_SIZE(sizes.ptr()) == PyTuple_GET_SIZE(strides.ptr());
  if (!fits) throw py::type_error("the sizes and strides of a tensor are tuples of one length");
  const auto rank = static_cast<int>(PyTuple_GET_SIZE(sizes.ptr()));
  constexpr int most = 16;
  if (rank > most) {
    user_error("use the memory of a tensor as a Buffer",
               text("it has at most ", most, " dimensions"), text("it has ", rank),
               "Merge some, as with tensor.flatten()");
  }
  halide_dimension_t dimensions[most];
  for (int axis = 0; axis < rank; axis++) {
    const int extent = part(PyTuple_GET_ITEM(sizes.ptr(), axis), "extents");
    // The stride of an axis with at most one element is arbitrary.
    const int stride = extent > 1 ? part(PyTuple_GET_ITEM(strides.ptr(), axis), "strides") : 1;
    dimensions[rank - 1 - axis] = halide_dimension_t(0, extent, stride);
  }
  return Runtime::Buffer<>(to_halide_type(type), data ? data : nothing, rank, dimensions);
}

void use_huge_pages(uintptr_t first, size_t bytes) {
  runtime::advise_huge_pages(reinterpret_cast<void*>(first), bytes);
}

ir::Scalar scalar_of_tensor(py::handle tensor, Type type) {
  if (type == Float(32)) return ir::Scalar::of_float(type, element_at<float>(address_of(tensor)));
  if (type == Float(64)) return ir::Scalar::of_float(type, element_at<double>(address_of(tensor)));
  return scalar_of(type, tensor.attr("item")());
}

bool is_of(py::handle tensor, const TensorKind& kind) {
  static const Name dtype("dtype"), shape("shape");
  if (checked(PyObject_GetAttr(tensor.ptr(), dtype.object)).ptr() != kind.dtype.ptr()) return false;
  const py::object sizes = checked(PyObject_GetAttr(tensor.ptr(), shape.object));
  const int same = PyObject_RichCompareBool(sizes.ptr(), kind.sizes.ptr(), Py_EQ);
  if (same < 0) throw py::error_already_set();
  return same == 1;
}

}  // namespace retrograde::python
