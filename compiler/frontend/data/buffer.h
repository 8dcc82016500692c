// buffer.h -- Buffer<T, Dims>: a shared handle to a Halide::Runtime::Buffer with a name, usable
// inside Exprs.
//
// After Buffer<float> in(640, 480), in(x, y) with ints is an element; with Exprs or Vars it is an Expr that loads
// the element. Copies of a handle share memory and shape, so cropping one handle crops them all; cropped() returns
// a handle with a shape of its own. Invalid sizes, undefined handles and mismatched types throw; nothing aborts.
#pragma once

#include <HalideBuffer.h>

#include <algorithm>
#include <concepts>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "frontend/data/buffer_contents.h"
#include "frontend/language/expr_ops.h"
#include "frontend/language/rdom.h"
#include "frontend/language/var.h"
#include "graph/function.h"
#include "ir/target.h"

// Adds half precision to the element types that HalideBuffer.h knows.
template <>
HALIDE_ALWAYS_INLINE constexpr halide_type_t halide_type_of<retrograde::float16_t>() {
  return halide_type_t(halide_type_float, 16);
}
// Adds bfloat16 to the element types that HalideBuffer.h knows.
template <>
HALIDE_ALWAYS_INLINE constexpr halide_type_t halide_type_of<retrograde::bfloat16_t>() {
  return halide_type_t(halide_type_bfloat, 16);
}

namespace retrograde {

// Compares a compiler type with a runtime type.
inline bool operator==(const Type& a, const halide_type_t& b) { return a == Type(b); }
// Compares a compiler type code with a runtime type code.
inline bool operator==(TypeCode a, halide_type_code_t b) { return a == Type(b, 8).code(); }
// Converts a compiler type to the runtime's representation.
halide_type_t to_halide_type(Type type);
// Converts a runtime type to the compiler's representation.
Type from_halide_type(halide_type_t type);

template <typename T = void, int Dims = Runtime::AnyDims>
class Buffer;

// A shared handle to an n-dimensional array with a name. T is the element type, or void if it is known only
// at run time; Dims is the number of dimensions, or AnyDims. Copies of a handle share memory and shape.
// Requires: the handle must have a buffer; an extent is not negative; its elements must fit the
// address space; its strides must fit 31 bits; its elements must fit the memory of this machine; a
// storage order names each dimension once; the element types must agree; the dimensions must agree.
template <typename T, int Dims>
class Buffer {
  static constexpr bool is_typed = !std::is_void_v<T>;
  using Bare = std::remove_const_t<T>;
  using VoidLikeT = std::conditional_t<std::is_const_v<T>, const void, void>;
  template <typename T2, int D2>
  friend class Buffer;

 public:
  using ElemType = T;                               // the element type
  using RuntimeBuffer = Runtime::Buffer<T>;         // the runtime's buffer class underneath
  static constexpr int AnyDims = Runtime::AnyDims;  // rank known at run time only
  // Whether T fixes the element type at compile time.
  static constexpr bool has_static_halide_type = !std::is_void_v<Bare>;
  // Whether Dims fixes the number of dimensions at compile time.
  static constexpr bool has_static_dimensions = Dims != AnyDims;
  // The element type that T fixes, as a runtime type.
  static constexpr halide_type_t static_halide_type() {
    return Runtime::Buffer<T>::static_halide_type();
  }
  // The number of dimensions that Dims fixes.
  static constexpr int static_dimensions() { return Dims; }

  // ---- construction ----
  Buffer() = default;  // an undefined handle
  // Another handle to the same buffer, perhaps with other static types.
  template <typename T2, int D2>
  Buffer(const Buffer<T2, D2>& other) : contents_(other.contents_) {
    static_assert(!std::is_const_v<T2> || std::is_const_v<T>, "a Buffer<const T> is no Buffer<T>");
    static_assert(std::is_void_v<Bare> || std::is_void_v<std::remove_const_t<T2>> ||
                      std::is_same_v<Bare, std::remove_const_t<T2>>,
                  "these Buffers have different element types");
    static_assert(Dims == AnyDims || D2 == AnyDims || Dims == D2,
                  "these Buffers have different dimensions");
    check_type();
  }
  // Wraps a runtime buffer and shares its memory.
  template <typename T2, int D2, int S2>
  Buffer(const Runtime::Buffer<T2, D2, S2>& buffer, const std::string& name = "")
      : Buffer(adopt(untyped(buffer), name)) {}
  // Wraps a runtime buffer struct; the caller keeps ownership of the memory.
  explicit Buffer(const halide_buffer_t& buffer, const std::string& name = "")
      : Buffer(adopt(Runtime::Buffer<>(buffer), name)) {}

