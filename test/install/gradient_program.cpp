// A user's program that computes one gradient and checks it by hand.
#include <retrograde/retrograde.h>

#include <cmath>
#include <cstdio>

using namespace retrograde;

namespace {

// d loss / d kernel(k), by the formula.
float expected(const Buffer<float>& in, const Buffer<float>& kernel, const Buffer<float>& want,
               int k) {
  float sum = 0.0f;
  for (int i = 0; i < want.width(); ++i) {
    float blurred = 0.0f;
    for (int j = 0; j < 3; ++j) blurred += in(i + j) * kernel(j);
    sum += 2.0f * (blurred - want(i)) * in(i + k);
  }
  return sum;
}

}  // namespace

int main() {
  Buffer<float> in(34), kernel(3), want(32);
  for (int i = 0; i < 34; ++i) in(i) = std::sin(0.3f * i);
  for (int i = 0; i < 32; ++i) want(i) = std::cos(0.2f * i);
  for (int i = 0; i < 3; ++i) kernel(i) = 0.25f * (i + 1);

  Var x("x");
  RDom k(0, 3), i(0, 32);
  Func blur("blur"), loss("loss");
  blur(x) = 0.0f;
  blur(x) += in(x + k) * kernel(k);
  loss() = 0.0f;
  loss() += (blur(i) - want(i)) * (blur(i) - want(i));

  Derivative derivative = propagate_adjoints(loss);
  Buffer<float> gradient = derivative(kernel).realize({3});

  for (int j = 0; j < 3; ++j) {
    const float right = expected(in, kernel, want, j);
    std::printf("d loss / d kernel(%d) = %g, by hand %g\n", j, gradient(j), right);
    if (!(std::fabs(gradient(j) - right) <= 1e-4f * (1.0f + std::fabs(right)))) return 1;
  }
  return 0;
}
