// docs/derivatives.md is written here from the rule table itself, so that the page cannot state a
// convention that the code does not have. RETROGRADE_UPDATE_GOLDEN=1 writes the page; read the
// difference before you commit it.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "autodiff/derivative_rules.h"
#include "ir/build.h"

namespace retrograde::ir {
namespace {

const char* const introduction = R"(# Derivatives: rules and conventions

Written from the compiler's rule table by `test/golden/derivatives_page_test.cpp`. Forward and reverse
mode use the same partials, so they are transposes of each other at every point, at kinks too.

- **Kinks.** At a tie of `min` and `max` the operand that the primal takes gets 1 and the other 0: both
  lie in [0, 1] and sum to 1. `clamp` is a `max` of a `min`: at a bound its derivative is 0 or 1. `abs`,
  `absd` and `hypot` have 0 at 0, the smallest subgradient.
- **Strong zeros.** An adjoint (or tangent) that is exactly 0 contributes exactly 0, whatever the
  partial is: infinite, NaN, or overflowed. That holds across Funcs: adjoints know whether a `select`,
  `min`, `max`, `clamp`, a stride or a seed of 0 in a consumer may have made them 0, or a slope that is 0
  where an operand is infinite: `exp(m * b)` with m = -inf, the maximum over an empty domain. Which
  factors of other Funcs may be infinite follows from their definitions
  (`compiler/autodiff/value_range.h`), where what images hold, sums and products count as finite; products
  that overflow inside one expression, `exp(-x * x * y)`, are seen. In forward mode an infinite tangent
  and a later slope of 0 make 0, too, and so do, inside one expression, a quotient or logarithm of a
  denormal number and a later factor of 0. NaNs and infinities that the output uses stay.
- **Poles.** Where a partial is infinite and the value finite (`sqrt`, `pow`, `asin`, `acos`, `acosh`), a
  factor of exactly 0 after it contributes 0: so norms, `sqrt(x*x + y*y)` at the origin, have gradient 0,
  and `sqrt(x)` at 0 keeps its infinity.
  Terms of one sum that cancel have derivative 0 before the pole is met: `pow(a - a, 0.5f)` has 0 by `a`
  in both modes. Where infinite adjoints of both signs reach an element by different Funcs, as in
  `sqrt(f - g)` where `g` is a copy of `f`, the gradient is NaN; forward mode, which sees one direction, has
  0 there along those that leave `f - g` as it is.
- **Steps.** Rounding, comparisons, integer arithmetic and casts to integers have derivative 0;
  `Derivative::explain()` says so where it makes a gradient 0.
- **Stable forms.** Differentiated in one step, so that nothing cancels, overflows or underflows before
  the derivative does (`compiler/autodiff/stable_forms.h`), of up to four terms in one expression:
  `s / (1 + exp(w))`, the logistic function; shares, `a / (a + b + ...)` and `a / (1 + |a|)`, of
  exponentials too (softmax); other ratios of sums of the same terms, `(a - b) / (a + b)`,
  `(exp(a) - exp(-a)) / (exp(a) + exp(-a))`, `(1 - a*a) / (1 + a*a)`; `log(exp(a) + exp(b) + c)`, and
  `max(a, b) + log(1 + exp(-|a - b|))` inside a sum, smooth where its parts have kinks (softplus,
  log-sum-exp, cross entropy of logits); `log(a / b)`, `atan(a / b)`, `sin(a) / a`;
  `a - a + b`; `a log(a)` and `a log(a / b)`; `(exp(a) - 1) / a`, `(1 - exp(-a)) / a`, `log(1 + a) / a`
  and their reciprocals;
  `sqrt(a*a + b*b + ...)` (norms, whose squares may underflow or overflow), their reciprocals, and
  `a / sqrt(a*a + b*b + ...)` (normalised, also by `max(norm, c)`, by a product with `1 / norm`, with
  `pow(a*a + b*b, -0.5f)` or with `fast_inverse_sqrt(a*a + b*b)`).
  `tanh` goes by exp(-2 |x|), since 1 - v^2
  has no digits left for large x; `erf` by two exponentials, since the rounding error of x^2 would be a
  factor; 1 - x^2 is (1 - x)(1 + x); `hypot` and `atan2` are scaled; `pow`'s dx is y v / x where y - 1
  would be rounded. A quotient's adjoint goes in two
  steps, by 1 / y and then by -v: both are adjoints of the program, where 1 / y or y^2 may overflow.
- **What cancels.** A Func that the output reads and does not change with has adjoint 0: the maximum that
  a softmax or a log-sum-exp over Funcs is shifted by, the largest element that a norm is scaled by. It
  is proven by the degrees in which all that reads the Func shifts or scales with it
  (`compiler/autodiff/invariance.h`), and `Derivative::explain()` says so. Summed path by path, that
  adjoint would be what rounding left of a cancellation, and the largest element would get it; without,
  softmax of 300 values is right to 3e-6 of the terms of each element. Forward mode follows every path.
- **Narrow types.** Adjoints and tangents of float16 and bfloat16 are float32.
- **Long sums.** An adjoint in float32 whose elements may get 4,096 terms or more (or a number that is
  known at run time only, or whatever a scatter of so many iterations brings) is summed in double by a
  Func of its own and rounded once, under every schedule: 12 million terms are right to 1e-6 of the sum
  of their absolute values. `Derivative::explain()` names the Func, `Derivative::accumulator()` gives it
  to schedules.
  Shorter sums stay in float32, wrong by at most the number of terms times 2^-24. Sums of the primal
  and tangents are as the program writes them. The adjoint of a scan carries sums from element to
  element, as the suffix sum that belongs to a prefix sum: over 64 elements or more (or a number that is
  known at run time only), unless constant factors with a sum below 1 - 1/64 forget them, the scan runs
  in double, and each element is rounded once. Adjoints on tapes and between kept states of loops over
  time are carried in the precision of the program.
- **Overwritten values.** Where a partial needs a value that an update has overwritten, as in
  `f(x) *= a(x, r)` or a filter in place, its versions are kept (`Overwritten::Auto`), in a Func with
  one more dimension or in copies, if all that the program keeps fits `AdjointOptions::version_bytes`,
  256 MiB; `Derivative::explain()` says what is kept and its bytes. More is refused when the gradient
  is made; where sizes are known at run time only, the call that needs more fails, before the memory
  is touched. `Overwritten::Refuse` keeps nothing: an error names the update, the value and what to
  write instead. `Overwritten::Store` keeps whatever it costs.
- **Loops over time.** An update such as `f(x) = g(f(x), t)` over a long `RDom t` overwrites what its
  partials need. `Overwritten::Store` keeps every version: memory for all n steps. With
  `AdjointOptions::checkpoint_states` (s states) or `checkpoint_bytes` a few states are kept and the
  steps between them are computed again, as few as that memory allows: r n - C(s + r, r - 1) for C(s +
  r - 1, s) < n <= C(s + r, s) (revolve: Griewank and Walther, ACM Algorithm 799), so 1,954 steps again
  for n = 1,000 and s = 44, and 3,636 for s = 10. n may be known at run time only, a Param or an extent
  of an input: then the pipeline finds r and the schedule itself. Time is the outermost reduction
  variable; gradients are the same bits for every s. What steps give to inputs without a time axis is
  summed inside, last step first, and from 4,096 steps on with what rounding lost beside it. A Func
  with a time axis of its own, `f(x, t + 1) = g(f(x, t))`, of which others read the last steps only, is
  folded first: a state is as many slices as a step looks back. Its adjoint is made when `wrt` names it;
  then, or when others read every step, it keeps its steps itself, the budget does not apply, and
  `Derivative::explain()` says so. To read every step within a budget, add up in the loop what is read
  of each: `f(x) = Tuple(g(f(x)[0], t), f(x)[1] + loss(f(x)[0], t))`.
- **Costs.** `Derivative::explain()` tells of every Func of a gradient whether it is stored or computed
  again, with bytes and operations; `Derivative::operations()` gives the numbers and their ratio.
- **ULP** is the largest error of a partial in float32, in units in the last place, on test points inside
  the domain, with operators that are themselves right to about one ULP.

x, y, w are the operands in order, v is the value.

)";

std::string cell(const std::string& text) {
  std::string result;
  for (char c : text) result += c == '|' ? std::string("\\|") : std::string(1, c);
  return result;
}

std::string row(const std::string& name, const DerivativeRule& rule) {
  std::ostringstream out;
  out << "| `" << name << "` | " << cell(rule.formula) << " | " << cell(rule.domain) << " | "
      << cell(rule.convention) << " | " << cell(rule.infinities) << " | ";
  if (rule.max_ulp < 0) {
    out << "not bounded";
  } else {
    out << rule.max_ulp;
  }
  out << " | " << cell(rule.source) << " |\n";
  return out.str();
}

std::string page() {
  std::ostringstream smooth, others;
  std::map<std::string, std::string> by_reason;  // operators without partials, together
  auto add = [&](const std::string& name, const DerivativeRule& rule) {
    if (rule.cls == RuleClass::Smooth) {
      smooth << row(name, rule);
    } else if (rule.cls != RuleClass::NoRule) {
      std::string& names = by_reason[rule.convention];
      names += (names.empty() ? "`" : ", `") + name + "`";
    }
  };
#define RETROGRADE_BINARY(K) add(#K, derivative_rule(Kind::K));
#include "ir/kinds.def"
  for (Kind k : {Kind::Select, Kind::Cast, Kind::Not}) add(kind_name(k), derivative_rule(k));
  for (int i = 0; i < op_count; ++i) {
    const Op op = static_cast<Op>(i);
    add(op_info(op).name, derivative_rule(op));
  }
  for (const auto& [reason, names] : by_reason)
    others << "| " << names << " | " << cell(reason) << " |\n";
  return introduction +
         std::string(
             "| operator | partials | domain | at kinks and poles | at infinities | ULP | source "
             "|\n"
             "|---|---|---|---|---|---|---|\n") +
         smooth.str() + "\n## Operators without partials\n\n| operators | rule |\n|---|---|\n" +
         others.str() +
         "\nSources: [GW] Griewank and Walther, Evaluating Derivatives, 2nd edition; [DLMF] NIST "
         "Digital Library of\nMathematical Functions; \"definition\": follows from the operator's "
         "definition.\n";
}

TEST(DerivativesPage, IsWhatTheRuleTableSays) {
  const std::string path = RETROGRADE_TEST_DIR "/../docs/derivatives.md", text = page();
  if (std::getenv("RETROGRADE_UPDATE_GOLDEN")) std::ofstream(path) << text;
  std::ifstream file(path);
  const std::string on_disk{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(on_disk, text) << "RETROGRADE_UPDATE_GOLDEN=1 writes " << path;
}

}  // namespace
}  // namespace retrograde::ir