  // Allocates dense memory: Buffer<float>(width, height) or Buffer<float>(width, height, "name").
  template <typename... Args>
  requires(frontend::AreSizes<Args...>::value &&
           !std::is_void_v<T>) explicit Buffer(int first, Args&&... rest) {
    const frontend::NamedSizes named(first, std::forward<Args>(rest)...);
    *this = adopt(frontend::allocate_buffer(static_halide_type(), named.sizes), named.name);
  }
  // Allocates dense memory for elements of a type that is known at run time.
  template <typename... Args>
  requires(frontend::AreSizes<Args...>::value) explicit Buffer(Type type, int first,
                                                               Args&&... rest) {
    const frontend::NamedSizes named(first, std::forward<Args>(rest)...);
    *this = adopt(frontend::allocate_buffer(to_halide_type(type), named.sizes), named.name);
  }
  // Allocates dense memory with one extent for each dimension.
  // Requires: an extent is not negative; its elements must fit the address space; its strides must fit
  // 31 bits; its elements must fit the memory of this machine.
  explicit Buffer(const std::vector<int>& sizes, const std::string& name = "")
      : Buffer(adopt(frontend::allocate_buffer(static_halide_type(), sizes), name)) {}
  explicit Buffer(Type type, const std::vector<int>& sizes, const std::string& name = "")
      : Buffer(adopt(frontend::allocate_buffer(to_halide_type(type), sizes), name)) {}
  // Allocates dense memory; `storage_order` lists the dimensions from innermost to outermost in memory.
  // Requires: a storage order names each dimension once.
  explicit Buffer(const std::vector<int>& sizes, const std::vector<int>& storage_order,
                  const std::string& name = "")
      : Buffer(adopt(frontend::allocate_buffer(static_halide_type(), sizes, storage_order), name)) {
  }
  explicit Buffer(Type type, const std::vector<int>& sizes, const std::vector<int>& storage_order,
                  const std::string& name = "")
      : Buffer(adopt(frontend::allocate_buffer(to_halide_type(type), sizes, storage_order), name)) {
  }

  // Wraps dense memory of the caller, which must outlive the Buffer.
  template <typename Array, size_t N>
  explicit Buffer(Array (&values)[N], const std::string& name = "")
      : Buffer(adopt(untyped(Runtime::Buffer<T>(values)), name)) {}
  template <typename... Args>
  requires(frontend::AreSizes<Args...>::value &&
           !std::is_void_v<T>) explicit Buffer(T* data, int first, Args&&... rest) {
    const frontend::NamedSizes named(first, std::forward<Args>(rest)...);
    *this = adopt(frontend::wrap_memory(static_halide_type(), data, named.sizes), named.name);
  }
  explicit Buffer(T* data, const std::vector<int>& sizes,
                  const std::string& name = "") requires(!std::is_void_v<T>)
      : Buffer(adopt(frontend::wrap_memory(static_halide_type(), data, sizes), name)) {}
  template <typename... Args>
  requires(frontend::AreSizes<Args...>::value) explicit Buffer(Type type, VoidLikeT* data,
                                                               int first, Args&&... rest) {
    const frontend::NamedSizes named(first, std::forward<Args>(rest)...);
    *this = adopt(frontend::wrap_memory(to_halide_type(type), data, named.sizes), named.name);
  }
  explicit Buffer(Type type, VoidLikeT* data, const std::vector<int>& sizes,
                  const std::string& name = "")
      : Buffer(adopt(frontend::wrap_memory(to_halide_type(type), data, sizes), name)) {}
  // Wraps memory with arbitrary strides: `shape` holds min, extent and stride of each dimension.
  explicit Buffer(T* data, int dimensions, const halide_dimension_t* shape,
                  const std::string& name = "") requires(!std::is_void_v<T>)
      : Buffer(adopt(
            Runtime::Buffer<>(static_halide_type(),
                              const_cast<void*>(static_cast<const void*>(data)), dimensions, shape),
            name)) {}
  explicit Buffer(Type type, VoidLikeT* data, int dimensions, const halide_dimension_t* shape,
                  const std::string& name = "")
      : Buffer(adopt(
            Runtime::Buffer<>(to_halide_type(type), const_cast<void*>(data), dimensions, shape),
            name)) {}

