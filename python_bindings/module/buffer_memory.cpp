// buffer_memory.cpp -- reads the memory of arrays and wraps it in Buffers; see buffer_memory.h.
#include "buffer_memory.h"

#include <algorithm>
#include <climits>
#include <cstdlib>

#include "casters.h"
#include "diagnostics/error.h"

namespace retrograde::python {

namespace {

using frontend::BufferContents;

// A deleter that destroys the contents, then releases the owner of the memory; works on any thread, with or without the
// GIL.
struct MemoryOwner {
  PyObject* owner;
  bool read_only;
  void operator()(BufferContents* contents) const {
    delete contents;
    if (!Py_IsInitialized()) return;
    const PyGILState_STATE state = PyGILState_Ensure();
    Py_DECREF(owner);
    PyGILState_Release(state);
  }
};

Buffer<> owned(Runtime::Buffer<> buffer, const std::string& name, PyObject* owner, bool read_only) {
  auto* contents = new BufferContents(std::move(buffer), name);
  Py_INCREF(owner);
  return Buffer<>(std::shared_ptr<BufferContents>(contents, MemoryOwner{owner, read_only}));
}

[[noreturn]] void refuse(const std::string& rule, const std::string& evidence,
                         const std::string& instead) {
  user_error("use the memory of an array as a Buffer", rule, evidence, instead);
}

// The type of a format of Python's module struct, given the size of an element.
std::optional<Type> type_of_format(std::string format, int64_t bytes) {
  if (!format.empty() && std::string("@=<").find(format[0]) != std::string::npos)
    format.erase(0, 1);
  if (format.size() != 1) return {};
  const int bits = static_cast<int>(8 * bytes);
  const auto is_one_of = [&](const char* codes) {
    return std::string(codes).find(format) != std::string::npos;
  };
  if (format == "?") return Bool();
  if (is_one_of("bhilqn")) return Int(bits);
  if (is_one_of("BHILQN")) return UInt(bits);
  if (is_one_of("efd")) return Float(bits);
  return {};
}

std::optional<ArrayMemory> buffer_protocol_memory(py::handle object) {
  if (!PyObject_CheckBuffer(object.ptr())) return {};
  auto view = py::reinterpret_steal<py::object>(PyMemoryView_FromObject(object.ptr()));
  if (!view) {
    PyErr_Clear();  // the buffer protocol has no format for NumPy's own types; other protocols are tried next
    return {};
  }
  const Py_buffer& buffer = *PyMemoryView_GET_BUFFER(view.ptr());
  const std::string format = buffer.format ? buffer.format : "B";
  const std::optional<Type> type = type_of_format(format, buffer.itemsize);
  if (!type) {
    refuse("its elements are numbers in the order of bytes of this machine",
           "their format is " + quoted(format),
           "Convert the array, as with array.astype(numpy.float32)");
  }
  ArrayMemory memory{view, buffer.buf, *type, {}, {}, buffer.readonly != 0};
  memory.shape.assign(buffer.shape, buffer.shape + buffer.ndim);
  memory.strides_bytes.assign(buffer.strides, buffer.strides + buffer.ndim);
  return memory;
}

std::vector<int64_t> dense_strides(const std::vector<int64_t>& shape, int64_t bytes) {
  std::vector<int64_t> strides(shape.size());
  for (size_t i = shape.size(); i-- > 0; bytes *= std::max<int64_t>(shape[i], 1))
    strides[i] = bytes;
  return strides;
}

// Reads NumPy's array interface, version 3: https://numpy.org/doc/stable/reference/arrays.interface.html.
std::optional<ArrayMemory> array_interface_memory(py::handle object) {
  if (!py::hasattr(object, "__array_interface__")) return {};
  const py::dict facts = object.attr("__array_interface__");
  const auto type_text = facts["typestr"].cast<std::string>();
  const int64_t bytes = std::stoll(type_text.substr(2));
  const bool is_bfloat =
      py::hasattr(object, "dtype") && std::string(py::str(object.attr("dtype"))) == "bfloat16";
  std::optional<Type> type;
  const int bits = static_cast<int>(8 * bytes);
  switch (type_text[1]) {
    case 'b':
      type = Bool();
      break;
    case 'i':
      type = Int(bits);
      break;
    case 'u':
      type = UInt(bits);
      break;
    case 'f':
      type = Float(bits);
      break;
    default:
      if (is_bfloat) type = BFloat(16);
  }
  const bool has_memory = facts.contains("data") && py::isinstance<py::tuple>(facts["data"]);
  if (!type || type_text[0] == '>' || !has_memory) {
    refuse("its elements are numbers in the order of bytes of this machine",
           "their type is " + quoted(type_text),
           "Convert the array, as with array.astype(numpy.float32)");
  }
  const py::tuple data = facts["data"];
  ArrayMemory memory;
  memory.owner = py::reinterpret_borrow<py::object>(object);
  memory.data = reinterpret_cast<void*>(data[0].cast<uintptr_t>());
  memory.read_only = data[1].cast<bool>();
  memory.type = *type;
  memory.shape = facts["shape"].cast<std::vector<int64_t>>();
  const bool has_strides = facts.contains("strides") && !facts["strides"].is_none();
  memory.strides_bytes = has_strides ? facts["strides"].cast<std::vector<int64_t>>()
                                     : dense_strides(memory.shape, bytes);
  return memory;
}

int dimension_part(int64_t value, const char* what) {
  if (value > INT32_MAX || value < INT32_MIN) {
    refuse(std::string(what) + " fit int32", text("one is ", value), "Split the array");
  }
  return static_cast<int>(value);
}

}  // namespace

std::optional<ArrayMemory> array_memory(py::handle object) {
  if (PyBytes_Check(object.ptr()) || PyUnicode_Check(object.ptr())) return {};
  if (auto memory = buffer_protocol_memory(object)) return memory;
  if (auto memory = array_interface_memory(object)) return memory;
  return dlpack_memory(object);
}

Buffer<> buffer_of(const ArrayMemory& memory, const std::string& name) {
  const int64_t bytes = memory.type.bytes();
  std::vector<halide_dimension_t> shape;
  for (size_t axis = memory.shape.size(); axis-- > 0;) {
    if (memory.shape[axis] > 1 && memory.strides_bytes[axis] % bytes != 0) {
      refuse("its strides are whole elements",
             text("axis ", axis, " has a stride of ", memory.strides_bytes[axis],
                  " bytes, and an element has ", bytes),
             "Copy it first, as with array.copy()");
    }
    // The stride of an axis with at most one element is arbitrary; choose one that fits.
    const int64_t stride = memory.strides_bytes[axis] / bytes;
    const bool leads_nowhere = memory.shape[axis] <= 1 && std::abs(stride) > INT32_MAX;
    shape.emplace_back(0, dimension_part(memory.shape[axis], "extents"),
                       leads_nowhere ? 0 : dimension_part(stride, "strides"));
  }
  Runtime::Buffer<> buffer(to_halide_type(memory.type), memory.data, static_cast<int>(shape.size()),
                           shape.data());
  return owned(std::move(buffer), name, memory.owner.ptr(), memory.read_only);
}

std::optional<Buffer<>> buffer_from(py::handle object) {
  const std::optional<ArrayMemory> memory = array_memory(object);
  if (!memory) return {};
  return buffer_of(*memory);
}

Buffer<> with_owner_of(const Buffer<>& source, const Buffer<>& view) {
  const auto* owner = std::get_deleter<MemoryOwner>(source.contents());
  if (!owner) return view;
  return owned(view.contents()->buffer, "", owner->owner, owner->read_only);
}

bool is_read_only(const Buffer<>& buffer) {
  const auto* owner = buffer.defined() ? std::get_deleter<MemoryOwner>(buffer.contents()) : nullptr;
  return owner && owner->read_only;
}

void check_writable(const Buffer<>& buffer, const std::string& asked) {
  if (!is_read_only(buffer)) return;
  user_error(asked, "a Buffer around a read-only array is read only",
             "the array behind " + quoted(buffer.name()) + " says that it is",
             "Give it a copy of the array");
}

}  // namespace retrograde::python
