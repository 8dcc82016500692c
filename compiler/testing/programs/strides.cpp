// Strides of workloads: convolutions, hops along a signal, changes of resolution, remainders and selects by parity.
// Borders are read within the grid, or clamped.
#include "frontend/language/inline_reductions.h"
#include "testing/programs/workload_maker.h"

namespace retrograde::fuzz {

// ---- convolutions along x ----

// out(x) = sum over r of w(r) a(stride x + dilation r), as an inline sum, an update or reads at constant offsets.
WorkloadMaker::Grid WorkloadMaker::strided_convolution(const Grid& a) {
  const int stride = c_.between(1, 4), dilation = c_.between(1, 3), taps = c_.between(1, 4);
  const bool has_border = c_.chance(30);
  const int reach = has_border ? 0 : dilation * (taps - 1),
            width = (a.width - 1 - reach) / stride + 1;
  if (a.width - 1 < reach) return {};
  const Grid source = has_border ? with_border(a) : a;
  const Input w = input({taps});
  const auto tap = [&](const Expr& k) {
    const Expr place = (stride == 1 ? Expr(x) : stride * x) + dilation * k;
    return source(has_border ? place - dilation * (taps / 2) : place, y) * w({k});
  };
  const RDom r(0, taps);
  const auto of = [&](const Expr& value) {
    return grid("conv", width, a.height, a.is_line, Tuple(value));
  };
  return c_.one_of<Grid>({
      [&] { return of(sum(r, tap(r.x))); },
      [&] {
        Grid sums = of(Expr(0.0f));
        sums.f(variables(a.is_line)) += tap(r.x);
        return sums;
      },
      [&] {
        Expr all = tap(0);
        for (int k = 1; k < taps; ++k) all = all + tap(k);
        return of(all);
      },
      [&] { return of(maximum(r, tap(r.x))); },
  });
}

// A dilated window of the grid in both dimensions, clamped at the border; y may be a channel that is mixed.
WorkloadMaker::Grid WorkloadMaker::dilated_window(const Grid& a) {
  const int dilation = c_.between(1, 4), taps = c_.between(2, 3);
  const auto u = [&](const Expr& k) {
    return clamp(x + dilation * (k - taps / 2), 0, a.width - 1);
  };
  if (a.is_line) {
    const Input w = input({taps});
    const RDom r(0, taps);
    return grid_like(a, "dilated", smooth(sum(r, a(u(r.x), y) * w({r.x}))));
  }
  const bool mixes = c_.chance(50);
  const Input w = input({taps, mixes ? a.height : taps});
  const RDom r(0, taps, 0, mixes ? a.height : taps);
  const Expr v = mixes ? Expr(r.y) : clamp(y + dilation * (r.y - taps / 2), 0, a.height - 1);
  return grid_like(a, "dilated", smooth(sum(r, a(u(r.x), v) * w({r.x, r.y})) * 0.5f));
}

// ---- transposed convolutions ----

// out(stride i + k) += w(k) a(i).
WorkloadMaker::Grid WorkloadMaker::transposed_by_scatter(const Grid& a) {
  const int stride = c_.between(1, 4), taps = c_.between(1, 4), dilation = c_.between(1, 2);
  const int width = stride * (a.width - 1) + dilation * (taps - 1) + 1;
  const Input w = input({taps});
  Grid out = grid("transposed", width, a.height, a.is_line, Tuple(Expr(0.0f)));
  const bool taps_first = c_.chance(50);
  const RDom r = taps_first ? RDom(0, taps, 0, a.width) : RDom(0, a.width, 0, taps);
  const Expr k = taps_first ? r.x : r.y, i = taps_first ? r.y : r.x;
  const Expr place = stride * i + dilation * k;
  if (a.is_line) {
    out.f(place) += a(i, y) * w({k});
  } else {
    out.f(place, y) += a(i, y) * w({k});
  }
  return out;
}

// out(x) = sum over k with (x - k) % stride == 0 of w(k) a((x - k) / stride).
WorkloadMaker::Grid WorkloadMaker::transposed_by_division(const Grid& a) {
  const int stride = c_.between(2, 4), taps = c_.between(1, 4);
  const int width = stride * (a.width - 1) + taps;
  const Input w = input({taps});
  const auto term = [&](const Expr& k) {
    const Expr from = (x - k) / stride;
    const Expr is_read = (x - k) % stride == 0 && from >= 0 && from < a.width;
    return select(is_read, a(clamp(from, 0, a.width - 1), y) * w({k}), 0.0f);
  };
  Expr value = term(0);
  if (c_.chance(50)) {
    const RDom r(0, taps);
    value = sum(r, term(r.x));
  } else {
    for (int k = 1; k < taps; ++k) value = value + term(k);
  }
  return grid("transposed", width, a.height, a.is_line, Tuple(value));
}

// The weights of an upsampling by phase: out(x) = sum over j of w(j, x % stride) a(x / stride + j).
WorkloadMaker::Grid WorkloadMaker::by_phases(const Grid& a) {
  const int stride = c_.between(2, 4), taps = c_.between(1, 3);
  if (a.width < taps) return {};
  const Input w = input({taps, stride});
  const RDom r(0, taps);
  const Expr value = sum(r, w({r.x, x % stride}) * a(x / stride + r.x, y));
  return grid("phases", stride * (a.width - taps + 1), a.height, a.is_line, Tuple(value));
}

// ---- hops along a signal ----

// Windowed frames of the first row, and their products with filters: out(k, t) = sum of signal(hop t + r) w(r, k).
WorkloadMaker::Grid WorkloadMaker::frames_of(const Grid& a) {
  const int hop = c_.between(1, 4), window = c_.between(1, 5), filters = c_.between(1, 3);
  if (a.width < window) return {};
  const int frames = (a.width - window) / hop + 1;
  const Input w = input({window, filters});
  const RDom r(0, window);
  const Expr term = a(hop * y + r.x, 0) * w({r.x, x});
  if (c_.chance(50)) {
    Grid out = grid("frames", filters, frames, false, Tuple(Expr(0.0f)));
    out.f(x, y) += term;
    return out;
  }
  const Expr power = sum(r, term);
  return grid("frames", filters, frames, false, Tuple(smooth(power) + power * power * 0.25f));
}

// Overlapping frames are added up: out(hop t + r) += a(r, t) w(r).
WorkloadMaker::Grid WorkloadMaker::overlap_added(const Grid& a) {
  if (a.is_line) return {};
  const int hop = c_.between(1, 4);
  const Input w = input({a.width});
  Grid out = line("signal", hop * (a.height - 1) + a.width, Expr(0.0f));
  const RDom r(0, a.width, 0, a.height);
  out.f(hop * r.y + r.x) += a(r.x, r.y) * w({r.x});
  return out;
}

// ---- resolutions ----

WorkloadMaker::Grid WorkloadMaker::downsampled(const Grid& a) {
  const int factor = c_.between(2, 4);
  if (a.width < factor) return {};
  const bool in_both = !a.is_line && a.height >= 2 && c_.chance(50);
  const Expr v = in_both ? 2 * y : Expr(y);
  Expr value = a(factor * x, v) + a(factor * x + 1, v) * coefficient();
  if (in_both) value = value * 0.5f + a(factor * x, v + 1);
  return grid("down", a.width / factor, in_both ? a.height / 2 : a.height, a.is_line,
              Tuple(c_.chance(50) ? value * 0.5f : max(value, a(factor * x + factor - 1, v))));
}

WorkloadMaker::Grid WorkloadMaker::upsampled(const Grid& a) {
  const int factor = c_.between(2, 3);
  const auto up = [&](const Expr& value) {
    return grid("up", factor * a.width, a.height, a.is_line, Tuple(value));
  };
  const Expr near = a(x / factor, y), next = a(min(x / factor + 1, a.width - 1), y);
  // Float32 holds all weights: at a constant x they are folded, and the interpreter compares in double.
  const Expr weight = cast<float>(x % factor) * (factor == 2 ? 0.5f : 0.25f);
  return c_.one_of<Grid>({
      [&] { return up(smooth(near)); },
      [&] { return up(lerp(near, next, weight)); },
      [&] { return up(select(x % factor == 0, near, (near + next) * 0.5f)); },
      [&] { return up(near * next + near * coefficient()); },
  });
}

// A chain of two changes of resolution, at an offset.
WorkloadMaker::Grid WorkloadMaker::there_and_back(const Grid& a) {
  if (a.width < 2) return {};
  const int offset = c_.below(2);
  if (c_.chance(50)) {
    const Grid down =
        grid("coarse", a.width / 2, a.height, a.is_line, Tuple(smooth(a(2 * x + offset, y))));
    keep(down);
    return grid("fine", 2 * down.width, a.height, a.is_line,
                Tuple(down(x / 2, y) * a(x, y) + down((2 * x) / 4, y)));
  }
  const Grid up = grid("fine", 2 * a.width, a.height, a.is_line, Tuple(smooth(a(x / 2, y))));
  keep(up);
  const Expr value = up(2 * x + 1, y) + 0.5f * up(2 * x + offset, y) * coefficient();
  return grid("coarse", a.width, a.height, a.is_line, Tuple(value));
}

// Pixel shuffles between the two dimensions, both ways.
WorkloadMaker::Grid WorkloadMaker::shuffled(const Grid& a) {
  if (a.is_line) return {};
  const int factor = c_.between(2, 3);
  if (a.height >= factor && c_.chance(50)) {
    const Expr value = a(x / factor, factor * y + x % factor);
    return grid("shuffled", factor * a.width, a.height / factor, false, Tuple(smooth(value)));
  }
  if (a.width < factor) return {};
  const Expr value = a(factor * x + y % factor, y / factor);
  return grid("unshuffled", a.width / factor, factor * a.height, false, Tuple(smooth(value)));
}

// ---- parity and remainders ----

WorkloadMaker::Grid WorkloadMaker::by_parity(const Grid& a) {
  const int of = c_.between(2, 3);
  const Expr phase = x % of, here = a(x, y), mirrored = a(a.width - 1 - x, y);
  return c_.one_of<Grid>({
      [&] { return grid_like(a, "parity", select(phase == 0, here, smooth(mirrored))); },
      [&] {
        return grid_like(a, "parity",
                         select((a.is_line ? Expr(x) : x + y) % 2 == 0, here * 2.0f, here * here));
      },
      [&] {
        const Expr value = select(phase == 0, a(x / of, y), smooth(a(a.width - 1 - x / of, y)));
        return grid("interleaved", of * a.width, a.height, a.is_line, Tuple(value));
      },
      [&] {  // the other one of two neighbours
        return grid_like(a, "swapped", a(clamp(x + 1 - 2 * (x % 2), 0, a.width - 1), y) * here);
      },
      [&] { return grid_like(a, "parity", here * cast<float>(phase + 1) * coefficient()); },
  });
}

WorkloadMaker::Grid WorkloadMaker::by_remainder(const Grid& a) {
  const int size = c_.between(1, 4), factor = c_.between(1, 5), offset = c_.between(0, 3);
  const Input w = input({size});
  const int width = a.width + c_.below(5);
  const Expr cyclic = a((factor * x + offset) % a.width, y);
  return grid("cyclic", width, a.height, a.is_line, Tuple(cyclic * w({x % size})));
}

// A step of a lifting wavelet, in place: odd elements, then even ones.
WorkloadMaker::Grid WorkloadMaker::lifted(const Grid& a) {
  if (a.width < 2) return {};
  Grid f = grid_like(a, "lifted", a(x, y));
  const RDom odd(0, a.width / 2), even(0, (a.width + 1) / 2);
  const auto at = [&](const Expr& u) {
    return a.is_line ? std::vector<Expr>{u} : std::vector<Expr>{u, y};
  };
  const auto inside = [&](const Expr& u) { return clamp(u, 0, a.width - 1); };
  const Expr k = coefficient();
  const Expr i = 2 * odd.x, j = 2 * even.x;
  f.f(at(i + 1)) = f(i + 1, y) - 0.5f * k * (f(i, y) + f(inside(i + 2), y));
  if (c_.chance(70)) f.f(at(j)) += 0.25f * sin(f(inside(j + 1), y));
  return f;
}

}  // namespace retrograde::fuzz
