// compute_with: the loop nests of fused stages, whose values must not change. Oracles: nests
// written by hand; the same Funcs without fusion.
#include <gtest/gtest.h>

#include <functional>

#include "ir/visit.h"
#include "lower/lower.h"
#include "retrograde/retrograde.h"

namespace retrograde {
namespace {

using Align = LoopAlignStrategy;

class ComputeWith : public testing::Test {
 protected:
  Var x{"x"}, y{"y"}, xo{"xo"}, xi{"xi"}, yo{"yo"}, yi{"yi"};
  static constexpr int width = 21, height = 18;

  // `make(true)` fuses the stages that `make(false)` computes separately.
  static void expect_same(const std::function<Func(bool)>& make, int w = width, int h = height) {
    Buffer<int> apart = make(false).realize({w, h}), together = make(true).realize({w, h});
    together.for_each_element(
        [&](int i, int j) { ASSERT_EQ(together(i, j), apart(i, j)) << i << " " << j; });
  }

  // Loop nests with the test's names, without the numbers that make them unique.
  static std::string nest_of(const Func& f) {
    return graph::without_numbers(lower::loop_nest_text({f.function()}));
  }

  // The nest of h, which reads f and g, with these loops of f and g at root.
  static std::string nest_of_sum(const std::string& loops) {
    return "produce f:\n  produce g:\n" + loops + R"(consume f:
  consume g:
    produce h:
      for y:
        for x:
          h(...) = ...
)";
  }
  static constexpr const char* sharing_y = R"(    for y:
      for x:
        f(...) = ...
      for x:
        g(...) = ...
)";

  static int count(const Func& output, const char* stop_after,
                   const std::function<bool(const Stmt&)>& is_counted) {
    lower::LowerOptions options;
    options.stop_after = stop_after;
    ir::LoweredFunction lowered = lower::lower(
        "test", {output.function()}, lower::infer_arguments({output.function()}), options);
    int found = 0;
    ir::walk(
        lowered.body, [](const Expr&) { return true; },
        [&](const Stmt& s) {
          found += is_counted(s);
          return true;
        });
    return found;
  }
};

TEST_F(ComputeWith, SharesLoopsDownToTheLevel) {
  Func f("f"), g("g"), h("h");
  f(x, y) = x + y;
  g(x, y) = x * y;
  h(x, y) = f(x, y) + g(x, y);
  f.compute_root();
  g.compute_root().compute_with(f, y);
  EXPECT_EQ(nest_of(h), nest_of_sum(sharing_y));
}

// A reduction loop runs with a pure one of its name, whose range is another.
TEST_F(ComputeWith, ReductionLoopsRunWithPureOnes) {
  for (const int terms : {5, height, 30}) {
    expect_same([&](bool fused) {
      Func f("f"), g("g"), h("h");
      RDom r(0, terms, "r");
      f(x, y) = x + y;
      g(x) = x;
      g(x) += (x + 2) * r;
      h(x, y) = f(x, y) - g(x);
      f.compute_root();
      g.compute_root();
      if (fused) g.update().rename(r, RVar("y")).reorder(x, RVar("y")).compute_with(f, y);
      return h;
    });
  }
}

