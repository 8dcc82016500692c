// kernel.h -- the interface of benchmark kernels, in the common subset of Halide 14 and Retrograde.
//
// Every kernel is one source file with algorithm and schedule (for a gradient, only the algorithm). It is written once,
// and compiled once with Halide's header and once with ours. list.def names all kernels. Inputs depend only on the
// position, so both sides compute from the same numbers.
#pragma once

#include <Halide.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "picture.h"

namespace kernels {

using namespace Halide;

// The type of values in gradients. It is double for checks that need more precision than float; the inputs are the same
// numbers.
#ifdef BENCH_FLOAT64
using real = double;
#else
using real = float;
#endif

struct Setup {
  Halide::Target target;
  bool small = false;  // small, odd sizes for a quick check of the results
  int threads = 1;
  bool primal = false;       // for a gradient: the program itself, without a schedule
  bool is_operator = false;  // a gradient with the program's output as last output
  std::string
      schedule;  // name of the schedule; see ../operators/schedules.cpp. For a kernel, it may also be by
                 // hand

  // Lanes of a full vector register.
  template <typename T>
  int lanes() const {
    return target.natural_vector_size<T>();
  }
  bool by_hand() const { return schedule.empty(); }
  int size(int full, int quick) const { return small ? quick : full; }
};

// A kernel that is ready to be compiled: its inputs are bound. The buffers' sizes count as the bytes that must be
// moved; `operations` counts those that the algorithm requires, a multiply-add as two.
struct Kernel {
  Halide::Pipeline pipeline;
  std::vector<Halide::Buffer<>> inputs, outputs;
  double operations = 0;
  size_t by =
      0;  // for a gradient: the number of outputs that are gradients, with respect to the first inputs
  double derive_seconds = 0,
         search_seconds = 0;  // for a gradient: times to derive and to schedule it
};

// Measures compile times.
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

// Binds `values`; an autoscheduler may rely on their size.
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
