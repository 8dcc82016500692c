// buffer.h -- Buffer<T, Dims>: a shared handle to a Halide::Runtime::Buffer with a name, usable
// inside Exprs.
//
// Buffer<float> in(640, 480); in(x, y) with ints is an element, with Exprs or Vars it is an Expr
// that loads it. Copies share the memory and the shape: cropping one handle crops them all;
// cropped() makes a new handle. Sizes that cannot be, accesses through an undefined handle and
// mismatched types throw, they do not abort.
#pragma once

#include <HalideBuffer.h>

#include <algorithm>
#include <concepts>
#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "frontend/data/devices.h"
#include "frontend/language/expr_ops.h"
#include "frontend/language/rdom.h"
#include "frontend/language/var.h"
#include "graph/function.h"
#include "ir/target.h"

// Element types that HalideBuffer.h does not know.
template <>
HALIDE_ALWAYS_INLINE constexpr halide_type_t halide_type_of<retrograde::float16_t>() {
  return halide_type_t(halide_type_float, 16);
}
template <>
HALIDE_ALWAYS_INLINE constexpr halide_type_t halide_type_of<retrograde::bfloat16_t>() {
  return halide_type_t(halide_type_bfloat, 16);
}

namespace retrograde {

namespace Runtime = ::Halide::Runtime;

inline bool operator==(const Type& a, const halide_type_t& b) { return a == Type(b); }
inline bool operator==(TypeCode a, halide_type_code_t b) { return a == Type(b, 8).code(); }
halide_type_t to_halide_type(Type type);
Type from_halide_type(halide_type_t type);

template <typename T = void, int Dims = Runtime::AnyDims>
class Buffer;

namespace frontend {

// What all handles to one buffer share.
struct BufferContents {
  BufferContents(Runtime::Buffer<> buffer, const std::string& name);
  ~BufferContents() { leave_device(buffer); }
  BufferContents(const BufferContents&) = delete;
  Runtime::Buffer<> buffer;
  std::string name;
  // The parameter that stands for `contents` in Exprs, made on first use.
  static std::shared_ptr<ParameterContents> parameter(
      const std::shared_ptr<BufferContents>& contents);

 private:
  std::mutex mutex_;
  std::weak_ptr<ParameterContents> parameter_;
};

// A buffer with memory of its own. CompileError when the sizes are negative, too large or there is
// no memory.
Runtime::Buffer<> allocate_buffer(halide_type_t type, const std::vector<int>& sizes,
                                  const std::vector<int>& storage_order = {});
Runtime::Buffer<> wrap_memory(halide_type_t type, const void* data, const std::vector<int>& sizes);
// Memory for a buffer that has a shape and none.
void allocate_host(Runtime::Buffer<>& buffer);
// storage_order: dimensions, innermost in memory first; empty: as they are numbered.
void check_sizes(halide_type_t type, const std::vector<int>& sizes, const std::string& asked,
                 const std::vector<int>& storage_order = {});
// Dense memory for as many elements, which begin at the same coordinates.
enum class Layout { OfSource, Planar, Interleaved };
Runtime::Buffer<> allocate_like(const Runtime::Buffer<>& source, halide_type_t type, Layout layout,
                                const std::string& asked);
Runtime::Buffer<> copy_of(const Runtime::Buffer<>& source, Layout layout, const std::string& asked);
// A type or number of dimensions that does not fit; -1 and halide_type_t() stand for any.
void check_convertible(const Runtime::Buffer<>& buffer, const std::string& name, halide_type_t type,
                       bool any_type, int dimensions);
[[noreturn]] void undefined_buffer(const char* method);
void check_dimension(const Runtime::Buffer<>& buffer, const std::string& name, int d,
                     const char* method);
void check_storage_order(const std::vector<int>& order, int dimensions, const std::string& asked);
void check_embed(const Runtime::Buffer<>& buffer, const std::string& name, int d);
void check_new_dimension(const Runtime::Buffer<>& buffer, const std::string& asked);
// A dimension that is to begin at `min`.
void check_coordinates(const Runtime::Buffer<>& buffer, const std::string& name, int d,
                       int64_t min);
void check_same_shape(const Runtime::Buffer<>& buffer, const std::string& name,
                      const Runtime::Buffer<>& other);
void check_crop(const Runtime::Buffer<>& buffer, const std::string& name, int d, int min,
                int extent);
void check_in_bounds(const Runtime::Buffer<>& buffer, const std::string& name, const int* at,
                     int count);
Expr buffer_access(const std::shared_ptr<BufferContents>& contents, const std::vector<Expr>& args);

// Buffer(3, 4, "name"): sizes, then possibly a name.
struct NamedSizes {
  std::vector<int> sizes;
  std::string name;
  template <typename... Args>
  explicit NamedSizes(Args&&... args) {
    (add(std::forward<Args>(args)), ...);
  }
  void add(int size) { sizes.push_back(size); }
  void add(const std::string& last) { name = last; }
};
template <typename... Args>
struct AreSizes : std::true_type {};
template <typename Last>
struct AreSizes<Last> : std::bool_constant<std::is_convertible_v<Last, int> ||
                                           std::is_convertible_v<Last, std::string>> {};
template <typename First, typename Second, typename... Rest>
struct AreSizes<First, Second, Rest...>
    : std::bool_constant<std::is_convertible_v<First, int> && AreSizes<Second, Rest...>::value> {};

}  // namespace frontend

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
  using ElemType = T;
  using RuntimeBuffer = Runtime::Buffer<T>;
  static constexpr int AnyDims = Runtime::AnyDims;
  static constexpr bool has_static_halide_type = !std::is_void_v<Bare>;
  static constexpr bool has_static_dimensions = Dims != AnyDims;
  static constexpr halide_type_t static_halide_type() {
    return Runtime::Buffer<T>::static_halide_type();
  }
  static constexpr int static_dimensions() { return Dims; }

