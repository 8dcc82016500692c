#include "checks/check_gradients.h"

#include <algorithm>
#include <limits>
#include <map>
#include <random>

#include "autodiff/sweeps/regions.h"
#include "checks/arrays.h"
#include "checks/derivative_pair.h"
#include "checks/slopes.h"
#include "checks/widen.h"
#include "diagnostics/error.h"

namespace retrograde {

namespace {

using namespace checks;
using checks::Values;

class Checker {
 public:
  Checker(const Func& output, const std::vector<int>& sizes, const GradientCheckOptions& options)
      : output_(output),
        shape_(shape_of_output(output, options.mins, sizes, asked(), "check_gradients")),
        options_(options),
        random_(options.seed) {
    widen({output.function()});  // throws first for operations without a meaning in double
    draw_weights();
    check_wrt();
  }

  GradientReport run() {
    differentiate();
    for (Input& input : pair_->inputs()) {
      if (is_wanted(input)) check(input);
    }
    compare_funcs();
    for (const auto& input : report_.inputs) {
      worsen(report_.worst_error, input.adjoint_error);
      worsen(report_.worst_error, input.complex_step_error);
      worsen(report_.worst_error, input.dot_product_error);
    }
    return std::move(report_);
  }

 private:
  std::string asked() const {
    return "check the gradients of " + retrograde::quoted(output_.name());
  }

  // ---- the requested inputs ----

  bool is_wanted(const Input& input) const {
    for (const AdjointInput& w : options_.wrt) {
      if (w.symbol() == input.own) return true;
    }
    return options_.wrt.empty();
  }
  void check_wrt() const {
    const auto inputs = floating_inputs(output_);
    for (const AdjointInput& w : options_.wrt) {
      if (std::ranges::find(inputs, w.symbol()) == inputs.end()) {
        user_error(asked(), "`wrt` names floating inputs that the output depends on",
                   "it names something else", "Give an ImageParam, a Buffer or a Param");
      }
    }
  }

  Values random_values(size_t n) {
    std::normal_distribution<double> normal;
    Values result(n);
    for (double& v : result) v = normal(random_);
    return result;
  }
  // Rounds values to the input's type, so that both precisions get the same numbers.
  static Values own_precision(Values values, Type type = Float(32)) {
    for (double& v : values) v = held_by(type, v);
    return values;
  }
  // Draws weights for each floating value of the output.
  void draw_weights() {
    bool any = false;
    for (Type t : output_.types()) {
      any |= t.is_float();
      weights_.push_back(t.is_float() ? own_precision(random_values(count(shape_)), t) : Values());
    }
    if (!any)
      unsupported(asked(), "derivatives are of floats", "the output has integers only",
                  "Check a Func of floats");
  }

  void differentiate() {
    pair_ = std::make_unique<DerivativePair>(output_, shape_, weights_, asked());
    Func primal = scheduled_for(output_, shape_);
    report_.primal_seconds = timed_warm([&] { return realize_values(primal, shape_); }).seconds;
    slopes_ = std::make_unique<Slopes>(pair_->wide_output(), shape_, weights_, pair_->inputs());
    report_.complex_step_refused = slopes_->complex_step_refused();
  }

