// Tests explain(): it describes the gradient's Funcs and their size, scatters and their reasons, values kept for
// updates, gradients that are zero, and gradients that are left out. The expected texts name the Func and the reason.
#include <algorithm>

#include "gradient/programs_suite.h"
#include "support/errors.h"
#include "support/facts.h"
#include "support/variables.h"

namespace retrograde::gradient {
namespace {

// A Built fact about an adjoint without scatters and privatised sums, with the given number of gathers.
std::string built(const std::string& adjoint, int gathers, const std::string& size) {
  return text('"', adjoint, "\", ", gathers,
              " gathers over reduction domains, 0 scatters inside pure dimensions, 0 privatised "
              "sums",
              size);
}

TEST(Explain, AdjointsSayHowTheyAccumulateAndHowLargeTheyAre) {
  Buffer<float> a = line(10);
  Func f("explained_f");
  RDom r(0, 3);
  f(x) = 0.0f;
  f(x) += a(x + r);
  Derivative d = propagate_adjoints(weighted_sum(f, {8}));
  expect_fact(d.explanations(), Fact::Built, f.name(),
              built("explained_f_adj", 0, ", 8 elements, 32 bytes when stored"));
  expect_fact(d.explanations(), Fact::Built, a.name(),
              built("b_adj", 1, ", 10 elements, 40 bytes when stored"));
}

TEST(Explain, ScattersSayWhichDataDecide) {
  Buffer<float> table = line(5);
  Buffer<int> index = places(12, 5);
  Func f("explained_f");
  f(x) = table(clamp(index(x), 0, 4));
  Derivative d = propagate_adjoints(weighted_sum(f, {12}));
  expect_fact(d.explanations(), Fact::Scattered, table.name(),
              text("read by \"", f.name(), "\": an index depends on \"", index.name(), "\""));
}

TEST(Explain, DearGathersSayWhatTheyWouldCost) {
  Buffer<float> a = line(63);
  Func f("explained_f");
  f(x) = a((3 * x) % 32 + x / 32);
  Derivative d = propagate_adjoints(weighted_sum(f, {1024}));
  expect_fact(d.explanations(), Fact::Scattered, a.name(),
              "read by \"explained_f\": a gather would run 61236 iterations for 1024 points");
}

TEST(Explain, FoldsSayWhatTheyKeep) {
  Buffer<float> a = line(6);
  Func f("explained_f");
  RDom r(0, 6);
  f() = 1.0f;
  f() *= a(r);
  Derivative d = propagate_adjoints(f, {.overwritten = Overwritten::Store});
  const std::vector<std::string> expected{
      "update 0 overwrites values that its partials need: \"explained_f_steps\" keeps 4 bytes in "
      "each iteration",
      "update 0 folds its domain into each element: \"explained_f_adj_steps\" keeps the adjoint "
      "before each iteration"};
  EXPECT_EQ(details_of(d.explanations(), Fact::Version, f.name()), expected);
}

TEST(Explain, TapesSayWhatTheyKeep) {
  Buffer<float> a = line(6);
  Buffer<int> at = places(6, 3);
  Func f("explained_f");
  RDom r(0, 6);
  f(x) = 1.0f;
  f(clamp(at(r), 0, 2)) *= a(r);
  Derivative d = propagate_adjoints(weighted_sum(f, {3}), {.overwritten = Overwritten::Store});
  const std::vector<std::string> expected{
      "update 0 overwrites values that its partials need: \"explained_f_tape\" keeps 1 place of 4 "
      "bytes in each iteration",
      "update 0 is run backward iteration by iteration: \"explained_f_adj_tape\" keeps the adjoint "
      "of each iteration"};
  EXPECT_EQ(details_of(d.explanations(), Fact::Version, f.name()), expected);
}

TEST(Explain, ZerosAndWhatWasNotRequestedSayWhy) {
  Buffer<float> a = line(), b = line(9, 4);
  Func f("explained_f");
  f(x) = floor(a(x)) + b(x);
  Derivative d = propagate_adjoints(weighted_sum(f, {9}));
  expect_fact(d.explanations(), Fact::Zero, a.name(),
              "the output does not depend on its value along a differentiable path: "
              "\"explained_f\" reads it in floor, whose derivative is 0");
  expect_fact(d.explanations(), Fact::Zero, f.name(),
              "floor has derivative 0 (constant between steps; 0 at the steps by convention)");
  Derivative only = propagate_adjoints(weighted_sum(f, {9}), {.wrt = {a}});
  expect_fact(only.explanations(), Fact::NotRequested, b.name(),
              "no requested gradient needs its adjoint");
}

// Between a loop over time that is folded and the output, copies replace the user's Funcs.
TEST(Explain, RequestedFuncsOfAFoldedLoopAreNoStrangers) {
  Buffer<float> a = line(5);
  Func f("explained_f"), last("explained_last");
  Var t("t");
  RDom r(0, 20);
  f(x, t) = a(x);
  f(x, r + 1) = sin(f(x, r)) * 1.1f;
  last(x) = f(x, 20) * 2.0f;
  Derivative d =
      propagate_adjoints(weighted_sum(last, {5}), {.wrt = {last, a}, .checkpoint_states = 3});
  EXPECT_EQ(details_of(d.explanations(), Fact::Zero), std::vector<std::string>());
  EXPECT_NE(Buffer<float>(d(last).realize({5}))(2), 0.0f);
}

// A clamp inside of a selection that takes only interior points: there are no borders to gather.
TEST(Explain, ConstantExteriorsAreOneGather) {
  ImageParam a(Float(32), 3, "explained_a");
  Func padded = BoundaryConditions::constant_exterior(a, 0.5f), f("explained_f");
  Var y("y"), z("z");
  f(x, y, z) = padded(x - 1, y, z) * padded(x, y + 2, z) * padded(x, y, z + 1);
  Derivative d = propagate_adjoints(weighted_sum(f, {9, 8, 7}));
  expect_fact(d.explanations(), Fact::Built, padded.name(),
              built("constant_exterior_adj", 0, ", 800 elements, 3200 bytes when stored"));
  expect_fact(d.explanations(), Fact::Built, a.name(), built("explained_a_adj", 0, ""));
  Buffer<float> image = random_image({9, 8, 7}, 0.25, 2, 5);
  a.set(image);
  Func loss = weighted_sum(f, {9, 8, 7});
  Func gradient = propagate_adjoints(loss)(a);
  for (const std::vector<int>& at : {std::vector<int>{0, 0, 0}, {8, 7, 6}, {4, 0, 6}, {3, 4, 5}}) {
    float found = evaluate(gradient, {at, {1, 1, 1}}).values[0].scalar.as_double();
    EXPECT_NEAR(found, difference(loss, image, at), 1e-4 * (1 + std::abs(found)));
  }
}

// Each zero names the consumers of the input and the operations that block its derivative.
TEST(Explain, ZerosSayWhichReaderStopsThem) {
  std::vector<Buffer<float>> a;
  for (unsigned k = 0; k < 8; ++k) a.push_back(line(9, k + 1));
  Param<float> scale("explained_scale");
  Func f("explained_f"), g("explained_g"), h("explained_h");
  g(x) = a[6](x) * 2.0f;
  h(x) = a[7](x);
  h(x) = a[5](x);
  f(x) = floor(a[0](x)) + cast<float>(cast<int>(a[1](x))) + stop_gradient(a[2](x)) +
         select(a[3](x) > 1.0f, 1.0f, 2.0f) + a[5](clamp(cast<int>(a[4](x)), 0, 8)) + round(g(x)) +
         h(x) + 0.0f * scale;
  Derivative d = propagate_adjoints(weighted_sum(f, {9}));
  auto stopped = [&](const std::string& input, const Func& reader, const std::string& how) {
    expect_fact(d.explanations(), Fact::Zero, input,
                text("the output does not depend on its value along a differentiable path: \"",
                     reader.name(), "\" reads it", how));
  };
  stopped(a[0].name(), f, " in floor, whose derivative is 0");
  stopped(a[1].name(), f, " in a cast to int32");
  stopped(a[2].name(), f, " in stop_gradient, whose derivative is 0");
  stopped(a[3].name(), f, " in a condition");
  stopped(a[4].name(), f, " in an index of \"" + a[5].name() + "\"");
  stopped(a[6].name(), g, ", and its own gradient is zero");
  stopped(g.name(), f, " in round, whose derivative is 0");
  expect_fact(d.explanations(), Fact::Zero, h.name(),
              "before update 0, which overwrites every element that is read");
  stopped(a[7].name(), h, " where the derivative is 0");
  stopped("explained_scale", f, " where the derivative is 0");
  EXPECT_EQ(Buffer<float>(d(h, -1).realize({9}))(4), 0.0f);
}

TEST(Explain, WhatTheOutputDoesNotDependOnIsZeroAndSaysSo) {
  Buffer<float> a = line(), other = line(4, 2);
  Func f("explained_f"), g("explained_g");
  f(x) = a(x) * a(x);
  g(x) = Tuple(1.0f, 2);
  g(x) = Tuple(3.0f, 4);
  Func loss = weighted_sum(f, {9});
  Derivative all = propagate_adjoints(loss), asked = propagate_adjoints(loss, {.wrt = {other, g}});
  expect_fact(asked.explanations(), Fact::Zero, other.name(), "the output does not depend on it");
  expect_fact(asked.explanations(), Fact::Zero, g.name(), "the output does not depend on it");
  ASSERT_TRUE(asked(other).defined());
  EXPECT_EQ(Buffer<float>(asked(other).realize({4}))(3), 0.0f);
  EXPECT_EQ(asked.adjoint(g).outputs(), 2);
  EXPECT_TRUE(asked(g, -1).defined());
  EXPECT_THROW(asked(a), CompileError) << "it was not requested";
  EXPECT_EQ(Buffer<float>(all(other).realize({4}))(3), 0.0f);
  expect_fact(all.explanations(), Fact::Zero, other.name(), "the output does not depend on it");
  expect_error({"1 updates", "Name one"}, [&] { all(g, 1); });
}

// The complete report on a small pipeline, in full and in short form.
TEST(Explain, TheAccountOfASmallPipeline) {
  Buffer<float> image = line(10), kernel = line(3, 2);
  ImageParam in(Float(32), 1, "told_in"), weights(Float(32), 1, "told_kernel");
  in.set(image);
  weights.set(kernel);
  in.dim(0).set_bounds(0, 10);
  weights.dim(0).set_bounds(0, 3);
  Func gain("told_gain"), blurred("told_blurred"), count("told_count"), loss("told_loss");
  RDom r(0, 3), s(0, 8);
  gain(x) = exp(in(x));
  blurred(x) = 0.0f;
  blurred(x) += gain(x + r) * weights(r);
  count() = cast<float>(in.dim(0).extent());
  loss() = 0.0f;
  loss() += (blurred(s) - 1.0f) * (blurred(s) - 1.0f) + 0.0f * count();
  Derivative d = propagate_adjoints(loss, {.wrt = {in}});
  EXPECT_EQ(
      d.explain(Detail::All),
      R"(built "told_loss": "told_loss_adj", 0 gathers over reduction domains, 0 scatters inside pure dimensions, 0 privatised sums, 1 elements, 4 bytes when stored
built "told_blurred": "told_blurred_adj", 0 gathers over reduction domains, 0 scatters inside pure dimensions, 0 privatised sums, 8 elements, 32 bytes when stored
built "told_gain": "told_gain_adj", 1 gathers over reduction domains, 0 scatters inside pure dimensions, 0 privatised sums, 10 elements, 40 bytes when stored
performance "told_gain": without a directive "told_gain_adj" is computed at root, parallel over its outermost dimension and vectorized over its innermost
built "told_in": "told_in_adj", 0 gathers over reduction domains, 0 scatters inside pure dimensions, 0 privatised sums, 10 elements, 40 bytes when stored
not requested "told_count": no requested gradient needs its adjoint
not requested "told_kernel": no requested gradient needs its adjoint
recomputed "told_loss_adj": at each of 30 reads, 0 operations each time, no memory
stored "told_gain": the gradient reads its values; 40 bytes, 30 operations, because it is requested or read often
stored "told_blurred": the gradient reads its values; 32 bytes, 152 operations, because it has updates
performance "told_blurred": without a directive it is computed at root: inside the loops of its consumer its updates would run again for each element
recomputed "told_blurred_adj": at each of 30 reads, 5 operations each time, no memory
stored "told_gain_adj": 40 bytes, 310 operations, because it has updates
stored "told_in_adj": 40 bytes, 70 operations, because it is requested or read often
left out "told_count": the gradient needs none of its values
left out "told_loss": the gradient needs none of its values
cost "told_loss": 249 operations and 36 bytes; its gradient alone: 562 operations, 2.26 times as many, and 152 bytes
performance "told_loss": its gradient stores 112 bytes of intermediate results, the program 32; most of them in "told_gain", 40: compute it inside the loops of its consumer to store less
)");
  EXPECT_EQ(
      d.explain(),
      R"(cost "told_loss": 249 operations and 36 bytes; its gradient alone: 562 operations, 2.26 times as many, and 152 bytes
stored (4): "told_gain" (40 bytes), "told_gain_adj" (40 bytes), "told_in_adj" (40 bytes), "told_blurred" (32 bytes)
recomputed (2): "told_loss_adj", "told_blurred_adj"
not requested (2): "told_count", "told_kernel"
left out (2): "told_count", "told_loss"
built (4): "told_loss", "told_blurred", "told_gain", "told_in"
performance (3): "told_gain", "told_blurred", "told_loss"
explain(Detail::All) lists every fact with its reason.
)");
}

TEST(Explain, NamesKeepTheirNumbersWhereTwoAreAlike) {
  using Kind = Explanation::Kind;
  const std::vector<Explanation> facts{{Kind::Zero, "twin$1", "\"twin$2\" reads it in floor"},
                                       {Kind::Scattered, "alone$7", "see \"alone$7_adj\""}};
  EXPECT_EQ(to_string(facts, Detail::All),
            "zero \"twin$1\": \"twin$2\" reads it in floor\n"
            "scattered \"alone\": see \"alone_adj\"\n");
  EXPECT_EQ(to_string({facts[1]}, Detail::Summary),
            "scattered (1): \"alone\"\nexplain(Detail::All) lists every fact with its reason.\n");
}

TEST(Explain, SummariesTellZeroFromZeroInPart) {
  using Kind = Explanation::Kind;
  const std::string words = to_string({{Kind::Zero, "partly", "floor has derivative 0"},
                                       {Kind::Built, "partly", "..."},
                                       {Kind::Zero, "wholly", "integers have no derivative"}},
                                      Detail::Summary);
  EXPECT_EQ(words,
            "zero (1): \"wholly\"\nzero in part (1): \"partly\"\nbuilt (1): \"partly\"\n"
            "explain(Detail::All) lists every fact with its reason.\n");
}

TEST(Explain, SummariesStayShort) {
  std::vector<Explanation> facts;
  for (int i = 0; i < 20; ++i) {
    Explanation fact{Explanation::Kind::Stored, "f" + std::string(1, static_cast<char>('a' + i)),
                     ""};
    fact.bytes = i;
    facts.insert(facts.end(), {fact, fact});
  }
  EXPECT_EQ(
      to_string(facts, Detail::Summary),
      "stored (20): \"ft\" (19 bytes), \"fs\" (18 bytes), \"fr\" (17 bytes), \"fq\" (16 bytes), "
      "\"fp\" (15 bytes), \"fo\" (14 bytes), \"fn\" (13 bytes), \"fm\" (12 bytes) and 12 more\n"
      "explain(Detail::All) lists every fact with its reason.\n");
}

TEST(Explain, WhatIsStoredFollowsTheSchedule) {
  Buffer<float> a = line(16);
  Func f("explained_f"), g("explained_g");
  f(x) = exp(a(x));
  g(x) = f(x) * f(x);
  Derivative d = propagate_adjoints(weighted_sum(g, {16}));
  auto line_of = [&](const Func& func) {
    for (const Explanation& e : d.costs()) {
      if (e.subject == func.name()) return text(to_string(e.kind), ": ", e.detail);
    }
    return std::string();
  };
  f.compute_root();
  EXPECT_EQ(line_of(f),
            "stored: the gradient reads its values; 64 bytes, 48 operations, by its schedule");
  f.compute_inline();
  EXPECT_EQ(
      line_of(f),
      "recomputed: the gradient reads its values; at each of 32 reads, 2 operations each time, "
      "no memory");
}

TEST(Explain, ExtentsOfRunTimeStaySymbolsInTheCosts) {
  ImageParam a(Float(32), 1, "symbolic_a");
  Func loss("symbolic_loss");
  RDom r(0, a.dim(0).extent());
  loss() = 0.0f;
  loss() += a(r) * a(r);
  Derivative d = propagate_adjoints(loss);
  expect_fact(d.costs(), Fact::Cost, loss.name(),
              "1 + 5*symbolic_a.extent.0 operations and 4 bytes; its gradient alone: "
              "5*symbolic_a.extent.0 operations, and 4*symbolic_a.extent.0 bytes");
}

}  // namespace
}  // namespace retrograde::gradient
