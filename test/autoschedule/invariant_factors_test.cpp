// Tests which factors of sums become Funcs of their own, and that values, bounds and the user's Funcs stay as they are.
#include "transform/invariant_factors.h"

#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <string>
#include <vector>

#include "graph/function.h"
#include "testing/interpreter.h"

namespace retrograde::transform {
namespace {

constexpr int bins = 8, samples = 128;

Var a("a"), b("b");

Buffer<float> signal(int size, int step) {
  Buffer<float> result(size);
  for (int i = 0; i < size; ++i) result(i) = static_cast<float>(i % 23 * step % 23) * 0.3125f;
  return result;
}

// How close a value is to the middle of a bin.
Expr closeness(const Expr& value, const Expr& bin) {
  const Expr apart = value - cast<float>(bin);
  return exp(-0.5f * apart * apart);
}

// The joint histogram of two signals, and the sum of its squares.
struct Histogram {
  explicit Histogram(int count = samples) : r(0, count, "r") { counts(a, b) = 0.0f; }
  Func loss() {
    RDom s(0, bins, 0, bins, "s");
    total() = 0.0f;
    total() += counts(s.x, s.y) * counts(s.x, s.y);
    return total;
  }
  Expr near_first() { return closeness(first(r), a); }
  Expr near_second() { return closeness(second(r), b); }