  // Another handle to an existing buffer.
  explicit Buffer(std::shared_ptr<frontend::BufferContents> contents)
      : contents_(std::move(contents)) {
    check_type();
  }

  // Allocates a Buffer of zero dimensions, which holds one element.
  static Buffer make_scalar(const std::string& name = "") {
    return adopt(frontend::allocate_buffer(static_halide_type(), {}), name);
  }
  static Buffer<> make_scalar(Type type, const std::string& name = "") {
    return Buffer<>(frontend::allocate_buffer(to_halide_type(type), {}), name);
  }
  static Buffer make_scalar(T* data, const std::string& name = "") requires(!std::is_void_v<T>) {
    return adopt(frontend::wrap_memory(static_halide_type(), data, {}), name);
  }
  // Allocates width x height x channels elements with the channels innermost in memory.
  static Buffer make_interleaved(int width, int height, int channels,
                                 const std::string& name = "") {
    return adopt(
        frontend::allocate_buffer(static_halide_type(), {width, height, channels}, {2, 0, 1}),
        name);
  }
  static Buffer<> make_interleaved(Type type, int width, int height, int channels,
                                   const std::string& name = "") {
    return Buffer<>(
        frontend::allocate_buffer(to_halide_type(type), {width, height, channels}, {2, 0, 1}),
        name);
  }
  static Buffer make_interleaved(T* data, int width, int height, int channels,
                                 const std::string& name = "") requires(!std::is_void_v<T>) {
    frontend::check_sizes(static_halide_type(), {width, height, channels},
                          "make an interleaved Buffer", {2, 0, 1});
    return adopt(untyped(Runtime::Buffer<T>::make_interleaved(data, width, height, channels)),
                 name);
  }
  // Allocates a Buffer with the mins, extents and storage order of `source`.
  template <typename T2, int D2>
  static Buffer make_with_shape_of(const Buffer<T2, D2>& source, const std::string& name = "") {
    halide_type_t type = source.runtime().type();
    if constexpr (!std::is_void_v<Bare>) type = static_halide_type();
    return adopt(frontend::allocate_like(source.runtime(), type, frontend::Layout::OfSource,
                                         "make a Buffer with the shape of another"),
                 name);
  }

  // ---- the handle ----
  bool defined() const { return contents_ != nullptr; }  // whether the handle has a buffer
  // The name that messages and generated code use.
  const std::string& name() const { return checked("name")->name; }
  // Renames the buffer for all handles.
  void set_name(const std::string& name) { checked("set_name")->name = name; }
  // Whether both handles refer to one buffer.
  template <typename T2, int D2>
  bool same_as(const Buffer<T2, D2>& other) const {
    return contents_ == other.contents_;
  }
  // The same buffer under other static types.
  // Requires: the element types must agree; the dimensions must agree.
  template <typename T2, int D2 = Dims>
  Buffer<T2, D2> as() const {
    Buffer<T2, D2> result;
    result.contents_ = contents_;
    result.check_type();
    return result;
  }
  // Whether the type and rank of `other` fit this class, so that a conversion would not throw.
  template <typename T2, int D2>
  static bool can_convert_from(const Buffer<T2, D2>& other) {
    if (!other.defined()) return false;
    return (std::is_void_v<Bare> || other.runtime().type() == static_halide_type()) &&
           (Dims == AnyDims || Dims == other.dimensions());
  }

