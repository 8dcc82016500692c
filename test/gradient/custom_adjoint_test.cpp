// Tests custom_adjoint and custom_tangent. Right rules agree with differences in double and with the generated
// derivative; rules that differ from the definitions show exactly in the gradient; incomplete rules are errors.
// custom_extern_test covers extern stages, which run as machine code.
#include "autodiff/custom_derivative.h"

#include <thread>

#include "autodiff/second_order.h"
#include "frontend/data/param.h"
#include "gradient/gradient_check.h"
#include "support/errors.h"
#include "support/facts.h"

namespace retrograde::gradient {
namespace {

using Contributions = std::vector<AdjointContribution>;

class CustomAdjoints : public ::testing::Test {
 protected:
  Var x{"x"}, i{"i"};
  Buffer<float> a = random_image({6}, 0.25, 1.5, 1);
  const oracle::Region all{{0}, {6}};

  double at(const Func& f, int point) {
    return evaluate(f, all).values[static_cast<size_t>(point)].scalar.as_double();
  }
  // f(x) = sin(a(x)), with a rule that says that the slope is `slope` everywhere.
  Func with_slope(float slope) {
    Func f("f");
    f(x) = sin(a(x));
    Buffer<float> input = a;
    custom_adjoint(f, {a}, [input, slope](const AdjointContext& c) {
      Func adj("a_adj");
      Var j;
      adj(j) = c.adjoint()(j) * slope;
      return Contributions{{input, adj}};
    });
    return f;
  }
  Func sum_of(const Func& f) {
    Func loss("loss");
    RDom r(0, 6);
    loss() = 0.0f;
    loss() += f(r) * cast<float>(r + 1);
    return loss;
  }
  // Defined over its whole domain, zero elsewhere.
  Func input() {
    Func g("g");
    g(x) = select(x >= 0 && x < 6, a(clamp(x, 0, 5)) * 2.0f, 0.0f);
    return g;
  }
};

TEST_F(CustomAdjoints, StandForTheDefinition) {
  Derivative d = propagate_adjoints(sum_of(with_slope(3.0f)));
  for (int n = 0; n < 6; ++n) EXPECT_EQ(at(d(a), n), 3.0 * (n + 1));
  expect_machine_code_agrees(d(a), all);
  EXPECT_EQ(details_of(d.explanations(), Fact::Custom),
            std::vector<std::string>{"its custom adjoint contributes \"b_from_f\" to \"b\""});
}

TEST_F(CustomAdjoints, ReplaceOneAnother) {
  Func f = with_slope(3.0f);
  Buffer<float> input = a;
  custom_adjoint(f, {a}, [input](const AdjointContext&) {
    return Contributions{AdjointContribution::zero(input)};
  });
  Derivative d = propagate_adjoints(sum_of(f));
  EXPECT_EQ(at(d(a), 2), 0.0);
  expect_fact(d.explanations(), Fact::Zero, a.name(),
              text("by the custom adjoint of \"", f.name(), "\""));
}

TEST_F(CustomAdjoints, OfAStencilReadSeveralTimes) {
  Func g = input(), f("f"), h("h"), k("k");
  f(x) = g(x) * g(x + 1);
  custom_adjoint(f, {g}, [g](const AdjointContext& c) {
    Func adj("g_adj");
    Var j;
    adj(j) = c.adjoint()(j) * g(j + 1) + c.adjoint()(j - 1) * g(j - 1);
    return Contributions{{g, adj}};
  });
  h(x) = f(x) * f(5 - x) + f(x + 1);
  k(x) = exp(f(x)) + h(x);
  expect_gradient(weighted_sum(k, {6}), a);
}

TEST_F(CustomAdjoints, OfTuples) {
  Func g("g"), f("f"), h("h");
  g(x) = Tuple(a(x), cast<int>(x), a(x) * 2.0f);
  f(x) = Tuple(g(x)[0] * g(x)[2], g(x)[0] + cast<float>(g(x)[1]));
  custom_adjoint(f, {g}, [g](const AdjointContext& c) {
    Func adj("g_adj");
    Var j;
    Func y = c.adjoint();
    adj(j) = Tuple(y(j)[0] * g(j)[2] + y(j)[1], 7.0f, y(j)[0] * g(j)[0]);
    return Contributions{{g, adj}};
  });
  h(x) = f(x)[0] * f(x)[1];
  expect_gradient(weighted_sum(h, {6}), a);
}

TEST_F(CustomAdjoints, GiveParametersSumsOverTheRegion) {
  Param<float> gain("gain");
  gain.set(0.75f);
  Func f("f"), along("along");
  f(x) = sin(a(x) * gain);
  Buffer<float> input = a;
  custom_adjoint(f, {a, gain}, [input, gain](const AdjointContext& c) {
    Contributions result;
    Var j;
    if (c.wants(input)) {
      Func adj("a_adj");
      adj(j) = c.adjoint()(j) * cos(input(j) * gain) * gain;
      result.push_back({input, adj});
    }
    if (c.wants(gain)) {
      Func adj("gain_adj");
      RDom r(c.region());
      adj() = 0.0f;
      adj() += c.adjoint()(r) * cos(input(r) * gain) * input(r);
      result.push_back({gain, adj});
    }
    return result;
  });
  Func loss = sum_of(f);
  expect_gradient(loss, a);
  double expected = 0;
  for (int n = 0; n < 6; ++n) expected += (n + 1) * std::cos(a(n) * 0.75) * a(n);
  Derivative only = propagate_adjoints(loss, {.wrt = {gain}});
  EXPECT_NEAR(evaluate_scalar(only(gain)), expected, 1e-12);
  EXPECT_FALSE(only.has(a));
  EXPECT_THROW(only(a), CompileError);
}

// A softmax of two Funcs, one of which the rule reads.
struct Softmax {
  Func exponential{"exponential"}, total{"total"}, f{"softmax"};
  Softmax(const Buffer<float>& a, const Var& x) {
    RDom r(0, 6);
    exponential(x) = exp(a(x));
    total() = 0.0f;
    total() += exponential(r);
    f(x) = exponential(x) / total();
  }
  void give_rule(const Buffer<float>& a) {
    custom_adjoint(f, {a}, [a](const AdjointContext& c) {
      Func dot("dot"), adj("a_adj");
      Var j;
      RDom r(c.region());
      dot() = 0.0f;
      dot() += c.adjoint()(r) * c.func()(r);
      adj(j) = c.func()(j) * (c.adjoint()(j) - dot());
      return Contributions{{a, adj}};
    });
  }
};

TEST_F(CustomAdjoints, OfSeveralFuncsTogether) {
  Softmax s(a, x);
  Func loss = weighted_sum(s.f, {6});
  Func expected = propagate_adjoints(loss)(a);
  s.give_rule(a);
  Derivative d = propagate_adjoints(loss);
  expect_gradient(loss, d, a);
  for (int n = 0; n < 6; ++n) EXPECT_NEAR(at(d(a), n), at(expected, n), 1e-12);
  EXPECT_TRUE(d(s.f).defined());
  EXPECT_THROW(d(s.total), CompileError);
  for (const Func& inside : {s.exponential, s.total}) {
    expect_fact(d.explanations(), Fact::Custom, inside.name(),
                "inside of the custom adjoint of \"softmax\": it has no adjoint of its own");
  }
}

TEST_F(CustomAdjoints, WhatIsInsideKeepsItsOtherReaders) {
  Softmax s(a, x);
  Func both("both");
  both(x) = s.f(x) + 0.25f * s.exponential(x);
  s.give_rule(a);
  expect_gradient(weighted_sum(both, {6}), a);
}

TEST_F(CustomAdjoints, GoPastIntegers) {
  Func q("q"), f("f");
  q(x) = cast<int>(round(a(x) * 4.0f));
  f(x) = cast<float>(q(x)) / 4.0f;
  Buffer<float> input = a;
  custom_adjoint(f, {a}, [input](const AdjointContext& c) {
    return Contributions{{input, c.adjoint()}};
  });
  Derivative d = propagate_adjoints(sum_of(f), {.wrt = {a}});
  for (int n = 0; n < 6; ++n) EXPECT_EQ(at(d(a), n), n + 1.0);
}

TEST_F(CustomAdjoints, CountOnlyWhereTheOutputDependsOnTheInput) {
  Func g("g"), f("f"), loss("loss");
  g(x) = a(x);
  f(x) = g(x);
  custom_adjoint(f, {g}, [g](const AdjointContext& c) {
    EXPECT_EQ(ir::print(c.region_of(g)[0].min), "2");
    EXPECT_EQ(ir::print(c.region_of(g)[0].extent), "3");
    Func adj("g_adj");
    Var j;
    adj(j) = 1.0f;
    return Contributions{{g, adj}};
  });
  RDom r(2, 3);
  loss() = 0.0f;
  loss() += f(r);
  Derivative d = propagate_adjoints(loss);
  for (int n = 0; n < 6; ++n) EXPECT_EQ(at(d(g), n), n >= 2 && n < 5 ? 1.0 : 0.0);
  for (int n = 0; n < 6; ++n) EXPECT_EQ(at(d(a), n), n >= 2 && n < 5 ? 1.0 : 0.0);
}

TEST_F(CustomAdjoints, OfFuncsWithUpdatesAndInterpretedAsOneStep) {
  Func f("f");
  RDom r(1, 5);
  f(x) = a(x);
  f(r) = f(r - 1) * 0.5f + a(r);  // not differentiated at all
  Buffer<float> input = a;
  custom_adjoint(f, {a}, [input](const AdjointContext& c) {
    Func adj("a_adj");
    Var j;
    adj(j) = c.adjoint()(j);
    return Contributions{{input, adj}};
  });
  Derivative d = propagate_adjoints(sum_of(f));
  EXPECT_EQ(at(d(a), 3), 4.0);
  EXPECT_EQ(at(d.adjoint(f), 3), 4.0);
  EXPECT_THROW(d(f, -1), CompileError);
}

TEST_F(CustomAdjoints, OfClones) {
  Func f = with_slope(3.0f), one("one"), two("two"), h("h");
  one(x) = f(x);
  two(x) = f(x) * 2.0f;
  Func clone = f.clone_in(two), wrapper = f.in(one);
  h(x) = one(x) + two(x) + clone(x) * 4.0f + wrapper(x) * 8.0f;
  Derivative d = propagate_adjoints(sum_of(h), {.wrt = {a}});
  for (int n = 0; n < 6; ++n) EXPECT_EQ(at(d(a), n), 3.0 * (1 + 2 + 4 + 8) * (n + 1));
}

TEST_F(CustomAdjoints, AreDifferentiatedAgain) {
  Func f("f");
  f(x) = sin(a(x));
  Func loss = weighted_sum(f, {6});
  Func expected = hessian_vector_product(loss, a, {{a, a}});
  Buffer<float> input = a;
  custom_adjoint(f, {a}, [input](const AdjointContext& c) {
    Func adj("a_adj");
    Var j;
    adj(j) = c.adjoint()(j) * cos(input(j));
    return Contributions{{input, adj}};
  });
  custom_tangent(f, {a}, [input](const TangentContext& c) {
    Func tan("f_tan");
    Var j;
    tan(j) = c.tangent(input)(j) * cos(input(j));
    return tan;
  });
  Func found = hessian_vector_product(loss, a, {{a, a}}), along("along");
  Func third = propagate_tangents(found, {{a, a}})(found);
  RDom r(0, 6);
  along() = 0.0f;
  along() += propagate_adjoints(loss)(a)(r)*a(r);
  Func reverse =
      propagate_adjoints(along)(a);  // (H + d/da) a: the gradient is counted a second time
  Func gradient = propagate_adjoints(loss)(a);
  Func expected_third = propagate_tangents(expected, {{a, a}})(expected);
  for (int n = 0; n < 6; ++n) {
    EXPECT_NEAR(at(found, n), at(expected, n), 1e-12);
    EXPECT_NEAR(at(reverse, n), at(expected, n) + at(gradient, n), 1e-12);
    EXPECT_NEAR(at(third, n), at(expected_third, n), 1e-12);
  }
  expect_machine_code_agrees(found, all);
}

// The slope of the slope is a rule of its own, which is not the derivative of the first one.
TEST_F(CustomAdjoints, HaveFuncsWithRulesOfTheirOwn) {
  Func f("f");
  f(x) = sin(a(x));
  Buffer<float> input = a;
  custom_adjoint(f, {a}, [input](const AdjointContext& c) {
    Func slope("slope"), adj("a_adj");
    Var j;
    slope(j) = cos(input(j));
    custom_adjoint(slope, {input}, [input](const AdjointContext& inner) {
      Func again("again");
      Var k;
      again(k) = inner.adjoint()(k) * 5.0f;
      return Contributions{{input, again}};
    });
    adj(j) = c.adjoint()(j) * slope(j);
    return Contributions{{input, adj}};
  });
  Func gradient = propagate_adjoints(sum_of(f))(a), along("along");
  RDom r(0, 6);
  along() = 0.0f;
  along() += gradient(r);
  Func second = propagate_adjoints(along)(a);
  for (int n = 0; n < 6; ++n) {
    EXPECT_NEAR(at(gradient, n), (n + 1) * std::cos(static_cast<double>(a(n))), 1e-12);
    EXPECT_NEAR(at(second, n), (n + 1) * 5.0, 1e-12);
  }
}

TEST_F(CustomAdjoints, DieWithTheirFunc) {
  auto token = std::make_shared<int>(1);
  std::weak_ptr<int> alive = token;
  {
    Func f("f"), clone;
    f(x) = a(x);
    Buffer<float> input = a;
    custom_adjoint(f, {a}, [input, token](const AdjointContext& c) {
      return Contributions{{input, c.adjoint()}};
    });
    token.reset();
    Func grad = propagate_adjoints(sum_of(f))(a);
    EXPECT_FALSE(alive.expired());
  }
  EXPECT_TRUE(alive.expired());
}

TEST_F(CustomAdjoints, RunInSeveralThreadsAtOnce) {
  Func loss = sum_of(with_slope(2.0f));
  std::vector<double> found(4);
  std::vector<std::thread> threads;
  for (size_t t = 0; t < found.size(); ++t)
    threads.emplace_back([&, t] { found[t] = at(propagate_adjoints(loss)(a), 2); });
  for (std::thread& t : threads) t.join();
  for (double v : found) EXPECT_EQ(v, 6.0);
}

TEST_F(CustomAdjoints, AreNotRunWhereNothingBehindThemIsWanted) {
  Func f("f"), h("h");
  f(x) = a(x);
  custom_adjoint(f, {a}, [](const AdjointContext&) -> Contributions { throw 1; });
  Buffer<float> b = random_image({6}, 0.25, 1.5, 2);
  h(x) = f(x) * b(x);
  EXPECT_NO_THROW(propagate_adjoints(sum_of(h), {.wrt = {b}}));
  EXPECT_THROW(propagate_adjoints(sum_of(h), {.wrt = {a}}), int);
}

// A zero from a consumer that chose another branch stays 0 even if the input has an infinite partial.
TEST_F(CustomAdjoints, ZerosStayStrongBehindARule) {
  Func g("g"), f("f"), h("h");
  Buffer<float> b(6);
  b.fill(0.0f);
  g(x) = sqrt(b(x));
  f(x) = g(x) * 2.0f;
  custom_adjoint(f, {g}, [g](const AdjointContext& c) {
    Func adj("g_adj");
    Var j;
    adj(j) = c.adjoint()(j) * 2.0f;
    return Contributions{{g, adj}};
  });
  h(x) = select(b(x) > 0.5f, f(x), 1.0f);
  Func grad = propagate_adjoints(sum_of(h))(b);
  for (int n = 0; n < 6; ++n) EXPECT_EQ(at(grad, n), 0.0);
}

// ---- forward ----

TEST_F(CustomAdjoints, TangentsOfInputsThatMove) {
  Param<float> gain("gain");
  gain.set(0.5f);
  Func g("g"), f("f"), one("one");
  g(x) = a(x) * a(x);
  f(x) = g(x) * gain;
  one() = 1.0f;
  Func expected_g = propagate_tangents(f, {{a, a}})(f),
       expected = propagate_tangents(f, {{a, a}, {gain, one}})(f);
  custom_tangent(f, {g, gain}, [g, gain](const TangentContext& c) {
    Func tan("tan");
    Var j;
    tan(j) = c.tangent(g)(j) * gain + g(j) * c.tangent(gain)();
    return tan;
  });
  Tangents t = propagate_tangents(f, {{a, a}, {gain, one}});
  Func found_g = propagate_tangents(f, {{a, a}})(f);
  for (int n = 0; n < 6; ++n) {
    EXPECT_NEAR(at(t(f), n), at(expected, n), 1e-12);
    EXPECT_NEAR(at(found_g, n), at(expected_g, n), 1e-12);
  }
  expect_fact(t.explanations(), Fact::Custom, f.name(), "\"f_tan\", from its custom tangent");
}

TEST_F(CustomAdjoints, OfAnInputWhoseBoundsAloneAreReadContributeNothingToIt) {
  ImageParam sized(Float(32), 1, "sized");
  sized.set(a);
  Func f("f");
  f(x) = sin(a(x)) * cast<float>(sized.width());
  Buffer<float> input = a;
  custom_adjoint(f, {a, sized}, [input, sized](const AdjointContext& c) {
    Func adj("a_adj"), sized_adj("sized_adj");
    Var j;
    adj(j) = c.adjoint()(j) * 3.0f;
    sized_adj(j) = 1.0f;
    return Contributions{{input, adj}, {sized, sized_adj}};
  });
  Derivative d = propagate_adjoints(sum_of(f));
  for (int n = 0; n < 6; ++n) {
    EXPECT_EQ(at(d(a), n), 3.0 * (n + 1));
    EXPECT_EQ(at(d(sized), n), 0.0);
  }
  expect_fact(
      d.explanations(), Fact::Zero, sized.name(),
      "the output reads no element of it, at most its bounds: the contribution of the custom "
      "adjoint of \"f\" is ignored");
}

// rule: a Func with a custom adjoint needs a rule for tangents, too
TEST_F(CustomAdjoints, WithoutATangentIsRefusedWhereInputsMove) {
  Func f = with_slope(3.0f), h("h");
  Buffer<float> b = random_image({6}, 0.25, 1.5, 2);
  h(x) = f(x) * b(x);
  EXPECT_NEAR(at(propagate_tangents(h, {{b, b}})(h), 1), std::sin(1.0 * a(1)) * b(1), 1e-12);
  expect_error<Unsupported>({"propagate tangents through \"f", "custom_tangent"}, [&] {
    propagate_tangents(h, {{a, a}});
  });
}

// ---- errors ----

class CustomAdjointErrors : public CustomAdjoints {
 protected:
  Func g{"g"}, f{"f"};
  Param<float> gain{"gain"};
  Param<int> count{"count"};
  CustomAdjointErrors() {
    g(x) = a(x);
    f(x) = g(x) * gain + cast<float>(count);
  }
  static Contributions none(const AdjointContext&) { return {}; }
  std::string when_given(const std::vector<AdjointInput>& inputs) {
    return error_of([&] { custom_adjoint(f, inputs, none); });
  }
  std::string when_run(const std::vector<AdjointInput>& inputs, const CustomAdjoint& rule,
                       const AdjointOptions& options = {}) {
    custom_adjoint(f, inputs, rule);
    return error_of([&] { propagate_adjoints(sum_of(f), options); });
  }
};

// rule: a rule belongs to a Func that is defined
// rule: only floating-point values have derivatives
TEST_F(CustomAdjointErrors, OfTheFunc) {
  Func undefined("undefined"), whole("whole");
  whole(x) = x;
  expect_error({"give \"undefined", "no definition", "Define it first"},
               [&] { custom_adjoint(undefined, {}, none); });
  expect_error({"only floating-point", "int32"}, [&] { custom_adjoint(whole, {}, none); });
  expect_error({"a rule is a function"}, [&] { custom_adjoint(f, {g}, nullptr); });
  expect_error({"custom tangent", "a rule is a function"},
               [&] { custom_tangent(f, {g}, nullptr); });
  expect_error({"extern stages only"}, [&] {
    custom_adjoint(f, {g}, none, [](const AdjointInput&, const Region& r) { return r; });
  });
}

TEST_F(CustomAdjointErrors, OfTheInputs) {
  Func other("other"), undefined("undefined");
  other(x) = 1.0f;
  expect_mentions(when_given({g, g}), {"listed once", "is listed twice"});
  expect_mentions(when_given({other}), {"does not depend on \"other"});
  expect_mentions(when_given({f}), {"is listed itself"});
  expect_mentions(when_given({count}), {"only floating-point", "has type int32"});
  expect_mentions(when_given({undefined}), {"must be defined", "input 0"});
}

// rule: its custom adjoint must know every input whose gradient is wanted
TEST_F(CustomAdjointErrors, AWantedInputThatTheRuleDoesNotKnow) {
  auto rule = [this](const AdjointContext& c) { return Contributions{{g, c.adjoint()}}; };
  expect_mentions(when_run({g}, rule, {.wrt = {a, gain}}),
                  {"propagate adjoints through \"f", "reads \"gain", "List it"});
  EXPECT_EQ(when_run({g}, rule), "no error");  // left out: gradient_lookup_test
  EXPECT_EQ(when_run({g}, rule, {.wrt = {a}}), "no error");
  expect_mentions(when_run({a, gain}, none, {.wrt = {g, a}}), {"reads \"g"});
}

// rule: has the dimensions of
TEST_F(CustomAdjointErrors, OfContributions) {
  Func flat("flat"), whole("whole"), pair("pair"), undefined("undefined");
  Var y("y");
  flat(x, y) = 1.0f;
  whole(x) = x;
  pair(x) = Tuple(1.0f, 2.0f);
  const AdjointOptions options{.wrt = {a}};
  auto giving = [&](const Contributions& given) {
    return when_run(
        {g}, [given](const AdjointContext&) { return given; }, options);
  };
  expect_mentions(giving({}), {"each wanted input gets a contribution", "none to \"g", "zero"});
  expect_mentions(giving({{a, g}}), {"was made for", "List it"});
  expect_mentions(giving({{g, g}, {g, g}}), {"one contribution", "two to \"g"});
  expect_mentions(giving({{g, flat}}), {"has the dimensions of its input", "has 2 and \"g"});
  expect_mentions(giving({{g, whole}}), {"made of floating-point values", "int32"});
  expect_mentions(giving({{g, pair}}), {"as many values", "has 2 and \"g"});
  expect_mentions(giving({{g, undefined}}), {"must be defined"});
}

// rule: a rule asks for the tangents of its inputs
TEST_F(CustomAdjointErrors, OfTangents) {
  Func flat("flat"), one("one"), h("h");
  Var y("y");
  flat(x, y) = 1.0f;
  one() = 1.0f;
  custom_tangent(f, {g}, [flat](const TangentContext&) { return flat; });
  expect_error({"the tangent that its rule gives", "has 2"}, [&] {
    propagate_tangents(f, {{a, a}});
  });
  expect_error({"every input that moves", "reads \"gain"}, [&] {
    propagate_tangents(f, {{a, a}, {gain, one}});
  });
  custom_tangent(f, {g}, [this](const TangentContext& c) { return c.tangent(gain); });
  expect_error({"is not listed"}, [&] { propagate_tangents(f, {{a, a}}); });
  h(x) = f(x);
  expect_error<Unsupported>({"a Func with a custom tangent", "Give it a custom_adjoint"},
                            [&] { propagate_adjoints(sum_of(h), {.wrt = {a}}); });
}

}  // namespace
}  // namespace retrograde::gradient
