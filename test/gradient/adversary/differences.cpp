// Central differences with a bound on their accuracy.
#include <cmath>

#include "gradient/adversary/probe.h"
#include "ir/visit.h"

namespace retrograde::gradient {

namespace {

constexpr double step = 1.0 / 128;

// The first column of a Richardson tableau for slopes at h, h/2, h/4, whose errors go with
// h^order, h^(order+grow) ...
double extrapolated(const double (&slopes)[3], double first, double second) {
  const auto& [a, b, c] = slopes;
  const double ab = (first * b - a) / (first - 1), bc = (first * c - b) / (first - 1);
  return (second * bc - ab) / (second - 1);
}

void for_each_node(const std::vector<Func>& outputs, ir::FunctionRef<void(const Expr&)> visit) {
  std::vector<graph::FuncPtr> functions;
  for (const Func& output : outputs) functions.push_back(output.function());
  for (const graph::FuncPtr& f : graph::topological_order(functions))
    walk(*f, [&](const Expr& e) { return visit(e), true; });
}

int narrowest_float(const std::vector<Func>& outputs) {
  int bits = 64;  // the width of the type, a rough measure of its mantissa
  for_each_node(outputs, [&](const Expr& e) {
    if (e.type().is_float()) bits = std::min(bits, e.type().is_bfloat() ? 8 : e.type().bits());
  });
  return bits;
}

}  // namespace

bool turns_within_a_step(const std::vector<Func>& outputs, double slope) {
  if (slope * step <= 1) return false;
  bool has_waves = false;
  for_each_node(outputs, [&](const Expr& e) {
    const auto* call = e.as<ir::Call>();
    has_waves |=
        call && (call->is_op(ir::Op::sin) || call->is_op(ir::Op::cos) || call->is_op(ir::Op::tan));
  });
  return has_waves;
}

double precision_of(const std::vector<Func>& outputs) {
  const int bits = narrowest_float(outputs);
  return bits == 8 ? 3e-2 : bits == 16 ? 4e-3 : 1e-6;
}

Slope slope_of(const std::function<double(double)>& f, double at_rest, double scale, double largest,
               double precision) {
  double central[3], right[3], left[3];
  for (int i = 0; i < 3; ++i) {
    const double h = step / (1 << i), up = f(h), down = f(-h);
    central[i] = (up - down) / (2 * h);
    right[i] = (up - at_rest) / h;
    left[i] = (at_rest - down) / h;
  }
  const double slope = extrapolated(central, 4, 16), coarse = (4 * central[1] - central[0]) / 3,
               one_sided = extrapolated(right, 2, 4) - extrapolated(left, 2, 4);
  const double doubt = precision * (scale + std::abs(slope) + 1e-3) +
                       10 * std::abs(slope - coarse) + 3 * std::abs(one_sided) + 1e-10 * largest;
  return {slope, doubt, doubt < 1e-2 * (std::abs(slope) + largest)};
}

}  // namespace retrograde::gradient