  // ---- making one ----
  Buffer() = default;
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
  template <typename T2, int D2, int S2>
  Buffer(const Runtime::Buffer<T2, D2, S2>& buffer, const std::string& name = "")
      : Buffer(adopt(untyped(buffer), name)) {}
  explicit Buffer(const halide_buffer_t& buffer, const std::string& name = "")
      : Buffer(adopt(Runtime::Buffer<>(buffer), name)) {}

  template <typename... Args>
  requires(frontend::AreSizes<Args...>::value &&
           !std::is_void_v<T>) explicit Buffer(int first, Args&&... rest) {
    const frontend::NamedSizes given(first, std::forward<Args>(rest)...);
    *this = adopt(frontend::allocate_buffer(static_halide_type(), given.sizes), given.name);
  }
  template <typename... Args>
  requires(frontend::AreSizes<Args...>::value) explicit Buffer(Type type, int first,
                                                               Args&&... rest) {
    const frontend::NamedSizes given(first, std::forward<Args>(rest)...);
    *this = adopt(frontend::allocate_buffer(to_halide_type(type), given.sizes), given.name);
  }
  // Requires: an extent is not negative; its elements must fit the address space; its strides must fit
  // 31 bits; its elements must fit the memory of this machine.
  explicit Buffer(const std::vector<int>& sizes, const std::string& name = "")
      : Buffer(adopt(frontend::allocate_buffer(static_halide_type(), sizes), name)) {}
  explicit Buffer(Type type, const std::vector<int>& sizes, const std::string& name = "")
      : Buffer(adopt(frontend::allocate_buffer(to_halide_type(type), sizes), name)) {}
  // storage_order: dimensions, innermost in memory first.
  // Requires: a storage order names each dimension once.
  explicit Buffer(const std::vector<int>& sizes, const std::vector<int>& storage_order,
                  const std::string& name = "")
      : Buffer(adopt(frontend::allocate_buffer(static_halide_type(), sizes, storage_order), name)) {
  }
  explicit Buffer(Type type, const std::vector<int>& sizes, const std::vector<int>& storage_order,
                  const std::string& name = "")
      : Buffer(adopt(frontend::allocate_buffer(to_halide_type(type), sizes, storage_order), name)) {
  }

