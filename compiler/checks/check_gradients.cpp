#include "checks/check_gradients.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "autodiff/regions.h"
#include "autodiff/tangents.h"
#include "checks/arrays.h"
#include "checks/widen.h"
#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde {

namespace {

using namespace checks;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

class Checker {
 public:
  Checker(const Func& output, const std::vector<int>& sizes, const GradientCheckOptions& options)
      : output_(output),
        shape_{std::vector<int>(sizes.size(), 0), sizes},
        options_(options),
        random_(options.seed),
        widened_(ir::widen({output.function()})),
        wide_output_(widened_.funcs.at(output.function().get())) {
    if (static_cast<int>(sizes.size()) != output.dimensions()) {
      user_error(asked(), "the output needs a size in each of its dimensions",
                 text("it has ", output.dimensions(), " dimensions and ", sizes.size(), " sizes"));
    }
    if (output.outputs() != 1)
      unsupported(asked(), "an output has one value", text("it has ", output.outputs()),
                  "Check a Func that combines them");
    weights_ = own_precision(random_values(count(shape_)));
    for (const auto& p : ir::parameters_of({output.function()})) {
      if (p->type.is_float())
        inputs_.push_back(bind_wide(p, widened_.parameters.at(p.get()), asked()));
    }
  }

  GradientReport run() {
    differentiate();
    for (size_t i = 0; i < inputs_.size(); ++i) check(i);
    compare_funcs();
    for (const auto& input : report_.inputs) {
      worsen(report_.worst_error, input.adjoint_error);
      worsen(report_.worst_error, input.dot_product_error);
    }
    return std::move(report_);
  }

 private:
  std::string asked() const {
    return "check the gradients of " + retrograde::quoted(output_.name());
  }

  Values random_values(size_t n) {
    std::normal_distribution<double> normal;
    Values result(n);
    for (double& v : result) v = normal(random_);
    return result;
  }
  static Values own_precision(Values values) {  // so that both precisions see the same numbers
    for (double& v : values) v = static_cast<float>(v);
    return values;
  }

  Func seed(Type type) {
    Buffer<> buffer = new_buffer(type, shape_);
    fill(buffer, weights_);
    return Direction::as_func(buffer);
  }
  Region bounds() const {
    Region region;
    for (int e : shape_.extents) region.push_back({0, e});
    return region;
  }

  void differentiate() {
    const AdjointOptions store{.overwritten = Overwritten::Store};
    own_ = std::make_unique<Derivative>(
        propagate_adjoints(output_, seed(output_.types()[0]), bounds(), store));
    wide_ = std::make_unique<Derivative>(
        propagate_adjoints(wide_output_, seed(Float(64)), bounds(), store));
    realize(output_, shape_);  // compiles
    auto start = Clock::now();
    realize(output_, shape_);
    report_.primal_seconds = seconds_since(start);
  }

  double weighted_output() { return dot(realize(wide_output_, shape_), weights_); }

  struct Slopes {
    double central, seconds;
  };
  Slopes central(Input& input, const Values& v, double h) {
    auto start = Clock::now();
    auto at = [&](double step) {
      Values moved = input.values;
      for (size_t i = 0; i < moved.size(); ++i) moved[i] += step * v[i];
      input.set_wide(moved);
      return weighted_output();
    };
    double slope = (at(h) - at(-h)) / (2 * h);
    input.set_wide(input.values);
    return {slope, seconds_since(start)};
  }

  // The best estimate of the slope along v, by the differences alone.
  double difference(Input& input, const Values& v, double adjoint, double scale,
                    std::vector<GradientReport::Step>* steps) {
    double size = std::max(largest(input.values), 1e-3);
    double best = 0, best_gap = std::numeric_limits<double>::infinity();
    double last_slope = 0, last_extrapolated = 0;
    for (int k = 4, n = 0; k <= options_.smallest_step; k += 2, ++n) {
      double h = std::ldexp(size, -k);
      Slopes s = central(input, v, h);
      double extrapolated = n == 0 ? s.central : (16 * s.central - last_slope) / 15;
      double gap = n < 2 ? best_gap : std::abs(extrapolated - last_extrapolated);
      if (n == 0 || gap < best_gap) best = extrapolated, best_gap = gap;
      last_slope = s.central;
      last_extrapolated = extrapolated;
      if (steps)
        steps->push_back({std::ldexp(1.0, -k), relative_error(s.central, adjoint, scale),
                          relative_error(extrapolated, adjoint, scale), s.seconds});
    }
    return best;
  }

