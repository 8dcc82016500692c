// Structures of users' programs over the last Func: pyramids, sliced histograms, convolutions, tables, scans,
// consecutive loops, argmax, domains with parametric bounds, boundary conditions of boundary conditions.
#include "frontend/language/inline_reductions.h"
#include "testing/programs/maker.h"

namespace retrograde::fuzz {

// The last Func at (u, v), as far as it has these dimensions.
Expr Maker::last_at(const Expr& u, const Expr& v) {
  const Func& last = p_.funcs.back();
  std::vector<Expr> place{u, v, Expr(1)};
  place.resize(static_cast<size_t>(last.dimensions()));
  return converted(Float(32), last(place).element(0));
}

Func Maker::define(const std::string& name, const std::vector<Var>& vars, const Tuple& values) {
  Func f(name + std::to_string(p_.funcs.size()));
  f(vars) = values;
  finish(f);
  return f;
}

Func Maker::define(const std::string& name, const std::vector<Var>& vars, const Expr& value) {
  return define(name, vars, Tuple(value));
}

// A pyramid: down- and upsampled, with the residual times a gain, on a mirrored border of run-time size.
void Maker::add_pyramid() {
  const bool in_both = c_.chance(40);
  const auto half = [&](const Expr& v) { return in_both ? v / 2 : v; };
  const auto twice = [&](const Expr& v) { return in_both ? 2 * v : v; };
  std::vector<Func> levels{define("level", {x, y}, last_at(x, y))};
  if (c_.chance(30)) levels.push_back(with_mirrored_border(levels.back()));
  for (int n = c_.between(1, 4); n > 0; --n) {
    const Func f = levels.back();
    const int shift = c_.around_zero(1);
    const Expr sides = f(2 * x - 1 + shift, twice(y)) + f(2 * x + 1 + shift, twice(y));
    levels.push_back(define("down", {x, y}, (f(2 * x, twice(y)) * 2.0f + sides) * 0.25f));
  }
  Func up = levels.back();
  for (size_t i = levels.size() - 1; i-- > 0;) {
    const Expr fine = levels[i](x, y), odd = cast<float>(x % 2);
    const Expr coarse = lerp(up(x / 2, half(y)), up((x + 1) / 2, half(y)), 0.25f + odd * 0.5f);
    const Expr gain = c_.chance(40) ? Expr(p_.scale) : fine;
    up = define("up", {x, y},
                c_.chance(50) ? coarse + (fine - coarse) * gain : coarse * 0.5f + sin(fine));
  }
}

Func Maker::with_mirrored_border(const Func& f) {
  Region region;
  for (int d = 0; d < 2; ++d) region.push_back({Expr(0), p_.count + c_.between(1, 3)});
  return bounded(c_.between(2, 4), 0.5f, f, region);
}

// A small bilateral grid: sums and counts of similar values, blurred, interpolated between its planes.
void Maker::add_grid() {
  const Func guide = define("guide", {x}, clamp(last_at(x, 1), 0.0f, 1.0f));
  RDom r(0, natural_size);
  if (c_.chance(30)) r.where(place_condition({r.x}));
  const Expr bin = cast<int>(guide(r.x) * 3.0f),
             value = guide(r.x) * read_image({{r.x}, {}, Func(), {}});
  Func grid = define("grid", {x, y}, Tuple(0.0f, 0.0f));
  const FuncRef cell = grid(r.x / 2, clamp(bin, 0, 3));
  grid(r.x / 2, clamp(bin, 0, 3)) = {cell[0] + converted(Float(32), value), cell[1] + 1.0f};
  const auto blur = [&](int k) {
    return grid(x, y)[k] + 0.5f * (grid(x - 1, y)[k] + grid(x + 1, y)[k] + grid(x, y - 1)[k]);
  };
  const Func blurred = define("blurred", {x, y}, Tuple(blur(0), blur(1)));
  const Expr z = guide(x) * 3.0f, plane = cast<int>(floor(z)), w = z - floor(z);
  const auto read = [&](int k) {
    return lerp(blurred(x / 2, clamp(plane, 0, 3))[k], blurred(x / 2, clamp(plane + 1, 0, 4))[k],
                w);
  };
  define("sliced", {x}, read(0) / (read(1) + 0.5f));
}

// A convolution with weights from an image, for each tap, input channel and output channel.
void Maker::add_convolution() {
  const auto i = static_cast<size_t>(c_.below(static_cast<int>(p_.images.size())));
  const Buffer<>& weights = p_.images[i];
  const int stride = c_.between(1, 2);
  RDom r(-1, 3, 0, c_.between(1, 3), 0, c_.between(1, 2));
  if (c_.chance(20)) r.where(place_condition({r.x, r.y}));
  std::vector<Expr> place{(r.x + 1 + 3 * y) % weights.extent(0), (r.y + y + r.z) % natural_size,
                          r.z % 2};
  place.resize(static_cast<size_t>(weights.dimensions()));
  for (size_t d = 0; d < place.size(); ++d) {
    const int min = weights.dim(static_cast<int>(d)).min();
    if (min != 0) place[d] = place[d] + min;
  }
  const Expr weight = p_.handles[i].defined() ? p_.handles[i](place) : Expr(weights(place));
  Func sums = define("conv", {x, y}, c_.chance(50) ? last_at(x, 0) : Expr(0.0f));
  const Func source = p_.funcs[p_.funcs.size() - 2];
  std::vector<Expr> tap{stride * x + r.x, r.y + r.z, Expr(0)};
  tap.resize(static_cast<size_t>(source.dimensions()));
  sums(x, y) += converted(Float(32), source(tap).element(0)) * converted(Float(32), weight);
  if (c_.chance(50))
    define("relu", {x, y}, max(sums(x, y), c_.chance(50) ? 0.0f : 0.1f * sums(x, y)));
}

// A learned table, read at a data-dependent index or between two entries.
void Maker::add_table() {
  const Func values = define("values", {x, y}, last_at(x, y));
  const Func table = define("table", {x}, sin(values(x, 1) + cast<float>(x) * p_.scale));
  const Expr v = clamp(values(x, y) * 4.0f, 0.0f, 7.0f), low = cast<int>(floor(v));
  const Expr nearest = table(clamp(low, 0, 7));
  define("looked_up", {x, y},
         c_.chance(50) ? nearest * values(x, y)
                       : lerp(nearest, table(clamp(low + 1, 0, 7)), v - floor(v)));
}

// Scans along both axes, forward or backward.
void Maker::add_scans() {
  Func s = define("scan", {x, y}, last_at(x, y));
  RDom r(1, natural_size - 1);
  const auto step = [&](const Expr& now, const Expr& before) {
    return c_.one_of<Expr>({
        [&] { return now + before; },
        [&] { return now * 0.5f + before * 0.75f; },
        [&] { return sin(now + before); },
        [&] { return max(now, before); },
    });
  };
  s(r, y) = step(s(r, y), s(r - 1, y));
  s(x, r) = step(s(x, r), s(x, r - 1));
  const Expr back = natural_size - 1 - r;
  if (c_.chance(40)) s(back, y) = step(s(back, y), s(back + 1, y));
  if (c_.chance(40)) s(x, back) = step(s(x, back), s(x, back + 1));
}

// Two loops: one keeps its steps and drives another that overwrites its state.
void Maker::add_two_loops() {
  const int steps = c_.between(2, 6);
  const Var t("t");
  const Func start = define("start", {x}, last_at(x, 1));
  Func wave = define("wave", {x, t}, Expr(start(x)));
  RDom r(0, natural_size, 1, steps), q(1, steps);
  const Expr beside = clamp(r.x + 1, 0, natural_size - 1);
  wave(r.x, r.y) = tanh(wave(r.x, r.y - 1) * 0.75f + wave(beside, r.y - 1) * 0.5f);
  Func state = define("state", {x}, Tuple(start(x), start(x + 1)));
  const Expr driven = state(x)[0] + 0.25f * wave(x, q) * state(x)[1];
  state(x) = {driven,
              c_.chance(50) ? state(x)[1] - 0.25f * state(x)[0] : cos(state(x)[1] * driven)};
}

// The value at the position where another Func is largest.
void Maker::add_place_of_maximum() {
  const Func f = define("scores", {x, y}, last_at(x, y));
  RDom r(0, c_.between(2, natural_size));
  const Tuple best = c_.chance(50) ? argmax(r, f(x + r, y)) : argmin(r, f(x, y - r));
  const Expr at = clamp(best[0], 0, natural_size - 1);
  define("best", {x, y}, f(c_.chance(50) ? at : x + at, y) * best[1] + best[1]);
}

// Triangular and banded domains with parametric bounds.
void Maker::add_parametric_sum() {
  const Func f = define("source", {x, y}, last_at(x, y));
  const Expr rows = c_.chance(30) ? max(p_.count - c_.between(1, 4), 0) : Expr(p_.count);
  RDom r(0, c_.chance(50) ? p_.count + 1 : Expr(natural_size), c_.around_zero(1), rows);
  r.where(c_.one_of<Expr>({
      [&] { return r.x + r.y < p_.count; },
      [&] { return r.x <= r.y && r.y < 2 * p_.count - r.x; },
      [&] { return abs(r.x - r.y) < p_.count && r.x % 2 == 0; },
      [&] { return f(r.x, r.y) > 0.5f; },
  }));
  Func s = define("band", {x}, Expr(f(x, 0)));
  if (c_.chance(50)) {
    s(x) += f(x + r.x, r.y) * f(x, p_.count);
  } else {
    s(r.x) = s(r.x) * 0.5f + f(r.x, r.y) * f(r.y, 1);
  }
}

void Maker::add_boundaries() {
  Func f = define("inside", {x, y}, last_at(x, y));
  for (int n = c_.between(1, 3); n > 0; --n) {
    Region region;
    for (int d = 0; d < 2; ++d)
      region.push_back({Expr(c_.around_zero(1)),
                        c_.chance(40) ? p_.count + 1 : Expr(c_.between(2, natural_size))});
    const Func around = bounded(c_.below(5), 0.5f, f, region);
    RDom taps(0, c_.between(2, 3));
    const Expr sides = c_.chance(30) ? sum(taps, around(x + taps - 1, y) * p_.scale)
                                     : around(x + c_.around_zero(2), y);
    f = define("around", {x, y}, sides + f(x, y) * 0.25f);
  }
}

void Maker::add_structure() {
  static constexpr void (Maker::*adds[])() = {&Maker::add_pyramid,
                                              &Maker::add_grid,
                                              &Maker::add_convolution,
                                              &Maker::add_table,
                                              &Maker::add_scans,
                                              &Maker::add_two_loops,
                                              &Maker::add_place_of_maximum,
                                              &Maker::add_parametric_sum,
                                              &Maker::add_boundaries};
  (this->*adds[c_.below(9)])();
}

}  // namespace retrograde::fuzz
