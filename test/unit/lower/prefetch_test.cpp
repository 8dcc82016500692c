// prefetch: the prefetched regions, and unchanged results.
#include <gtest/gtest.h>

#include "frontend/include/retrograde/retrograde.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "lower/lower.h"

namespace retrograde {
namespace {

// The statement after a pass.
Stmt lowered(const Func& f, const std::string& pass) {
  lower::LowerOptions options;
  options.target = get_jit_target_from_environment();
  options.validate = true;
  Stmt result;
  options.observe = [&](const std::string& name, double, const Stmt& s) {
    if (name == pass) result = s;
  };
  const std::vector<graph::FuncPtr> outputs = {f.function()};
  lower::lower("f", outputs, lower::infer_arguments(outputs), options);
  return result;
}

std::string as_text(const Expr& e) { return graph::without_numbers(ir::print(e)); }

// The one prefetched box.
const ir::Prefetch* prefetch_in(const Stmt& s) {
  std::vector<const ir::Prefetch*> found;
  ir::walk(s, [&](const ir::Prefetch& n) { found.push_back(&n); });
  EXPECT_EQ(found.size(), 1u);
  return found.at(0);
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
  const Stmt s = lowered(blur.out, "insert_prefetches");
  const ir::Prefetch* box = prefetch_in(s);
  EXPECT_EQ(box->name, "in");
  EXPECT_EQ(as_text(box->bounds.at(1).min), "out.s0.y + 2");
  EXPECT_EQ(as_text(box->bounds.at(1).extent), "2");
  blur.expect_right();
}

TEST(Prefetch, EveryBoundStrategyKeepsTheResult) {
  for (auto strategy : {PrefetchBoundStrategy::Clamp, PrefetchBoundStrategy::GuardWithIf,
                        PrefetchBoundStrategy::NonFaulting}) {
    Blur blur;
    blur.out.prefetch(blur.in, blur.y, blur.y, 3, strategy).vectorize(blur.x, 8);
    const Stmt s = lowered(blur.out, "insert_prefetches");
    const bool is_guarded = ir::any_node(s, [](const ir::IfThenElse& n) {
      return ir::any_node(n.when_true, [](const ir::Prefetch&) { return true; });
    });
    EXPECT_EQ(is_guarded, strategy == PrefetchBoundStrategy::GuardWithIf) << ir::print(s);
    const bool is_clamped =
        ir::any_node(prefetch_in(s)->bounds.at(1).min,
                     [](const ir::Variable& n) { return n.name == "in.extent.1"; });
    EXPECT_EQ(is_clamped, strategy == PrefetchBoundStrategy::Clamp) << ir::print(s);
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
  int requests = 0;
  ir::walk(lowered(blur.out, "lower_prefetches"), [&](const ir::Call& n) {
    if (n.op != ir::Op::prefetch) return;
    ++requests;
    EXPECT_TRUE(ir::any_node(n.args.at(0),
                             [](const ir::Binary& product) {
                               return product.kind == ir::Kind::Mul &&
                                      ir::is_const_int(product.b, 16);
                             }))
        << "16 floats a line: " << ir::print(n.args.at(0));
  });
  EXPECT_EQ(requests, 1);
}

TEST(Prefetch, AFuncAndInsideOfATile) {
  Var x("x"), y("y"), xo("xo"), yo("yo"), xi("xi"), yi("yi");
  Func f("f"), out("out");
  f(x, y) = Tuple(x + y, cast<uint8_t>(x));
  out(x, y) = f(x, y)[0] + cast<int>(f(x, y + 1)[1]);
  f.compute_root();
  out.tile(x, y, xo, yo, xi, yi, 16, 8).parallel(yo);
  out.prefetch(f, xo, yo, 1);
  std::vector<std::string> names;
  ir::walk(lowered(out, "insert_prefetches"),
           [&](const ir::Prefetch& n) { names.push_back(graph::without_numbers(n.name)); });
  EXPECT_EQ(names, std::vector<std::string>{"f"});
  Buffer<int> result = out.realize({100, 50});
  result.for_each_element([&](int i, int j) { ASSERT_EQ(result(i, j), 2 * i + j); });
}

}  // namespace
}  // namespace retrograde
