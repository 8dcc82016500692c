// Hand-written kernels for the simulated device, in the form that the compiler generates.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "gpu/gpu_image.h"

namespace gpu_kernels {

using Thread = retrograde_simt_thread;

// ---- operations inside of kernels ----

template <typename T>
T load(Thread* t, const T* from, int32_t site, int32_t space = retrograde_simt_global) {
  t->calls->access(t, from, sizeof(T), retrograde_simt_load, space, site);
  return *from;
}
template <typename T>
void store(Thread* t, T* to, T value, int32_t site, int32_t space = retrograde_simt_global) {
  t->calls->access(t, to, sizeof(T), retrograde_simt_store, space, site);
  *to = value;
}
template <typename T>
void add_atomically(Thread* t, T* to, T value, int32_t site) {
  t->calls->access(t, to, sizeof(T), retrograde_simt_atomic, retrograde_simt_global, site);
  *to += value;
}
inline void barrier(Thread* t, int32_t site) { t->calls->barrier(t, site); }
inline uint32_t shuffle(Thread* t, uint32_t value, int32_t lane, int32_t kind, int32_t site) {
  return t->calls->shuffle(t, value, lane, kind, site);
}
inline int32_t global_x(const Thread* t) { return t->block[0] * t->threads[0] + t->thread[0]; }

// ---- y = a x + y ----

struct SaxpyArgs {
  const float* x;
  float* y;
  float a;
  int32_t n;
};
inline void saxpy(Thread* t, const uint8_t* memory) {
  const auto& args = *reinterpret_cast<const SaxpyArgs*>(memory);
  const int32_t i = global_x(t);
  if (i >= args.n) return;
  const float y = load(t, args.y + i, 1);
  store(t, args.y + i, args.a * load(t, args.x + i, 0) + y, 2);
}

// ---- 32 x 32 tiles through shared memory ----

struct TransposeArgs {
  const float* in;
  float* out;
  int32_t n;
};
template <int pitch, bool with_barrier>
void transpose(Thread* t, const uint8_t* memory) {
  const auto& args = *reinterpret_cast<const TransposeArgs*>(memory);
  auto* tile = reinterpret_cast<float*>(t->shared);
  const int32_t x = t->thread[0], y = t->thread[1], n = args.n;
  const int32_t bx = t->block[0] * 32, by = t->block[1] * 32;
  for (int32_t row = y; row < 32; row += t->threads[1]) {
    const float value = load(t, args.in + (by + row) * n + bx + x, 0);
    store(t, tile + row * pitch + x, value, 1, retrograde_simt_shared);
  }
  if (with_barrier) barrier(t, 2);
  for (int32_t row = y; row < 32; row += t->threads[1]) {
    const float value = load(t, tile + x * pitch + row, 3, retrograde_simt_shared);
    store(t, args.out + (bx + row) * n + by + x, value, 4);
  }
}

// ---- one array of ints, and a number ----

struct ArrayArgs {
  int32_t* data;
  int32_t n;
};
template <void (*body)(Thread*, int32_t* data, int32_t n)>
void on_array(Thread* t, const uint8_t* memory) {
  const auto& args = *reinterpret_cast<const ArrayArgs*>(memory);
  body(t, args.data, args.n);
}

// ---- images ----

constexpr int32_t saxpy_bytes[] = {8, 8, 4, 4};
constexpr const char* saxpy_sites[] = {"x(i)", "y(i)", "y(i) = (a * x(i)) + y(i)"};
constexpr int32_t transpose_bytes[] = {8, 8, 4};
constexpr const char* transpose_sites[] = {"in(x, y)", "tile(x, y) = in(x, y)",
                                           "gpu_thread_barrier", "tile(y, x)",
                                           "out(y, x) = tile(x, y)"};
constexpr int32_t array_bytes[] = {8, 4};
constexpr const char* array_sites[] = {"first statement", "second statement", "third statement"};

inline retrograde_gpu_kernel saxpy_kernel() {
  return {"saxpy", saxpy, 0, 4, saxpy_bytes, 3, saxpy_sites};
}
template <int pitch = 33, bool with_barrier = true>
retrograde_gpu_kernel transpose_kernel() {
  return {"transpose", transpose<pitch, with_barrier>, 1, 3, transpose_bytes, 5, transpose_sites};
}
template <void (*body)(Thread*, int32_t* data, int32_t n)>
retrograde_gpu_kernel array_kernel(const char* name, bool waits) {
  return {name, on_array<body>, waits, 2, array_bytes, 3, array_sites};
}

class Image {
 public:
  Image(std::initializer_list<retrograde_gpu_kernel> kernels) : kernels_(kernels) {
    image_.magic = RETROGRADE_GPU_IMAGE_MAGIC;
    image_.num_kernels = static_cast<int32_t>(kernels_.size());
    image_.kernels = kernels_.data();
  }
  Image(const Image&) = delete;
  const char* source() const { return reinterpret_cast<const char*>(&image_); }
  static constexpr int bytes = sizeof(retrograde_gpu_image);
  // The kernel's text for devices; it lives as long as the image.
  void set_ptx(const char* text) {
    image_.ptx = text;
    image_.ptx_bytes = std::char_traits<char>::length(text);
  }

 private:
  const std::vector<retrograde_gpu_kernel> kernels_;
  retrograde_gpu_image image_ = {};
};

}  // namespace gpu_kernels
