// explain() says what was built and how large it is, what scatters and why, what an update kept,
// what is zero and what was left out. The texts are the oracle: each names the Func and the reason.
#include "gradient/programs_suite.h"

namespace retrograde::gradient {
namespace {

Var x("x");

void expect_line(const Derivative& d, Explanation::Kind kind, const std::string& subject,
                 const std::string& phrase) {
  for (const Explanation& e : d.explanations()) {
    if (e.kind == kind && e.subject == subject && e.detail.find(phrase) != std::string::npos)
      return;
  }
  ADD_FAILURE() << to_string(kind) << " " << subject << ": " << phrase << " is not in\n"
                << d.explain();
}

TEST(Explain, AdjointsSayHowTheyAccumulateAndHowLargeTheyAre) {
  Buffer<float> a = line(10);
  Func f("explained_f");
  RDom r(0, 3);
  f(x) = 0.0f;
  f(x) += a(x + r);
  Derivative d = propagate_adjoints(weighted_sum(f, {8}));
  expect_line(d, Explanation::Kind::Built, f.name(), "8 elements, 32 bytes when stored");
  expect_line(d, Explanation::Kind::Built, a.name(), "1 gathers");
  expect_line(d, Explanation::Kind::Built, a.name(), "10 elements, 40 bytes");
}

TEST(Explain, ScattersSayWhichDataDecide) {
  Buffer<float> table = line(5);
  Buffer<int> index = places(12, 5);
  Func f("explained_f");
  f(x) = table(clamp(index(x), 0, 4));
  Derivative d = propagate_adjoints(weighted_sum(f, {12}));
  expect_line(d, Explanation::Kind::Scattered, table.name(), "\"" + index.name() + "\"");
}

TEST(Explain, DearGathersSayWhatTheyWouldCost) {
  Buffer<float> a = line(71);
  Func f("explained_f");
  f(x) = a((13 * x) % 64 + x / 64);
  Derivative d = propagate_adjoints(weighted_sum(f, {512}));
  expect_line(d, Explanation::Kind::Scattered, a.name(), "iterations for 512 points");
}

TEST(Explain, TapesSayWhatTheyKeep) {
  Buffer<float> a = line(6);
  Func f("explained_f");
  RDom r(0, 6);
  f() = 1.0f;
  f() *= a(r);
  Derivative d = propagate_adjoints(f, {.overwritten = Overwritten::Store});
  expect_line(d, Explanation::Kind::Version, f.name(),
              "keeps 1 place of 4 bytes in each iteration");
  expect_line(d, Explanation::Kind::Version, f.name(), "is run backward");
}

TEST(Explain, ZerosAndWhatWasNotRequestedSayWhy) {
  Buffer<float> a = line(), b = line(9, 4);
  Func f("explained_f");
  f(x) = floor(a(x)) + b(x);
  Derivative d = propagate_adjoints(weighted_sum(f, {9}));
  expect_line(d, Explanation::Kind::Zero, a.name(), "does not depend on its value");
  expect_line(d, Explanation::Kind::Zero, f.name(), "floor has derivative 0");
  Derivative only = propagate_adjoints(weighted_sum(f, {9}), {.wrt = {a}});
  expect_line(only, Explanation::Kind::NotRequested, b.name(), "nothing that was requested");
}

}  // namespace
}  // namespace retrograde::gradient