  void check(size_t index) {
    Input& input = inputs_[index];
    GradientReport::Input result{input.own->name, 0, 0, 0, {}};
    Func own = own_->of(AdjointInput(input.own));
    realize(own, input.shape);  // compiles
    auto start = Clock::now();
    Values g_own = realize(own, input.shape);
    report_.adjoint_seconds += seconds_since(start);
    Values g = realize(wide_->of(AdjointInput(input.wide)), input.shape);

    Buffer<> direction = new_buffer(Float(64), input.shape);
    Func tangent =
        propagate_tangents(wide_output_, {{AdjointInput(input.wide), direction}})(wide_output_);
    for (int d = 0; d < options_.directions; ++d) {
      Values v = own_precision(random_values(count(input.shape)));
      fill(direction, v);
      double adjoint = dot(g, v), scale = 1e-2 * typical(g, v);
      double forward = dot(realize(tangent, shape_), weights_);
      double slope = difference(input, v, adjoint, scale, d == 0 ? &result.steps : nullptr);
      worsen(result.adjoint_error, relative_error(adjoint, slope, scale));
      worsen(result.dot_product_error, relative_error(adjoint, forward, scale));
      worsen(result.own_precision_error, relative_error(dot(g_own, v), adjoint, scale));
    }
    report_.inputs.push_back(result);
  }

  // ---- where the digits go ----

  void compare_funcs() {
    auto order = ir::topological_order({output_.function()});
    ir::Box box;
    for (int e : shape_.extents) box.push_back({Expr(0), Expr(e - 1)});
    ir::Regions regions(order, box);
    std::map<const ir::Symbol*, double> inherited;
    double most = 4;  // an adjoint that only rounds loses less than this
    for (auto f = order.rbegin(); f != order.rend(); ++f) {
      auto error = func_error(*f, regions);
      double before = inherited[f->get()];
      for (const ir::FuncPtr& callee : ir::direct_callees(**f)) {
        double& worst = inherited[callee.get()];
        worsen(worst, error.value_or(before));
      }
      if (!error) continue;
      double eps = std::numeric_limits<float>::epsilon();
      double lost = *error / std::max(before, eps);
      report_.funcs.push_back({(*f)->name, *error, lost});
      if (!(lost <= most)) most = lost, report_.loses_digits = (*f)->name;
    }
  }

  std::optional<double> func_error(const ir::FuncPtr& f, const ir::Regions& regions) {
    auto shape = constant_shape(regions.of(f.get()));
    Func own = own_->adjoint(Func(f)), wide = wide_->adjoint(Func(widened_.funcs.at(f.get())));
    if (!shape || shape->extents.size() != f->args.size() || !own.defined() || !wide.defined() ||
        own.outputs() != 1)
      return std::nullopt;
    Values a = realize(own, *shape), b = realize(wide, *shape);
    double size = largest(b), worst = 0;
    for (size_t i = 0; i < a.size(); ++i) worsen(worst, relative_error(a[i], b[i], size));
    return worst;
  }

  const Func& output_;
  Shape shape_;
  GradientCheckOptions options_;
  std::mt19937_64 random_;
  ir::Widened widened_;
  Func wide_output_;
  Values weights_;
  std::vector<Input> inputs_;
  std::unique_ptr<Derivative> own_, wide_;
  GradientReport report_;
};

// JSON has no NaN and no infinity.
nlohmann::json number(double v) {
  return std::isfinite(v) ? nlohmann::json(v) : nlohmann::json(std::isnan(v) ? "nan" : "inf");
}

}  // namespace

std::string GradientReport::to_json() const {
  nlohmann::json result{{"worst_error", number(worst_error)}, {"loses_digits", loses_digits},
                        {"primal_seconds", primal_seconds},   {"adjoint_seconds", adjoint_seconds},
                        {"inputs", nlohmann::json::array()},  {"funcs", nlohmann::json::array()}};
  for (const Input& i : inputs) {
    nlohmann::json steps = nlohmann::json::array();
    for (const Step& s : i.steps)
      steps.push_back({{"step", s.step},
                       {"central_error", number(s.central_error)},
                       {"richardson_error", number(s.richardson_error)},
                       {"seconds", s.seconds}});
    result["inputs"].push_back({{"name", i.name},
                                {"adjoint_error", number(i.adjoint_error)},
                                {"dot_product_error", number(i.dot_product_error)},
                                {"own_precision_error", number(i.own_precision_error)},
                                {"steps", steps}});
  }
  for (const FuncError& f : funcs)
    result["funcs"].push_back(
        {{"name", f.name}, {"adjoint_error", number(f.error)}, {"lost", number(f.lost)}});
  return result.dump(2);
}

GradientReport check_gradients(const Func& output, const std::vector<int>& sizes,
                               const GradientCheckOptions& options) {
  return Checker(output, sizes, options).run();
}

}  // namespace retrograde
