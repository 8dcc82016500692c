// filters_generator.cpp -- the generators that become PyTorch operators: with images, numbers, and
// one or two outputs.
#include <retrograde/retrograde.h>

namespace {

using namespace retrograde;

class Weighted : public Generator<Weighted> {
 public:
  Input<Buffer<float>> image{"image", 2};
  Input<Buffer<float>> taps{"taps", 1};
  Input<float> gain{"gain", 1.0f};
  Input<bool> negative{"negative", false};
  Output<Buffer<float>> blurred{"blurred", 2};
  Output<Buffer<float>> squared{"squared", 2};

  void generate() {
    Var x("x"), y("y");
    RDom k(0, taps.dim(0).extent());
    Expr sign = select(negative, -gain, gain);
    blurred(x, y) = 0.0f;
    blurred(x, y) += sign * image(x + k, y) * taps(k);
    squared(x, y) = image(x, y) * image(x, y);
  }
};

class SumOfTwo : public Generator<SumOfTwo> {
 public:
  Input<Buffer<float>> a{"a", 1};
  Input<Buffer<float>> b{"b", 1};
  Output<Buffer<float>> total{"total", 1};

  void generate() {
    Var x("x");
    total(x) = a(x) + b(x);
  }
};

}  // namespace

RETROGRADE_REGISTER_GENERATOR(Weighted, weighted)
RETROGRADE_REGISTER_GENERATOR(SumOfTwo, sum_of_two)