  void check(Input& input) {
    const bool has_complex_step = slopes_->complex_step_refused().empty();
    GradientReport::Input result;
    result.name = input.own->name;
    Func own = pair_->own_adjoint(input), wide = pair_->wide_adjoint(input);
    const auto g_own = timed_warm([&] { return realize(own, input.shape); });
    const auto g = timed_warm([&] { return realize(wide, input.shape); });
    report_.adjoint_seconds += g_own.seconds;

    Buffer<> direction = new_buffer(Float(64), input.shape);
    Func moved = pair_->tangent(input, direction);
    for (int d = 0; d < options_.directions; ++d) {
      Values v = own_precision(random_values(count(input.shape)));
      fill(direction, v);
      const double adjoint = dot(g.value, v), scale = 1e-2 * typical(g.value, v);
      const auto forward =
          timed_warm([&] { return weighted_sum(realize_values(moved, shape_), weights_); });
      const auto slope = slopes_->by_differences(input, v, options_.smallest_step, adjoint, scale,
                                                 d == 0 ? &result.steps : nullptr);
      const auto by_complex =
          has_complex_step ? slopes_->by_complex_step(input, v) : Timed<double>{};
      auto error = [&](double value, double reference) {
        return relative_error(value, reference, scale);
      };
      worsen(result.adjoint_error, error(adjoint, slope.value));
      if (has_complex_step) worsen(result.complex_step_error, error(adjoint, by_complex.value));
      worsen(result.dot_product_error, error(adjoint, forward.value));
      worsen(result.own_precision_error, error(dot(g_own.value, v), adjoint));
      if (d > 0) continue;
      const double reference = has_complex_step ? by_complex.value : adjoint;
      result.methods = {
          {"differences", error(slope.value, reference), slope.seconds},
          {"tangent in double", error(forward.value, reference), forward.seconds},
          {"adjoint in double", error(adjoint, reference), g.seconds},
          {"adjoint in its own precision", error(dot(g_own.value, v), reference), g_own.seconds}};
      if (has_complex_step) result.methods.push_back({"complex step", 0, by_complex.seconds});
    }
    report_.inputs.push_back(result);
  }

  // ---- errors by Func ----

  void compare_funcs() {
    auto order = topological_order({output_.function()});
    autodiff::Regions regions(order, box_of(shape_));
    const auto errors = func_errors(order, regions);
    std::map<const ir::Symbol*, double> inherited;
    double most = 4;  // rounding alone loses less than this factor
    for (auto f = order.rbegin(); f != order.rend(); ++f) {
      const double before = inherited[f->get()];
      const double error = ir::value_or(errors, f->get(), before);
      for (const FuncPtr& callee : direct_callees(**f)) worsen(inherited[callee.get()], error);
      if (!errors.contains(f->get())) continue;
      double eps = std::numeric_limits<float>::epsilon();
      double lost = error / std::max(before, eps);
      report_.funcs.push_back({(*f)->name, error, lost});
      if (!(lost <= most)) most = lost, report_.loses_digits = (*f)->name;
    }
  }

  // The worst error of the adjoint of each Func, for adjoints over a known region.
  std::map<const ir::Symbol*, double> func_errors(const std::vector<FuncPtr>& order,
                                                  const autodiff::Regions& regions) {
    std::vector<const ir::Symbol*> funcs;
    Batch own, wide;
    for (const FuncPtr& f : order) {
      auto shape = constant_shape(regions.of(f.get()));
      Func adjoint = pair_->own_adjoint(f);
      if (!shape || shape->extents.size() != f->args.size() || !adjoint.defined()) continue;
      Func in_double = pair_->wide_adjoint(f);
      if (!in_double.defined()) continue;
      funcs.push_back(f.get());
      own.add(adjoint, *shape);
      wide.add(in_double, *shape);
    }
    const auto a = own.realize(), b = wide.realize();
    std::map<const ir::Symbol*, double> result;
    for (size_t n = 0; n < funcs.size(); ++n) {
      double& worst = result[funcs[n]] = 0;
      for (size_t k = 0; k < a[n].size(); ++k) {
        const double size = largest(b[n][k]);
        for (size_t i = 0; i < a[n][k].size(); ++i)
          worsen(worst, relative_error(a[n][k][i], b[n][k][i], size));
      }
    }
    return result;
  }

  const Func& output_;
  Shape shape_;
  GradientCheckOptions options_;
  std::mt19937_64 random_;
  std::vector<Values> weights_;
  std::unique_ptr<DerivativePair> pair_;
  std::unique_ptr<Slopes> slopes_;
  GradientReport report_;
};

}  // namespace

GradientReport check_gradients(const Func& output, const std::vector<int>& sizes,
                               const GradientCheckOptions& options) {
  return Checker(output, sizes, options).run();
}

}  // namespace retrograde
