// total_generator.cpp -- the sum of two tensors.
#include <retrograde/retrograde.h>

namespace {

using namespace retrograde;

class Total : public Generator<Total> {
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

RETROGRADE_REGISTER_GENERATOR(Total, total)