  // Around memory of someone else, dense, which must live as long as the Buffer.
  template <typename Array, size_t N>
  explicit Buffer(Array (&values)[N], const std::string& name = "")
      : Buffer(adopt(untyped(Runtime::Buffer<T>(values)), name)) {}
  template <typename... Args>
  requires(frontend::AreSizes<Args...>::value &&
           !std::is_void_v<T>) explicit Buffer(T* data, int first, Args&&... rest) {
    const frontend::NamedSizes given(first, std::forward<Args>(rest)...);
    *this = adopt(frontend::wrap_memory(static_halide_type(), data, given.sizes), given.name);
  }
  explicit Buffer(T* data, const std::vector<int>& sizes,
                  const std::string& name = "") requires(!std::is_void_v<T>)
      : Buffer(adopt(frontend::wrap_memory(static_halide_type(), data, sizes), name)) {}
  template <typename... Args>
  requires(frontend::AreSizes<Args...>::value) explicit Buffer(Type type, VoidLikeT* data,
                                                               int first, Args&&... rest) {
    const frontend::NamedSizes given(first, std::forward<Args>(rest)...);
    *this = adopt(frontend::wrap_memory(to_halide_type(type), data, given.sizes), given.name);
  }
  explicit Buffer(Type type, VoidLikeT* data, const std::vector<int>& sizes,
                  const std::string& name = "")
      : Buffer(adopt(frontend::wrap_memory(to_halide_type(type), data, sizes), name)) {}
  // Any strides: `shape` holds min, extent and stride of each dimension.
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

  // Another handle to buffers that exist.
  explicit Buffer(std::shared_ptr<frontend::BufferContents> contents)
      : contents_(std::move(contents)) {
    check_type();
  }

  static Buffer make_scalar(const std::string& name = "") {
    return adopt(frontend::allocate_buffer(static_halide_type(), {}), name);
  }
  static Buffer<> make_scalar(Type type, const std::string& name = "") {
    return Buffer<>(frontend::allocate_buffer(to_halide_type(type), {}), name);
  }
  static Buffer make_scalar(T* data, const std::string& name = "") requires(!std::is_void_v<T>) {
    return adopt(frontend::wrap_memory(static_halide_type(), data, {}), name);
  }
  // Three dimensions, the last one (channels) innermost in memory.
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
  template <typename T2, int D2>
  static Buffer make_with_shape_of(const Buffer<T2, D2>& source, const std::string& name = "") {
    halide_type_t type = source.runtime().type();
    if constexpr (!std::is_void_v<Bare>) type = static_halide_type();
    return adopt(frontend::allocate_like(source.runtime(), type, frontend::Layout::OfSource,
                                         "make a Buffer with the shape of another"),
                 name);
  }

  // ---- the handle ----
  bool defined() const { return contents_ != nullptr; }
  const std::string& name() const { return checked("name")->name; }
  void set_name(const std::string& name) { checked("set_name")->name = name; }
  template <typename T2, int D2>
  bool same_as(const Buffer<T2, D2>& other) const {
    return contents_ == other.contents_;
  }
  // The same buffer under another static type.
  // Requires: the element types must agree; the dimensions must agree.
  template <typename T2, int D2 = Dims>
  Buffer<T2, D2> as() const {
    Buffer<T2, D2> result;
    result.contents_ = contents_;
    result.check_type();
    return result;
  }
  template <typename T2, int D2>
  static bool can_convert_from(const Buffer<T2, D2>& other) {
    if (!other.defined()) return false;
    return (std::is_void_v<Bare> || other.runtime().type() == static_halide_type()) &&
           (Dims == AnyDims || Dims == other.dimensions());
  }

  // The buffer of the runtime underneath, as it is: not a copy.
  Runtime::Buffer<T>* get() { return &checked("get")->buffer.template as<T>(); }
  const Runtime::Buffer<T>* get() const { return &checked("get")->buffer.template as<T>(); }
  halide_buffer_t* raw_buffer() { return checked("raw_buffer")->buffer.raw_buffer(); }
  const halide_buffer_t* raw_buffer() const { return checked("raw_buffer")->buffer.raw_buffer(); }
  operator Runtime::Buffer<T>&() { return *get(); }
  operator const Runtime::Buffer<T>&() const { return *get(); }
  std::shared_ptr<graph::ParameterContents> parameter() const {
    checked("parameter");
    return frontend::BufferContents::parameter(contents_);
  }

