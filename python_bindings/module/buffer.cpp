// buffer.cpp -- binds Buffer: shapes, and conversions to and from arrays that share its memory.
#include <algorithm>

#include "bind_all.h"
#include "binding.h"
#include "buffer_class.h"
#include "buffer_memory.h"

namespace retrograde::python {

namespace {

template <class Change>
Buffer<> changed(const Buffer<>& buffer, Change change) {
  Buffer<> result = buffer.alias();
  change(result);
  return with_owner_of(buffer, result);
}

py::object shape(const Buffer<>& buffer) {
  py::list result;
  for (int d = buffer.dimensions(); d-- > 0;) result.append(buffer.extent(d));
  return py::tuple(result);
}

using Box = std::vector<std::pair<int, int>>;

// Changes of the shape that all handles see.
void bind_shapes(BufferClass& c) {
  c.def("crop", py::overload_cast<int, int, int>(&Buffer<>::crop), py::arg("dimension"),
        py::arg("min"), py::arg("extent"))
      .def("crop", py::overload_cast<const Box&>(&Buffer<>::crop), py::arg("box"))
      .def("slice", py::overload_cast<int, int>(&Buffer<>::slice), py::arg("dimension"),
           py::arg("position"))
      .def("slice", py::overload_cast<int>(&Buffer<>::slice), py::arg("dimension"))
      .def("embed", &Buffer<>::embed, py::arg("dimension"), py::arg("position") = 0)
      .def("translate", py::overload_cast<int, int>(&Buffer<>::translate), py::arg("dimension"),
           py::arg("delta"))
      .def("translate", py::overload_cast<const std::vector<int>&>(&Buffer<>::translate),
           py::arg("delta"))
      .def(
          "set_min", [](Buffer<>& b, const std::vector<int>& mins) { b.set_min(mins); },
          py::arg("mins"))
      .def("transpose", py::overload_cast<int, int>(&Buffer<>::transpose), py::arg("d1"),
           py::arg("d2"))
      .def("transpose", py::overload_cast<const std::vector<int>&>(&Buffer<>::transpose),
           py::arg("order"))
      .def("add_dimension", &Buffer<>::add_dimension)
      .def("allocate", &Buffer<>::allocate)
      .def("deallocate", &Buffer<>::deallocate)
      .def("reset", &Buffer<>::reset);
}

// New handles to the same memory.
void bind_views(BufferClass& c) {
  c.def(
       "cropped",
       [](const Buffer<>& b, int d, int min, int extent) {
         return changed(b, [&](Buffer<>& to) { to.crop(d, min, extent); });
       },
       py::arg("dimension"), py::arg("min"), py::arg("extent"))
      .def(
          "cropped",
          [](const Buffer<>& b, const Box& box) {
            return changed(b, [&](Buffer<>& to) { to.crop(box); });
          },
          py::arg("box"))
      .def(
          "sliced",
          [](const Buffer<>& b, int d, std::optional<int> position) {
            return changed(b, [&](Buffer<>& to) { to.slice(d, position.value_or(b.min(d))); });
          },
          py::arg("dimension"), py::arg("position") = py::none())
      .def(
          "embedded",
          [](const Buffer<>& b, int d, int position) {
            return changed(b, [&](Buffer<>& to) { to.embed(d, position); });
          },
          py::arg("dimension"), py::arg("position") = 0)
      .def(
          "translated",
          [](const Buffer<>& b, int d, int delta) {
            return changed(b, [&](Buffer<>& to) { to.translate(d, delta); });
          },
          py::arg("dimension"), py::arg("delta"))
      .def(
          "translated",
          [](const Buffer<>& b, const std::vector<int>& delta) {
            return changed(b, [&](Buffer<>& to) { to.translate(delta); });
          },
          py::arg("delta"))
      .def(
          "transposed",
          [](const Buffer<>& b, int d1, int d2) {
            return changed(b, [&](Buffer<>& to) { to.transpose(d1, d2); });
          },
          py::arg("d1"), py::arg("d2"))
      // A view with the dimensions in reverse order.
      .def("reverse_axes",
           [](const Buffer<>& b) {
             return changed(b, [](Buffer<>& to) {
               std::vector<int> order;
               for (int d = to.dimensions(); d-- > 0;) order.push_back(d);
               to.transpose(order);
             });
           })
      .def("alias", [](const Buffer<>& b) { return changed(b, [](Buffer<>&) {}); });
}

void bind_facts(BufferClass& c) {
  c.def("defined", &Buffer<>::defined)
      .def("name", &Buffer<>::name)
      .def("set_name", &Buffer<>::set_name, py::arg("name"))
      .def(
          "same_as", [](const Buffer<>& a, const Buffer<>& b) { return a.same_as(b); },
          py::arg("other"))
      .def("type", &Buffer<>::type)
      .def("dimensions", &Buffer<>::dimensions)
      .def(
          "dim", [](const Buffer<>& b, int d) { return Runtime::Buffer<>::Dimension(b.dim(d)); },
          py::arg("dimension"))
      .def("min", &Buffer<>::min, py::arg("dimension"))
      .def("extent", &Buffer<>::extent, py::arg("dimension"))
      .def("stride", &Buffer<>::stride, py::arg("dimension"))
      .def("width", &Buffer<>::width)
      .def("height", &Buffer<>::height)
      .def("channels", &Buffer<>::channels)
      .def("left", &Buffer<>::left)
      .def("right", &Buffer<>::right)
      .def("top", &Buffer<>::top)
      .def("bottom", &Buffer<>::bottom)
      .def("number_of_elements", &Buffer<>::number_of_elements)
      .def("size_in_bytes", &Buffer<>::size_in_bytes)
      .def(
          "contains", [](const Buffer<>& b, const std::vector<int>& at) { return b.contains(at); },
          py::arg("at"))
      .def("is_read_only", &is_read_only)
      .def_property_readonly("shape", &shape)
      .def("host_dirty", &Buffer<>::host_dirty)
      .def("set_host_dirty", &Buffer<>::set_host_dirty, py::arg("dirty") = true)
      .def("device_dirty", &Buffer<>::device_dirty)
      .def("set_device_dirty", &Buffer<>::set_device_dirty, py::arg("dirty") = true)
      .def("has_device_allocation", &Buffer<>::has_device_allocation)
      .def("copy_to_host", [](Buffer<>& b) { return b.copy_to_host(); })
      // Extension modules accept this in place of an array; see compiler/aot/python_extension.h.
      .def("_get_raw_halide_buffer_t",
           [](Buffer<>& b) {
             return reinterpret_cast<uintptr_t>(b.defined() ? b.raw_buffer() : nullptr);
           })
      .def("device_sync", [](Buffer<>& b) { return b.device_sync(); })
      .def("device_free", [](Buffer<>& b) { return b.device_free(); })
      .def("copy_to_device", [](Buffer<>& b) { return b.copy_to_device(); });
}

// The memory as a dict of NumPy's array interface.
py::dict array_interface(const ArrayMemory& memory) {
  using namespace py::literals;
  if (format_of(memory.type).empty())
    throw py::attribute_error("no array of NumPy has elements of type " + to_string(memory.type));
  const char kind = memory.type.is_bool()   ? 'b'
                    : memory.type.is_int()  ? 'i'
                    : memory.type.is_uint() ? 'u'
                                            : 'f';
  return py::dict(
      "version"_a = 3, "shape"_a = py::tuple(py::cast(memory.shape)),
      "typestr"_a = text(memory.type.bytes() == 1 ? '|' : '<', kind, memory.type.bytes()),
      "data"_a = py::make_tuple(reinterpret_cast<uintptr_t>(memory.data), memory.read_only),
      "strides"_a = py::tuple(py::cast(memory.strides_bytes)));
}

void bind_arrays(BufferClass& c) {
  c.def(
       "__dlpack__",
       [](const Buffer<>& b, const py::object& stream, const py::object& max_version,
          const py::object& device, const py::object& copy) {
         if (!stream.is_none())
           throw py::buffer_error("the memory is the CPU's, which has no streams");
         const bool wants_other_device = !device.is_none() && !device.equal(py::make_tuple(1, 0));
         if (wants_other_device) throw py::buffer_error("the memory is the CPU's");
         const bool versioned =
             !max_version.is_none() && py::tuple(max_version)[0].cast<int>() >= 1;
         const bool copies = !copy.is_none() && copy.cast<bool>();
         return dlpack_capsule(copies ? b.copy() : b, versioned);
       },
       py::kw_only(), py::arg("stream") = py::none(), py::arg("max_version") = py::none(),
       py::arg("dl_device") = py::none(), py::arg("copy") = py::none())
      // Raises for elements that the buffer protocol cannot describe; NumPy would create an array of one object.
      .def("__array__",
           [](const Buffer<>& b, const py::args&, const py::kwargs&) -> py::object {
             throw py::type_error("no array of NumPy has elements of type " +
                                  to_string(memory_of(b).type) + ": see Buffer.bits()");
           })
      .def("__dlpack_device__", [](const Buffer<>&) { return py::make_tuple(1, 0); })
      .def_property_readonly("__array_interface__",
                             [](const Buffer<>& b) { return array_interface(memory_of(b)); })
      // Numba's protocol for device memory; a Buffer without device memory lacks the attribute.
      .def_property_readonly("__cuda_array_interface__", [](const Buffer<>& b) {
        if (!b.defined() || !b.has_device_allocation())
          throw py::attribute_error("the Buffer has no memory on a device: see copy_to_device()");
        py::dict interface = array_interface(device_memory_of(b));
        interface["stream"] = 1;  // the default stream: where copies and runs are queued
        return interface;
      });
}

// A Buffer on an array's memory. Dimension 0 is the last axis of the array, or the first one if `reverse_axes` is
// false.
Buffer<> buffer_over(const py::object& array, const std::string& name,
                     const std::optional<Type>& type, bool reverse_axes) {
  std::optional<ArrayMemory> memory = array_memory(array);
  if (!memory) throw py::type_error("a Buffer is made of an array, or of a type and sizes");
  if (type && type->bytes() == memory->type.bytes())
    memory->type = *type;
  else if (type)
    throw py::type_error("the elements of the array have another size than " + to_string(*type));
  if (!reverse_axes) {  // buffer_of reverses them
    std::ranges::reverse(memory->shape);
    std::ranges::reverse(memory->strides_bytes);
  }
  return buffer_of(*memory, name);
}

void bind_dimension(py::module_& m) {
  using Dimension = Runtime::Buffer<>::Dimension;
  py::class_<Dimension>(m, "BufferDimension")
      .def("min", &Dimension::min)
      .def("extent", &Dimension::extent)
      .def("max", &Dimension::max)
      .def("stride", &Dimension::stride);
}

}  // namespace

void bind_buffer(py::module_& m) {
  bind_dimension(m);
  BufferClass c(m, "Buffer", {}, py::buffer_protocol());
  c.def(py::init<>())
      .def(py::init([](const Buffer<>& other) { return other; }), py::arg("buffer"))
      .def(py::init(&buffer_over), py::arg("array"), py::arg("name") = "",
           py::arg("type") = py::none(), py::arg("reverse_axes") = true)
      .def(py::init([](const py::object& array, const std::string& name, bool reverse_axes) {
             return buffer_over(array, name, std::nullopt, reverse_axes);
           }),
           py::arg("array"), py::arg("name"), py::arg("reverse_axes"))
      .def(py::init<Type, const std::vector<int>&, const std::string&>(), py::arg("type"),
           py::arg("sizes"), py::arg("name") = "")
      .def(py::init<Type, const std::vector<int>&, const std::vector<int>&, const std::string&>(),
           py::arg("type"), py::arg("sizes"), py::arg("storage_order"), py::arg("name") = "")
      .def_static(
          "make_scalar",
          [](Type type, const std::string& name) { return Buffer<>::make_scalar(type, name); },
          py::arg("type"), py::arg("name") = "")
      .def_static(
          "make_interleaved",
          [](Type type, int width, int height, int channels, const std::string& name) {
            return Buffer<>::make_interleaved(type, width, height, channels, name);
          },
          py::arg("type"), py::arg("width"), py::arg("height"), py::arg("channels"),
          py::arg("name") = "")
      // A shape without memory, for a bounds query: a call writes the required region into it.
      .def_static(
          "make_bounds_query",
          [](Type type, const std::vector<int>& sizes, const std::string& name) {
            return Buffer<>(Runtime::Buffer<>(to_halide_type(type), nullptr, sizes), name);
          },
          py::arg("type"), py::arg("sizes"), py::arg("name") = "")
      .def_static(
          "make_with_shape_of",
          [](const Buffer<>& source, const std::string& name) {
            return Buffer<>::make_with_shape_of(source, name);
          },
          py::arg("source"), py::arg("name") = "");
  bind_facts(c);
  bind_shapes(c);
  bind_views(c);
  bind_buffer_elements(c);
  bind_arrays(c);
  add_buffer_protocol(c);
}

}  // namespace retrograde::python
