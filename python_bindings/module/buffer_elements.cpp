// buffer_elements.cpp -- binds the elements of Buffers: reading, storing, filling, copying.
#include <pybind11/functional.h>

#include <cstring>

#include "binding.h"
#include "buffer_class.h"
#include "buffer_memory.h"
#include "numbers.h"

namespace retrograde::python {

namespace {

bool are_numbers(const py::tuple& index) {
  for (py::handle i : index) {
    if (!PyIndex_Check(i.ptr()) || py::isinstance<Expr>(i)) return false;
  }
  return true;
}

py::tuple as_tuple(const py::object& index) {
  return py::isinstance<py::tuple>(index) ? py::tuple(index) : py::make_tuple(index);
}

char* address_of(const Buffer<>& buffer, const int* at) {
  int64_t elems = 0;
  for (int d = 0; d < buffer.dimensions(); d++)
    elems += static_cast<int64_t>(at[d] - buffer.min(d)) * buffer.stride(d);
  return reinterpret_cast<char*>(buffer.raw_buffer()->host) + elems * buffer.type().bytes();
}

char* checked_address(const Buffer<>& buffer, const py::tuple& index) {
  std::vector<int> at;
  for (py::handle i : index) at.push_back(i.cast<int>());
  if (static_cast<int>(at.size()) != buffer.dimensions()) {
    user_error("access the Buffer " + quoted(buffer.name()),
               "an access gives one coordinate for each dimension",
               text("it has ", buffer.dimensions(), " dimensions and was given ", at.size(),
                    " coordinates"),
               "Give that many coordinates");
  }
  frontend::check_in_bounds(buffer.contents()->buffer, buffer.name(), at.data(),
                            static_cast<int>(at.size()));
  for (int d = 0; d < buffer.dimensions(); d++) {
    // C++ accepts one past the end, for pointers, but there is no element.
    if (at[d] >= buffer.min(d) + buffer.extent(d))
      throw py::index_error("the coordinate lies outside of the Buffer");
  }
  return address_of(buffer, at.data());
}

template <class T>
T read(const char* from) {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return value;
}

ir::Scalar load(Type type, const char* from) {
  const auto bits = [&]() -> uint64_t {
    switch (type.bytes()) {
      case 1:
        return read<uint8_t>(from);
      case 2:
        return read<uint16_t>(from);
      case 4:
        return read<uint32_t>(from);
      default:
        return read<uint64_t>(from);
    }
  };
  return type.is_uint()
             ? ir::Scalar::of_uint(type, bits())
             : ir::eval_reinterpret(type, ir::Scalar::of_uint(UInt(type.bits()), bits()));
}

void store(Type type, char* to, const ir::Scalar& value) {
  const uint64_t bits =
      type.is_float() ? ir::eval_reinterpret(UInt(type.bits()), value).u : value.u;
  std::memcpy(to, &bits, type.bytes());  // this machine is little-endian
}

// buffer[x, y]: an element if the coordinates are numbers, an Expr that loads it if they are Exprs.
py::object get_item(const Buffer<>& buffer, const py::object& index) {
  const py::tuple at = as_tuple(index);
  if (!are_numbers(at)) return py::cast(buffer(coordinates(index)));
  return object_of(load(buffer.type(), checked_address(buffer, at)));
}

void set_item(const Buffer<>& buffer, const py::object& index, const py::object& value) {
  check_writable(buffer, "store an element of the Buffer " + quoted(buffer.name()));
  char* const to = checked_address(buffer, as_tuple(index));
  store(buffer.type(), to, scalar_of(buffer.type(), value));
}

void fill(const Buffer<>& buffer, const py::object& value) {
  check_writable(buffer, "fill the Buffer " + quoted(buffer.name()));
  const Type type = buffer.type();
  const ir::Scalar scalar = scalar_of(type, value);
  buffer.get()->for_each_element(
      [&](const int* at) { store(type, address_of(buffer, at), scalar); });
}

bool all_equal(const Buffer<>& buffer, const py::object& value) {
  const ir::Scalar wanted = scalar_of(buffer.type(), value);
  bool equal = true;
  buffer.get()->for_each_element([&](const int* at) {
    const ir::Scalar element = load(buffer.type(), address_of(buffer, at));
    equal = equal && ir::eval_binary(ir::Kind::EQ, element, wanted).as_bool();
  });
  return equal;
}

Buffer<> bits_of(const Buffer<>& buffer) {
  Runtime::Buffer<> same = buffer.contents()->buffer;
  same.raw_buffer()->type = to_halide_type(UInt(8 * buffer.type().bytes()));
  return with_owner_of(buffer, Buffer<>(same));
}

std::string repr(const Buffer<>& b) {
  if (!b.defined()) return "<retrograde.Buffer, undefined>";
  std::string out = "<retrograde.Buffer " + quoted(b.name()) + " " + to_string(b.type());
  for (int d = 0; d < b.dimensions(); d++) {
    out += text(d == 0 ? " over " : " x ", "[", b.min(d), ", ", b.min(d) + b.extent(d), ")");
  }
  return out + ">";
}

}  // namespace

void bind_buffer_elements(BufferClass& c) {
  c.def("copy", [](const Buffer<>& b) { return b.copy(); })
      .def("copy_to_planar", [](const Buffer<>& b) { return b.copy_to_planar(); })
      .def("copy_to_interleaved", [](const Buffer<>& b) { return b.copy_to_interleaved(); })
      .def(
          "copy_from",
          [](Buffer<>& b, const Buffer<>& source) {
            check_writable(b, "copy into the Buffer " + quoted(b.name()));
            b.copy_from(source);
          },
          py::arg("source"))
      .def(
          "fill", [](const Buffer<>& b, const py::object& value) { return fill(b, value), b; },
          py::arg("value"))
      .def("all_equal", &all_equal, py::arg("value"))
      .def(
          "for_each_element",
          [](const Buffer<>& b, const py::function& f) {
            b.get()->for_each_element([&](const int* at) {
              py::tuple point(b.dimensions());
              for (int d = 0; d < b.dimensions(); d++) point[d] = at[d];
              f(*point);
            });
            return b;
          },
          py::arg("function"))
      .def("__getitem__", &get_item, py::arg("index"))
      .def("__setitem__", &set_item, py::arg("index"), py::arg("value"))
      .def("__call__", [](const Buffer<>& b, const py::args& index) { return get_item(b, index); })
      .def("bits", &bits_of)
      .def("__repr__", &repr);
}

}  // namespace retrograde::python