  // ---- shape ----
  Type type() const { return from_halide_type(runtime().type()); }
  int dimensions() const { return runtime().dimensions(); }
  // Requires: a dimension is numbered from 0.
  auto dim(int i) const {
    check_dimension(i, "dim");
    return runtime().dim(i);
  }
  int min(int i) const { return dim(i).min(); }
  int extent(int i) const { return dim(i).extent(); }
  int stride(int i) const { return dim(i).stride(); }
  int width() const { return dimensions() > 0 ? extent(0) : 1; }
  int height() const { return dimensions() > 1 ? extent(1) : 1; }
  int channels() const { return dimensions() > 2 ? extent(2) : 1; }
  int left() const { return min(0); }
  int right() const { return dim(0).max(); }
  int top() const { return min(1); }
  int bottom() const { return dim(1).max(); }
  size_t number_of_elements() const { return runtime().number_of_elements(); }
  size_t size_in_bytes() const { return runtime().size_in_bytes(); }
  template <typename... Ints>
  bool contains(Ints... at) const {
    return runtime().contains(at...);
  }
  bool contains(const std::vector<int>& at) const { return runtime().contains(at); }
  T* begin() const { return get()->begin(); }
  T* end() const { return get()->end(); }
  T* data() const { return reinterpret_cast<T*>(raw_buffer()->host); }

  // ---- changing the shape, for all handles ----
  // Requires: a dimension is numbered from 0; a crop or slice lies inside the buffer.
  void crop(int d, int min, int extent) {
    frontend::check_crop(runtime(), name(), d, min, extent);
    contents_->buffer.crop(d, min, extent);
  }
  void crop(const std::vector<std::pair<int, int>>& box) {
    for (size_t d = 0; d < box.size(); d++) crop(static_cast<int>(d), box[d].first, box[d].second);
  }
  // Requires: a dimension is numbered from 0; a crop or slice lies inside the buffer.
  void slice(int d, int position) {
    frontend::check_crop(runtime(), name(), d, position, 1);
    contents_->buffer.slice(d, position);
  }
  void slice(int d) { slice(d, min(d)); }
  // Requires: a new dimension stands before, between or behind those that are there; its strides must
  // fit 31 bits.
  void embed(int d, int position = 0) {
    frontend::check_embed(runtime(), name(), d);
    contents_->buffer.embed(d, position);
  }
  // Requires: a dimension is numbered from 0; coordinates must fit int32.
  void translate(int d, int delta) {
    check_dimension(d, "translate");
    frontend::check_coordinates(runtime(), name(), d, int64_t{min(d)} + delta);
    check_on_host("translate");
    contents_->buffer.translate(d, delta);
  }
  void translate(const std::vector<int>& delta) {
    for (size_t d = 0; d < delta.size(); d++) translate(static_cast<int>(d), delta[d]);
  }
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
  // Requires: a dimension is numbered from 0.
  void transpose(int d1, int d2) {
    check_dimension(d1, "transpose");
    check_dimension(d2, "transpose");
    contents_->buffer.transpose(d1, d2);
  }
  // Requires: a storage order names each dimension once.
  void transpose(const std::vector<int>& order) {
    frontend::check_storage_order(order, dimensions(),
                                  "transpose the Buffer " + retrograde::quoted(name()));
    contents_->buffer.transpose(order);
  }
  // Requires: its strides must fit 31 bits.
  void add_dimension() {
    frontend::check_new_dimension(runtime(),
                                  "add a dimension to the Buffer " + retrograde::quoted(name()));
    contents_->buffer.add_dimension();
  }
  void allocate() { frontend::allocate_host(checked("allocate")->buffer); }
  void deallocate() { checked("deallocate")->buffer.deallocate(); }
  void reset() { contents_.reset(); }

