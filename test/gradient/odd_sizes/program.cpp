#include "gradient/odd_sizes/program.h"

#include <algorithm>
#include <cmath>

#include "frontend/language/boundary_conditions.h"
#include "frontend/language/inline_reductions.h"
#include "testing/interpreter.h"

namespace retrograde::gradient {

namespace {

const Var x("x"), y("y");

class OddMaker {
 public:
  OddMaker(Choices& choices, OddProgram& program) : c_(choices), p_(program) {}

  void run() {
    is_flat_ = c_.chance(30);
    const int width = is_flat_ ? c_.between(3, 700) : c_.between(5, 70);
    const int height = is_flat_ ? 1 : c_.between(3, 40);
    make_image(width, height);
    for (int n = c_.between(1, 6); n > 0; --n) add_piece();
    const Stage last = stages_.back();
    p_.output = last.f;
    p_.width = last.width;
    p_.height = last.height;
  }

 private:
  struct Stage {  // has values at [0, width) x [0, height)
    Func f;
    int width, height;
  };

  void make_image(int width, int height) {
    p_.image = Buffer<float>(std::vector<int>{width, height});
    p_.gain.set(0.75f);
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i)
        p_.image(i, j) = static_cast<float>((i * 7919 + j * 104729) % 2003) / 1000.0f - 1.0f;
    }
    Func source("source");
    source(x, y) = p_.image(x, y);
    add(source, width, height, std::to_string(width) + " x " + std::to_string(height));
  }

  void add(Func f, int width, int height, const std::string& words) {
    p_.pieces += words;
    if (!stages_.empty() && c_.chance(45)) {
      f.compute_root();
      p_.pieces += " at root";
    }
    p_.pieces += "; ";
    stages_.push_back({f, width, height});
  }
  Stage recent() {
    const int n = static_cast<int>(stages_.size());
    return stages_[static_cast<size_t>(n - 1 - c_.below(std::min(n, 2)))];
  }
  Func named(const char* name) { return Func(name + std::to_string(stages_.size())); }

  void add_piece() {
    switch (c_.below(14)) {
      case 0:
      case 1:
      case 2:
        return add_stencil();
      case 3:
      case 4:
        return add_inline_reduction();
      case 5:
      case 6:
        return add_place();
      case 7:
      case 8:
        return add_border();
      case 9:
        return add_half();
      case 10:
        return add_row_average();
      case 11:
        return add_histogram();
      case 12:
        return add_recursive_filter();
      default:
        return add_pointwise();
    }
  }

  void add_stencil() {
    const Stage a = recent();
    const int k = c_.between(1, 3), l = is_flat_ ? 0 : c_.between(0, 2);
    if (a.width - k < 3 || a.height - l < 1) return;
    Func f = named("stencil");
    const Expr here = a.f(x, y), there = a.f(x + k, y + l);
    switch (c_.below(4)) {
      case 0:
        f(x, y) = here * 0.5f + there * 0.25f;
        break;
      case 1:
        f(x, y) = here * there + p_.gain;
        break;
      case 2:
        f(x, y) = tanh(here - there * p_.gain);
        break;
      default:
        f(x, y) = abs(a.f(x + k, y) - a.f(x, y + l)) + 0.125f * here;
    }
    add(f, a.width - k, a.height - l, "stencil");
  }

  void add_inline_reduction() {
    const Stage a = recent();
    const int k = c_.between(2, 5), l = is_flat_ ? 1 : c_.between(1, 3);
    if (a.width - k < 3 || a.height - l < 1) return;
    const RDom r(0, k, 0, l);
    Func f = named("inlined");
    const Expr v = a.f(x + r.x, y + r.y);
    switch (c_.below(4)) {
      case 0:
        f(x, y) = sum(r, v * v) * 0.125f;
        break;
      case 1:
        f(x, y) = maximum(r, v);
        break;
      case 2:
        f(x, y) = sum(r, v * exp(-abs(v - a.f(x, y))));
        break;
      default:
        f(x, y) = minimum(r, v * p_.gain) + a.f(x, y);
    }
    add(f, a.width - k + 1, a.height - l + 1, "inline reduction");
  }

  void add_place() {
    const Stage a = recent();
    const int k = c_.between(2, 5), l = is_flat_ ? 1 : c_.between(1, 2);
    if (a.width - k < 3 || a.height - l < 1) return;
    const RDom r(0, k, 0, l);
    const Expr v = a.f(x + r.x, y + r.y);
    const Tuple best = c_.chance(50) ? argmax(r, v) : argmin(r, v);
    Func f = named("best");
    if (c_.chance(50)) {
      f(x, y) = best[2] * p_.gain + a.f(x, y);
    } else {
      f(x, y) = a.f(x + clamp(best[0], 0, k - 1), y + clamp(best[1], 0, l - 1)) * best[2];
    }
    add(f, a.width - k + 1, a.height - l + 1, "argmax");
  }

