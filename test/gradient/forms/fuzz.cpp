// fuzz_forms -- searches for pointwise expressions whose gradient is wrong, in float32 and in double. support/fuzz.h
// describes its arguments.
#include "support/fuzz.h"
#include "gradient/forms/check_form.h"
#include "gradient/forms/expressions.h"
#include "ir/print.h"

namespace {

using namespace retrograde;
using namespace retrograde::gradient;
using namespace retrograde::fuzz;

// One draw seeds the points at which the expression is checked.
Judged judge(Choices& choices, bool compile) {
  FormResult total;
  const auto seed = static_cast<uint64_t>(choices.below(1 << 30));
  const Choices fresh = choices;
  for (const Type& type : {Float(32), Float(64)}) {
    choices = fresh;
    total += check_form(make_form(choices, type), seed, compile);
  }
  return {
      total.finding.empty() ? Judgement::Right : Judgement::Wrong,
      total.finding,
      {{"slopes", static_cast<uint64_t>(total.checked)},
       {"ill-conditioned", static_cast<uint64_t>(total.ill_conditioned)},
       {"places where a value is not finite or not normal", static_cast<uint64_t>(total.outside)}}};
}

}  // namespace

int main(int argc, char** argv) {
  const auto text = [](Choices& choices) {
    choices.below(1 << 30);
    return ir::print(make_form(choices, Float(32)));
  };
  return fuzz_main({.judge = judge, .text = text}, argc, argv);
}
