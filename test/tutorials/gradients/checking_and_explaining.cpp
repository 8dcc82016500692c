// Checking and explaining gradients.
//
// check_gradients compares adjoints with finite differences, the complex step and tangents, in double.
// explanations() reports how each adjoint is computed, what is stored, and why a gradient is zero.
#include <retrograde/retrograde.h>

#include <algorithm>
#include <cmath>

#include "tutorial.h"

using namespace retrograde;

int main(int argc, char** argv) {
  const int n = 24;
  Buffer<float> a({n}, "a"), table({8}, "table");
  Buffer<int> places({n}, "places");
  for (int i = 0; i < n; ++i) {
    a(i) = 0.5f + static_cast<float>(i * 5 % 11) / 16;
    places(i) = i * 3 % 8;
  }
  for (int i = 0; i < 8; ++i) table(i) = 1.0f + 0.125f * static_cast<float>(i);

  Var x("x");
  Func looked_up("looked_up"), model("model"), loss("loss");
  RDom r(0, n - 1);
  looked_up(x) = table(clamp(places(x), 0, 7));
  model(x) = tanh(a(x) * a(x + 1)) * looked_up(x) + floor(8.0f * a(x)) / 8.0f;
  loss() = 0.0f;
  loss() += pow(model(r), 2);

  // ---- Is it right? Finite differences fail at steps, so the step function is left out of the check. ----
  Func smooth("smooth"), smooth_loss("smooth_loss");
  smooth(x) = tanh(a(x) * a(x + 1)) * looked_up(x);
  smooth_loss() = 0.0f;
  smooth_loss() += pow(smooth(r), 2);
  GradientReport report = check_gradients(smooth_loss);
  claim(report.worst_error < 1e-8, "adjoints in double agree with differences to eight digits");
  for (const GradientReport::Input& input : report.inputs)
    claim(input.dot_product_error < 1e-12, "and with tangents to twelve digits: " + input.name);
  claim(report.complex_step_refused.empty(),
        "the complex step, exact up to rounding, was possible");
  for (const GradientReport::Input& input : report.inputs)
    claim(input.own_precision_error < 1e-4,
          "in float32, as the program runs, four digits are correct");

  // ---- Would an error be noticed? This rule omits a factor of two. ----
  Func wrong("wrong"), wrong_loss("wrong_loss");
  wrong(x) = a(x) * a(x);
  custom_adjoint(wrong, {a}, [a](const AdjointContext& context) {
    Func half("half");
    Var i("i");
    half(i) = context.adjoint()(i) * a(i);  // should be 2 a(i)
    return std::vector<AdjointContribution>{{a, half}};
  });
  wrong_loss() = 0.0f;
  wrong_loss() += wrong(r);
  GradientCheckOptions quick;
  quick.directions = 1;
  claim(check_gradients(wrong_loss, {}, quick).worst_error > 0.1,
        "check_gradients finds the wrong rule");

  // ---- Explanations of the gradient. ----
  Derivative d = propagate_adjoints(loss);
  std::printf("\nIn short:\n%s\n", d.explain().c_str());
  std::printf("Fact by fact:\n%s\n", d.explain(Detail::All).c_str());
  auto says = [&](Explanation::Kind kind, const std::string& subject) {
    const std::vector<Explanation> facts = d.explanations();
    return std::any_of(facts.begin(), facts.end(), [&](const Explanation& fact) {
      return fact.kind == kind && fact.subject.find(subject) != std::string::npos;
    });
  };
  claim(says(Explanation::Kind::Built, a.name()), "built: the gradient by a is a gather");
  claim(says(Explanation::Kind::Scattered, table.name()),
        "scattered: the table is read at data-dependent indices, so its gradient is a scatter");
  Derivative by_places = propagate_adjoints(loss);
  by_places(places);  // integers have no derivative; requested on purpose
  bool zero = false;
  for (const Explanation& fact : by_places.explanations())
    zero = zero || fact.kind == Explanation::Kind::Zero;
  claim(zero, "zero: the gradient by integers is zero, and the reason is reported");

  // ---- The cost of the gradient. ----
  const GradientOperations operations = d.operations();
  claim(operations.ratio() && *operations.ratio() < 6,
        "the whole gradient takes at most six times the operations of the program");

  std::vector<double> central, richardson;
  for (const GradientReport::Step& step : report.inputs.front().steps) {
    central.push_back(std::log10(std::max(step.central_error, 1e-16)));
    richardson.push_back(std::log10(std::max(step.richardson_error, 1e-16)));
  }
  Picture picture("log10 of the error of finite differences, for smaller steps");
  picture.curve("central differences", central, -16, 0);
  picture.curve("extrapolated", richardson, -16, 0);
  picture.write(argc, argv, "checking_and_explaining");
}
