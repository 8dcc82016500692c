// newton_cg.cpp -- truncated Newton (J. Nocedal, S. Wright, Numerical Optimization, 2nd edition, 2006, algorithm 7.1).
// Each step solves H p = -g approximately by conjugate gradients, which stop early at negative curvature, and then
// searches along p.
//
// Ours differs in two ways. If the first direction already has negative curvature, the length of the step along -g
// comes from the magnitude of the curvature. Products that are not finite end the inner iteration like negative
// curvature.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/minimize_run.h"

namespace apps {

namespace {

using Vector = std::vector<double>;

double inner_product(const Vector& a, const Vector& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

void add_scaled(Vector& to, double factor, const Vector& what) {
  for (size_t n = 0; n < to.size(); ++n) to[n] += factor * what[n];
}

// The step if the first direction has negative curvature.
Vector downhill(const Vector& g, double curvature) {
  Vector p = g;
  const double size = inner_product(g, g);
  const double length =
      std::isfinite(curvature) && curvature != 0 ? size / std::abs(curvature) : 1 / std::sqrt(size);
  for (double& v : p) v *= -length;
  return p;
}

// An approximate solution of H p = -g, always a descent direction.
Vector newton_direction(MinimizeRun& run, const Vector& x, const Vector& g) {
  const double size = std::sqrt(inner_product(g, g));
  const double enough = std::min(0.5, std::sqrt(size)) * size;
  Vector p(g.size(), 0.0), rest = g, along = g;
  for (double& v : along) v = -v;
  for (size_t k = 0; k < 2 * g.size(); ++k) {
    const Vector product = run.product(x, along);
    const double curvature = inner_product(along, product);
    if (!std::isfinite(curvature) || curvature <= 1e-14 * inner_product(along, along))
      return k == 0 ? downhill(g, curvature) : p;
    const double before = inner_product(rest, rest), length = before / curvature;
    add_scaled(p, length, along);
    add_scaled(rest, length, product);
    const double now = inner_product(rest, rest);
    if (std::sqrt(now) <= enough) break;
    for (size_t n = 0; n < along.size(); ++n) along[n] = now / before * along[n] - rest[n];
  }
  return p;
}

// Moves x along p until the loss falls enough (Armijo); returns false if no step is short enough. Updates `loss` and
// `g`.
bool search_along(MinimizeRun& run, Vector& x, double& loss, Vector& g, const Vector& p) {
  constexpr double enough = 1e-4, shortest = 1e-12;
  const double slope = inner_product(g, p);
  if (!(slope < 0)) return false;
  Vector at(x.size()), g_at(x.size());
  const auto evaluate = [&](double length) {
    at = x;
    add_scaled(at, length, p);
    const double value = run.evaluate(at, g_at);
    return all_finite(value, g_at) ? value : INFINITY;
  };
  double length = 1, value = evaluate(length);
  while (!(value <= loss + enough * length * slope)) {
    // The vertex of the parabola through the known values, clamped to [0.1, 0.5].
    const double vertex =
        std::isfinite(value) ? -slope * length * length / (2 * (value - loss - slope * length)) : 0;
    length = std::clamp(vertex, 0.1 * length, 0.5 * length);
    if (length < shortest) return false;
    value = evaluate(length);
  }
  x = at;
  g = g_at;
  loss = value;
  return true;
}

}  // namespace

void run_newton_cg(MinimizeRun& run, Vector x) {
  Vector g(x.size());
  double loss = run.problem().evaluate(x, g);
  do {
    if (!search_along(run, x, loss, g, newton_direction(run, x, g))) {
      // As a last resort, go downhill.
      const Vector product = run.product(x, g);
      if (!search_along(run, x, loss, g, downhill(g, inner_product(g, product))))
        return run.end("the line search found no decrease");
    }
  } while (!run.ends_after_step(loss, g));
}

}  // namespace apps
