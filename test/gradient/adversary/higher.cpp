// Checks derivatives of derivatives along two directions u and v. Every order of the two modes must agree, with each
// other and with differences of <v, gradient> along u. Third derivatives are taken along u, v and u.
#include <cmath>

#include "diagnostics/error.h"
#include "gradient/adversary/probe.h"

namespace retrograde::gradient {

namespace {

class Higher {
 public:
  Higher(Subject& s, const Motion& v, const Derivative& d)
      : s_(s), v_(v), d_(d), u_(s.program, s.weights, "u") {}

  void run() {
    first_ = v_.along([&](const AdjointInput& x) { return d_.of(x); });
    second_ = u_and_v();
    if (s_.is_late()) return;
    compare_with_differences();
    if (s_.is_late()) return;
    compare("tangents of tangents", tangents_of_tangents(), second_);
    if (s_.is_late()) return;
    if (s_.weights.below(2) == 0) {
      compare("adjoints of tangents", adjoint_of_tangent(), second_);
    } else {
      compare("adjoints of adjoints", adjoint_of_adjoint(), second_);
    }
    if (s_.program.checks.order >= 3 && !s_.is_late()) compare_third();
  }

 private:
  static Func along(const Func& f, const std::vector<Direction>& directions) {
    return f.defined() ? propagate_tangents(f, directions)(f) : f;
  }
  Product u_and_v() const {
    return v_.along([&](const AdjointInput& x) { return along(d_.of(x), u_.directions()); });
  }
  Func tangent(const SeededOutput& of) const { return along(of.output, v_.directions()); }
  Func tangent_twice(const SeededOutput& of) const { return along(tangent(of), u_.directions()); }
  static Product weighted_output(const Func& f, const SeededOutput& like) {
    if (!f.defined()) return {};
    return weighted(evaluate(f, like.region), like.region, like.w);
  }
  Product tangents_of_tangents() const {
    return s_.total(
        [&](const SeededOutput& each) { return weighted_output(tangent_twice(each), each); });
  }
  Product adjoint_of_tangent() const {
    std::vector<OutputAdjoint> tangents = s_.adjoints();
    for (size_t i = 0; i < tangents.size(); ++i) tangents[i].output = tangent(s_.outputs[i]);
    std::erase_if(tangents, [](const OutputAdjoint& each) { return !each.output.defined(); });
    if (tangents.empty()) return {};
    const Derivative d = propagate_adjoints(tangents, s_.options());
    return u_.along([&](const AdjointInput& x) { return d.of(x); });
  }
  // The adjoint of an adjoint: the derivative of the sum over inputs of <v, gradient>, one input at a time.
  Product adjoint_of_adjoint() const {
    Product result;
    const std::vector<Direction> directions = v_.directions();
    for (size_t i = 0; i < directions.size(); ++i) {
      const Func gradient = d_.of(directions[i].input);
      if (!gradient.defined()) continue;
      Region bounds;
      const oracle::Region region = v_.region(i);
      for (size_t d = 0; d < region.mins.size(); ++d)
        bounds.push_back({Expr(region.mins[d]), Expr(region.extents[d])});
      const Derivative d =
          propagate_adjoints(gradient, directions[i].tangent, bounds, s_.options());
      const Product part = u_.along([&](const AdjointInput& x) { return d.of(x); });
      result.add(part);
    }
    return result;
  }

  // A value that is not finite may be a pole of the second derivative; then differences decide.
  void compare(const char* what, const Product& a, const Product& b) const {
    if (!a.is_finite() || !b.is_finite()) return;
    const double slack = 1e-9 * (a.magnitude + b.magnitude + first_.magnitude + 1 + s_.largest);
    if (std::abs(a.sum - b.sum) <= slack) return;
    decide(Judgement::Wrong, text("second derivatives differ: ", what, " say ", a.sum,
                                  ", tangents of adjoints ", b.sum));
  }
  void compare_with_differences() const {
    if (s_.program.stops_gradients) return;
    const auto moved = [&](double by) {
      u_.move(by);
      const Product result = v_.along([&](const AdjointInput& x) { return d_.of(x); });
      u_.move(-by);
      return result.sum;
    };
    const Slope slope = slope_of(moved, first_.sum, second_.magnitude, first_.magnitude,
                                 10 * precision_of(s_.program.outputs));
    if (!slope.is_smooth) return;
    if (std::abs(slope.value - second_.sum) <= slope.doubt) return;
    decide(Judgement::Wrong, text("tangents of adjoints say ", second_.sum, " and differences ",
                                  slope.value, " +- ", slope.doubt));
  }

  void compare_third() const {
    const auto u = u_.directions(), v = v_.directions();
    const Product a = v_.along([&](const AdjointInput&x) { return along(along(d_.of(x), u), v); }),
                  b = s_.total([&](const SeededOutput&each) {
                    return weighted_output(along(tangent_twice(each), v), each);
                  });
    if (!a.is_finite() || !b.is_finite()) return;
    const double slack = 1e-8 * (a.magnitude + b.magnitude + second_.magnitude + 1 + s_.largest);
    if (std::abs(a.sum - b.sum) <= slack) return;
    decide(Judgement::Wrong, text("third derivatives differ: ", a.sum, " and ", b.sum));
  }

  Subject& s_;
  const Motion& v_;
  const Derivative& d_;
  const Motion u_;
  Product first_, second_;
};

}  // namespace

void compare_higher(Subject& s, const Motion& v, const Derivative& derivative) {
  Higher(s, v, derivative).run();
}

}  // namespace retrograde::gradient
