// Learn a blur: a first gradient.
//
// A picture was blurred with an unknown kernel, and we have the picture before and after. Gradient descent
// on the difference finds the kernel.
#include <retrograde/retrograde.h>

#include <cmath>

#include "tutorial.h"

using namespace retrograde;

int main(int argc, char** argv) {
  // ---- The input: a sharp picture, and the same picture blurred. ----
  const int size = 48;
  const float truth[3][3] = {
      {1, 2, 1}, {2, 4, 2}, {1, 2, 1}};  // in sixteenths; the program does not use it to learn
  Buffer<float> sharp(size + 2, size + 2), given(size, size);
  for (int y = 0; y < size + 2; ++y)
    for (int x = 0; x < size + 2; ++x)
      sharp(x, y) = static_cast<float>((x * x + 3 * y * y + x * y) % 17) / 16 - 0.5f;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      given(x, y) = 0;
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) given(x, y) += sharp(x + i, y + j) * truth[j][i] / 16;
    }
  }

  // ---- The model and the loss. Both are forward code only. ----
  Buffer<float> kernel(3, 3);
  kernel.fill(0.0f);
  Var x("x"), y("y");
  Func blur("blur"), loss("loss");
  RDom taps(kernel), pixels(given);
  blur(x, y) = 0.0f;
  blur(x, y) += sharp(x + taps.x, y + taps.y) * kernel(taps.x, taps.y);
  loss() = 0.0f;
  loss() += pow(blur(pixels.x, pixels.y) - given(pixels.x, pixels.y), 2) / (size * size);

  // ---- The gradient is a Func with the dimensions of the variable that it differentiates by. ----
  Derivative d = propagate_adjoints(loss);
  Func gradient = d(kernel);
  claim(gradient.dimensions() == 2, "the gradient by a two-dimensional kernel has two dimensions");

  // Each element is the slope of the loss along one tap.
  auto loss_now = [&] { return Buffer<float>(loss.realize())(); };
  Buffer<float> slopes = gradient.realize({3, 3});
  const float step = 1.0f / 16;
  kernel(1, 1) += step;
  const float after = loss_now();
  kernel(1, 1) -= 2 * step;
  const float before = loss_now();
  kernel(1, 1) += step;
  claim(std::abs((after - before) / (2 * step) - slopes(1, 1)) < 0.001f * std::abs(slopes(1, 1)),
        "a finite difference along one tap agrees with the gradient");

  // ---- Gradient descent. ----
  std::vector<double> losses;
  for (int n = 0; n < 60; ++n) {
    losses.push_back(std::log10(loss_now()));
    Buffer<float> g = gradient.realize({3, 3});
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) kernel(i, j) -= 2.0f * g(i, j);
  }
  float worst = 0;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) worst = std::max(worst, std::abs(kernel(i, j) - truth[j][i] / 16));
  claim(losses.back() < losses.front() - 6, "the loss fell below a millionth of its start");
  claim(worst < 1e-3f, "all nine taps are correct to 1e-3");

  Picture picture("log10 of the loss over 60 steps; the learned kernel");
  picture.curve("", losses, -14, 0);
  std::vector<std::vector<double>> rows(3, std::vector<double>(3));
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) rows[j][i] = kernel(i, j);
  picture.cells(340, 60, 36, rows, 0, 0.25);
  picture.write(argc, argv, "learn_a_blur");
}
