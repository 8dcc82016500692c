// What is a seed?
//
// A program with many outputs has a Jacobian J instead of a single gradient, with one row per output.
// Reverse mode computes a weighted sum of the rows, w^T J. The seed is w, the weight of each output. A loss
// is the special case of one output with weight 1.
#include <retrograde/retrograde.h>

#include <cmath>

#include "tutorial.h"

using namespace retrograde;

int main(int argc, char** argv) {
  const int n = 12;
  Buffer<float> a(n);
  for (int i = 0; i < n; ++i) a(i) = 1.0f + 0.25f * static_cast<float>(i * 5 % 7);
  Var x("x");
  Func f("f");
  f(x) = a(x) * a(x + 1);  // outputs 0 ... 10 exist; d f(x) / d a(x) = a(x + 1)
  const int outputs = n - 1;

  // ---- A seed that is 1 at one output and 0 elsewhere gives that output's row of J. ----
  Param<int> p("p");
  Func one("one");
  one(x) = select(x == p, 1.0f, 0.0f);
  Func row = propagate_adjoints(f, one, {{0, outputs}})(a);
  std::vector<std::vector<double>> matrix;
  bool right = true;
  for (int k = 0; k < outputs; ++k) {
    p.set(k);
    Buffer<float> slopes = row.realize({n});
    matrix.emplace_back(slopes.begin(), slopes.end());
    for (int i = 0; i < n; ++i) {
      const float expected = i == k ? a(k + 1) : i == k + 1 ? a(k) : 0.0f;
      right = right && slopes(i) == expected;
    }
  }
  claim(right, "a seed with a single 1 gives one row of J exactly");

  // ---- Any other seed gives a weighted sum of the rows, in a single sweep. ----
  Buffer<float> weights(outputs);
  for (int k = 0; k < outputs; ++k) weights(k) = 0.5f - 0.125f * static_cast<float>(k);
  Buffer<float> swept = propagate_adjoints(f, weights)(a).realize({n});
  double worst = 0;
  for (int i = 0; i < n; ++i) {
    double sum = 0;
    for (int k = 0; k < outputs; ++k) sum += weights(k) * matrix[k][i];
    worst = std::max(worst, std::abs(sum - swept(i)));
  }
  claim(worst < 1e-6, "a seed w gives w^T J");

  // ---- For a loss, the seed is its derivative by each output. ----
  Func loss("loss"), by_hand("by_hand");
  RDom r(0, outputs);
  loss() = 0.0f;
  loss() += f(r) * f(r);
  by_hand(x) = 2.0f * f(x);  // d loss / d f(x)
  Buffer<float> of_loss = propagate_adjoints(loss)(a).realize({n});
  Buffer<float> of_seed = propagate_adjoints(f, by_hand, {{0, outputs}})(a).realize({n});
  worst = 0;
  for (int i = 0; i < n; ++i) worst = std::max<double>(worst, std::abs(of_loss(i) - of_seed(i)));
  claim(worst < 1e-5, "the gradient of a loss is the sweep with seed d loss / d f");

  // ---- The bounds select the outputs that count. Outside them the seed is not even read. ----
  Func ones("ones");
  ones(x) = 1.0f;
  Buffer<float> first = propagate_adjoints(f, ones, {{0, 3}})(a).realize({n});
  claim(first(0) == a(1) && first(3) == a(2) && first(4) == 0.0f,
        "outputs outside the bounds contribute nothing");

  Picture picture("The Jacobian of f(x) = a(x) a(x + 1), one row per seed");
  picture.cells(60, 40, 18, matrix, 0, 2.5);
  picture.text(270, 60, "row k: the seed is 1 at k");
  picture.text(270, 80, "column i: derivatives by a(i)");
  picture.write(argc, argv, "what_is_a_seed");
}