  // ---- new handles to the same memory ----
  Buffer cropped(int d, int min, int extent) const {
    Buffer result = alias();
    result.crop(d, min, extent);
    return result;
  }
  Buffer cropped(const std::vector<std::pair<int, int>>& box) const {
    Buffer result = alias();
    result.crop(box);
    return result;
  }
  Buffer<T> sliced(int d, int position) const {
    Buffer<T> result = alias();
    result.slice(d, position);
    return result;
  }
  Buffer<T> sliced(int d) const { return sliced(d, min(d)); }
  Buffer<T> embedded(int d, int position = 0) const {
    Buffer<T> result = alias();
    result.embed(d, position);
    return result;
  }
  Buffer translated(int d, int delta) const {
    Buffer result = alias();
    result.translate(d, delta);
    return result;
  }
  Buffer translated(const std::vector<int>& delta) const {
    Buffer result = alias();
    result.translate(delta);
    return result;
  }
  Buffer transposed(int d1, int d2) const {
    Buffer result = alias();
    result.transpose(d1, d2);
    return result;
  }
  Buffer alias() const { return adopt(Runtime::Buffer<>(runtime()), ""); }

  // ---- elements ----
  // New memory, same elements.
  // Requires: its newest elements must be on the host (RuntimeError); the buffer must have memory; its
  // strides must fit 31 bits.
  Buffer<Bare, Dims> copy() const { return copied(frontend::Layout::OfSource, "copy"); }
  Buffer<Bare, Dims> copy_to_planar() const {
    return copied(frontend::Layout::Planar, "copy_to_planar");
  }
  // Requires: an interleaved Buffer has three dimensions.
  Buffer<Bare, Dims> copy_to_interleaved() const {
    return copied(frontend::Layout::Interleaved, "copy_to_interleaved");
  }
  // Into this buffer, where the two overlap.
  // Requires: both Buffers have one type and as many dimensions.
  template <typename T2, int D2>
  void copy_from(const Buffer<T2, D2>& source) {
    if (runtime().type() != source.runtime().type() || dimensions() != source.dimensions()) {
      user_error(
          text("copy ", retrograde::quoted(source.name()), " into ", retrograde::quoted(name())),
          "both Buffers have one type and as many dimensions",
          text("they have ", source.dimensions(), " dimensions of ", to_string(source.type()),
               " and ", dimensions(), " of ", to_string(type())),
          "Copy into a Buffer of the same type and dimensions");
    }
    check_on_host("copy_from");
    source.check_on_host("copy_from");
    get()->copy_from(*source.get());
  }
  template <typename ValueOrFn>
  Buffer& fill(ValueOrFn&& value) {
    check_on_host("fill");
    get()->fill(std::forward<ValueOrFn>(value));
    return *this;
  }
  template <typename V>
  bool all_equal(V value) const {
    check_on_host("all_equal");
    return get()->all_equal(static_cast<Bare>(value));
  }
  // f(element of this, elements of the others at the same place...)
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
  // f(x, y, ...) or f(const int* at)
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

  // The element at a point. Checked unless NDEBUG is set, as Halide::Runtime::Buffer does, but by
  // an exception.
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

  // The load of an element, inside an Expr.
  template <std::convertible_to<Expr>... Args>
  Expr operator()(const Expr& first, Args&&... rest) const {
    checked("operator()");
    return frontend::buffer_access(contents_, {first, Expr(std::forward<Args>(rest))...});
  }
  Expr operator()(const std::vector<Expr>& args) const {
    checked("operator()");
    return frontend::buffer_access(contents_, args);
  }
  // Not of braces, whose elements are Exprs: {x, 0}.
  template <std::same_as<Var> V>
  Expr operator()(const std::vector<V>& args) const {
    checked("operator()");
    return frontend::buffer_access(contents_, std::vector<Expr>(args.begin(), args.end()));
  }