  // The runtime's buffer underneath, not a copy.
  Runtime::Buffer<T>* get() { return &checked("get")->buffer.template as<T>(); }
  const Runtime::Buffer<T>* get() const { return &checked("get")->buffer.template as<T>(); }
  // The C struct underneath, as generated code receives it.
  halide_buffer_t* raw_buffer() { return checked("raw_buffer")->buffer.raw_buffer(); }
  const halide_buffer_t* raw_buffer() const { return checked("raw_buffer")->buffer.raw_buffer(); }
  // Passes the runtime's buffer to functions that expect one.
  operator Runtime::Buffer<T>&() { return *get(); }
  // Passes the runtime's buffer to functions that read one.
  operator const Runtime::Buffer<T>&() const { return *get(); }
  // The parameter that represents this buffer in Exprs.
  std::shared_ptr<graph::ParameterContents> parameter() const {
    checked("parameter");
    return frontend::BufferContents::parameter(contents_);
  }

  // ---- shape ----

  // The element type.
  Type type() const { return from_halide_type(runtime().type()); }
  int dimensions() const { return runtime().dimensions(); }  // the number of dimensions
  // Min, extent, max and stride of one dimension, as a runtime object.
  // Requires: a dimension is numbered from 0.
  auto dim(int i) const {
    check_dimension(i, "dim");
    return runtime().dim(i);
  }
  int min(int i) const { return dim(i).min(); }        // first coordinate of dimension i
  int extent(int i) const { return dim(i).extent(); }  // elements along dimension i
  int stride(int i) const { return dim(i).stride(); }  // distance in memory, in elements
  // Extent of dimension 0, or 1 if there is none.
  int width() const { return dimensions() > 0 ? extent(0) : 1; }
  // Extent of dimension 1, or 1 if there is none.
  int height() const { return dimensions() > 1 ? extent(1) : 1; }
  // Extent of dimension 2, or 1 if there is none.
  int channels() const { return dimensions() > 2 ? extent(2) : 1; }
  int left() const { return min(0); }          // first coordinate of dimension 0
  int right() const { return dim(0).max(); }   // last coordinate of dimension 0
  int top() const { return min(1); }           // first coordinate of dimension 1
  int bottom() const { return dim(1).max(); }  // last coordinate of dimension 1
  // Product of all extents.
  size_t number_of_elements() const { return runtime().number_of_elements(); }
  // Bytes from the first element to the last in memory, gaps between them included.
  size_t size_in_bytes() const { return runtime().size_in_bytes(); }
  // Whether a point lies inside the bounds.
  template <typename... Ints>
  bool contains(Ints... at) const {
    return runtime().contains(at...);
  }
  bool contains(const std::vector<int>& at) const { return runtime().contains(at); }
  T* begin() const { return get()->begin(); }  // lowest address of an element
  T* end() const { return get()->end(); }      // one past the highest address
  // Address of the element at the mins.
  T* data() const { return reinterpret_cast<T*>(raw_buffer()->host); }

  // ---- changes of the shape that all handles see; moving coordinates drops device memory ----

