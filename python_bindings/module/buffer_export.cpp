// buffer_export.cpp -- exports Buffers through Python's buffer protocol.
//
// The slots are set here rather than by pybind11, because version 2.10 lets C++ exceptions escape from them.
#include <algorithm>
#include <memory>

#include "buffer_memory.h"
#include "casters.h"
#include "diagnostics/error.h"

namespace retrograde::python {

namespace {

// Data of one view of a Buffer. The runtime's handle keeps memory that the Buffer allocated alive; the view's `obj`
// keeps everything else alive.
struct View {
  Runtime::Buffer<> buffer;
  std::string format;
  std::vector<Py_ssize_t> shape, strides;
};

bool is_dense(const ArrayMemory& memory) {
  int64_t bytes = memory.type.bytes();
  for (size_t i = memory.shape.size(); i-- > 0; bytes *= memory.shape[i]) {
    if (memory.shape[i] > 1 && memory.strides_bytes[i] != bytes) return false;
  }
  return true;
}

// The reason why the view is impossible; empty if it is possible.
std::string refusal(const Buffer<>& buffer, const ArrayMemory& memory, int flags) {
  if (format_of(memory.type).empty()) {
    return "arrays of Python have no elements of type " + to_string(memory.type) +
           ": take Buffer.bits(), or DLPack";
  }
  if ((flags & PyBUF_WRITABLE) && is_read_only(buffer)) return "the Buffer is read only";
  if ((flags & PyBUF_STRIDES) != PyBUF_STRIDES && !is_dense(memory))
    return "the Buffer is not dense";
  if ((flags & PyBUF_F_CONTIGUOUS) == PyBUF_F_CONTIGUOUS && memory.shape.size() > 1) {
    return "the Buffer is not dense in the order of Fortran";
  }
  if ((flags & PyBUF_C_CONTIGUOUS) == PyBUF_C_CONTIGUOUS && !is_dense(memory)) {
    return "the Buffer is not dense";
  }
  return "";
}

void fill_view(Py_buffer* out, const Buffer<>& buffer, int flags) {
  const ArrayMemory memory = memory_of(buffer);
  if (const std::string why = refusal(buffer, memory, flags); !why.empty()) {
    throw py::buffer_error(why);
  }
  auto view = std::make_unique<View>();
  view->buffer = buffer.contents()->buffer;
  view->format = format_of(memory.type);
  view->shape.assign(memory.shape.begin(), memory.shape.end());
  view->strides.assign(memory.strides_bytes.begin(), memory.strides_bytes.end());
  out->buf = memory.data;
  out->itemsize = memory.type.bytes();
  out->len = out->itemsize;
  for (const Py_ssize_t extent : view->shape) out->len *= extent;
  out->readonly = is_read_only(buffer);
  out->ndim = static_cast<int>(view->shape.size());
  out->format = (flags & PyBUF_FORMAT) ? view->format.data() : nullptr;
  out->shape = (flags & PyBUF_ND) ? view->shape.data() : nullptr;
  out->strides = (flags & PyBUF_STRIDES) == PyBUF_STRIDES ? view->strides.data() : nullptr;
  out->suboffsets = nullptr;
  out->internal = view.release();
}

int get_buffer(PyObject* self, Py_buffer* out, int flags) {
  out->obj = nullptr;
  try {
    fill_view(out, py::handle(self).cast<const Buffer<>&>(), flags);
  } catch (py::error_already_set& error) {
    error.restore();
    return -1;
  } catch (const std::exception& error) {
    PyErr_SetString(PyExc_BufferError, error.what());
    return -1;
  }
  out->obj = self;
  Py_INCREF(self);
  return 0;
}

void release_buffer(PyObject*, Py_buffer* view) { delete static_cast<View*>(view->internal); }

}  // namespace

std::string format_of(Type type) {
  if (type.is_bool()) return "?";
  const int size = type.bits() == 8 ? 0 : type.bits() == 16 ? 1 : type.bits() == 32 ? 2 : 3;
  if (type.is_int()) return std::string(1, "bhiq"[size]);
  if (type.is_uint()) return std::string(1, "BHIQ"[size]);
  if (type.is_float() && !type.is_bfloat()) return std::string(1, " efd"[size]);
  return "";
}

namespace {

ArrayMemory memory_at(void* data, const Buffer<>& buffer) {
  ArrayMemory memory;
  memory.data = data;
  memory.type = buffer.type();
  memory.read_only = is_read_only(buffer);
  for (int d = buffer.dimensions(); d-- > 0;) {
    memory.shape.push_back(buffer.extent(d));
    memory.strides_bytes.push_back(static_cast<int64_t>(buffer.stride(d)) * memory.type.bytes());
  }
  return memory;
}

}  // namespace

ArrayMemory memory_of(const Buffer<>& buffer) {
  const ArrayMemory memory = memory_at(buffer.data(), buffer);
  if (!memory.data && buffer.number_of_elements() > 0) {
    user_error("take the elements of the Buffer " + quoted(buffer.name()), "it must have memory",
               "it has only a shape", "Call allocate() on it first");
  }
  return memory;
}

ArrayMemory device_memory_of(const Buffer<>& buffer) {
  if (buffer.host_dirty()) {
    user_error("take the device memory of the Buffer " + quoted(buffer.name()),
               "its newest elements must be there", "they are on the host",
               "Call copy_to_device() first");
  }
  return memory_at(reinterpret_cast<void*>(buffer.raw_buffer()->device), buffer);
}

void add_buffer_protocol(py::handle buffer_class) {
  auto* type = reinterpret_cast<PyHeapTypeObject*>(buffer_class.ptr());
  type->as_buffer.bf_getbuffer = get_buffer;
  type->as_buffer.bf_releasebuffer = release_buffer;
  type->ht_type.tp_as_buffer = &type->as_buffer;
}

}  // namespace retrograde::python
