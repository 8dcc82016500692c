// User-defined derivatives.
//
// A correct derivative may still be useless: the derivative of a step function is 0. custom_adjoint defines
// how adjoints pass through a Func, whatever its definition is. straight_through covers the common case in
// one expression.
#include <retrograde/retrograde.h>

#include <cmath>

#include "tutorial.h"

using namespace retrograde;

const int n = 32;

int main(int argc, char** argv) {
  // A signal gets a gain and an offset and is stored in steps of a quarter. Which gain and offset bring the
  // stored signal closest to `wanted`?
  Buffer<float> signal(n), wanted(n);
  for (int i = 0; i < n; ++i) {
    signal(i) = std::sin(0.4f * static_cast<float>(i));
    wanted(i) = std::round(4 * (1.7f * signal(i) + 0.6f)) / 4;
  }
  Param<float> gain("gain", 1.0f), offset("offset", 0.0f);
  Var x("x");
  Func scaled("scaled"), loss("loss");
  Func stored("stored");
  RDom r(0, n);
  scaled(x) = gain * signal(x) + offset;
  stored(x) = round(4.0f * scaled(x)) / 4.0f;
  loss() = 0.0f;
  loss() += pow(stored(r) - wanted(r), 2) / n;

  // ---- Without a rule the gradient is zero, and the reason is reported. ----
  Derivative flat = propagate_adjoints(loss);
  auto value_of = [](Func f) { return Buffer<float>(f.realize())(); };
  claim(value_of(flat(gain)) == 0.0f && value_of(flat(offset)) == 0.0f,
        "rounding has derivative 0, and so do its inputs");
  bool told = false;
  for (const Explanation& fact : flat.explanations())
    told = told ||
           (fact.kind == Explanation::Kind::Zero && fact.detail.find("round") != std::string::npos);
  claim(told, "explanations() names round as the reason");

  // ---- A rule: the adjoint of `stored` passes on to `scaled` unchanged, as if nothing had been rounded. A
  // rule returns an adjoint, over the whole input, for each input that it covers. ----
  custom_adjoint(stored, {scaled}, [scaled](const AdjointContext& context) {
    Func passed("passed");
    Var i("i");
    passed(i) = context.adjoint()(i);
    return std::vector<AdjointContribution>{{scaled, passed}};
  });
  Derivative d = propagate_adjoints(loss);
  Func by_gain = d(gain), by_offset = d(offset);
  std::vector<double> losses;
  for (int step = 0; step < 40; ++step) {
    losses.push_back(value_of(loss));
    const float down_gain = 0.3f * value_of(by_gain), down_offset = 0.3f * value_of(by_offset);
    gain.set(gain.get() - down_gain);
    offset.set(offset.get() - down_offset);
  }
  std::printf("gain %.3f, offset %.3f, loss %.4f (%.4f before)\n", gain.get(), offset.get(),
              losses.back(), losses.front());
  claim(losses.back() < 0.1 * losses.front(),
        "with the rule, gain and offset are learned through the rounding");

  // ---- The same without a separate Func: one expression's value with another's derivative. ----
  Func inside("inside"), other("other");
  inside(x) = straight_through(round(4.0f * scaled(x)) / 4.0f, scaled(x));
  other() = 0.0f;
  other() += pow(inside(r) - wanted(r), 2) / n;
  Derivative e = propagate_adjoints(other);
  claim(std::abs(value_of(e(gain)) - value_of(by_gain)) < 1e-5f &&
            std::abs(value_of(e(offset)) - value_of(by_offset)) < 1e-5f,
        "straight_through gives the same gradient");

  // ---- Nothing is dropped silently: a requested gradient that the rule does not cover is an error. ----
  Func mixed("mixed"), sum("sum");
  mixed(x) = scaled(x) * wanted(x);
  sum() = 0.0f;
  sum() += mixed(r);
  custom_adjoint(mixed, {scaled}, [scaled](const AdjointContext& context) {
    Func passed("passed");
    Var i("i");
    passed(i) = context.adjoint()(i);
    return std::vector<AdjointContribution>{{scaled, passed}};
  });
  std::string refusal;
  try {
    propagate_adjoints(sum, {.wrt = {wanted}});
  } catch (const CompileError& error) {
    refusal = error.what();
  }
  std::printf("\n%s\n\n", refusal.c_str());
  claim(refusal.find("mixed") != std::string::npos,
        "a requested input that the rule does not cover is an error");

  Picture picture("The loss over steps that learn through rounding");
  picture.curve("", losses, 0, losses.front());
  picture.write(argc, argv, "custom_rules");
}