  // Restricts dimension d to [min, min + extent).
  // Requires: a dimension is numbered from 0; a crop or slice lies inside the buffer.
  void crop(int d, int min, int extent) {
    frontend::check_crop(runtime(), name(), d, min, extent);
    contents_->buffer.crop(d, min, extent);
  }
  // Restricts dimensions 0, 1, ... to a box of (min, extent) pairs.
  void crop(const std::vector<std::pair<int, int>>& box) {
    for (size_t d = 0; d < box.size(); d++) crop(static_cast<int>(d), box[d].first, box[d].second);
  }
  // Removes dimension d by fixing its coordinate at `position`.
  // Requires: a dimension is numbered from 0; a crop or slice lies inside the buffer.
  void slice(int d, int position) {
    frontend::check_crop(runtime(), name(), d, position, 1);
    contents_->buffer.slice(d, position);
  }
  // Removes dimension d by fixing its coordinate at the min.
  void slice(int d) { slice(d, min(d)); }
  // Inserts a dimension d of extent 1 with the coordinate `position`.
  // Requires: a new dimension is inserted before, between or after the existing ones; its strides must
  // fit 31 bits.
  void embed(int d, int position = 0) {
    frontend::check_embed(runtime(), name(), d);
    contents_->buffer.embed(d, position);
  }
  // Adds `delta` to the coordinates of dimension d.
  // Requires: a dimension is numbered from 0; coordinates must fit int32.
  void translate(int d, int delta) {
    check_dimension(d, "translate");
    frontend::check_coordinates(runtime(), name(), d, int64_t{min(d)} + delta);
    check_on_host("translate");
    contents_->buffer.translate(d, delta);
  }
  // Adds one offset to the coordinates of each dimension.
  void translate(const std::vector<int>& delta) {
    for (size_t d = 0; d < delta.size(); d++) translate(static_cast<int>(d), delta[d]);
  }
  // Moves the first coordinate of dimensions 0, 1, ... to `mins`.
  // Requires: a dimension is numbered from 0; coordinates must fit int32.
  template <typename... Ints>
  void set_min(Ints... mins) {
    set_min(std::vector<int>{mins...});
  }
  void set_min(const std::vector<int>& mins) {
    if (!mins.empty()) check_dimension(static_cast<int>(mins.size()) - 1, "set_min");
    for (size_t d = 0; d < mins.size(); d++)
      frontend::check_coordinates(runtime(), name(), static_cast<int>(d), mins[d]);
    check_on_host("set_min");
    contents_->buffer.set_min(mins);
  }
  // Swaps two dimensions without moving elements.
  // Requires: a dimension is numbered from 0.
  void transpose(int d1, int d2) {
    check_dimension(d1, "transpose");
    check_dimension(d2, "transpose");
    contents_->buffer.transpose(d1, d2);
  }
  // Reorders the dimensions without moving elements: dimension i becomes dimension order[i].
  // Requires: a storage order names each dimension once.
  void transpose(const std::vector<int>& order) {
    frontend::check_storage_order(order, dimensions(),
                                  "transpose the Buffer " + retrograde::quoted(name()));
    contents_->buffer.transpose(order);
  }
  // Appends an outermost dimension of extent 1.
  // Requires: its strides must fit 31 bits.
  void add_dimension() {
    frontend::check_new_dimension(runtime(),
                                  "add a dimension to the Buffer " + retrograde::quoted(name()));
    contents_->buffer.add_dimension();
  }
  // Allocates host memory for a Buffer that has a shape only.
  void allocate() { frontend::allocate_host(checked("allocate")->buffer); }
  // Frees the memory that this Buffer allocated and keeps the shape.
  void deallocate() { checked("deallocate")->buffer.deallocate(); }
  void reset() { contents_.reset(); }  // makes this handle undefined

  // ---- new handles to the same memory ----

  // A view restricted to [min, min + extent) in dimension d.
  Buffer cropped(int d, int min, int extent) const {
    Buffer result = alias();
    result.crop(d, min, extent);
    return result;
  }
  // A view restricted to a box of (min, extent) pairs.
  Buffer cropped(const std::vector<std::pair<int, int>>& box) const {
    Buffer result = alias();
    result.crop(box);
    return result;
  }
  // A view without dimension d, whose coordinate is fixed at `position`.
  Buffer<T> sliced(int d, int position) const {
    Buffer<T> result = alias();
    result.slice(d, position);
    return result;
  }
  // A view without dimension d, whose coordinate is fixed at the min.
  Buffer<T> sliced(int d) const { return sliced(d, min(d)); }
  // A view with an additional dimension d of extent 1.
  Buffer<T> embedded(int d, int position = 0) const {
    Buffer<T> result = alias();
    result.embed(d, position);
    return result;
  }
  // A view whose coordinates in dimension d are larger by `delta`.
  Buffer translated(int d, int delta) const {
    Buffer result = alias();
    result.translate(d, delta);
    return result;
  }
  // A view whose coordinates are larger by one offset for each dimension.
  Buffer translated(const std::vector<int>& delta) const {
    Buffer result = alias();
    result.translate(delta);
    return result;
  }
  // A view with two dimensions swapped.
  Buffer transposed(int d1, int d2) const {
    Buffer result = alias();
    result.transpose(d1, d2);
    return result;
  }
  // A view of all elements with a shape and a name of its own.
  Buffer alias() const { return adopt(Runtime::Buffer<>(runtime()), ""); }

