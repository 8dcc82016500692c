// fft.h -- many complex FFTs of one small length, fully unrolled: radix-2 steps by decimation in frequency (Gentleman
// and Sande 1966), values in Tuples, one transform per lane.
#pragma once

#include "program.h"

namespace programs {

class SmallFft : public Halide::Generator<SmallFft> {
 public:
  GeneratorParam<int> length{"length", 16};
  // (transform, point, part): part 0 is real, part 1 imaginary.
  Input<Buffer<float>> signal{"signal", 3};
  Output<Buffer<float>> spectrum{"spectrum", 3};

  void generate() {
    stages.emplace_back("stage_0");
    stages[0](t, k) = Halide::Tuple(signal(t, k, 0), signal(t, k, 1));
    for (int half = length / 2; half >= 1; half /= 2) add_stage(half);
    std::vector<Expr> real, imaginary;
    for (int i = 0; i < length; i++) {
      real.push_back(stages.back()(t, reversed(i))[0]);
      imaginary.push_back(stages.back()(t, reversed(i))[1]);
    }
    spectrum(t, k, part) = select(part == 0, mux(k, real), mux(k, imaginary));
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var block("block");
    spectrum.bound(k, 0, length).bound(part, 0, 2).split(t, block, t, lanes);
    spectrum.reorder(part, k, t, block).unroll(part).unroll(k).vectorize(t).parallel(block);
    for (Func& stage : stages) {
      stage.compute_at(spectrum, block).bound(k, 0, length).reorder(k, t);
      stage.unroll(k).vectorize(t, lanes);
    }
  }

 private:
  // Blocks of 2 * half points: sums in the first half, twiddled differences in the second.
  void add_stage(int half) {
    Func source = stages.back();
    Func stage("stage_" + std::to_string(length / half));
    std::vector<Expr> real(length), imaginary(length);
    for (int first = 0; first < length; first++) {
      const int place = first % (2 * half), second = first + half;
      if (place >= half) continue;
      Halide::Tuple p = source(t, first), q = source(t, second);
      Expr angle = -3.14159265f * static_cast<float>(place) / static_cast<float>(half);
      Expr c = cos(angle), s = sin(angle), dr = p[0] - q[0], di = p[1] - q[1];
      real[first] = p[0] + q[0];
      imaginary[first] = p[1] + q[1];
      real[second] = dr * c - di * s;
      imaginary[second] = dr * s + di * c;
    }
    stage(t, k) = Halide::Tuple(mux(k, real), mux(k, imaginary));
    stages.push_back(stage);
  }

  int reversed(int index) {
    int result = 0;
    for (int bit = 1; bit < length; bit *= 2) result += index & bit ? length / 2 / bit : 0;
    return result;
  }

  Var t{"t"}, k{"k"}, part{"part"};
  std::vector<Func> stages;
};

inline Registered ffts_of(int length) {
  return at_sizes({{64}, {1000}, {20000}},
                  [=](const Sizes& n) {
                    return std::vector{in<float>({n[0], length, 2}, -1, 1).noise(),
                                       out<float>({n[0], length, 2})};
                  })
      .with("length=" + std::to_string(length));
}

}  // namespace programs