  Buffer<float> first = signal(samples, 5), second = signal(samples, 7);
  RDom r;
  Func counts{"counts"}, total{"total"};
};

std::vector<FuncPtr> factors_in(const std::vector<FuncPtr>& outputs) {
  std::vector<FuncPtr> result;
  for (const FuncPtr& f : topological_order(outputs)) {
    if (is_invariant_factor(*f)) result.push_back(f);
  }
  return result;
}
std::vector<FuncPtr> factors_of(const Func& output) {
  return factors_in(with_invariant_factors({output.function()}));
}

int exponentials(const FuncContents& f) {
  int count = 0;
  walk(f, [&](const Call& call) { count += call.is_op(Op::exp); });
  return count;
}

TEST(InvariantFactors, AreFuncsOverTheVariablesThatTheyDependOn) {
  Histogram h;
  h.counts(a, b) += h.near_first() * h.near_second();
  const std::vector<FuncPtr> outputs = with_invariant_factors({h.loss().function()});
  const std::vector<FuncPtr> factors = factors_in(outputs);
  ASSERT_EQ(factors.size(), 2u);
  EXPECT_EQ(factors[0]->args, (std::vector<std::string>{"a", "x"}))
      << "vectors of the sum run along a";
  EXPECT_EQ(factors[1]->args, (std::vector<std::string>{"x", "b"}));
  for (const FuncPtr& f : topological_order(outputs))
    EXPECT_EQ(exponentials(*f), f->made ? 1 : 0) << f->name;
  EXPECT_EQ(exponentials(*h.counts.function()), 2) << "the user's Func stays as it is";
}

TEST(InvariantFactors, KeepValues) {
  Histogram h;
  h.counts(a, b) += h.near_first() * h.near_second() * h.second(h.r);
  const FuncPtr output = h.loss().function();
  const FuncPtr factored = with_invariant_factors({output}).front();
  ASSERT_EQ(factors_in({factored}).size(), 2u);
  const auto value_of = [](const FuncPtr& f) {
    return oracle::Interpreter().realize(f, {}).front().values[0].scalar.as_double();
  };
  EXPECT_EQ(value_of(factored), value_of(output));
  Buffer<float> expected = Func(output).realize(), found = Func(factored).realize();
  EXPECT_NEAR(found(), expected(), 1e-5f * expected());
}

// Vectors of the adjoint of a factor run along its first dimension, unless they take terms along long rows of the sum.
TEST(InvariantFactors, AreLaidOutForTheirAdjoints) {
  const auto args_of_second = [](int64_t row, int64_t terms) {
    Histogram h;
    h.counts(a, b) += h.near_first() * h.near_second();
    const auto values = [&](const FuncContents&, int, const std::string& variable) {
      return std::optional<int64_t>(variable == "a" ? row : variable == "b" ? 100 : terms);
    };
    return hoist_invariant_factors({h.counts.function()}, values).factors.at(1)->args;
  };
  EXPECT_EQ(args_of_second(16, 1000), (std::vector<std::string>{"x", "b"}));
  EXPECT_EQ(args_of_second(512, 1000), (std::vector<std::string>{"b", "x"}));
  EXPECT_EQ(args_of_second(64, 20), (std::vector<std::string>{"b", "x"}));
}

// A product that is added is contracted with the addition, where a Func would round it.
TEST(InvariantFactors, AreNotProductsThatAreAdded) {
  Histogram h;
  h.counts(a, b) += h.near_first() * h.second(h.r);
  const std::vector<FuncPtr> factors = factors_of(h.loss());
  ASSERT_EQ(factors.size(), 1u);
  EXPECT_FALSE(
      any_node(*factors[0]->pure, [&](const Call& call) { return call.name == h.second.name(); }));
}

TEST(InvariantFactors, AreSharedByEqualFactors) {
  Histogram h;
  h.counts(a, b) += h.near_first() * h.near_second() + h.near_first() * h.second(h.r);
  EXPECT_EQ(factors_of(h.loss()).size(), 2u);
  const std::vector<FuncPtr> once = with_invariant_factors({h.total.function()});
  EXPECT_EQ(factors_in(with_invariant_factors(once)).size(), 2u);
}

// A part that needs fewer variables than the rest of a factor is a factor of its own.
TEST(InvariantFactors, AreAsSmallAsTheirVariables) {
  Var c("c");
  Histogram h;
  Func cubes("cubes"), total("total");
  cubes(a, b, c) = 0.0f;
  cubes(a, b, c) += h.near_first() * h.near_second() * closeness(h.first(h.r), c);
  RDom s(0, bins, 0, bins, 0, bins);
  total() = 0.0f;
  total() += cubes(s.x, s.y, s.z);
  const std::vector<FuncPtr> factors = factors_of(total);
  ASSERT_EQ(factors.size(), 3u);
  for (const FuncPtr& f : factors) EXPECT_EQ(f->args.size(), 2u);
}

// ---- programs without factors ----

TEST(InvariantFactors, OfScheduledFuncsStay) {
  Histogram h, of_update;
  h.counts(a, b) += h.near_first() * h.near_second();
  h.counts.compute_root();
  EXPECT_TRUE(factors_of(h.loss()).empty());
  of_update.counts(a, b) += of_update.near_first() * of_update.near_second();
  of_update.counts.update().vectorize(a, 4);
  EXPECT_TRUE(factors_of(of_update.loss()).empty());
}

TEST(InvariantFactors, OfAtomicUpdatesStay) {
  Histogram h;
  h.counts(a, b) += h.near_first() * h.near_second();
  h.counts.update().atomic();
  EXPECT_TRUE(factors_of(h.loss()).empty());
}

// A predicate decides which elements are read.
TEST(InvariantFactors, OfUpdatesWithPredicatesStay) {
  Histogram h;
  h.r.where(h.first(h.r) > 0.5f);
  h.counts(a, b) += h.near_first() * h.near_second();
  EXPECT_TRUE(factors_of(h.loss()).empty());
}

TEST(InvariantFactors, ThatAreReadConditionallyStay) {
  Histogram h;
  const Expr inside = h.r > 2;
  h.counts(a, b) +=
      call_op(Op::if_then_else, Float(32), {inside, closeness(h.first(h.r), a), 0.0f}) *
      h.second(h.r + 0 * b);
  const std::vector<FuncPtr> factors = factors_of(h.loss());
  for (const FuncPtr& f : factors)  // the choice as a whole may move
    EXPECT_TRUE(any_node(*f->pure, [](const Call& call) { return call.is_op(Op::if_then_else); }));
  Histogram split;
  split.counts(a, b) +=
      call_op(Op::if_then_else, Float(32), {split.r > a + b, split.near_first(), 0.0f});
  EXPECT_TRUE(factors_of(split.loss()).empty());
}

TEST(InvariantFactors, WithEffectsStay) {
  Histogram h;
  h.counts(a, b) += retrograde::print(h.near_first()) * h.near_second();
  EXPECT_EQ(factors_of(h.loss()).size(), 2u) << "what is printed may move, the print may not";
  for (const FuncPtr& f : factors_of(h.total))
    EXPECT_FALSE(any_node(*f->pure, [](const Call& call) { return !call.is_pure(); }));
  Histogram of_function;
  of_function.counts(a, b) +=
      call_extern("some_function", Float(32), {of_function.near_first()}) *
      exp(call_extern("some_function", Float(32), {of_function.first(of_function.r)}));
  for (const FuncPtr& f : factors_of(of_function.loss()))
    EXPECT_FALSE(any_node(*f->pure, [](const Call& call) { return call.is_extern(); }));
}

TEST(InvariantFactors, OfOtherReductionsStay) {
  Histogram h;
  h.counts(a, b) = max(h.counts(a, b), h.near_first() * h.near_second());
  EXPECT_TRUE(factors_of(h.loss()).empty());
}

TEST(InvariantFactors, ThatDependOnAllVariablesStay) {
  Histogram h;
  h.counts(a, b) += exp(-abs(h.first(h.r) - cast<float>(a) - h.second(h.r) * cast<float>(b)));
  EXPECT_TRUE(factors_of(h.loss()).empty());
}

TEST(InvariantFactors, OfPureVariablesAloneStay) {
  Histogram h;
  h.counts(a, b) += closeness(h.first(a), b) * h.second(h.r);
  EXPECT_TRUE(factors_of(h.loss()).empty());
}

// Weights of rows that add up to 1, in the blends of a few numbers.
TEST(InvariantFactors, MayBeQuotients) {
  constexpr int rows = 400;
  const auto factors_with = [&](int numbers) {
    Buffer<float> weights(24, rows), values(numbers, 24), totals(rows);
    Func blended("blended"), loss("loss");
    const RDom r(0, 24, "r"), all(0, numbers, 0, rows, "all");
    blended(a, b) = 0.0f;
    blended(a, b) += weights(r, b) / totals(b) * values(a, r);
    loss() = 0.0f;
    loss() += blended(all.x, all.y);
    return factors_of(loss);
  };
  ASSERT_EQ(factors_with(12).size(), 1u);
  EXPECT_EQ(factors_with(12)[0]->args.size(), 2u);
  EXPECT_TRUE(factors_with(4).empty()) << "so few divisions cost less than memory";
}

// A mean that each of many terms is compared with.
TEST(InvariantFactors, MayBeQuotientsOfPureVariables) {
  const auto factors_with = [](int terms) {
    const Buffer<float> points(3, terms), sums(3), counts(4);
    Func spread("spread");
    const RDom r(0, terms, "r");
    spread(a) = 0.0f;
    spread(a) += points(a, r) * (points(a, r) - sums(a) / counts(Expr(0)));
    spread.bound(a, 0, 3);
    return factors_of(spread);
  };
  const std::vector<FuncPtr> factors = factors_with(20000);
  ASSERT_EQ(factors.size(), 1u);
  EXPECT_EQ(factors[0]->args, std::vector<std::string>{"a"});
  EXPECT_TRUE(factors_with(64).empty());
}

TEST(InvariantFactors, OfFewTermsStay) {
  Histogram few(16), none(0);
  few.counts(a, b) += few.near_first() * few.near_second();
  EXPECT_TRUE(factors_of(few.loss()).empty());
  none.counts(a, b) += none.near_first() * none.near_second();
  EXPECT_TRUE(factors_of(none.loss()).empty());
}

TEST(InvariantFactors, OfUnknownOrLargeSizesStay) {
  const auto count_with = [](int64_t extent) {
    Histogram h;
    h.counts(a, b) += h.near_first() * h.near_second();
    const auto values = [&](const FuncContents&, int, const std::string& variable) {
      return variable == "b" || extent == 0 ? std::optional<int64_t>(bins)
             : extent < 0                   ? std::nullopt
                                            : std::optional(extent);
    };
    return hoist_invariant_factors({h.counts.function()}, values).factors.size();
  };
  EXPECT_EQ(count_with(256), 2u);
  EXPECT_EQ(count_with(-1), 0u);
  EXPECT_EQ(count_with(8 << 10), 1u) << "256 MB for a and r; b and r take 256 KB";
}

// ---- bounds ----

// The region that a pipeline requires of an image.
std::vector<int> required_of(const FuncPtr& output, ImageParam image) {
  image.reset();
  Func(output).infer_input_bounds(std::vector<int32_t>{});
  const Buffer<> found = image.get();
  return {found.dim(0).min(), found.dim(0).extent()};
}

// Rows of 5 bins are no whole vectors, and a select reads on both sides.
TEST(InvariantFactors, ReadNoMoreOfImagesThanTheTermDid) {
  ImageParam image(Float(32), 1, "image");
  Func counts("counts"), total("total");
  RDom r(3, 1001), s(0, 5, 0, 5);
  counts(a, b) = 0.0f;
  counts(a, b) +=
      closeness(select(r > 500, image(r - 3), image(r + 7)), a) * closeness(image(r), b);
  total() = 0.0f;
  total() += counts(s.x, s.y);
  const FuncPtr output = total.function();
  const FuncPtr factored = with_invariant_factors({output}).front();
  ASSERT_EQ(factors_in({factored}).size(), 2u);
  EXPECT_EQ(required_of(factored, image), required_of(output, image));
}

}  // namespace
}  // namespace retrograde::transform
