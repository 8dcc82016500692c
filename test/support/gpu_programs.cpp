#include "support/gpu_programs.h"

#include <algorithm>

namespace gpu_programs {
namespace {

using namespace retrograde;

Var x("x"), y("y"), z("z"), c("c"), k("k"), xi("xi"), yi("yi"), u("u"), v("v");

Buffer<float> picture(int width, int height) {
  Buffer<float> image(width, height);
  image.for_each_element([&](int i, int j) {
    image(i, j) = static_cast<float>((i * 37 + j * 101 + (i * j) % 17) % 256) / 256;
  });
  return image;
}

Func tiled(Func f, bool on_gpu, int width = 16, int height = 8) {
  if (on_gpu) f.compute_root().gpu_tile(x, y, xi, yi, width, height, TailStrategy::GuardWithIf);
  return f;
}

// ---- from linear algebra ----

// Each block stages its tile of both matrices in shared memory, 16 products at a time. Each thread keeps a square of
// sums in registers, 16 apart, so that neighbouring threads read neighbouring words.
Func matrix_product(bool on_gpu, int scale) {
  const int n = 64 * scale, threads = 16, each = scale == 1 ? 4 : 8, steps = 16;
  const Buffer<float> a = picture(n, n), b = picture(n, n);
  RDom r(0, n, "r");
  RVar ro("ro"), ri("ri");
  Var xt("xt"), yt("yt");
  Func sum("sum"), out("out"), left("left"), right("right");
  left(x, y) = a(x, y);
  right(x, y) = b(x, y);
  sum(x, y) = 0.0f;
  sum(x, y) += left(r, y) * right(x, r);
  out(x, y) = sum(x, y);
  if (on_gpu) {
    const auto square = [&](Stage stage, const Var& columns, const Var& rows) {
      return stage.split(columns, u, xt, threads).split(rows, v, yt, threads).unroll(u).unroll(v);
    };
    out.tile(x, y, xi, yi, threads * each, threads * each).gpu_blocks(x, y);
    square(out, xi, yi).reorder(u, v, xt, yt, x, y).gpu_threads(xt, yt);
    sum.compute_at(out, x).store_in(MemoryType::Register);
    square(sum, x, y).reorder(u, v, xt, yt).gpu_threads(xt, yt);
    square(sum.update().split(r, ro, ri, steps), x, y)
        .reorder(u, v, ri, xt, yt, ro)
        .unroll(ri)
        .gpu_threads(xt, yt);
    left.compute_at(sum, ro)
        .split(y, v, yt, threads)
        .reorder(v, x, yt)
        .unroll(v)
        .gpu_threads(x, yt);
    right.compute_at(sum, ro)
        .split(x, u, xt, threads)
        .reorder(u, xt, y)
        .unroll(u)
        .gpu_threads(xt, y);
  }
  return out;
}

// ---- filters ----

Func convolution(bool on_gpu, int scale) {
  const Buffer<float> in = picture(100 * scale, 60 * scale), weights = picture(3, 3);
  RDom r(-1, 3, -1, 3, "r");
  Func tile("tile"), sum("sum"), out("out");
  tile(x, y) = BoundaryConditions::repeat_edge(in)(x, y);
  sum(x, y) += tile(x + r.x, y + r.y) * weights(r.x + 1, r.y + 1);
  out(x, y) = sum(x, y);
  if (on_gpu) {
    tiled(out, true, 32, 4);
    tile.compute_at(out, x).gpu_threads(x, y);
    sum.compute_at(out, xi);
    sum.update().unroll(r.x).unroll(r.y);
  }
  return out;
}

Func separable_blur(bool on_gpu, int scale) {
  const Buffer<float> in = picture(128 * scale, 64 * scale);
  Func rows("rows"), out("out");
  const Func image = BoundaryConditions::mirror_image(in);
  rows(x, y) = (image(x - 1, y) + 2.0f * image(x, y) + image(x + 1, y)) / 4.0f;
  out(x, y) = (rows(x, y - 1) + 2.0f * rows(x, y) + rows(x, y + 1)) / 4.0f;
  if (on_gpu) {
    tiled(out, true, 32, 8);
    rows.compute_at(out, x).gpu_threads(x, y);
  }
  return out;
}

Func tone_curve(bool on_gpu, int scale) {
  const Buffer<float> in = picture(256 * scale, 64 * scale);
  Func out("out");
  out(x, y) = in(x, y) * in(x, y) * (3.0f - 2.0f * in(x, y));
  if (on_gpu) out.gpu_tile(x, y, xi, yi, 64, 4);
  return out;
}

Func recursive_filter(bool on_gpu, int scale) {
  const int width = 48 * scale, last = width - 1;
  const Buffer<float> in = picture(width, 80 * scale);
  RDom forth(1, last, "forth"), back(1, last, "back");
  Func out("out");
  out(x, y) = in(x, y);
  out(forth, y) = 0.6f * out(forth - 1, y) + 0.4f * in(forth, y);
  out(last - back, y) = 0.6f * out(width - back, y) + 0.4f * out(last - back, y);
  if (on_gpu) {
    out.gpu_tile(x, y, xi, yi, 16, 8);
    out.update(0).gpu_tile(y, yi, 32, TailStrategy::GuardWithIf);
    out.update(1).gpu_tile(y, yi, 32, TailStrategy::GuardWithIf);
  }
  return out;
}

// ---- whole pipelines ----

Func half_as_large(Func f, const std::string& name) {
  Func result(name);
  result(x, y, _) = (f(2 * x, 2 * y, _) + f(2 * x + 1, 2 * y, _) + f(2 * x, 2 * y + 1, _) +
                     f(2 * x + 1, 2 * y + 1, _)) /
                    4.0f;
  return result;
}
Func twice_as_large(Func f, const std::string& name) {
  Func result(name);
  result(x, y, _) = 0.75f * f(x / 2, y / 2, _) + 0.25f * f((x + 1) / 2, (y + 1) / 2, _);
  return result;
}

// Paris, Hasinoff, Kautz: Local Laplacian Filters (SIGGRAPH 2011), with few levels.
Func local_laplacian(bool on_gpu, int scale) {
  const Buffer<float> in = picture(64 * scale, 48 * scale);
  constexpr int levels = 3, tones = 4;
  Func image("image"), remapped("remapped");
  image(x, y) = BoundaryConditions::repeat_edge(in)(x, y);
  const Expr distance = image(x, y) - cast<float>(k) / (tones - 1);
  remapped(x, y, k) = image(x, y) + 0.5f * distance * exp(-distance * distance * 8.0f);
  std::vector<Func> gaussian = {remapped}, plain = {image}, laplacian(levels), result(levels);
  for (int level = 1; level < levels; ++level) {
    const std::string number = std::to_string(level);
    gaussian.push_back(half_as_large(gaussian.back(), "gaussian" + number));
    plain.push_back(half_as_large(plain.back(), "plain" + number));
  }
  for (int level = levels - 1; level >= 0; --level) {
    const std::string number = std::to_string(level);
    const auto at = static_cast<size_t>(level);
    Func& own = laplacian[at] = Func("laplacian" + number);
    own(x, y, k) = gaussian[at](x, y, k);
    if (level + 1 < levels)
      own(x, y, k) -= twice_as_large(gaussian[at + 1], "up" + number)(x, y, k);
    const Expr tone = clamp(plain[at](x, y), 0.0f, 1.0f) * (tones - 1);
    const Expr low = clamp(cast<int>(tone), 0, tones - 2), part = tone - cast<float>(low);
    Expr value = (1.0f - part) * own(x, y, low) + part * own(x, y, low + 1);
    if (level + 1 < levels) value += twice_as_large(result[at + 1], "grown" + number)(x, y);
    result[at] = Func("result" + number);
    result[at](x, y) = value;
  }
  for (auto* funcs : {&gaussian, &plain, &laplacian, &result}) {
    for (Func f : *funcs) tiled(f, on_gpu);
  }
  for (size_t level = 0; on_gpu && level + 1 < levels; ++level)
    laplacian[level].update().gpu_tile(x, y, xi, yi, 16, 8, TailStrategy::GuardWithIf);
  return result[0];
}

// Chen, Paris, Durand: Real-time Edge-Aware Image Processing with the Bilateral Grid (SIGGRAPH 2007).
Func bilateral_grid(bool on_gpu, int scale) {
  constexpr int cell = 8, tones = 8;
  const Buffer<float> in = picture(64 * scale, 48 * scale);
  const Func image = BoundaryConditions::repeat_edge(in);
  RDom r(0, cell, 0, cell, "r");
  Func grid("grid"), along_z("along_z"), along_x("along_x"), along_y("along_y"), out("out");
  const Expr value = clamp(image(x * cell + r.x - cell / 2, y * cell + r.y - cell / 2), 0.0f, 1.0f);
  const Expr tone = clamp(cast<int>(value * tones + 0.5f), 0, tones);
  grid(x, y, z, c) = 0.0f;
  grid(x, y, tone, c) += select(c == 0, value, 1.0f);
  along_z(x, y, z, c) = grid(x, y, z - 1, c) + 2.0f * grid(x, y, z, c) + grid(x, y, z + 1, c);
  along_x(x, y, z, c) =
      along_z(x - 1, y, z, c) + 2.0f * along_z(x, y, z, c) + along_z(x + 1, y, z, c);
  along_y(x, y, z, c) =
      along_x(x, y - 1, z, c) + 2.0f * along_x(x, y, z, c) + along_x(x, y + 1, z, c);
  const Expr here = clamp(image(x, y), 0.0f, 1.0f) * tones;
  const Expr zi = cast<int>(here), zf = here - cast<float>(zi);
  const auto sliced = [&](int channel) {
    return (1.0f - zf) * along_y(x / cell, y / cell, zi, channel) +
           zf * along_y(x / cell, y / cell, zi + 1, channel);
  };
  out(x, y) = sliced(0) / max(sliced(1), 1e-3f);
  grid.compute_root();  // otherwise each of its consumers would recompute it
  for (const Func& f : {grid, along_z, along_x, along_y, out}) tiled(f, on_gpu, 8, 8);
  if (on_gpu) grid.update().gpu_tile(x, y, xi, yi, 4, 4, TailStrategy::GuardWithIf);
  return out;
}

// From a raw sensor image to colours: hot pixels, demosaicing, a colour matrix, a tone curve.
Func camera_pipe(bool on_gpu, int scale) {
  Buffer<uint16_t> raw(72 * scale, 52 * scale);
  raw.for_each_element([&](int i, int j) {
    raw(i, j) = static_cast<uint16_t>((i * 131 + j * 57 + (i * j) % 97) % 1024);
  });
  Func mended("mended"), at_red("at_red"), at_blue("at_blue"), green("green"), colours("colours"),
      matched("matched"), curve("curve"), out("out");
  const Func in = BoundaryConditions::mirror_interior(raw);
  const Expr around = max(max(in(x - 2, y), in(x + 2, y)), max(in(x, y - 2), in(x, y + 2)));
  mended(x, y) = cast<float>(min(in(x, y), around));
  const Expr is_green = (x + y) % 2 == 0;
  green(x, y) =
      select(is_green, mended(x, y),
             (mended(x - 1, y) + mended(x + 1, y) + mended(x, y - 1) + mended(x, y + 1)) / 4.0f);
  const auto around_of = [&](int row) {
    const Expr in_row = y % 2 == row;
    return select(in_row && !is_green, mended(x, y), in_row && is_green,
                  (mended(x - 1, y) + mended(x + 1, y)) / 2.0f, is_green,
                  (mended(x, y - 1) + mended(x, y + 1)) / 2.0f,
                  (mended(x - 1, y - 1) + mended(x + 1, y - 1) + mended(x - 1, y + 1) +
                   mended(x + 1, y + 1)) /
                      4.0f);
  };
  at_red(x, y) = around_of(0);
  at_blue(x, y) = around_of(1);
  colours(x, y, c) = mux(c, {at_red(x, y), green(x, y), at_blue(x, y)});
  const auto row_of = [&](float r, float g, float b) {
    return r * colours(x, y, 0) + g * colours(x, y, 1) + b * colours(x, y, 2);
  };
  matched(x, y, c) =
      mux(c, {row_of(1.6f, -0.4f, -0.2f), row_of(-0.3f, 1.5f, -0.2f), row_of(0.0f, -0.5f, 1.5f)});
  curve(x) =
      cast<uint8_t>(clamp(255.0f * pow(cast<float>(x) / 1023.0f, 1.0f / 2.2f), 0.0f, 255.0f));
  out(x, y, c) = cast<float>(curve(clamp(cast<int>(matched(x, y, c)), 0, 1023)));
  curve.compute_root();  // a table, so that equal values get equal bytes
  if (on_gpu) {
    curve.gpu_tile(x, xi, 128);
    out.bound(c, 0, 3).reorder(c, x, y).unroll(c);
    tiled(out, true, 16, 8);
    mended.compute_at(out, x).gpu_threads(x, y);
    green.compute_at(out, x).gpu_threads(x, y);
  }
  return out;
}

// A training step of a filter: its weights minus a fraction of the gradient of the loss.
Func training_step(bool on_gpu, int scale) {
  const int width = 64 * scale, height = 32 * scale;
  const Buffer<float> in = picture(width + 2, height + 2), wanted = picture(width, height),
                      start = picture(3, 3);
  RDom r(0, 3, 0, 3, "r"), all(0, width, 0, height, "all");
  Func weights("weights"), filtered("filtered"), loss("loss"), step("step");
  weights(x, y) = start(x, y);
  filtered(x, y) = 0.0f;
  filtered(x, y) += in(x + r.x, y + r.y) * weights(r.x, r.y);
  const Expr error = filtered(all.x, all.y) - wanted(all.x, all.y);
  loss() = 0.0f;
  loss() += error * error / static_cast<float>(width * height);
  const Derivative d = propagate_adjoints(loss);
  const Func gradient = d(weights);
  step(x, y) = weights(x, y) - 0.1f * gradient(x, y);
  // Stages of the gradient have no names by which a user could schedule them.
  step.set_estimates({{0, 3}, {0, 3}});
  if (on_gpu) Pipeline(step).auto_schedule(get_host_target().with_feature(Target::CUDA));
  return step;
}

}  // namespace

float reduced_value(int i) { return static_cast<float>(i % 1000) / 1024; }

Program reduction(int values) {
  const auto build = [values](bool on_gpu) {
    const int block = 256, threads = std::clamp(values / 64, block, 1 << 18);
    Buffer<float> in(values);
    in.for_each_element([&](int i) { in(i) = reduced_value(i); });
    RDom r(0, values, "r");
    Func sum("sum"), total("total");
    sum() = 0.0f;
    sum() += in(r);
    total(x) = sum();
    if (on_gpu) {
      sum.compute_root();
      // Neighbouring threads read neighbouring elements; then fewer and fewer threads add up these sums, 64 each, until
      // there is one.
      RVar left = r;
      for (int parts = threads; parts > 1; parts = parts > 64 ? parts / 64 : 1) {
        const std::string number = std::to_string(parts);
        RVar outer("outer" + number), inner("inner" + number);
        Func sums = sum.update().split(left, outer, inner, parts).rfactor(inner, u);
        sums.compute_root().gpu_tile(u, xi, std::min(parts, block));
        sums.update().reorder(outer, u).gpu_tile(u, xi, std::min(parts, block));
        left = inner;
      }
      sum.update().gpu_single_thread();
    }
    return total;
  };
  return {"reduction", build, {1}, false, 4.0 * values, 1.0 * values, 1 << 10};
}

std::vector<Program> all(int scale) {
  using Builder = Func(bool on_gpu, int scale);
  std::vector<Program> programs;
  // Bytes and operations for an element of the output's first two dimensions.
  const auto add = [&](const char* name, Builder* build, std::vector<int> sizes, double bytes,
                       double operations, int timing_scale) {
    for (size_t d = 0; d < std::min<size_t>(sizes.size(), 2); ++d) sizes[d] *= scale;
    const double elements = static_cast<double>(sizes[0]) * sizes[1];
    programs.push_back({name, [=](bool on_gpu) { return build(on_gpu, scale); }, sizes, false,
                        bytes * elements, operations * elements, timing_scale});
  };
  add("tone_curve", tone_curve, {256, 64}, 8, 5, 32);
  add("separable_blur", separable_blur, {128, 64}, 8, 8, 64);
  for (Program& program : programs) program.is_streaming = true;
  add("convolution", convolution, {100, 60}, 8, 18, 64);
  add("matrix_product", matrix_product, {64, 64}, 12, 2.0 * 64 * scale, 32);
  add("recursive_filter", recursive_filter, {48, 80}, 8, 6, 64);
  add("local_laplacian", local_laplacian, {64, 48}, 8, 0, 64);
  add("bilateral_grid", bilateral_grid, {64, 48}, 8, 0, 64);
  add("camera_pipe", camera_pipe, {72, 52, 3}, 14, 0, 64);
  programs.push_back({"training_step",
                      [=](bool on_gpu) { return training_step(on_gpu, scale); },
                      {3, 3},
                      false,
                      8.0 * 64 * 32 * scale * scale,
                      (18.0 + 3 + 18) * 64 * 32 * scale * scale,
                      16});
  programs.push_back(reduction((1 << 14) * scale));
  return programs;
}

Program named(const std::string& name, int scale) {
  for (Program& program : all(scale)) {
    if (program.name == name) return program;
  }
  return {};
}

}  // namespace gpu_programs
