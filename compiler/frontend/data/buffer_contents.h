// buffer_contents.h -- what all handles to one Buffer share, and the checks of its operations, independent
// of its static type.
#pragma once

#include <HalideBuffer.h>

#include <memory>
#include <mutex>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "frontend/data/devices.h"
#include "graph/function.h"
#include "ir/expr.h"

namespace retrograde::frontend {

// State that all handles to one buffer share.
struct BufferContents {
  BufferContents(Runtime::Buffer<> buffer, const std::string& name);
  ~BufferContents() { leave_device(buffer); }
  BufferContents(const BufferContents&) = delete;
  Runtime::Buffer<> buffer;
  std::string name;
  // The parameter that represents `contents` in Exprs, created on first use.
  static std::shared_ptr<ParameterContents> parameter(
      const std::shared_ptr<BufferContents>& contents);

 private:
  std::mutex mutex_;
  std::weak_ptr<ParameterContents> parameter_;
};

// Allocates a buffer. Throws CompileError if a size is negative or too large, or if memory runs out.
Runtime::Buffer<> allocate_buffer(halide_type_t type, const std::vector<int>& sizes,
                                  const std::vector<int>& storage_order = {});
// Describes dense memory that the caller owns.
Runtime::Buffer<> wrap_memory(halide_type_t type, const void* data, const std::vector<int>& sizes);
// Allocates host memory for a buffer that has a shape but no memory.
void allocate_host(Runtime::Buffer<>& buffer);
// `storage_order` lists the dimensions from innermost to outermost in memory; empty means 0, 1, 2, ...
void check_sizes(halide_type_t type, const std::vector<int>& sizes, const std::string& asked,
                 const std::vector<int>& storage_order = {});
// How a copy lies in memory; in all cases densely, with the mins and extents of its source.
enum class Layout { OfSource, Planar, Interleaved };
// Allocates dense memory with the extents and mins of `source`.
Runtime::Buffer<> allocate_like(const Runtime::Buffer<>& source, halide_type_t type, Layout layout,
                                const std::string& asked);
Runtime::Buffer<> copy_of(const Runtime::Buffer<>& source, Layout layout, const std::string& asked);
// Checks element type and rank; `any_type` and a `dimensions` of -1 accept everything.
void check_convertible(const Runtime::Buffer<>& buffer, const std::string& name, halide_type_t type,
                       bool any_type, int dimensions);
[[noreturn]] void undefined_buffer(const char* method);
void check_dimension(const Runtime::Buffer<>& buffer, const std::string& name, int d,
                     const char* method);
void check_storage_order(const std::vector<int>& order, int dimensions, const std::string& asked);
void check_embed(const Runtime::Buffer<>& buffer, const std::string& name, int d);
void check_new_dimension(const Runtime::Buffer<>& buffer, const std::string& asked);
// Checks that dimension `d` may begin at `min`.
void check_coordinates(const Runtime::Buffer<>& buffer, const std::string& name, int d,
                       int64_t min);
void check_same_shape(const Runtime::Buffer<>& buffer, const std::string& name,
                      const Runtime::Buffer<>& other);
void check_crop(const Runtime::Buffer<>& buffer, const std::string& name, int d, int min,
                int extent);
void check_in_bounds(const Runtime::Buffer<>& buffer, const std::string& name, const int* at,
                     int count);
Expr buffer_access(const std::shared_ptr<BufferContents>& contents, const std::vector<Expr>& args);

// Constructor arguments of the form (3, 4, "name"): sizes, then an optional name.
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

}  // namespace retrograde::frontend
