// f(scatter(...)) = gather(...), as Halide documents it.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <vector>

namespace retrograde {
namespace {

const Var x("x"), y("y");

std::vector<int> values_of(Func& f, int n) {
  const Buffer<int> result = f.realize({n});
  return {result.begin(), result.end()};
}

TEST(SeveralPoints, EachGetsItsValue) {
  Func f("f");
  f(x, y) = 0;
  f(x, scatter(3, 4)) = gather(1, 2);
  const Buffer<int> result = f.realize({2, 5});
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(result(i, 2), 0);
    EXPECT_EQ(result(i, 3), 1);
    EXPECT_EQ(result(i, 4), 2);
  }
}

TEST(SeveralPoints, StandBetweenOperators) {
  Func f("f");
  RDom r(0, 2, 0, 2);
  f(x, y) = 0;
  f(2 * r.x + scatter(1, 0), 2 * r.y + scatter(0, 1)) = 2 * gather(r.x + 5, r.y + 7) + 1;
  const Buffer<int> result = f.realize({4, 4});
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(result(2 * i + 1, 2 * j), 2 * (i + 5) + 1);
      EXPECT_EQ(result(2 * i, 2 * j + 1), 2 * (j + 7) + 1);
      EXPECT_EQ(result(2 * i, 2 * j), 0);
    }
  }
}

TEST(SeveralPoints, TheLastOfTwoAtOnePlaceCounts) {
  Func f("f");
  f(x) = 0;
  f(scatter(2, 2)) = gather(3, 5);
  EXPECT_EQ(values_of(f, 4), (std::vector<int>{0, 0, 5, 0}));
}

TEST(SeveralPoints, ChangePlaces) {
  for (bool swaps : {true, false}) {
    Param<bool> p("p");
    p.set(swaps);
    Func f("f"), g("g");
    f(x) = 10 + x;
    f(scatter(3, 5)) = f(select(p, gather(5, 3), gather(3, 5)));
    EXPECT_EQ(values_of(f, 6), swaps ? (std::vector<int>{10, 11, 12, 15, 14, 13})
                                     : (std::vector<int>{10, 11, 12, 13, 14, 15}));
    g(x) = 10 + x;
    g(select(p, scatter(3, 5, 5), scatter(1, 2, 3))) =
        g(select(p, gather(5, 3, 3), gather(2, 3, 1)));
    EXPECT_EQ(values_of(g, 6), swaps ? (std::vector<int>{10, 11, 12, 15, 14, 13})
                                     : (std::vector<int>{10, 12, 13, 11, 14, 15}));
  }
}

TEST(SeveralPoints, OfTuplesAndUnderAPredicate) {
  Func f("f");
  RDom r(0, 4);
  r.where(r % 2 == 1);
  f(x) = Tuple(0, 1.0f);
  f(r + scatter(0, 10)) = Tuple(gather(r, -r), cast<float>(gather(r + 1, r + 2)));
  Realization result = f.realize({16});
  const Buffer<int> first = result[0];
  const Buffer<float> second = result[1];
  for (int i = 0; i < 16; ++i) {
    const bool is_first = i == 1 || i == 3, is_second = i == 11 || i == 13;
    EXPECT_EQ(first(i), is_first ? i : is_second ? 10 - i : 0);
    EXPECT_EQ(second(i), is_first ? float(i + 1) : is_second ? float(i - 8) : 1.0f);
  }
}

TEST(SeveralPoints, AddToWhatIsThere) {
  Func f("f");
  f(x) = x;
  f(scatter(0, 2)) += gather(10, 20);
  EXPECT_EQ(values_of(f, 4), (std::vector<int>{10, 1, 22, 3}));
}

TEST(SeveralPoints, HaveGradients) {
  Buffer<float> a(3);
  a.fill(2.0f);
  RDom r(0, 2), all(0, 4);
  Func f("f"), loss("loss");
  f(x) = 0.0f;
  f(r + scatter(0, 2)) = gather(a(r), a(r + 1) * a(r + 1));
  loss() = 0.0f;
  loss() += f(all) * cast<float>(all + 1);
  const Buffer<float> d = propagate_adjoints(loss)(a).realize({3});
  EXPECT_FLOAT_EQ(d(0), 1.0f);          // 1 a(0)
  EXPECT_FLOAT_EQ(d(1), 2.0f + 12.0f);  // 2 a(1) + 3 a(1)^2
  EXPECT_FLOAT_EQ(d(2), 16.0f);         // 4 a(2)^2
}

}  // namespace
}  // namespace retrograde