  // ---- elements ----

  // Copies the elements to new memory with the same storage order.
  // Requires: its newest elements must be on the host (RuntimeError); the buffer must have memory; its
  // strides must fit 31 bits.
  Buffer<Bare, Dims> copy() const { return copied(frontend::Layout::OfSource, "copy"); }
  // Copies the elements to new memory with dimension 0 innermost.
  Buffer<Bare, Dims> copy_to_planar() const {
    return copied(frontend::Layout::Planar, "copy_to_planar");
  }
  // Copies the elements to new memory with dimension 2, the channels, innermost.
  // Requires: an interleaved Buffer has three dimensions.
  Buffer<Bare, Dims> copy_to_interleaved() const {
    return copied(frontend::Layout::Interleaved, "copy_to_interleaved");
  }
  // Overwrites the elements of this Buffer where its bounds overlap those of `source`.
  // Requires: both Buffers have the same type and number of dimensions.
  template <typename T2, int D2>
  void copy_from(const Buffer<T2, D2>& source) {
    if (runtime().type() != source.runtime().type() || dimensions() != source.dimensions()) {
      user_error(
          text("copy ", retrograde::quoted(source.name()), " into ", retrograde::quoted(name())),
          "both Buffers have the same type and number of dimensions",
          text("they have ", source.dimensions(), " dimensions of ", to_string(source.type()),
               " and ", dimensions(), " of ", to_string(type())),
          "Copy into a Buffer of the same type and dimensions");
    }
    check_on_host("copy_from");
    source.check_on_host("copy_from");
    get()->copy_from(*source.get());
  }
  // Sets every element to a value, or to the result of a function of its coordinates.
  template <typename ValueOrFn>
  Buffer& fill(ValueOrFn&& value) {
    check_on_host("fill");
    get()->fill(std::forward<ValueOrFn>(value));
    return *this;
  }
  // Whether every element equals `value`.
  template <typename V>
  bool all_equal(V value) const {
    check_on_host("all_equal");
    return get()->all_equal(static_cast<Bare>(value));
  }
  // Calls f(element of this, elements of the others at the same point...) for every point.
  // Requires: all Buffers have the same extents.
  template <typename Fn, typename... Others>
  Buffer& for_each_value(Fn&& f, Others... others) {
    check_on_host("for_each_value");
    (others.check_on_host("for_each_value"), ...);
    (frontend::check_same_shape(runtime(), name(), others.runtime()), ...);
    get()->for_each_value(std::forward<Fn>(f), (*others.get())...);
    return *this;
  }
  template <typename Fn, typename... Others>
  const Buffer& for_each_value(Fn&& f, Others... others) const {
    check_on_host("for_each_value");
    (others.check_on_host("for_each_value"), ...);
    (frontend::check_same_shape(runtime(), name(), others.runtime()), ...);
    get()->for_each_value(std::forward<Fn>(f), (*others.get())...);
    return *this;
  }
  // Calls f(x, y, ...) or f(const int* coordinates) for every point.
  template <typename Fn>
  Buffer& for_each_element(Fn&& f) {
    get()->for_each_element(std::forward<Fn>(f));
    return *this;
  }
  template <typename Fn>
  const Buffer& for_each_element(Fn&& f) const {
    get()->for_each_element(std::forward<Fn>(f));
    return *this;
  }

