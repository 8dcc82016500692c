// Index arrays of workloads: gathers and scatters by integer inputs, and reads at constant indices.
#include <algorithm>

#include "frontend/language/inline_reductions.h"
#include "testing/programs/workload_maker.h"

namespace retrograde::fuzz {

WorkloadMaker::Index WorkloadMaker::integers(int count, int low, int high) {
  Buffer<int> data(std::vector<int>{count}, "indices" + std::to_string(index_arrays_++));
  std::mt19937 random(static_cast<unsigned>(c_.below(1 << 16)));
  data.get()->for_each_value([&](int& v) {
    v = low + static_cast<int>(random() % static_cast<unsigned>(high - low + 1));
  });
  if (!c_.chance(30)) return [data](const Expr& i) { return data(i); };
  ImageParam handle(Int(32), 1, data.name() + "_given");
  handle.set(data);
  return [handle](const Expr& i) { return Expr(handle(i)); };
}

// Clamped indices may be out of range by one; promised ones are not. Large arrays repeat indices and leave some out.
WorkloadMaker::Index WorkloadMaker::indices(int count, int size) {
  if (c_.chance(30)) {
    const Index index = integers(count, 0, size - 1);
    return [=](const Expr& i) { return unsafe_promise_clamped(index(i), 0, size - 1); };
  }
  const Index index = integers(count, -1, size);
  return [=](const Expr& i) { return clamp(index(i), 0, size - 1); };
}

// ---- gathers ----

WorkloadMaker::Grid WorkloadMaker::gathered(const Grid& a) {
  const int count = extent();
  const Index index = indices(count, a.width);
  const auto of = [&](const Expr& value) {
    return grid("gathered", count, a.height, a.is_line, Tuple(value));
  };
  return c_.one_of<Grid>({
      [&] { return of(a(index(x), y)); },
      [&] { return of(smooth(a(index(x), y)) * coefficient()); },
      [&] { return of(input({count})({x}) * a(index(x), y)); },
      [&] { return of(a(index(index(x) % count), y)); },  // an index of an index
      [&] {  // the index along the outer dimension of the result
        return grid("rows", a.height, count, false, Tuple(smooth(a(index(y), x))));
      },
  });
}

// Indices beyond the border of the grid, where a boundary condition gives values.
WorkloadMaker::Grid WorkloadMaker::gathered_from_border(const Grid& a) {
  const int count = extent();
  const Grid b = with_border(a);
  const Index index = integers(count, -2, a.width + 1);
  const Expr value = b(index(x), c_.chance(50) ? Expr(y) : y - 1);
  return grid("beyond", count, a.height, a.is_line, Tuple(smooth(value) * coefficient()));
}

// Several elements of one table: differences along edges, neighbours, bags of entries.
WorkloadMaker::Grid WorkloadMaker::gathered_pairs(const Grid& a) {
  const int count = extent();
  const Index from = indices(count, a.width), to = indices(count, a.width);
  const Expr u = a(from(x), y), v = a(to(x), y);
  const auto of = [&](const Expr& value) {
    return grid("pairs", count, a.height, a.is_line, Tuple(value));
  };
  return c_.one_of<Grid>({
      [&] { return of(u * v); },
      [&] { return of(tanh(u - v) * coefficient()); },
      [&] { return of(u * a(min(from(x) + 1, a.width - 1), y)); },
      [&] {  // y may be read at another index
        return of(u + smooth(v) * a(to(x), min(y + 1, a.height - 1)));
      },
      [&] {
        const RDom r(0, count);
        return grid("bag", a.width, a.height, a.is_line,
                    Tuple(sum(r, a(from(r.x), y) * a(x, y)) * 0.25f));
      },
  });
}

// ---- scatters ----

WorkloadMaker::Grid WorkloadMaker::scattered(const Grid& a) {
  const int size = extent();
  const Index index = indices(a.width, size);
  Grid out = grid("scattered", size, a.height, a.is_line, Tuple(Expr(0.0f)));
  const bool is_loop = !a.is_line && c_.chance(40);
  const RDom r = is_loop ? RDom(0, a.width, 0, a.height) : RDom(0, a.width);
  std::vector<Expr> place{index(r.x)};
  if (!a.is_line) place.push_back(is_loop ? Expr(r.y) : Expr(y));
  const Expr value = a(r.x, is_loop ? Expr(r.y) : Expr(y));
  const Expr added = c_.one_of<Expr>({
      [&] { return value; },
      [&] { return smooth(value) * coefficient(); },
      [&] { return value * input({a.width})({r.x}); },
  });
  out.f(place) += added;
  return out;
}

// The last value of each index counts, or the largest; or values are multiplied.
WorkloadMaker::Grid WorkloadMaker::overwritten_by_index(const Grid& a) {
  const int size = extent();
  const Index index = indices(a.width, size);
  Grid out = grid("stored", size, a.height, a.is_line, Tuple(Expr(0.5f)));
  const RDom r(0, a.width);
  std::vector<Expr> place{index(r.x)};
  if (!a.is_line) place.emplace_back(y);
  const Expr value = a(r.x, y), old = out.f(place);
  out.f(place) = c_.one_of<Expr>({
      [&] { return smooth(value); },
      [&] { return max(old, value); },
      [&] { return old * (1.0f + 0.125f * value); },
      [&] { return old * 0.5f + value * 0.25f; },
  });
  return out;
}

// Messages along the edges of a graph, added up at their targets.
WorkloadMaker::Grid WorkloadMaker::messages(const Grid& a) {
  const int edges = extent();
  const Index source = indices(edges, a.width), target = indices(edges, a.width);
  const Expr w = c_.chance(50) ? input({edges})({t}) : coefficient();
  Func message = named("message");
  const Expr from = a(source(t), y), to = a(target(t), y);
  const Expr sent = c_.chance(50) ? tanh(from - to) : from * to;
  message(t, y) = sent * w;
  p_.funcs.push_back(message);
  Grid out = grid_like(a, "received", c_.chance(50) ? a(x, y) : Expr(0.0f));
  const RDom r(0, edges);
  std::vector<Expr> place{target(r.x)};
  if (!a.is_line) place.emplace_back(y);
  out.f(place) += message(r.x, a.is_line ? Expr(0) : Expr(y)) * 0.5f;
  return out;
}

// A sparse matrix in coordinates, times the columns of the grid.
WorkloadMaker::Grid WorkloadMaker::sparse_product(const Grid& a) {
  const int entries = extent(), rows = extent();
  const Index row = indices(entries, rows), column = indices(entries, a.width);
  const Input values = input({entries});
  Grid out = grid("product", rows, a.height, a.is_line, Tuple(Expr(0.0f)));
  const RDom r(0, entries);
  std::vector<Expr> place{row(r.x)};
  if (!a.is_line) place.emplace_back(y);
  out.f(place) += values({r.x}) * a(column(r.x), y);
  if (!c_.chance(40)) return out;
  keep(out);
  return grid_like(out, "softened", smooth(out(x, y)));
}

// Sums of consecutive elements, whose segments are given by their ends or by a number for each element.
WorkloadMaker::Grid WorkloadMaker::segments(const Grid& a) {
  const int count = c_.between(1, 4);
  Grid out = grid("segments", count, a.height, a.is_line, Tuple(Expr(0.0f)));
  RDom r(0, a.width);
  if (c_.chance(50)) {
    const Index segment = indices(a.width, count);
    out.f(variables(a.is_line)) += select(segment(r.x) == x, smooth(a(r.x, y)), 0.0f);
    return out;
  }
  const Index end = indices(count, a.width);
  r.where(r.x <= end(x) && r.x >= end(max(x - 1, 0)));
  out.f(variables(a.is_line)) += smooth(a(r.x, y));
  return out;
}

// ---- constant indices ----

// Residuals of observations, each of a camera with a few parameters: they share nonlinear expressions.
WorkloadMaker::Grid WorkloadMaker::residuals(const Grid& a) {
  const int parameters = c_.between(2, 6), cameras = c_.between(1, 5), outputs = c_.between(1, 3);
  const Input camera = input({parameters, cameras});
  const Index of = indices(a.width, cameras);
  const Expr at = c_.chance(70) ? of(x) : x % cameras;
  std::vector<Expr> p;
  for (int k = 0; k < parameters; ++k) p.push_back(camera({Expr(k), at}));
  const Expr point = a(x, 0), angle = sqrt(p[0] * p[0] + p[1] * p[1] + 0.25f);
  const Expr turned = point * cos(angle) + p[1] * sin(angle) / angle;
  const Expr depth = 2.5f + turned * turned;
  Expr scale = 1.0f / depth;
  for (size_t k = 2; k < p.size(); ++k) scale = scale * (1.0f + 0.125f * p[k] * turned);
  const std::vector<Expr> values{turned * scale, p.back() * scale - point, angle * turned};
  Expr value = values[0];
  for (int k = 1; k < outputs; ++k) value = select(y == k, values[static_cast<size_t>(k)], value);
  if (outputs == 1)
    return line("residual", a.width, value * a(x, c_.chance(50) ? 0 : a.height - 1));
  return grid("residual", a.width, outputs, false, Tuple(value));
}

// Channels along one dimension, read at constant indices: colour conversions, products of small vectors.
WorkloadMaker::Grid WorkloadMaker::channels_mixed(const Grid& a) {
  if (a.is_line) return {};
  const int channels = std::min(a.height, 3);
  const auto c = [&](int k) { return a(x, std::min(k, channels - 1)); };
  const Expr k = coefficient(), bright = 0.25f * c(0) + 0.5f * c(1) + 0.125f * c(2);
  const Expr root = sqrt(bright * bright + 0.25f);
  return c_.one_of<Grid>({
      [&] { return line("luma", a.width, smooth(bright)); },
      [&] { return line("norm", a.width, sqrt(c(0) * c(0) + c(1) * c(1) + c(2) * c(2) + 0.25f)); },
      [&] {
        return grid_like(a, "colours",
                         mux(min(Expr(y), 2), {root * k, (c(2) - bright) / root, c(0) * root}));
      },
      [&] { return grid_like(a, "ratio", a(x, y) / (1.5f + root * root)); },
      [&] {
        return grid(
            "turned", a.width, 2, false,
            Tuple(select(y == 0, c(0) * cos(k) - c(1) * sin(k), c(0) * sin(k) + c(1) * root)));
      },
  });
}

// Linear interpolation at positions that are data.
WorkloadMaker::Grid WorkloadMaker::interpolated(const Grid& a) {
  const int count = extent();
  const Expr at = (input({count})({x}) + 1.25f) * (0.4f * static_cast<float>(a.width));
  const Expr low = cast<int>(floor(at)), w = at - floor(at);
  const auto read = [&](const Expr& i) { return a(clamp(i, 0, a.width - 1), y); };
  return grid("interpolated", count, a.height, a.is_line, Tuple(lerp(read(low), read(low + 1), w)));
}

}  // namespace retrograde::fuzz
