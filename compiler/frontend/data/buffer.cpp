// buffer.cpp -- allocation and checks of Buffers, and the Exprs that load from them.
#include "frontend/data/buffer.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>

#include "ir/visit.h"

namespace retrograde {

halide_type_t to_halide_type(Type type) {
  const auto code = [&] {
    switch (type.code()) {
      case TypeCode::Int:
        return halide_type_int;
      case TypeCode::UInt:
        return halide_type_uint;
      case TypeCode::Float:
        return halide_type_float;
      case TypeCode::BFloat:
        return halide_type_bfloat;
      case TypeCode::Handle:
        return halide_type_handle;
    }
    internal_error("a type of unknown code");
  }();
  return halide_type_t(code, static_cast<uint8_t>(type.bits()),
                       static_cast<uint16_t>(type.lanes()));
}

Type::Type(const halide_type_t& type) : Type(from_halide_type(type)) {}
Type::Type(halide_type_code_t code, int bits, int lanes)
    : Type(from_halide_type(
          halide_type_t(code, static_cast<uint8_t>(bits), static_cast<uint16_t>(lanes)))) {}
Type::operator halide_type_t() const { return to_halide_type(*this); }

Type from_halide_type(halide_type_t type) {
  switch (type.code) {
    case halide_type_int:
      return Int(type.bits, type.lanes);
    case halide_type_uint:
      return UInt(type.bits, type.lanes);
    case halide_type_float:
      return Float(type.bits, type.lanes);
    case halide_type_bfloat:
      return BFloat(type.bits, type.lanes);
    default:
      return Handle(type.lanes);
  }
}

namespace frontend {

namespace {

std::string sizes_text(const std::vector<int>& sizes) {
  std::string out;
  for (int size : sizes) out += text(out.empty() ? "" : " x ", size);
  return out;
}

// Throws if there is no memory; the runtime's Buffer would write through a null pointer.
void* allocate_or_throw(size_t bytes) {
  void* block = std::malloc(bytes);
  if (!block) {
    user_error("allocate a Buffer", "its elements must fit the memory of this machine",
               text(bytes, " bytes were refused"), "Use a smaller Buffer");
  }
  return block;
}

}  // namespace

namespace {

// The stride of a dense dimension is the product of the inner extents, which HalideBuffer.h multiplies in 32 bits.
void check_strides(const std::vector<int>& sizes, const std::vector<int>& storage_order,
                   const std::string& asked) {
  int64_t stride = 1;
  for (size_t n = 0; n < sizes.size(); n++) {
    const size_t d = storage_order.empty() ? n : static_cast<size_t>(storage_order[n]);
    if (stride > INT32_MAX) {
      user_error(asked, "its strides must fit 31 bits",
                 text("the extents are ", sizes_text(sizes),
                      ", so that elements which are next to each other in "
                      "dimension ",
                      d, " lie ", stride, " elements apart"),
                 "Use several smaller Buffers, as tiles of the image");
    }
    stride *= sizes[d];
  }
}

}  // namespace

void check_sizes(halide_type_t type, const std::vector<int>& sizes, const std::string& asked,
                 const std::vector<int>& storage_order) {
  uint64_t bytes = type.bytes();
  for (int size : sizes) {
    if (size < 0) {
      user_error(asked, "an extent is not negative", text("the extents are ", sizes_text(sizes)),
                 "Give extents of at least 0");
    }
    if (__builtin_mul_overflow(bytes, static_cast<uint64_t>(size), &bytes) ||
        bytes > INT64_MAX / 2) {
      user_error(asked, "its elements must fit the address space",
                 text("the extents are ", sizes_text(sizes)), "Use a smaller Buffer");
    }
  }
  check_strides(sizes, storage_order, asked);
}

void check_coordinates(const Runtime::Buffer<>& buffer, const std::string& name, int d,
                       int64_t min) {
  const int64_t end = min + buffer.dim(d).extent();
  if (min >= INT32_MIN && end <= INT32_MAX) return;
  user_error(text("let dimension ", d, " of the Buffer ", quoted(name), " begin at ", min),
             "coordinates must fit int32", text("they would be [", min, ", ", end, ")"),
             "Give smaller coordinates");
}

Runtime::Buffer<> wrap_memory(halide_type_t type, const void* data, const std::vector<int>& sizes) {
  check_sizes(type, sizes, "make a Buffer around memory");
  return Runtime::Buffer<>(type, const_cast<void*>(data), sizes);
}

void allocate_host(Runtime::Buffer<>& buffer) { buffer.allocate(allocate_or_throw, std::free); }

void check_storage_order(const std::vector<int>& order, int dimensions, const std::string& asked) {
  std::vector<int> times_named(dimensions, 0);
  bool is_order = static_cast<int>(order.size()) == dimensions;
  for (int d : order) is_order = is_order && d >= 0 && d < dimensions && times_named[d]++ == 0;
  if (is_order) return;
  user_error(asked, "a storage order names each dimension once",
             text("there are ", dimensions, " dimensions"),
             "Name every dimension, in the order of storage");
}

Runtime::Buffer<> allocate_buffer(halide_type_t type, const std::vector<int>& sizes,
                                  const std::vector<int>& storage_order) {
  const std::string asked = "make a Buffer";
  if (storage_order.empty()) {
    check_sizes(type, sizes, asked);
    Runtime::Buffer<> buffer(type, nullptr, sizes);
    allocate_host(buffer);
    return buffer;
  }
  check_storage_order(storage_order, static_cast<int>(sizes.size()), asked);
  check_sizes(type, sizes, asked, storage_order);
  const std::vector<int> in_memory = mapped(storage_order, [&](int d) { return sizes[d]; });
  Runtime::Buffer<> buffer(type, nullptr, in_memory);
  buffer.transpose(storage_order);
  allocate_host(buffer);
  return buffer;
}

namespace {

// Dimensions from the smallest stride to the largest.
std::vector<int> order_in_memory(const Runtime::Buffer<>& buffer) {
  std::vector<int> order(static_cast<size_t>(buffer.dimensions()));
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return buffer.dim(a).stride() < buffer.dim(b).stride(); });
  return order;
}

}  // namespace

