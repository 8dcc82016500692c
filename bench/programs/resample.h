// resample.h -- resizes a picture: each pixel is a sum under a kernel whose width and position follow from the scale,
// which is an argument. Weights are computed once for each row and column.
#pragma once

#include "program.h"

namespace programs {

class Resample : public Halide::Generator<Resample> {
 public:
  GeneratorParam<bool> interleaved{"interleaved", false};
  Input<Buffer<>> input{"input", 3};
  Input<float> scale{"scale"};  // output size divided by input size
  Output<Buffer<>> output{"output", 3};

  void generate() {
    stretch = max(1.0f, 1.0f / scale);
    Expr taps = cast<int>(ceil(2 * stretch));
    RDom r(0, taps), s(0, taps), over_y(0, taps), over_x(0, taps);
    weights_of(rows, rows_total, r);
    weights_of(columns, columns_total, s);

    Func pixels = Halide::BoundaryConditions::repeat_edge(input);
    Expr pixel = cast<float>(pixels(x, first(y) + over_y, c));
    tall(x, y, c) = sum(rows(y, over_y) * pixel, "sum_y");
    Expr value = sum(columns(x, over_x) * tall(first(x) + over_x, y, c), "sum_x");
    const Halide::Type type = output.type();
    if (type.is_uint()) value = clamp(value + 0.5f, 0.0f, cast<float>(type.max()));
    output(x, y, c) = cast(type, value);
  }

  void schedule() {
    const int lanes = natural_vector_size<float>();
    Var ni("ni"), yi("yi");
    for (auto [weights, total] : {std::pair(rows, rows_total), {columns, columns_total}}) {
      weights.compute_root().split(n, n, ni, lanes).reorder(ni, k, n).vectorize(ni);
      total.compute_at(weights, n).vectorize(n, lanes);
    }
    tall.compute_at(output, yi).vectorize(x, lanes);
    output.vectorize(x, lanes).split(y, y, yi, 16).parallel(y);
    if (!interleaved) return;
    input.dim(0).set_stride(3);
    input.dim(2).set_stride(1).set_bounds(0, 3);
    output.dim(0).set_stride(3);
    output.dim(2).set_stride(1).set_bounds(0, 3);
    output.reorder(c, x, yi, y).unroll(c);
    tall.reorder(c, x, y).bound(c, 0, 3).unroll(c);
  }

 private:
  // The position of output point `at` in the input, and the first pixel under its kernel.
  Expr place(Expr at) { return (cast<float>(at) + 0.5f) / scale - 0.5f; }
  Expr first(Expr at) { return cast<int>(ceil(place(at) - stretch)); }

  // A tent that extends `stretch` on either side; the weights of a point add up to 1.
  void weights_of(Func& weights, Func& total, RDom& r) {
    auto tent = [&](Expr tap) {
      return max(0.0f, 1.0f - abs(cast<float>(first(n) + tap) - place(n)) / stretch);
    };
    total(n) = sum(tent(r), "sum_of_tents");
    weights(n, k) = tent(k) / total(n);
  }

  Var x{"x"}, y{"y"}, c{"c"}, n{"n"}, k{"k"};
  Expr stretch;
  Func rows{"rows"}, columns{"columns"}, rows_total{"rows_total"}, columns_total{"columns_total"};
  Func tall{"tall"};
};

// Cases for T: smaller, larger, much smaller.
template <typename T>
Registered resampled(double limit, bool is_interleaved) {
  const auto arguments = [=](const Sizes& n) {
    const float scale = static_cast<float>(n[2]) / 100.0f;
    Argument from = in<T>({n[0], n[1], 3}, 0, limit);
    Argument to = out<T>({n[0] * n[2] / 100, n[1] * n[2] / 100, 3});
    if (is_interleaved) from = from.interleaved(), to = to.interleaved();
    return std::vector{from, value<float>(scale), to};
  };
  const Type type = type_of<T>();
  const std::string name = (type.code == 2 ? "float" : "uint") + std::to_string(type.bits);
  return at_sizes({{130, 96, 50}, {641, 479, 160}, {2000, 1504, 37}}, arguments)
      .with("input.type=" + name)
      .with("output.type=" + name)
      .with(std::string("interleaved=") + (is_interleaved ? "true" : "false"));
}

}  // namespace programs
