// Recurrences of workloads: sweeps in place, red-black orders, cascades of recursive filters, sweeps over two
// dimensions that depend on both, powers of a matrix.
#include <algorithm>

#include "testing/programs/workload_maker.h"

namespace retrograde::fuzz {

// Gauss-Seidel: each point reads neighbours of this sweep and of the one before.
WorkloadMaker::Grid WorkloadMaker::swept_in_place(const Grid& a) {
  Grid u = grid_like(a, "swept", a(x, y));
  const int sweeps = c_.between(1, 4);
  const Expr k = coefficient();
  const RDom r = a.is_line ? RDom(0, a.width, 0, sweeps) : RDom(0, a.width, 0, a.height, 0, sweeps);
  const Expr i = r.x, j = a.is_line ? Expr(y) : Expr(r.y);
  const Expr left = u(clamp(i - 1, 0, a.width - 1), j), right = u(clamp(i + 1, 0, a.width - 1), j);
  const Expr next = c_.chance(50) ? u(i, j) * 0.5f + 0.25f * k * (left + right)
                                  : sin(left) * 0.5f + u(i, j) * right * 0.25f;
  if (a.is_line) {
    u.f(i) = next;
  } else {
    u.f(i, j) = next;
  }
  p_.has_loop = true;
  return u;
}

// Points of one colour read neighbours of the other.
WorkloadMaker::Grid WorkloadMaker::red_black(const Grid& a) {
  if (a.width < 3 || (!a.is_line && a.height < 3)) return {};
  Grid u = grid_like(a, "relaxed", a(x, y));
  const int sweeps = c_.between(1, 3);
  const Expr k = coefficient();
  RDom r = a.is_line ? RDom(1, a.width - 2, 0, 2, 0, sweeps)
                     : RDom(1, a.width - 2, 1, a.height - 2, 0, 2, 0, sweeps);
  const Expr i = r.x, j = a.is_line ? Expr(y) : Expr(r.y), colour = a.is_line ? r.y : r.z;
  r.where((a.is_line ? i : i + j) % 2 == colour);
  Expr around = u(i - 1, j) + u(i + 1, j);
  if (!a.is_line) around = (around + u(i, j - 1) + u(i, j + 1)) * 0.5f;
  const Expr next = u(i, j) + 0.5f * k * (around * 0.5f - u(i, j));
  if (a.is_line) {
    u.f(i) = next;
  } else {
    u.f(i, j) = c_.chance(50) ? next : tanh(next) + 0.125f * around * u(i, j);
  }
  p_.has_loop = true;
  return u;
}

// Filters of first or second order in a row, over samples along x, for each signal y.
WorkloadMaker::Grid WorkloadMaker::recursive_filters(const Grid& a) {
  const int filters = c_.between(1, 3), order = c_.between(1, 2);
  const Input weights = input({3, filters});
  Grid from = a;
  for (int f = 0; f < filters; ++f) {
    const auto w = [&](int k) { return weights({Expr(k), Expr(f)}); };
    Grid g = grid_like(a, "filtered", Expr(0.0f));
    const RDom r(0, a.width);
    const std::vector<Expr> here = a.is_line ? std::vector<Expr>{r.x} : std::vector<Expr>{r.x, y};
    Expr value = w(0) * from(r.x, y) + 0.5f * w(1) * g(r.x - 1, y);
    if (order == 2) value = value - 0.25f * w(2) * g(r.x - 2, y);
    g.f(here) = value;
    keep(g);
    from = g;
  }
  return grid_like(a, "filtered_out", smooth(from(x, y)));
}

// Costs of alignments: each point reads its predecessors along both dimensions.
WorkloadMaker::Grid WorkloadMaker::aligned(const Grid& a) {
  if (a.is_line || a.width < 2 || a.height < 2) return {};
  Grid d = grid_like(a, "aligned", a(x, y));
  const RDom r(1, a.width - 1, 1, a.height - 1);
  const Expr left = d(r.x - 1, r.y), up = d(r.x, r.y - 1), both = d(r.x - 1, r.y - 1);
  d.f(r.x, r.y) = c_.one_of<Expr>({
      [&] { return d(r.x, r.y) + 0.25f * (left + up) + 0.25f * both; },
      [&] { return d(r.x, r.y) * 0.5f + min(left, min(up, both)) * 0.5f; },
      [&] { return a(r.x, r.y) - log(exp(-left) + exp(-up) + exp(-both)) * 0.5f; },
      [&] { return tanh(left * up) + 0.5f * a(r.x, r.y) * both; },
  });
  p_.has_loop = true;
  return d;
}

// v(i, t + 1) = sum over j of m(j, i) g(v(j, t)).
WorkloadMaker::Grid WorkloadMaker::matrix_powers(const Grid& a) {
  const int size = std::min(a.width, 4), steps = c_.between(1, 4);
  const Input m = input({size, size});
  const bool is_linear = c_.chance(40);
  Func v = named("powers");
  v(x, t) = select(t == 0, a(clamp(x, 0, size - 1), 0), 0.0f);
  const RDom r(0, size, 0, size, 0, steps);
  const Expr old = v(r.x, r.z);
  v(r.y, r.z + 1) += 0.5f * m({r.x, r.y}) * (is_linear ? old : sin(old));
  p_.funcs.push_back(v);
  p_.has_loop = true;
  if (c_.chance(50)) return line("power", size, v(x, steps));
  return grid("all_powers", size, steps + 1, false, Tuple(v(x, y)));
}

}  // namespace retrograde::fuzz