  void add_border() {
    using namespace BoundaryConditions;
    const Stage a = recent();
    const Region region{{Expr(0), Expr(a.width)}, {Expr(0), Expr(a.height)}};
    Func around;
    switch (c_.below(4)) {
      case 0:
        around = repeat_edge(a.f, region);
        break;
      case 1:
        around = constant_exterior(a.f, 0.25f, region);
        break;
      case 2:
        around = mirror_image(a.f, region);
        break;
      default:
        around = repeat_image(a.f, region);
    }
    const int k = c_.between(1, 3), l = is_flat_ ? 0 : c_.between(0, 1);
    Func f = named("border");
    f(x, y) = around(x - k, y - l) + 0.5f * around(x + k, y + l) - a.f(x, y) * 0.25f;
    add(f, a.width, a.height, "border");
  }

  void add_half() {
    const Stage a = recent();
    if (a.width < 8) return;
    Func f = named("half");
    f(x, y) = (a.f(2 * x, y) + a.f(2 * x + 1, y)) * 0.5f;
    add(f, a.width / 2, a.height, "half");
  }

  void add_row_average() {
    const Stage a = recent();
    const RDom r(0, a.width);
    Func rows = named("rows"), f = named("centred");
    rows(y) = 0.0f;
    rows(y) += a.f(r, y);
    if (c_.chance(50)) rows.compute_root();
    f(x, y) = a.f(x, y) - rows(y) * (1.0f / static_cast<float>(a.width));
    add(f, a.width, a.height, "average of rows");
  }

  void add_histogram() {
    const Stage a = recent();
    const RDom r(0, a.width, 0, a.height);
    const Var bin("bin");
    const auto bin_of = [](const Expr& v) {
      return clamp(cast<int>(clamp(v * 4.0f + 4.0f, 0.0f, 7.0f)), 0, 7);
    };
    Func bins = named("bins"), f = named("levelled");
    bins(bin) = 0.0f;
    bins(bin_of(a.f(r.x, r.y))) += a.f(r.x, r.y);
    bins.compute_root();
    f(x, y) = bins(bin_of(a.f(x, y))) * 0.001f + a.f(x, y);
    add(f, a.width, a.height, "histogram");
  }

  void add_recursive_filter() {
    const Stage a = recent();
    Func f = named("filter");
    const RDom r(1, a.width - 1);
    f(x, y) = a.f(x, y);
    f(r, y) = f(r, y) * 0.5f + f(r - 1, y) * 0.5f;
    add(f, a.width, a.height, "recursive filter");
  }

  void add_pointwise() {
    const Stage a = recent(), b = recent();
    Func f = named("pointwise");
    switch (c_.below(4)) {
      case 0:
        f(x, y) = a.f(x, y) * p_.gain + b.f(x, y);
        break;
      case 1:
        f(x, y) = sqrt(abs(a.f(x, y)) + 0.5f);
        break;
      case 2:
        f(x, y) = exp(-a.f(x, y) * a.f(x, y)) * b.f(x, y);
        break;
      default:
        f(x, y) = max(a.f(x, y), b.f(x, y) * 0.5f);
    }
    add(f, std::min(a.width, b.width), std::min(a.height, b.height), "pointwise");
  }

  Choices& c_;
  OddProgram& p_;
  std::vector<Stage> stages_;
  bool is_flat_ = false;
};

// The largest difference, relative to the largest element.
double difference(const Func& gradient, const Buffer<float>& found, uint64_t operations) {
  oracle::InterpreterOptions options;
  options.widen = true;
  options.max_operations = operations;
  const oracle::Region region = oracle::region_of(*found.raw_buffer());
  const oracle::Array expected =
      oracle::Interpreter(options).realize(gradient.function(), region).front();
  double worst = 0, scale = 1e-3;
  region.for_each([&](const std::vector<int>& at) {
    const double e = expected.at(at).scalar.as_double();
    scale = std::max(scale, std::fabs(e));
    worst = std::max(worst, std::fabs(e - found.get()->operator()(at.data())));
  });
  return worst / scale;
}

}  // namespace

OddProgram make_odd_program(Choices& choices) {
  OddProgram program;
  OddMaker(choices, program).run();
  return program;
}

std::string check_odd_program(const OddProgram& program, uint64_t operations) {
  Func loss("loss");
  const RDom all(0, program.width, 0, program.height);
  const Expr v = program.output(all.x, all.y);
  loss() = 0.0f;
  loss() += v * v * 0.01f;
  std::string doing = "value";
  try {
    loss.realize();
    doing = "derivative";
    const Derivative d = propagate_adjoints(loss, {.overwritten = Overwritten::Store});
    doing = "gradient by the image";
    Func by_image = d(program.image), by_gain = d(program.gain);
    Buffer<float> found =
        by_image.realize({program.image.dim(0).extent(), program.image.dim(1).extent()});
    doing = "gradient by the gain";
    if (by_gain.defined()) by_gain.realize();
    doing = "interpreter";
    const double off = difference(by_image, found, operations);
    return off <= 2e-3 ? "" : "gradient off by " + std::to_string(off);
  } catch (const std::exception& error) {
    const std::string what = error.what();
    if (doing == "interpreter" && what.find("operations") != std::string::npos) return "";
    return doing + ": " + what;
  }
}

}  // namespace retrograde::gradient