Runtime::Buffer<> allocate_like(const Runtime::Buffer<>& source, halide_type_t type, Layout layout,
                                const std::string& asked) {
  if (layout == Layout::Interleaved && source.dimensions() != 3) {
    user_error(asked, "an interleaved Buffer has three dimensions",
               text("it has ", source.dimensions()), "Slice or embed it first");
  }
  std::vector<int> sizes, mins, order;
  for (int d = 0; d < source.dimensions(); d++) {
    sizes.push_back(source.dim(d).extent());
    mins.push_back(source.dim(d).min());
  }
  if (layout == Layout::OfSource) order = order_in_memory(source);
  if (layout == Layout::Interleaved) order = {2, 0, 1};
  check_sizes(type, sizes, asked, order);
  Runtime::Buffer<> buffer = allocate_buffer(type, sizes, order);
  buffer.set_min(mins);
  return buffer;
}

Runtime::Buffer<> copy_of(const Runtime::Buffer<>& source, Layout layout,
                          const std::string& asked) {
  if (!source.data() && source.number_of_elements() > 0)
    user_error(asked, "the buffer must have memory", "it has only a shape", "Call allocate()");
  Runtime::Buffer<> copy = allocate_like(source, source.type(), layout, asked);
  copy.copy_from(source);
  return copy;
}

void check_new_dimension(const Runtime::Buffer<>& buffer, const std::string& asked) {
  const int last = buffer.dimensions() - 1;
  if (last < 0) return;
  const int64_t stride = int64_t{buffer.dim(last).extent()} * buffer.dim(last).stride();
  if (stride <= INT32_MAX && stride >= INT32_MIN) return;
  user_error(asked, "its strides must fit 31 bits",
             text("the stride of dimension ", last + 1, " would be ", stride),
             "Crop the Buffer first");
}

BufferContents::BufferContents(Runtime::Buffer<> buffer, const std::string& name)
    : buffer(std::move(buffer)), name(name.empty() ? unique_name("b") : claim_name(name)) {}

std::shared_ptr<ParameterContents> BufferContents::parameter(
    const std::shared_ptr<BufferContents>& contents) {
  std::lock_guard lock(contents->mutex_);
  if (auto existing = contents->parameter_.lock()) return existing;
  auto result = std::make_shared<ParameterContents>();
  result->name = contents->name;
  result->type = from_halide_type(contents->buffer.type());
  result->is_buffer = true;
  result->is_literal = true;
  result->dimensions = contents->buffer.dimensions();
  result->constraints.resize(result->dimensions);
  result->buffer_owner = contents;
  result->buffer = contents->buffer.raw_buffer();
  contents->parameter_ = result;
  return result;
}

