#include "testing/programs/workloads.h"

#include <algorithm>

#include "frontend/language/boundary_conditions.h"
#include "testing/programs/workload_maker.h"

namespace retrograde::fuzz {

int WorkloadMaker::extent() { return c_.pick(std::vector<int>{3, 1, 2, 5, 4, 7, 9, 17}); }

// ---- inputs ----

// Values from 1/4 to 5/4, of either sign in half of the inputs. A step of 2^-7 to either side is exact.
WorkloadMaker::Input WorkloadMaker::input(const std::vector<int>& extents) {
  if (p_.images.size() >= most_inputs) return [](const std::vector<Expr>&) { return Expr(0.5f); };
  Buffer<float> image(extents, "input" + std::to_string(p_.images.size()));
  std::mt19937 random(static_cast<unsigned>(c_.below(1 << 16)));
  const bool has_signs = c_.chance(50);
  image.get()->for_each_value([&](float& v) {
    v = 0.25f + static_cast<float>(random() % 4096) / 4096.0f;
    if (has_signs && random() % 2 == 0) v = -v;
  });
  p_.images.push_back(image);
  p_.handles.emplace_back();
  if (!c_.chance(30)) return [image](const std::vector<Expr>& place) { return image(place); };
  ImageParam handle(Float(32), image.dimensions(), image.name() + "_given");
  handle.set(image);
  p_.handles.back() = handle;
  return [handle](const std::vector<Expr>& place) { return Expr(handle(place)); };
}

WorkloadMaker::Grid WorkloadMaker::input_grid() {
  const bool is_line = c_.chance(40);
  const int width = extent(), height = is_line ? 1 : extent();
  const Input image = input(is_line ? std::vector<int>{width} : std::vector<int>{width, height});
  const Expr value = image(is_line ? std::vector<Expr>{x} : std::vector<Expr>{x, y});
  return grid("source", width, height, is_line, Tuple(value));
}

// ---- Funcs ----

std::vector<Var> WorkloadMaker::variables(bool is_line) const {
  return is_line ? std::vector<Var>{x} : std::vector<Var>{x, y};
}

void WorkloadMaker::keep(const Grid& grid) {
  p_.funcs.push_back(grid.f);
  grids_.push_back(grid);
}

WorkloadMaker::Grid WorkloadMaker::grid(const char* name, int width, int height, bool is_line,
                                        const Tuple& values) {
  Func f = named(name);
  f(variables(is_line)) = values;
  return {f, width, height, is_line};
}
WorkloadMaker::Grid WorkloadMaker::grid_like(const Grid& a, const char* name, const Expr& value) {
  return grid(name, a.width, a.height, a.is_line, Tuple(value));
}
WorkloadMaker::Grid WorkloadMaker::line(const char* name, int width, const Expr& value) {
  return grid(name, width, 1, true, Tuple(value));
}

WorkloadMaker::Grid WorkloadMaker::recent() {
  const int n = static_cast<int>(grids_.size());
  return grids_[static_cast<size_t>(n - 1 - c_.below(std::min(n, 3)))];
}

WorkloadMaker::Grid WorkloadMaker::with_border(const Grid& a) {
  using namespace BoundaryConditions;
  Region region{{Expr(0), Expr(a.width)}};
  if (!a.is_line) region.push_back({Expr(0), Expr(a.height)});
  const Func bordered = c_.one_of<Func>({
      [&] { return repeat_edge(a.f, region); },
      [&] { return constant_exterior(a.f, Expr(0.0f), region); },
      [&] { return repeat_image(a.f, region); },
      [&] { return mirror_image(a.f, region); },
      [&] { return mirror_interior(a.f, region); },
  });
  return {bordered, a.width, a.height, a.is_line};
}

// ---- values ----

Expr WorkloadMaker::smooth(const Expr& a) {
  return c_.one_of<Expr>({
      [&] { return a; },
      [&] { return a * 0.75f + 0.25f; },
      [&] { return sin(a); },
      [&] { return tanh(a); },
      [&] { return a * a * 0.5f; },
      [&] { return exp(-a * a); },
      [&] { return sqrt(a * a + 0.25f); },
      [&] { return a / (1.5f + a * a); },
      [&] { return max(a, 0.1f * a); },
  });
}

Expr WorkloadMaker::coefficient() {
  return c_.one_of<Expr>({
      [&] { return Expr(0.75f); },
      [&] { return Expr(p_.scale); },
      [&] {
        const int size = c_.between(1, 4);
        return input({size})({Expr(c_.below(size))});
      },
  });
}

// ---- the program ----

const std::vector<WorkloadMaker::Piece>& WorkloadMaker::pieces_of(Workload kind) {
  using M = WorkloadMaker;
  // Loops that keep their steps are drawn as often as all other loops together.
  static const std::vector<Piece> loops{
      &M::kept_steps,     &M::kept_steps, &M::kept_steps,        &M::kept_steps, &M::kept_steps,
      &M::swept_in_place, &M::red_black,  &M::recursive_filters, &M::aligned,    &M::matrix_powers};
  static const std::vector<Piece> strides{
      &M::strided_convolution,    &M::dilated_window, &M::transposed_by_scatter,
      &M::transposed_by_division, &M::by_phases,      &M::frames_of,
      &M::overlap_added,          &M::downsampled,    &M::upsampled,
      &M::there_and_back,         &M::shuffled,       &M::by_parity,
      &M::by_remainder,           &M::lifted};
  static const std::vector<Piece> index_arrays{&M::gathered,
                                               &M::gathered_pairs,
                                               &M::scattered,
                                               &M::overwritten_by_index,
                                               &M::messages,
                                               &M::sparse_product,
                                               &M::segments,
                                               &M::residuals,
                                               &M::channels_mixed,
                                               &M::interpolated,
                                               &M::gathered_from_border};
  return kind == Workload::TimeLoops ? loops : kind == Workload::Strides ? strides : index_arrays;
}

void WorkloadMaker::add_piece(Workload kind) {
  if (kind == Workload::Any) kind = static_cast<Workload>(c_.between(1, 3));
  const Grid made = (this->*c_.pick(pieces_of(kind)))(recent());
  if (!made.f.defined()) return;
  keep(made);
  static const char* const names[] = {"", "with time loops", "with strides", "with index arrays"};
  p_.contents.insert(names[static_cast<size_t>(kind)]);
}

void WorkloadMaker::run(Workload kind) {
  p_.scale.set(0.75f);
  keep(input_grid());
  for (int n = c_.between(1, 3); n > 0; --n) add_piece(kind);
  const int outputs = c_.between(1, 3);
  for (int n = outputs; n > 0; --n) add_output(n == outputs ? grids_.back() : recent());
  if (outputs > 1) p_.contents.insert("with several outputs");
}

// ---- outputs ----

// All of a region, or a part of it.
oracle::Region WorkloadMaker::part_of(const std::vector<int>& extents) {
  oracle::Region region;
  const bool is_part = c_.chance(30);
  for (const int size : extents) {
    const int min = is_part ? c_.below(size) : 0;
    region.mins.push_back(min);
    region.extents.push_back(is_part ? c_.between(1, size - min) : size);
  }
  return region;
}

void WorkloadMaker::make_output(const Func& f, const std::vector<int>& extents) {
  p_.funcs.push_back(f);
  p_.outputs.push_back(f);
  if (p_.runs.empty()) p_.runs.emplace_back();
  p_.runs.front().push_back(part_of(extents));
}

void WorkloadMaker::add_output(const Grid& a) {
  const std::vector<Var> vars = variables(a.is_line);
  std::vector<int> size{a.width};
  if (!a.is_line) size.push_back(a.height);
  const Expr value = a(x, y);
  Func out = named("out");
  switch (c_.below(6)) {
    case 0:
      out(vars) = smooth(value) * coefficient();
      break;
    case 1:
      out(vars) = Tuple(smooth(value), value * value);
      break;
    case 2:  // neighbours
      out(vars) = value * a(min(x + 1, a.width - 1), y);
      break;
    case 3: {  // a sum along rows
      const RDom r(0, a.width);
      out(y) = 0.0f;
      out(y) += a(r.x, y) * coefficient();
      size = {a.height};
      break;
    }
    case 4: {  // a loss
      const RDom r(0, a.width, 0, a.height);
      const Expr v = a(r.x, r.y);
      out() = 0.0f;
      out() += v * v * 0.25f;
      size = {};
      break;
    }
    default: {  // reads the output before
      const bool reads = !p_.outputs.empty() && p_.outputs.back().dimensions() == 0;
      out(vars) = smooth(value) + (reads ? Expr(p_.outputs.back()()) : Expr(0.25f));
    }
  }
  make_output(out, size);
}

RandomProgram make_workload(Choices& choices, Workload kind) {
  RandomProgram program;
  WorkloadMaker(choices, program).run(kind);
  return program;
}

}  // namespace retrograde::fuzz