  // The element at a point. Coordinates are checked unless NDEBUG is set, as in Halide::Runtime::Buffer, but
  // a violation throws.
  // Requires: an access gives one coordinate for each dimension; the buffer must have memory; a
  // coordinate lies inside the buffer, or one past its end; its newest elements must be on the host
  // (RuntimeError).
  template <std::convertible_to<int>... Ints>
  decltype(auto) operator()(int first, Ints... rest) const {
    const int at[] = {first, static_cast<int>(rest)...};
    return element(at, 1 + static_cast<int>(sizeof...(rest)));
  }
  decltype(auto) operator()() const { return element(nullptr, 0); }
  decltype(auto) operator()(const int* at) const { return element(at, dimensions()); }

  // An Expr that loads the element at the given coordinates.
  template <std::convertible_to<Expr>... Args>
  Expr operator()(const Expr& first, Args&&... rest) const {
    checked("operator()");
    return frontend::buffer_access(contents_, {first, Expr(std::forward<Args>(rest))...});
  }
  Expr operator()(const std::vector<Expr>& args) const {
    checked("operator()");
    return frontend::buffer_access(contents_, args);
  }
  // The constraint excludes braced lists such as {x, 0}, whose elements are Exprs.
  template <std::same_as<Var> V>
  Expr operator()(const std::vector<V>& args) const {
    checked("operator()");
    return frontend::buffer_access(contents_, std::vector<Expr>(args.begin(), args.end()));
  }

  // ---- devices: copies of the elements on a GPU ----

  // Host and device each hold a copy of the elements. host_dirty means that the host's elements are newer than the
  // device's, device_dirty the opposite; a copy moves elements only if such a mark requires it.
  // Calls return 0. Failures throw RuntimeError with the runtime's message. If `user` has an error handler, it
  // receives the message instead, and the call returns the runtime's error code; other handlers are not called.

  // Copies the elements to the host if the device's are newer.
  int copy_to_host(JITUserContext* user = nullptr) {
    return on_device("copy_to_host", user).copy_to_host();
  }
  // Waits for pending work on the device memory of this Buffer.
  int device_sync(JITUserContext* user = nullptr) { return on_device("device_sync", user).sync(); }
  // Frees device memory that this Buffer allocated.
  // Requires: only memory that the Buffer allocated is freed (RuntimeError); no other Buffer may use its
  // device memory (RuntimeError).
  int device_free(JITUserContext* user = nullptr) { return on_device("device_free", user).free(); }
  // Forgets the device memory; elements that are newer there are lost.
  void device_deallocate() { frontend::leave_device(checked("device_deallocate")->buffer); }
  // Copies the elements to the device if the host's are newer; allocates device memory on the first call.
  // Requires: devices are CUDA's (Unsupported); a GPU must be named.
  int copy_to_device(const Target& target = Target(), JITUserContext* user = nullptr) {
    return copy_to_device(DeviceAPI::Default_GPU, target, user);
  }
  int copy_to_device(DeviceAPI device, const Target& target = Target(),
                     JITUserContext* user = nullptr) {
    return on_device("copy_to_device", user).copy_to_device(device, target);
  }
  // Allocates device memory unless the Buffer has some.
  int device_malloc(const Target& target = Target(), JITUserContext* user = nullptr) {
    return device_malloc(DeviceAPI::Default_GPU, target, user);
  }
  int device_malloc(DeviceAPI device, const Target& target = Target(),
                    JITUserContext* user = nullptr) {
    return on_device("device_malloc", user).allocate(device, target);
  }
  // Uses memory at the device address `handle`, which stays the caller's, as the Buffer's device memory.
  // Requires: a Buffer has one device memory at a time (RuntimeError).
  int device_wrap_native(DeviceAPI device, uint64_t handle, const Target& target = Target(),
                         JITUserContext* user = nullptr) {
    return on_device("device_wrap_native", user).wrap(device, handle, target);
  }
  // Stops using wrapped device memory without freeing it.
  // Requires: only memory that was wrapped is detached (RuntimeError).
  int device_detach_native(JITUserContext* user = nullptr) {
    return on_device("device_detach_native", user).detach();
  }
  // Whether the Buffer has device memory.
  bool has_device_allocation() const { return runtime().has_device_allocation(); }
  // Whether the device's elements are newer.
  bool device_dirty() const { return runtime().device_dirty(); }
  // Whether the host's elements are newer.
  bool host_dirty() const { return runtime().host_dirty(); }
  // Marks the host's elements as newer than the device's, or clears the mark.
  // Requires: its newest elements must be on the host (RuntimeError); its newest elements must not be on
  // the host alone (RuntimeError).
  void set_host_dirty(bool dirty = true) {
    if (dirty) on_device("set_host_dirty").check_not_newer_on_device();
    contents_->buffer.set_host_dirty(dirty);
  }
  // Marks the device's elements as newer than the host's, or clears the mark.
  void set_device_dirty(bool dirty = true) {
    if (dirty) on_device("set_device_dirty").check_not_newer_on_host();
    contents_->buffer.set_device_dirty(dirty);
  }

