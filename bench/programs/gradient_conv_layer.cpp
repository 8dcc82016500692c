// gradient_conv_layer -- a 3 x 3 convolution of 16 channels to 16 with ReLU. Gradients: picture, filters, biases.
#include "gradient.h"

namespace {

class GradientConvLayer : public Halide::Generator<GradientConvLayer> {
 public:
  GeneratorParam<bool> primal{"primal", false};
  Input<Buffer<float>> image{"image", 3};
  Input<Buffer<float>> filter{"filter", 4};
  Input<Buffer<float>> bias{"bias", 1};
  Input<Buffer<float>> seed{"seed", 3};
  Output<Buffer<double>> sum{"sum", 0};
  Output<Buffer<float>> d_image{"d_image", 3};
  Output<Buffer<float>> d_filter{"d_filter", 4};
  Output<Buffer<float>> d_bias{"d_bias", 1};

  void generate() {
    Func picture = programs::values_of(image, "picture", {66, 50, 16});
    Func taps = programs::values_of(filter, "taps", {3, 3, 16, 16});
    Func offset = programs::values_of(bias, "offset", {16});

    Func conv("conv"), result("result");
    RDom r(0, 3, 0, 3, 0, 16, "r");
    conv(x, y, c) = offset(c);
    conv(x, y, c) += taps(r.x, r.y, r.z, c) * picture(x + r.x, y + r.y, r.z);
    result(x, y, c) = max(0.0f, conv(x, y, c));
    programs::store({conv}, primal);
    programs::Weighed weighed(result, seed, {64, 48, 16}, primal);
    sum() = weighed.sum();
    d_image = weighed.by(picture);
    programs::estimate(image, {66, 50, 16});
    programs::estimate(d_image, {66, 50, 16});
    d_filter = weighed.by(taps);
    programs::estimate(filter, {3, 3, 16, 16});
    programs::estimate(d_filter, {3, 3, 16, 16});
    d_bias = weighed.by(offset);
    programs::estimate(bias, {16});
    programs::estimate(d_bias, {16});
    programs::estimate(seed, {64, 48, 16});
    programs::estimate(sum, {});
  }

 private:
  Var x{"x"}, y{"y"}, c{"c"};
};

}  // namespace

PROGRAM(gradient_conv_layer, GradientConvLayer, at_sizes({{}}, [](const Sizes&) {
                                                  return std::vector{
                                                      in<float>({66, 50, 16}),
                                                      in<float>({3, 3, 16, 16}, -0.1, 0.1).noise(),
                                                      in<float>({16}, -1, 1).noise(),
                                                      in<float>({64, 48, 16}, -1, 1).noise(),
                                                      out<double>({}),
                                                      out<float>({66, 50, 16}),
                                                      out<float>({3, 3, 16, 16}),
                                                      out<float>({16})};
                                                }).gradients(3))
