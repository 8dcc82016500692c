// Loops over time that keep their steps: u(x, t) = f(u(x - 1, t - 1), u(x, t - 1), ...) in one reduction domain.
#include <algorithm>

#include "testing/programs/workload_maker.h"

namespace retrograde::fuzz {

std::vector<Expr> WorkloadMaker::TimeLoop::at(const Expr& x, const Expr& y, const Expr& t) const {
  std::vector<Expr> place{x};
  if (!is_line) place.push_back(y);
  place.insert(place.begin() + time_at, t);
  return place;
}

WorkloadMaker::TimeLoop WorkloadMaker::choose_loop(const Grid& start) {
  TimeLoop l{named("state"), start.width, start.height, 0,     0,     0, 1, 0, Border::Clamp,
             start.is_line,  false,       false,        false, false, x, y, t};
  const int last = l.is_line ? 1 : 2;
  l.steps = c_.pick(std::vector<int>{3, 1, 2, 4, 6, 9});
  l.back = c_.between(1, 2);
  l.slots = l.steps + l.back;
  l.border = static_cast<Border>(c_.below(5));
  l.time_at = c_.chance(30) ? c_.below(last) : last;
  l.values = c_.chance(20) ? 2 : 1;
  l.is_reversed = c_.chance(12);
  l.is_x_pure = c_.chance(15);
  l.is_y_pure = c_.chance(20);
  l.sweeps = c_.chance(20);
  return l;
}

// ---- the initial states ----

// By the pure definition at all steps, by an update at the first ones, or by a select.
void WorkloadMaker::define_start(TimeLoop& l, const Grid& start) {
  std::vector<Var> vars{x};
  if (!l.is_line) vars.push_back(y);
  vars.insert(vars.begin() + l.time_at, t);
  const bool is_open = l.border == Border::Open;
  const Expr first =
      is_open ? start(clamp(x, 0, l.width - 1), clamp(y, 0, l.height - 1)) : start(x, y);
  const auto both = [&](const Expr& value) {
    return l.values == 1 ? Tuple(value) : Tuple(value, value * 0.5f);
  };
  const int how = c_.below(3);
  if (how == 0) {
    l.u(vars) = both(first);
  } else if (how == 1) {
    l.u(vars) = both(Expr(0.125f));
    for (int k = 0; k < l.back; ++k) l.u(l.at(x, y, l.slot(k))) = both(first);
  } else {
    const Expr is_first = l.is_reversed ? t >= l.slots - l.back : t < l.back;
    l.u(vars) = both(select(is_first, first, 0.0f));
  }
}

// ---- the domain ----

Range WorkloadMaker::along(const TimeLoop& l, int size) const {
  if (l.border != Border::Interior) return {Expr(0), Expr(size)};
  return {Expr(1), Expr(std::max(size - 2, 0))};
}

// Time is the outermost variable of most domains. The number of steps may be a parameter.
void WorkloadMaker::choose_domain(TimeLoop& l) {
  const int first = c_.chance(50) ? l.back : 0;
  const bool is_parameter = !count_is_used_ && c_.chance(15);
  if (is_parameter) p_.count.set(l.steps);
  count_is_used_ |= is_parameter;
  const Range time{Expr(first), is_parameter ? Expr(p_.count) : Expr(l.steps)};
  Region region;
  if (l.moves_x()) region.push_back(along(l, l.width));
  if (l.moves_y()) region.push_back(along(l, l.height));
  const bool is_innermost = c_.chance(12);
  region.insert(is_innermost ? region.begin() : region.end(), time);
  const RDom r(region);
  int next = is_innermost ? 1 : 0;
  if (l.moves_x()) l.x = r[next++];
  if (l.moves_y()) l.y = r[next++];
  const Expr step = r[is_innermost ? 0 : next];
  l.t = first == l.back ? step : step + l.back;
}

// ---- reads of earlier steps ----

Expr WorkloadMaker::moved(const TimeLoop& l, const Expr& u, int by, int size) const {
  if (by == 0) return u;
  if (l.border == Border::Clamp || l.border == Border::Zero) return clamp(u + by, 0, size - 1);
  return l.border == Border::Periodic ? (u + (by + size)) % size : u + by;
}

// The state at a neighbour, some steps ago. A pure dimension is read in place.
Expr WorkloadMaker::neighbour(const TimeLoop& l, int dx, int dy, int ago, int value) const {
  if (!l.moves_x()) dx = 0;
  if (!l.moves_y()) dy = 0;
  const Expr u = moved(l, l.x, dx, l.width), v = moved(l, l.y, dy, l.height);
  const Expr read = l.u(l.at(u, v, l.slot(ago == 0 ? l.t : l.t - ago))).element(value);
  if (l.border != Border::Zero || (dx == 0 && dy == 0)) return read;
  const Expr inside_x = l.x + dx >= 0 && l.x + dx < l.width,
             inside_y = l.y + dy >= 0 && l.y + dy < l.height;
  return select(dy == 0 ? inside_x : dx == 0 ? inside_y : inside_x && inside_y, read, 0.0f);
}

Expr WorkloadMaker::sides(const TimeLoop& l) const {
  Expr sum = 0.0f;
  if (l.moves_x()) sum = neighbour(l, -1, 0, 1) + neighbour(l, 1, 0, 1);
  if (!l.moves_y()) return sum;
  const Expr of_y = neighbour(l, 0, -1, 1) + neighbour(l, 0, 1, 1);
  return l.moves_x() ? sum + of_y : of_y;
}

// ---- steps ----

// A coefficient, which may depend on the place or on the step.
Expr WorkloadMaker::place_coefficient(const TimeLoop& l) {
  std::vector<int> size{l.width};
  std::vector<Expr> place{l.x};
  if (!l.is_line) size.push_back(l.height), place.push_back(l.y);
  return c_.one_of<Expr>({
      [&] { return coefficient(); },
      [&] { return input(size)(place); },
      [&] { return input({l.slots})({l.t}); },
      [&] {
        size.push_back(l.slots), place.push_back(l.t - 1);
        return input(size)(place);
      },
  });
}

Expr WorkloadMaker::linear_step(const TimeLoop& l) {
  const Expr own = neighbour(l, 0, 0, 1), k = place_coefficient(l);
  const Expr change = sides(l) - static_cast<float>(side_count(l)) * own;
  return c_.one_of<Expr>({
      [&] { return own + 0.125f * k * change; },
      [&] { return own * 0.75f + 0.25f * k; },
      [&] { return own * 0.5f + neighbour(l, -1, 0, 1) * k * 0.25f; },
      [&] { return 2.0f * own - neighbour(l, 0, 0, l.back) + 0.125f * k * change; },
      [&] { return own + 0.125f * k * (neighbour(l, 1, 0, l.back) - neighbour(l, -1, 0, 1)); },
      [&] { return (neighbour(l, 1, 1, 1) + neighbour(l, -1, -1, 1)) * 0.25f + own * k * 0.5f; },
  });
}

Expr WorkloadMaker::nonlinear_step(const TimeLoop& l) {
  const Expr own = neighbour(l, 0, 0, 1), k = place_coefficient(l);
  const Expr left = neighbour(l, -1, 0, 1), right = neighbour(l, 1, 0, 1);
  return c_.one_of<Expr>({
      [&] { return own * 0.75f + 0.25f * sin(sides(l)) * k; },
      [&] { return tanh(own * k + 0.5f * left - 0.25f * right); },
      [&] { return (left + right) / (2.5f + own * own) + 0.125f * k; },
      [&] { return own + 0.125f * k * own * (1.0f - own * own) * left; },
      [&] { return own * exp(-0.25f * k * k) + 0.25f * left * right / (1.0f + own * own); },
      [&] { return max(left, right * k) * 0.5f + own * 0.25f; },
      [&] { return k * 0.25f - 0.5f * log(exp(-left) + exp(-right)); },
      [&] { return select(l.t % 2 == 0, own, sin(left) * k); },
      [&] { return 1.5f * sin(own) - 0.5f * neighbour(l, 0, 0, l.back) * k; },
  });
}

// Reads states of this step that a sweep has already computed, and of the one before.
Expr WorkloadMaker::swept_step(const TimeLoop& l) {
  const Expr own = neighbour(l, 0, 0, 1), k = coefficient();
  const Expr before = neighbour(l, l.moves_x() ? -1 : 0, l.moves_x() ? 0 : -1, 0);
  return c_.one_of<Expr>({
      [&] { return own * 0.5f + 0.25f * before * k; },
      [&] { return 0.5f * sin(before) * own + 0.25f * k * neighbour(l, 1, 0, 1); },
  });
}

// ---- what is read of the loop ----

WorkloadMaker::Grid WorkloadMaker::steps_read(const TimeLoop& l) {
  const Expr end = l.slot(l.slots - 1), before = l.slot(l.slots - 2);
  const auto u = [&](const Expr& at_x, const Expr& at_y, const Expr& at_t) {
    return Expr(l.u(l.at(at_x, at_y, at_t)).element(0));
  };
  const auto like_start = [&](const char* name, const Expr& value) {
    return grid(name, l.width, l.height, l.is_line, Tuple(value));
  };
  return c_.one_of<Grid>({
      [&] { return like_start("last", u(x, y, end)); },
      [&] {
        if (l.values == 1) return like_start("last", u(x, y, end) * u(x, y, end));
        return like_start("last", u(x, y, end) * l.u(l.at(x, y, end)).element(1));
      },
      [&] { return like_start("change", u(x, y, end) - 0.5f * u(x, y, before)); },
      [&] { return grid("steps", l.width, l.slots, false, Tuple(u(x, l.height / 2, y))); },
      [&] { return line("trace", l.slots, u(l.width / 2, l.height / 2, x)); },
      [&] { return grid("some", l.width, (l.slots + 1) / 2, false, Tuple(u(x, 0, 2 * y))); },
      [&] {
        const RDom q(0, l.slots);
        Grid all = like_start("sum", Expr(0.0f));
        all.f(variables(l.is_line)) += u(x, y, q.x) * 0.25f;
        return all;
      },
  });
}

WorkloadMaker::Grid WorkloadMaker::kept_steps(const Grid& a) {
  TimeLoop l = choose_loop(a);
  define_start(l, a);
  choose_domain(l);
  const bool sweeps = l.sweeps && (l.moves_x() || l.moves_y());
  const Expr next = sweeps ? swept_step(l) : c_.chance(50) ? nonlinear_step(l) : linear_step(l);
  const std::vector<Expr> written = l.at(l.x, l.y, l.slot(l.t));
  if (l.values == 1) {
    l.u(written) = next;
  } else {
    const Expr other = neighbour(l, 0, 0, 1, 1);
    l.u(written) = Tuple(next + 0.25f * other, other * 0.5f - 0.25f * neighbour(l, 1, 0, 1));
  }
  p_.funcs.push_back(l.u);
  p_.has_loop = true;
  return steps_read(l);
}

}  // namespace retrograde::fuzz