  const std::shared_ptr<frontend::BufferContents>& contents() const { return contents_; }

 private:
  std::shared_ptr<frontend::BufferContents> contents_;

  template <typename T2, int D2, int S2>
  static Runtime::Buffer<> untyped(Runtime::Buffer<T2, D2, S2> buffer) {
    // This class keeps track of const elements; the two types differ in nothing else.
    return Runtime::Buffer<>(
        reinterpret_cast<Runtime::Buffer<std::remove_const_t<T2>, D2, S2>&>(buffer));
  }
  static Buffer adopt(Runtime::Buffer<> buffer, const std::string& name) {
    Buffer result;
    result.contents_ = std::make_shared<frontend::BufferContents>(std::move(buffer), name);
    result.check_type();
    return result;
  }
  void check_type() const {
    if (!contents_) return;
    halide_type_t type{};
    if constexpr (!std::is_void_v<Bare>) type = static_halide_type();
    frontend::check_convertible(contents_->buffer, contents_->name, type, std::is_void_v<Bare>,
                                Dims);
  }
  const std::shared_ptr<frontend::BufferContents>& checked(const char* method) const {
    if (!contents_) frontend::undefined_buffer(method);
    return contents_;
  }
  void check_dimension(int d, const char* method) const {
    frontend::check_dimension(runtime(), name(), d, method);
  }
  const Runtime::Buffer<>& runtime() const { return checked("shape")->buffer; }
  frontend::DeviceCall on_device(const char* method, JITUserContext* user = nullptr) const {
    checked(method);
    return {contents_->buffer, contents_->name, method, user};
  }
  Buffer<Bare, Dims> copied(frontend::Layout layout, const char* method) const {
    check_on_host(method);
    return Buffer<Bare, Dims>(frontend::copy_of(
        runtime(), layout, text("call ", method, "() of the Buffer ", retrograde::quoted(name()))));
  }
  // For methods that access elements on the host, and for those that move coordinates, which drops device memory.
  void check_on_host(const char* method) const { on_device(method).check_not_newer_on_device(); }

  std::add_lvalue_reference_t<T> element(const int* at, int count) const
      requires(!std::is_void_v<T>) {
    halide_buffer_t& raw = *checked("operator()")->buffer.raw_buffer();
#ifndef NDEBUG
    frontend::check_in_bounds(contents_->buffer, contents_->name, at, count);
    if (raw.device_dirty()) check_on_host("operator()");
#endif
    // A caller may write through the reference. Testing the mark first avoids one store for each element.
    if constexpr (!std::is_const_v<T>) {
      if (!raw.host_dirty()) raw.set_host_dirty();
    }
    ptrdiff_t offset = 0;
    for (int d = 0; d < std::min(count, raw.dimensions); d++)
      offset += static_cast<ptrdiff_t>(raw.dim[d].stride) * (at[d] - raw.dim[d].min);
    return reinterpret_cast<T*>(raw.host)[offset];
  }
};

// One reduction variable for each dimension, over all coordinates of the buffer.
template <typename T, int Dims>
RDom::RDom(const Buffer<T, Dims>& buffer) {
  Region region;
  for (int d = 0; d < buffer.dimensions(); d++)
    region.push_back({Expr(buffer.min(d)), Expr(buffer.extent(d))});
  initialize(region, "");
}

}  // namespace retrograde