TEST_F(ComputeWith, ChainsShareEachWhatTheySay) {
  Func f("f"), g("g"), h("h"), out("out");
  f(x, y) = x + y;
  g(x, y) = x * y;
  h(x, y) = x - y;
  out(x, y) = f(x, y) + g(x, y) + h(x, y);
  for (Func* func : {&f, &g, &h}) func->compute_at(out, yo);
  out.split(y, yo, yi, 4);
  g.compute_with(f, y);
  h.compute_with(g, x);
  const auto nest = [](const std::string& loops) {
    return R"(produce out:
  for y.yo:
    produce f:
      produce g:
        produce h:
)" + loops +
           R"(    consume f:
      consume g:
        consume h:
          for y.yi in [0, 3]:
            for x:
              out(...) = ...
)";
  };
  EXPECT_EQ(nest_of(out), nest(R"(          for y:
            for x:
              f(...) = ...
            for x:
              g(...) = ...
              h(...) = ...
)"));
  // g cannot pass on loops that it does not share with f.
  g.compute_with(f, x);
  h.compute_with(g, y);
  EXPECT_EQ(nest_of(out), nest(R"(          for y:
            for x:
              f(...) = ...
              g(...) = ...
            for x:
              h(...) = ...
)"));
}

TEST_F(ComputeWith, UpdatesRunTogetherInTheOrderOfTheirFuncs) {
  expect_same([&](bool together) {
    Func f("f"), g("g"), h("h");
    f(x, y) = x + y;
    f(x, y) += f(x, y) * 3;
    g(x, y) = x * y;
    g(x, y) -= x;
    h(x, y) = f(x, y) * 7 + g(x, y);
    f.compute_root();
    g.compute_root();
    if (together) {
      g.compute_with(f.update(0), x);
    }
    return h;
  });
  Func f("f"), g("g"), h("h");
  f(x, y) = x + y;
  f(x, y) += 1;
  g(x, y) = x * y;
  h(x, y) = f(x, y) + g(x, y);
  f.compute_root();
  g.compute_root().compute_with(f.update(0), y);
  EXPECT_EQ(nest_of(h).substr(0, nest_of(h).find("consume")), R"(produce f:
  produce g:
    for y:
      for x:
        f(...) = ...
    for y:
      for x:
        f(...) = ...
      for x:
        g(...) = ...
)");
}

TEST_F(ComputeWith, OnlyDifferentRangesNeedConditions) {
  const auto conditions = [&](bool together, int apart) {
    Func f("f"), g("g"), h("h");
    f(x, y) = x + y;
    g(x, y) = x * y;
    h(x, y) = f(x, y) + g(x, y + apart);
    f.compute_root().split(x, xo, xi, 8);
    g.compute_root().split(x, xo, xi, 8);
    if (together) g.compute_with(f, xo);
    return count(h, "build_loop_nests",
                 [](const Stmt& s) { return s.as<ir::IfThenElse>() != nullptr; });
  };
  EXPECT_EQ(conditions(true, 0), conditions(false, 0));
  EXPECT_EQ(conditions(true, 1), conditions(false, 1) + 2);
}

TEST_F(ComputeWith, DifferentRangesAreAlignedAsAsked) {
  for (Align align : {Align::Auto, Align::NoAlign, Align::AlignStart, Align::AlignEnd}) {
    for (const int far : {0, 3, 100}) {
      expect_same([&](bool together) {
        Func f("f"), g("g"), h("h");
        f(x, y) = x + y;
        g(x, y) = x * y;
        h(x, y) = f(x, y) + g(x - far, y - far) * g(x - far + 2, y + 2 - far);
        f.compute_root();
        g.compute_root();
        if (together) g.compute_with(f, x, align);
        return h;
      });
    }
  }
}

TEST_F(ComputeWith, EachDimensionIsAlignedOnItsOwn) {
  expect_same([&](bool together) {
    Func f("f"), g("g"), k("k"), h("h");
    f(x, y) = x + y;
    g(x, y) = x * y;
    k(x, y) = x - 3 * y;
    h(x, y) = f(x, y) + f(x + 1, y) + g(x - 5, y - 2) * k(x + 4, y) + k(x, y + 9);
    f.compute_root();
    g.compute_root();
    k.compute_root();
    if (together) {
      g.compute_with(f, x, {{x, Align::AlignStart}, {y, Align::AlignEnd}});
      k.compute_with(g, x, {{x, Align::AlignEnd}, {y, Align::AlignStart}});
    }
    return h;
  });
}

TEST_F(ComputeWith, SplitsMayDiffer) {
  expect_same([&](bool together) {
    Func f("f"), g("g"), h("h");
    f(x, y) = x + y;
    g(x, y) = x * y;
    h(x, y) = f(x, y) + g(x, y);
    f.compute_root().split(x, xo, xi, 8).vectorize(xi).parallel(y);
    g.compute_root().split(x, xo, xi, 4).unroll(xi).parallel(y);
    if (together) g.compute_with(f, xo);
    return h;
  });
}

TEST_F(ComputeWith, ProducersInsideServeAllWhoShare) {
  for (const int apart : {0, 1, 5}) {
    expect_same([&](bool together) {
      Func p("p"), f("f"), g("g"), h("h");
      p(x, y) = x * x + y;
      f(x, y) = p(x, y) + p(x + 1, y);
      g(x, y) = p(x, y - 1) * 5;
      h(x, y) = f(x, y) + g(x, y + apart) + g(x, y - apart);
      f.compute_root();
      g.compute_root();
      p.compute_root();
      if (together) {
        g.compute_with(f, y);
        p.compute_at(f, y);
      }
      return h;
    });
  }
}

TEST_F(ComputeWith, ProducersInsideComputeNoMoreThanRuns) {
  Func p("p"), f("f"), g("g"), h("h");
  p(x, y) = x * x + y;
  f(x, y) = p(x, y) + 1;
  g(x, y) = p(x, y) * 5;
  h(x, y) = f(x, y) + g(x, y + 2);
  f.compute_root();
  g.compute_root().compute_with(f, y);
  p.compute_at(f, y);
  // Both stages run in one copy of the row; a row where only one of them runs is not merged with
  // another.
  EXPECT_EQ(count(h, "simplify_storage",
                  [&](const Stmt& s) {
                    const ir::For* loop = s.as<ir::For>();
                    return loop && loop->name == p.name() + ".s0.y";
                  }),
            0);
}

TEST_F(ComputeWith, ProducersInsideSlideOverSharedLoops) {
  for (const int apart : {0, 2}) {
    expect_same([&](bool together) {
      Func p("p"), f("f"), g("g"), h("h");
      p(x, y) = x * x + y;
      f(x, y) = p(x, y - 1) + p(x, y + 1);
      g(x, y) = p(x, y) * 5;
      h(x, y) = f(x, y) + g(x, y + apart);
      f.compute_root();
      g.compute_root();
      p.compute_root();
      if (together) {
        g.compute_with(f, y);
        p.store_root().compute_at(f, y);
      }
      return h;
    });
  }
}

TEST_F(ComputeWith, ProducersOfAGuestStayInItsOwnLoops) {
  expect_same([&](bool together) {
    Func p("p"), f("f"), g("g"), h("h");
    p(x, y) = x * x + y;
    f(x, y) = x - y;
    g(x, y) = p(x, y) * p(x + 1, y);
    h(x, y) = f(x, y) + g(x, y + 2);
    f.compute_root();
    g.compute_root();
    p.compute_at(g, x);
    if (together) {
      g.compute_with(f, y, Align::AlignStart);
      p.store_at(f, y);
    }
    return h;
  });
}

TEST_F(ComputeWith, GroupsInsideOfConsumersSlideTogether) {
  expect_same([&](bool together) {
    Func f("f"), g("g"), h("h");
    f(x, y) = x + y * y;
    g(x, y) = x * y;
    h(x, y) = f(x, y) + f(x, y + 1) + g(x + 1, y) + g(x, y + 3);
    f.store_root().compute_at(h, y);
    g.store_root().compute_at(h, y);
    if (together) g.compute_with(f, x);
    return h;
  });
}

TEST_F(ComputeWith, ConsumersBetweenMembersComeAfterTheGroup) {
  expect_same([&](bool together) {
    Func f("f"), k("k"), p("p"), g("g"), h("h");
    f(x, y) = x + y;
    k(x, y) = f(x, y) * 2;
    p(x, y) = x - 7 * y;
    g(x, y) = p(x, y + 1) * y;
    h(x, y) = k(x, y) + g(x, y);
    for (Func* func : {&f, &k, &p, &g}) func->compute_root();
    if (together) g.compute_with(f, y);
    return h;
  });
}

TEST_F(ComputeWith, ReductionLoopsAreShared) {
  expect_same([&](bool together) {
    RDom r(0, 10, "r"), q(2, 5, "q");
    Func f("f"), g("g"), h("h");
    f(x, y) = 0;
    f(x, y) += r * x;
    g(x, y) = 1;
    g(x, y) += q * y;
    h(x, y) = f(x, y) + g(x, y);
    f.compute_root().update().reorder(x, y, r);
    g.compute_root().update().reorder(x, y, q);
    if (together) {
      g.compute_with(f, x);
      g.update().compute_with(f.update(), x);
    }
    return h;
  });
}

TEST_F(ComputeWith, WhereOneIsNotNeededTheOthersRunWithoutIt) {
  for (int missing = 0; missing < 3; ++missing) {
    expect_same([&](bool together) {
      Func funcs[3] = {Func("f"), Func("g"), Func("k")}, out("out");
      for (int i = 0; i < 3; ++i) funcs[i](x, y) = x * (i + 2) - y;
      Expr sum = 1;
      for (int i = 0; i < 3; ++i) {
        if (i != missing) sum += funcs[i](x, y + i);
      }
      out(x, y) = sum;
      out(x, y) += funcs[missing](x, y) + funcs[(missing + 1) % 3](x - 1, y);
      for (Func& f : funcs) f.compute_at(out, y);
      if (together) {
        funcs[1].compute_with(funcs[0], x, Align::AlignStart);
        funcs[2].compute_with(funcs[1], x, Align::AlignEnd);
      }
      return out;
    });
  }
}

TEST_F(ComputeWith, OutputsShareLoops) {
  Func f("f"), g("g");
  f(x, y) = x + y;
  g(x, y) = x * y + f(0, 0) * 0;
  Func k("k");
  k(x, y) = x * y;
  k.compute_with(f, y);
  Pipeline pipeline({f, k});
  Buffer<int> a(9, 7), b(4, 12);
  pipeline.realize({a, b});
  a.for_each_element([&](int i, int j) { ASSERT_EQ(a(i, j), i + j); });
  for (int j = 0; j < 12; ++j)
    for (int i = 0; i < 4; ++i) ASSERT_EQ(b(i, j), i * j);
}

TEST_F(ComputeWith, TheLevelMayBeSetLater) {
  Func f("f"), g("g"), h("h");
  f(x, y) = x + y;
  g(x, y) = x * y;
  h(x, y) = f(x, y) + g(x, y);
  LoopLevel level;
  f.compute_root();
  g.compute_root().compute_with(level);
  level.set(LoopLevel(f, x));
  EXPECT_EQ(nest_of(h), nest_of_sum(R"(    for y:
      for x:
        f(...) = ...
        g(...) = ...
)"));
  level.set(LoopLevel(f, y));
  EXPECT_EQ(nest_of(h), nest_of_sum(sharing_y));
}

TEST_F(ComputeWith, TheFirstStageMayBeSpecialized) {
  for (const bool set : {false, true}) {
    expect_same([&](bool together) {
      Param<bool> p("p");
      p.set(set);
      Func f("f"), g("g"), h("h");
      f(x, y) = select(p, x + y, x - y);
      g(x, y) = x * y;
      h(x, y) = f(x, y) + g(x, y + 1);
      f.compute_root();
      g.compute_root();
      f.specialize(p);
      if (together) g.compute_with(f, y);
      return h;
    });
  }
}

// ---- an update fused with the stage before it ----

TEST_F(ComputeWith, AScanStartsInItsBlockOfRows) {
  expect_same([&](bool together) {
    Func f("f"), out("out");
    RDom r(1, width - 1, "r");
    f(x, y) = x * y % 7;
    f(r, y) += 3 * f(r - 1, y);
    out(x, y) = f(x, y);
    f.compute_root().split(y, y, yi, 4, TailStrategy::GuardWithIf);
    f.update().split(y, y, yi, 4, TailStrategy::GuardWithIf).reorder(yi, r, y).unroll(yi);
    if (together) f.update().compute_with(f, y);
    return out;
  });
}

TEST_F(ComputeWith, AnUpdateStartsInItsTile) {
  Func f("f"), out("out");
  RDom r(0, 3, "r");
  f(x, y) = 1;
  f(x, y) += x * r + y;
  out(x, y) = f(x, y);
  f.compute_root();
  f.update().compute_with(f, y);
  EXPECT_EQ(nest_of(out), R"(produce f:
  for y:
    for x:
      f(...) = ...
    for x:
      for r in [0, 2]:
        f(...) = ...
consume f:
  produce out:
    for y:
      for x:
        out(...) = ...
)");
}

// Tiles do not divide the Func; tails of both stages end where it does.
TEST_F(ComputeWith, TilesOfAnUpdateEndTogether) {
  expect_same([&](bool together) {
    Func f("f"), out("out");
    RDom r(0, 5, "r");
    f(x, y) = x - y;
    f(x, y) += (x + 1) * r + y;
    f(x, y) *= 3;
    out(x, y) = f(x, y);
    f.compute_root();
    f.tile(x, y, xo, yo, xi, yi, 8, 4).vectorize(xi);
    f.update(0).tile(x, y, xo, yo, xi, yi, 8, 4, TailStrategy::GuardWithIf);
    f.update(0).reorder(xi, yi, r, xo, yo).parallel(yo).vectorize(xi).unroll(yi);
    f.update(1).tile(x, y, xo, yo, xi, yi, 8, 4, TailStrategy::GuardWithIf).parallel(yo);
    if (together) {
      f.parallel(yo);
      f.update(0).compute_with(f, xo);
      f.update(1).compute_with(f.update(0), yo);
    }
    return out;
  });
}

// A sliding window is computed once by both stages.
TEST_F(ComputeWith, AnUpdateThatSlidesStartsInItsPart) {
  expect_same([&](bool together) {
    Func f("f"), out("out");
    RDom r(0, 4, "r");
    f(x, y) = x + 2 * y;
    f(x, y) += x * r - y;
    out(x, y) = f(x, y) + f(x, y + 1) + f(x, y + 2);
    f.store_root().compute_at(out, y);
    if (together) f.update().compute_with(f, y);
    return out;
  });
}

// The loops may be those of a third Func.
TEST_F(ComputeWith, AnUpdateFollowsItsFuncIntoOtherLoops) {
  expect_same([&](bool together) {
    Func f("f"), g("g"), out("out");
    RDom r(0, 4, "r");
    g(x, y) = x - y;
    f(x, y) = x + 2 * y;
    f(x, y) += x * r - y;
    out(x, y) = f(x, y + 3) + g(x, y);
    f.compute_root();
    g.compute_root();
    if (together) {
      f.compute_with(g, y, LoopAlignStrategy::AlignStart);
      f.update().compute_with(f, y);
    }
    return out;
  });
}

// A tile with a producer computed in it, for both stages or for the update alone.
TEST_F(ComputeWith, ProducersInTilesOfAnUpdateAlone) {
  expect_same([&](bool together) {
    Func p("p"), f("f"), out("out");
    RDom r(0, 4, "r");
    p(x, y) = x * y + 3;
    f(x, y) = x;
    f(x, y) += p(x + r, y + 1);
    out(x, y) = f(x, y);
    f.compute_root().split(y, y, yi, 4, TailStrategy::GuardWithIf);
    f.update().split(y, y, yi, 4).reorder(x, yi, r, y);
    p.compute_at(LoopLevel(f, y, 1));
    if (together) f.update().compute_with(f, y);
    return out;
  });
}

TEST_F(ComputeWith, ProducersInTilesOfAnUpdate) {
  expect_same([&](bool together) {
    Func p("p"), f("f"), out("out");
    RDom r(0, 4, "r");
    p(x, y) = x * y + 3;
    f(x, y) = p(x, y);
    f(x, y) += p(x + r, y + 1);
    out(x, y) = f(x, y);
    f.compute_root().split(y, y, yi, 4, TailStrategy::GuardWithIf);
    f.update().split(y, y, yi, 4).reorder(x, yi, r, y);
    if (together) {
      f.update().compute_with(f, y);
      p.compute_at(f, y);
    } else {
      p.compute_root();
    }
    return out;
  });
}

}  // namespace
}  // namespace retrograde
