// realization.h -- the Buffers that hold the values of a realized Func.
#pragma once

#include <utility>
#include <vector>

#include "frontend/data/buffer.h"

namespace retrograde {

// The result of realize(): one Buffer for each value of the Func.
class Realization {
 public:
  // Wraps Buffers, one for each value.
  // Requires: it holds at least one Buffer; its Buffers must be defined.
  explicit Realization(std::vector<Buffer<>> buffers);
  Realization(std::initializer_list<Buffer<>> buffers)
      : Realization(std::vector<Buffer<>>(buffers)) {}
  template <typename T, int Dims, typename... Rest>
  requires((std::is_convertible_v<Rest, Buffer<>> && ...))
      Realization(Buffer<T, Dims>& first, Rest&&... rest)
      : Realization(std::vector<Buffer<>>{first, Buffer<>(std::forward<Rest>(rest))...}) {}

  size_t size() const { return buffers_.size(); }  // number of Buffers
  // The Buffer of value i.
  // Requires: its Buffers are numbered from 0.
  const Buffer<>& operator[](size_t i) const { return buffers_[checked(i)]; }
  Buffer<>& operator[](size_t i) { return buffers_[checked(i)]; }
  // The Buffer of a Func with a single value.
  // Requires: it must hold exactly one.
  template <typename T, int Dims>
  operator Buffer<T, Dims>() const {
    check_one_value();
    return buffers_[0].template as<T, Dims>();
  }
  // Waits for device work that uses any of the Buffers.
  int device_sync() {
    for (Buffer<>& buffer : buffers_) buffer.device_sync();
    return 0;
  }

 private:
  size_t checked(size_t i) const;
  void check_one_value() const;
  std::vector<Buffer<>> buffers_;
};

}  // namespace retrograde
