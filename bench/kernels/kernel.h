// kernel.h -- what one benchmark kernel is, in the dialect that Halide 14 and Retrograde share.
//
// Every kernel is one source file: algorithm and schedule (of a gradient the algorithm), written
// once, compiled once against Halide's header and once against ours. list.def names them all.
// Inputs are made by a generator that depends on nothing but the point, so both sides compute from
// the same numbers.
#pragma once

#include <Halide.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "picture.h"

namespace kernels {

// Of the values of gradients. In double where a check needs more than float has: the same numbers as
// inputs.
#ifdef BENCH_FLOAT64
using real = double;
#else
using real = float;
#endif

struct Setup {
  Halide::Target target;
  bool small = false;  // sizes for a check of the results: odd, and quick
  int threads = 1;
  bool primal = false;       // of a gradient: the program itself, without a schedule
  bool is_operator = false;  // a gradient, and the program's output as the last
  std::string schedule;      // whose; see ../operators/schedules.cpp. Of a kernel: or by hand

  // Lanes of a full vector register.
  template <typename T>
  int lanes() const {
    return target.natural_vector_size<T>();
  }
  bool by_hand() const { return schedule.empty(); }
  int size(int full, int quick) const { return small ? quick : full; }
};

// Ready to be compiled: the kernel has bound its inputs. The buffers count as the bytes that must
// move; `operations` are those that the algorithm cannot do without, a multiply-add being two.
struct Kernel {
  Halide::Pipeline pipeline;
  std::vector<Halide::Buffer<>> inputs, outputs;
  double operations = 0;
  size_t by = 0;  // of a gradient: so many outputs are gradients, by as many first inputs
  double derive_seconds = 0, search_seconds = 0;  // of a gradient: making it, and its schedule
};

// What is measured of compilers.
class Stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

#define KERNEL(name) Kernel name(const Setup& setup);
#define GRADIENT(name) Kernel name(const Setup& setup);
#include "../list.def"
#define OPERATOR(name) Kernel name(const Setup& setup);
#include "../operators/list.def"

// Reads `values`; an autoscheduler may count on their size.
template <typename T>
void bind(Halide::ImageParam& input, const Halide::Buffer<T>& values) {
  input.set(values);
  for (int d = 0; d < values.dimensions(); d++)
    input.dim(d).set_estimate(values.dim(d).min(), values.dim(d).extent());
}

// Values from 0 to just below `limit`.
template <typename T>
Halide::Buffer<T> make_image(const std::vector<int>& sizes, double limit = 1) {
  Halide::Buffer<T> image(sizes);
  const int width = sizes[0], height = sizes.size() > 1 ? sizes[1] : 1;
  T* at = image.data();
  for (size_t i = 0; i < image.number_of_elements(); i++) {
    const int x = static_cast<int>(i % width), rest = static_cast<int>(i / width);
    at[i] = static_cast<T>(limit * picture(x, rest % height, rest / height));
  }
  return image;
}

}  // namespace kernels