void check_convertible(const Runtime::Buffer<>& buffer, const std::string& name, halide_type_t type,
                       bool any_type, int dimensions) {
  const std::string asked = text("use the Buffer ", quoted(name));
  if (!any_type && buffer.type() != type) {
    user_error(asked + " as a Buffer of " + to_string(from_halide_type(type)),
               "the element types must agree",
               "its elements are " + to_string(from_halide_type(buffer.type())),
               "Convert the elements first");
  }
  if (dimensions != Runtime::AnyDims && buffer.dimensions() != dimensions) {
    user_error(asked + text(" as a Buffer of ", dimensions, " dimensions"),
               "the dimensions must agree", text("it has ", buffer.dimensions()),
               "Slice or embed it first");
  }
}

void undefined_buffer(const char* method) {
  user_error(text("call ", method, "() of a Buffer"), "the handle must have a buffer",
             "it was never given one", "Construct the Buffer with sizes, or assign one");
}

void check_dimension(const Runtime::Buffer<>& buffer, const std::string& name, int d,
                     const char* method) {
  if (d >= 0 && d < buffer.dimensions()) return;
  user_error(text("call ", method, " for dimension ", d, " of the Buffer ", quoted(name)),
             "a dimension is numbered from 0", text("it has ", buffer.dimensions(), " dimensions"),
             "Give a number below that");
}

void check_embed(const Runtime::Buffer<>& buffer, const std::string& name, int d) {
  const std::string asked =
      text("embed the Buffer ", quoted(name), " as dimension ", d, " of another");
  if (d >= 0 && d <= buffer.dimensions()) return check_new_dimension(buffer, asked);
  user_error(asked, "a new dimension is inserted before, between or after the existing ones",
             text("it has ", buffer.dimensions(), " dimensions"),
             text("Give a number from 0 to ", buffer.dimensions()));
}

void check_same_shape(const Runtime::Buffer<>& buffer, const std::string& name,
                      const Runtime::Buffer<>& other) {
  bool is_same = buffer.dimensions() == other.dimensions();
  for (int d = 0; is_same && d < buffer.dimensions(); d++)
    is_same = buffer.dim(d).extent() == other.dim(d).extent();
  if (is_same) return;
  user_error("visit the values of the Buffer " + quoted(name) + " and of others",
             "all Buffers have the same extents", "one of them has other extents",
             "Crop them to one size first");
}

void check_crop(const Runtime::Buffer<>& buffer, const std::string& name, int d, int min,
                int extent) {
  check_dimension(buffer, name, d, "crop");
  const auto dim = buffer.dim(d);
  const int64_t end = int64_t{min} + extent, whole_end = int64_t{dim.min()} + dim.extent();
  if (extent >= 0 && min >= dim.min() && end <= whole_end) return;
  user_error(text("take [", min, ", ", end, ") of dimension ", d, " of the Buffer ", quoted(name)),
             "a crop or slice lies inside the buffer",
             text("it covers [", dim.min(), ", ", whole_end, ")"), "Clamp the region first");
}

void check_in_bounds(const Runtime::Buffer<>& buffer, const std::string& name, const int* at,
                     int count) {
  const auto place = [&] {
    std::string out;
    for (int d = 0; d < count; d++) out += text(d ? ", " : "", at[d]);
    return text("access (", out, ") of the Buffer ", quoted(name));
  };
  for (int d = buffer.dimensions(); d < count; d++) {
    if (at[d] == 0) continue;  // Halide programs write scalar(0)
    user_error(place(), "an access gives one coordinate for each dimension",
               text("it has ", buffer.dimensions(), " dimensions"), "Give that many coordinates");
  }
  if (!buffer.raw_buffer()->host)
    user_error(place(), "the buffer must have memory", "it has only a shape", "Call allocate()");
  for (int d = 0; d < std::min(count, buffer.dimensions()); d++) {
    const auto dim = buffer.dim(d);
    // One past the end is allowed: loops over pointers take its address.
    if (at[d] >= dim.min() && at[d] <= dim.max() + 1) continue;
    user_error(place(), "a coordinate lies inside the buffer, or one past its end",
               text("dimension ", d, " covers [", dim.min(), ", ", dim.max(), "]"),
               "Give a coordinate in this range");
  }
}

Expr buffer_access(const std::shared_ptr<BufferContents>& contents, const std::vector<Expr>& args) {
  const auto parameter = BufferContents::parameter(contents);
  std::vector<Expr> at =
      access_coordinates(args, parameter->dimensions, "the Buffer " + quoted(parameter->name));
  return call_image(parameter->name, parameter->type, std::move(at), SymbolRef(parameter));
}

}  // namespace frontend
}  // namespace retrograde