  // ---- devices: copies of the elements on a GPU ----
  // host_dirty: the host's elements are newer than the device's; device_dirty: the other way round. Copies
  // are made where they say so. Results are 0; what goes wrong is a RuntimeError with the runtime's
  // text, or goes to the error handler of the context, whose other handlers are not asked; then the
  // result is its code.
  int copy_to_host(JITUserContext* user = nullptr) {
    return on_device("copy_to_host", user).copy_to_host();
  }
  int device_sync(JITUserContext* user = nullptr) { return on_device("device_sync", user).sync(); }
  // Requires: only memory that the Buffer allocated is freed (RuntimeError); no other Buffer may use its
  // device memory (RuntimeError).
  int device_free(JITUserContext* user = nullptr) { return on_device("device_free", user).free(); }
  // As if the handle had never had device memory; what was newer there is lost.
  void device_deallocate() { frontend::leave_device(checked("device_deallocate")->buffer); }
  // Device memory comes with the first copy.
  // Requires: devices are CUDA's (Unsupported); a GPU must be named.
  int copy_to_device(const Target& target = Target(), JITUserContext* user = nullptr) {
    return copy_to_device(DeviceAPI::Default_GPU, target, user);
  }
  int copy_to_device(DeviceAPI device, const Target& target = Target(),
                     JITUserContext* user = nullptr) {
    return on_device("copy_to_device", user).copy_to_device(device, target);
  }
  // Memory on the device, unless there is some.
  int device_malloc(const Target& target = Target(), JITUserContext* user = nullptr) {
    return device_malloc(DeviceAPI::Default_GPU, target, user);
  }
  int device_malloc(DeviceAPI device, const Target& target = Target(),
                    JITUserContext* user = nullptr) {
    return on_device("device_malloc", user).allocate(device, target);
  }
  // The Buffer's device memory is what is at this device address, which stays the caller's.
  // Requires: a Buffer has one device memory at a time (RuntimeError).
  int device_wrap_native(DeviceAPI device, uint64_t handle, const Target& target = Target(),
                         JITUserContext* user = nullptr) {
    return on_device("device_wrap_native", user).wrap(device, handle, target);
  }
  // Requires: only memory that was wrapped is detached (RuntimeError).
  int device_detach_native(JITUserContext* user = nullptr) {
    return on_device("device_detach_native", user).detach();
  }
  bool has_device_allocation() const { return runtime().has_device_allocation(); }
  bool device_dirty() const { return runtime().device_dirty(); }
  bool host_dirty() const { return runtime().host_dirty(); }
  // Requires: its newest elements must be on the host (RuntimeError); its newest elements must not be on
  // the host alone (RuntimeError).
  void set_host_dirty(bool dirty = true) {
    if (dirty) on_device("set_host_dirty").check_not_newer_on_device();
    contents_->buffer.set_host_dirty(dirty);
  }
  void set_device_dirty(bool dirty = true) {
    if (dirty) on_device("set_device_dirty").check_not_newer_on_host();
    contents_->buffer.set_device_dirty(dirty);
  }

  const std::shared_ptr<frontend::BufferContents>& contents() const { return contents_; }

 private:
  std::shared_ptr<frontend::BufferContents> contents_;

  template <typename T2, int D2, int S2>
  static Runtime::Buffer<> untyped(Runtime::Buffer<T2, D2, S2> buffer) {
    // Constness of the elements is kept by this class; the two types differ in nothing else.
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
  // Of what reads or writes elements on the host, or moves coordinates, which drops device memory.
  void check_on_host(const char* method) const { on_device(method).check_not_newer_on_device(); }

  std::add_lvalue_reference_t<T> element(const int* at, int count) const
      requires(!std::is_void_v<T>) {
    halide_buffer_t& raw = *checked("operator()")->buffer.raw_buffer();
#ifndef NDEBUG
    frontend::check_in_bounds(contents_->buffer, contents_->name, at, count);
    if (raw.device_dirty()) check_on_host("operator()");
#endif
    // Who gets a reference may write. Looked at first: a store would be one for each element.
    if constexpr (!std::is_const_v<T>) {
      if (!raw.host_dirty()) raw.set_host_dirty();
    }
    ptrdiff_t offset = 0;
    for (int d = 0; d < std::min(count, raw.dimensions); d++)
      offset += static_cast<ptrdiff_t>(raw.dim[d].stride) * (at[d] - raw.dim[d].min);
    return reinterpret_cast<T*>(raw.host)[offset];
  }
};

template <typename T, int Dims>
RDom::RDom(const Buffer<T, Dims>& buffer) {
  Region region;
  for (int d = 0; d < buffer.dimensions(); d++)
    region.push_back({Expr(buffer.min(d)), Expr(buffer.extent(d))});
  initialize(region, "");
}

}  // namespace retrograde
