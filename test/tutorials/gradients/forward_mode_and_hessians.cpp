// Forward mode and Hessians.
//
// propagate_tangents answers the question that reverse mode does not: if the inputs move in this direction,
// how do all values move? The tangent of a gradient is a product with the Hessian, and a few such products
// give the whole Hessian.
#include <retrograde/retrograde.h>

#include <cmath>

#include "tutorial.h"

using namespace retrograde;

const int n = 32;
using Vector = std::vector<double>;

double dot(const Vector& a, const Vector& b) {
  double sum = 0;
  for (int i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

Vector values(const Buffer<float>& b) { return {b.begin(), b.end()}; }

// Solves H s = g by conjugate gradients, which need only products with H.
template <typename Product>
Vector solve(const Product& product, const Vector& g) {
  Vector s(n, 0.0), rest = g, along = g;
  for (int k = 0; k < 2 * n && dot(rest, rest) > 1e-16 * dot(g, g); ++k) {
    const Vector h = product(along);
    const double before = dot(rest, rest), step = before / dot(along, h);
    for (int i = 0; i < n; ++i) {
      s[i] += step * along[i];
      rest[i] -= step * h[i];
    }
    const double turn = dot(rest, rest) / before;
    for (int i = 0; i < n; ++i) along[i] = rest[i] + turn * along[i];
  }
  return s;
}

int main(int argc, char** argv) {
  // Fits a smooth line to noisy points; a fourth-order term penalises large values.
  Buffer<float> line(n), points(n), v(n);
  for (int i = 0; i < n; ++i) {
    points(i) = std::sin(0.3f * static_cast<float>(i)) + static_cast<float>(i * 7 % 5) / 8;
    v(i) = static_cast<float>(i * 11 % 7) / 4 - 0.75f;
  }
  line.fill(0.0f);
  Func loss("loss");
  RDom all(0, n), pairs(0, n - 1);
  loss() = 0.0f;
  loss() += 0.5f * pow(line(all) - points(all), 2) + 0.25f * pow(line(all), 4);
  loss() += 4.0f * pow(line(pairs + 1) - line(pairs), 2);

  // ---- Forward and reverse mode see the same matrix from two sides: <J v, w> = <v, J^T w>. ----
  Func gradient = propagate_adjoints(loss)(line);
  const double slope = Buffer<float>(propagate_tangents(loss, {{line, v}})(loss).realize())();
  claim(std::abs(slope - dot(values(gradient.realize({n})), values(v))) < 1e-3,
        "the tangent along v is the gradient times v");

  // ---- The tangent of the gradient is H v. H itself is never formed. ----
  Func hv = hessian_vector_product(loss, line, {{line, v}});
  const float h = 1.0f / 256;
  const Vector here = values(gradient.realize({n})), product = values(hv.realize({n}));
  for (int i = 0; i < n; ++i) line(i) += h * v(i);
  const Vector there = values(gradient.realize({n}));
  for (int i = 0; i < n; ++i) line(i) -= h * v(i);
  double worst = 0;
  for (int i = 0; i < n; ++i)
    worst = std::max(worst, std::abs((there[i] - here[i]) / h - product[i]));
  claim(worst < 0.05, "a finite difference of gradients is close to H v");

  // ---- The whole Hessian: columns that share no row share a product. ----
  Jacobian matrix = hessian(loss, line);
  claim(matrix.colours() == 3, "only neighbours interact: three products suffice for any length");
  Buffer<float> dense = matrix.dense().realize({n, n});
  Vector by_rows(n, 0.0);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) by_rows[i] += dense(i, j) * v(j);
  worst = 0;
  for (int i = 0; i < n; ++i) worst = std::max(worst, std::abs(by_rows[i] - product[i]));
  claim(worst < 1e-3, "its product with v is H v");

  // ---- An application: Newton's method compared with gradient descent. ----
  Buffer<float> direction(n);
  Func any = hessian_vector_product(loss, line, {{line, direction}});
  auto times_h = [&](const Vector& u) {
    for (int i = 0; i < n; ++i) direction(i) = static_cast<float>(u[i]);
    return values(any.realize({n}));
  };
  auto size_of_gradient = [&] {
    const Vector g = values(gradient.realize({n}));
    return std::log10(std::sqrt(dot(g, g)));
  };
  Vector downhill, newton;
  for (int k = 0; k < 12; ++k) {
    downhill.push_back(size_of_gradient());
    const Vector g = values(gradient.realize({n}));
    for (int i = 0; i < n; ++i) line(i) -= static_cast<float>(0.05 * g[i]);
  }
  line.fill(0.0f);
  for (int k = 0; k < 12; ++k) {
    newton.push_back(size_of_gradient());
    const Vector step = solve(times_h, values(gradient.realize({n})));
    for (int i = 0; i < n; ++i) line(i) -= static_cast<float>(step[i]);
  }
  claim(newton[6] < -4, "six Newton steps bring the gradient below 1e-4");
  claim(downhill[11] > -2, "twelve steps of gradient descent do not bring it below 1e-2");

  Picture picture("log10 of the gradient's size over 12 steps");
  picture.curve("gradient descent", downhill, -6, 1);
  picture.curve("Newton", newton, -6, 1);
  picture.write(argc, argv, "forward_mode_and_hessians");
}
