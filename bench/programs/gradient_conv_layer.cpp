// gradient_conv_layer -- a 3 x 3 convolution of 16 channels to 16 with ReLU. Gradients: picture, filters, biases.
#include "gradient.h"

namespace {

struct GradientConvLayer : programs::GradientGenerator<GradientConvLayer> {
  Variable picture{"image", "picture", {66, 50, 16}}, taps{"filter", "taps", {3, 3, 16, 16}},
      offset{"bias", "offset", {16}};
  Seed seed{{64, 48, 16}};

  void generate() {
    Func conv("conv"), result("result");
    RDom r(0, 3, 0, 3, 0, 16, "r");
    conv(x, y, c) = offset(c);
    conv(x, y, c) += taps(r.x, r.y, r.z, c) * picture(x + r.x, y + r.y, r.z);
    result(x, y, c) = max(0.0f, conv(x, y, c));
    store({conv});
    differentiate(result, seed, {&picture, &taps, &offset});
  }
};

}  // namespace

PROGRAM(gradient_conv_layer, GradientConvLayer,
        gradients_of({in<float>({66, 50, 16}), in<float>({3, 3, 16, 16}, -0.1, 0.1).noise(),
                      in<float>({16}, -1, 1).noise()},
                     {64, 48, 16}))
