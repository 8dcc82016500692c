// A buffer between protected pages, which turns an out-of-bounds access into a crash.
#pragma once

#include <HalideRuntime.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstring>
#include <new>

#include "ir/scalar.h"

namespace retrograde::testing_codegen {

using namespace ir;

// A one-dimensional buffer that lies directly before or directly after a protected page: an access outside of it is a
// crash.
class Array {
 public:
  enum class Guard { Above, Below };
  Array(Type type, size_t count, Guard guard = Guard::Above) : type_(type) {
    const auto page = static_cast<size_t>(sysconf(_SC_PAGESIZE));
    const size_t bytes = count * static_cast<size_t>(type.bytes()),
                 pages = (bytes + page - 1) / page * page;
    mapped_ = pages + page;
    void* memory = mmap(nullptr, mapped_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    memory_ = static_cast<uint8_t*>(memory);
    uint8_t* first = guard == Guard::Above ? memory_ : memory_ + page;
    mprotect(first, pages, PROT_READ | PROT_WRITE);
    bytes_ = guard == Guard::Above ? memory_ + pages - bytes : first;
    dimension_ = halide_dimension_t(0, static_cast<int32_t>(count), 1);
    buffer_.host = bytes_;
    buffer_.type = halide_type_t(static_cast<halide_type_code_t>(type.code()),
                                 static_cast<uint8_t>(type.bits()));
    buffer_.dimensions = 1;
    buffer_.dim = &dimension_;
  }
  ~Array() { munmap(memory_, mapped_); }
  Array(const Array&) = delete;
  template <typename T>
  T* data() {
    return reinterpret_cast<T*>(bytes_);
  }
  size_t size() const { return static_cast<size_t>(dimension_.extent); }
  Type type() const { return type_; }
  halide_buffer_t* raw() { return &buffer_; }

  Scalar get(size_t i) const {
    uint64_t pattern = 0;
    std::memcpy(&pattern, bytes_ + i * static_cast<size_t>(type_.bytes()),
                static_cast<size_t>(type_.bytes()));
    const Scalar bits = Scalar::of_uint(UInt(8 * type_.bytes()), pattern);
    return type_.is_bool() ? Scalar::of_bool(pattern != 0) : eval_reinterpret(type_, bits);
  }
  void set(size_t i, const Scalar& value) {
    const uint64_t pattern =
        type_.is_bool() ? value.u : eval_reinterpret(UInt(8 * type_.bytes()), value).u;
    std::memcpy(bytes_ + i * static_cast<size_t>(type_.bytes()), &pattern,
                static_cast<size_t>(type_.bytes()));
  }

 private:
  Type type_;
  uint8_t *memory_, *bytes_;
  size_t mapped_;
  halide_dimension_t dimension_;
  halide_buffer_t buffer_ = {};
};

}  // namespace retrograde::testing_codegen
