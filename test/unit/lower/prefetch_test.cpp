// prefetch: the prefetched regions, and unchanged results.
#include <gtest/gtest.h>

#include "frontend/include/retrograde/retrograde.h"
#include "ir/print.h"
#include "lower/lower.h"
#include "support/errors.h"

namespace retrograde {
namespace {

std::string lowered(const Func& f, const std::string& pass) {
  lower::LowerOptions options;
  options.target = get_jit_target_from_environment();
  options.validate = true;
  std::string result;
  options.observe = [&](const std::string& name, double, const Stmt& s) {
    if (name == pass) result = ir::print(s);
  };
  const std::vector<graph::FuncPtr> outputs = {f.function()};
  lower::lower("f", outputs, lower::infer_arguments(outputs), options);
  return result;
}

struct Blur {
  Var x{"x"}, y{"y"};
  ImageParam in{Float(32), 2, "in"};
  Func out{"out"};
  Blur() { out(x, y) = in(x, y) + in(x + 1, y + 1); }
  void expect_right() {
    Buffer<float> data(65, 33);
    data.for_each_element([&](int i, int j) { data(i, j) = static_cast<float>(i + 100 * j); });
    in.set(data);
    Buffer<float> result = out.realize({64, 32});
    result.for_each_element(
        [&](int i, int j) { ASSERT_EQ(result(i, j), static_cast<float>(2 * i + 200 * j + 101)); });
  }
};

TEST(Prefetch, TheBoxOfALaterIterationIsAskedFor) {
  Blur blur;
  blur.out.prefetch(blur.in, blur.y, blur.y, 2, PrefetchBoundStrategy::NonFaulting);
  const std::string text = lowered(blur.out, "insert_prefetches");
  const size_t at = text.find("prefetch in");
  ASSERT_NE(at, std::string::npos) << text;
  const std::string line = text.substr(at, text.find('\n', at) - at);
  expect_mentions(line, {".s0.y + 2, 2]"});
  blur.expect_right();
}

TEST(Prefetch, EveryBoundStrategyKeepsTheResult) {
  for (auto strategy : {PrefetchBoundStrategy::Clamp, PrefetchBoundStrategy::GuardWithIf,
                        PrefetchBoundStrategy::NonFaulting}) {
    Blur blur;
    blur.out.prefetch(blur.in, blur.y, blur.y, 3, strategy).vectorize(blur.x, 8);
    const std::string text = lowered(blur.out, "insert_prefetches");
    const size_t at = text.find("prefetch in"), loop = text.rfind("for ", at);
    ASSERT_NE(at, std::string::npos) << text;
    const std::string before = text.substr(loop, at - loop);
    const std::string line = text.substr(at, text.find('\n', at) - at);
    EXPECT_EQ(before.find("if ") != std::string::npos,
              strategy == PrefetchBoundStrategy::GuardWithIf)
        << before;
    EXPECT_EQ(line.find("in.extent.1") != std::string::npos,
              strategy == PrefetchBoundStrategy::Clamp)
        << line;
    blur.expect_right();
  }
}

// A split's promises about the current iteration's coordinates do not hold for prefetched ones.
TEST(Prefetch, LaterCoordinatesKeepNoPromises) {
  for (auto strategy : {PrefetchBoundStrategy::Clamp, PrefetchBoundStrategy::GuardWithIf,
                        PrefetchBoundStrategy::NonFaulting}) {
    Var x("x"), xo("xo"), xi("xi"), tile("tile"), column("column");
    Func f("f"), g("g"), h("h"), out("out");
    f(x) = x * 3;
    g(x) = f(x);
    h(x) = g(x) + g(x / 3);
    out(x) = h(x);
    f.compute_root();
    out.split(x, xo, xi, 8, TailStrategy::ShiftInwards);
    h.compute_at(out, xi).split(x, tile, column, 4, TailStrategy::GuardWithIf);
    g.compute_at(h, column);
    h.prefetch(f, column, tile, 1, strategy);
    const Target target = get_host_target().with_feature(Target::CheckedAccesses);
    for (int size : {8, 13}) {
      const Buffer<int> found = out.realize({size}, target);
      for (int i = 0; i < size; i++) ASSERT_EQ(found(i), 3 * i + 3 * (i / 3)) << size;
    }
  }
}

TEST(Prefetch, OneRequestForEachCacheLine) {
  Blur blur;
  blur.out.prefetch(blur.in, blur.y, blur.y, 1, PrefetchBoundStrategy::NonFaulting);
  const std::string text = lowered(blur.out, "lower_prefetches");
  expect_mentions(text, {"prefetch<int32>(address_of"});
  EXPECT_NE(text.find("* 16"), std::string::npos) << "16 floats a line:\n" << text;
}

TEST(Prefetch, AFuncAndInsideOfATile) {
  Var x("x"), y("y"), xo("xo"), yo("yo"), xi("xi"), yi("yi");
  Func f("f"), out("out");
  f(x, y) = Tuple(x + y, cast<uint8_t>(x));
  out(x, y) = f(x, y)[0] + cast<int>(f(x, y + 1)[1]);
  f.compute_root();
  out.tile(x, y, xo, yo, xi, yi, 16, 8).parallel(yo);
  out.prefetch(f, xo, yo, 1);
  expect_mentions(lowered(out, "insert_prefetches"), {"prefetch f"});
  Buffer<int> result = out.realize({100, 50});
  result.for_each_element([&](int i, int j) { ASSERT_EQ(result(i, j), 2 * i + j); });
}

}  // namespace
}  // namespace retrograde
