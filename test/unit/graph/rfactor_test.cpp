// rfactor: the resulting definitions, and unchanged results in the interpreter and in machine code.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>
#include <functional>

#include "support/errors.h"
#include "testing/interpreter.h"

namespace retrograde {
namespace {

class Rfactor : public testing::Test {
 protected:
  Rfactor() : input(width, height) {
    input.for_each_element(
        [&](int i, int j) { input(i, j) = (i * 37 + j * 11 + i * i * j) % 101; });
  }

  // Compares the program with and without its schedule, interpreted and compiled.
  static void expect_same(const std::function<Func(bool)>& make, const std::vector<int>& size) {
    const Func plain = make(false);
    Func scheduled = make(true);
    const oracle::Region region{std::vector<int>(size.size(), 0), size};
    const auto expected = oracle::Interpreter().realize(plain.function(), region);
    const auto interpreted = oracle::Interpreter().realize(scheduled.function(), region);
    const Realization compiled = scheduled.realize(size);
    for (size_t v = 0; v < expected.size(); v++) {
      const auto actual = oracle::compare(expected[v], *compiled[v].raw_buffer());
      EXPECT_TRUE(actual.agrees()) << actual.first_mismatch;
      for (size_t i = 0; i < expected[v].values.size(); i++)
        ASSERT_EQ(expected[v].values[i].scalar.i, interpreted[v].values[i].scalar.i) << i;
    }
  }

  static constexpr int width = 37, height = 13;
  Buffer<int> input;
  Var x{"x"}, y{"y"}, u{"u"}, v{"v"};
  RVar rxo{"rxo"}, rxi{"rxi"}, ryo{"ryo"}, ryi{"ryi"};
};

TEST_F(Rfactor, SumOverTheOuterVariable) {
  expect_same(
      [&](bool scheduled) {
        Func f("f");
        RDom r(0, width, 0, height);
        f(x) = x;
        f(x) += input(r.x, r.y) * x;
        if (scheduled) {
          Func partial = f.update().rfactor(r.y, u);
          EXPECT_EQ(partial.dimensions(), 2);
          EXPECT_EQ(partial.num_update_definitions(), 1);
          EXPECT_EQ(partial.rvars().size(), 1u);
          EXPECT_EQ(f.rvars().size(), 1u);
          partial.compute_root().update().reorder(r.x, x, u).parallel(u).vectorize(x, 4);
        }
        return f;
      },
      {9});
}

TEST_F(Rfactor, SplitsWithTails) {
  for (const int factor : {1, 4, 8, 37, 50}) {
    expect_same(
        [&](bool scheduled) {
          Func f("f");
          RDom r(0, width, 0, height);
          f() = 0;
          f() += input(r.x, r.y);
          if (scheduled) {
            f.update().split(r.x, rxo, rxi, factor);
            Func partial = f.update().rfactor({{rxi, u}, {r.y, v}});
            partial.compute_root().vectorize(u, 4).update().vectorize(u, 4);
          }
          return f;
        },
        {});
  }
}

// The tail's condition promises that the variables lie in their domain. At points of the pure
// variable without an iteration, nothing may be read or written.
TEST_F(Rfactor, ThePreservedLoopMayRunPastItsEnds) {
  expect_same(
      [&](bool scheduled) {
        Func f("f");
        RDom r(0, 4);
        f(x) = 1;
        f(r) += 1;
        if (scheduled) {
          f.update().split(r, rxo, rxi, 3);
          Func partial = f.update().rfactor(rxo, u);
          partial.compute_root().align_bounds(u, 5, 2);
        }
        return f;
      },
      {6});
}

// The operands of the condition are read inside the domain, not where a rounded-up loop runs.
TEST_F(Rfactor, ConditionsReadNothingPastTheEnds) {
  expect_same(
      [&](bool scheduled) {
        Func f("f"), g("g");
        RDom r(4, 5);
        g(x) = x % 3;
        g.compute_root();
        r.where(g(r) > 0);
        f(x) = 9;
        f(clamp(g(r), 0, 5)) = min(f(clamp(g(r), 0, 5)), cast<int>(r));
        if (scheduled) {
          f.update().split(r, rxo, rxi, 4);
          Func partial = f.update().rfactor(rxo, u);
          Var uo("uo"), ui("ui");
          partial.compute_root();
          partial.update().split(u, uo, ui, 1 << 16, TailStrategy::RoundUp);
        }
        return f;
      },
      {6});
}

TEST_F(Rfactor, TwiceMakesATree) {
  expect_same(
      [&](bool scheduled) {
        Func f("f");
        RDom r(0, width, 0, height);
        f() = 7;
        f() += input(r.x, r.y);
        if (scheduled) {
          Func rows = f.update().rfactor(r.y, u);
          rows.compute_root();
          rows.update().split(r.x, rxo, rxi, 8);
          Func lanes = rows.update().rfactor(rxi, v);
          lanes.compute_at(rows, u).update().vectorize(v);
        }
        return f;
      },
      {});
}

TEST_F(Rfactor, HistogramCombinesAllBins) {
  expect_same(
      [&](bool scheduled) {
        Func hist("hist");
        RDom r(0, width, 0, height);
        hist(x) = 0;
        hist(clamp(input(r.x, r.y), 0, 31)) += 1;
        if (scheduled) {
          Func partial = hist.update().rfactor(r.y, u);
          partial.compute_root().update().parallel(u);
          hist.update().vectorize(x, 8);
        }
        return hist;
      },
      {32});
}

TEST_F(Rfactor, PredicateOverBothVariables) {
  expect_same(
      [&](bool scheduled) {
        Func f("f");
        RDom r(0, width, 0, height);
        r.where(r.x + r.y < 20 && r.y != 3);
        f(x) = 1;
        f(x) = max(f(x), input(r.x, r.y) - x);
        if (scheduled) f.update().rfactor(r.y, u).compute_root();
        return f;
      },
      {5});
}

TEST_F(Rfactor, KeptCoordinatesStay) {
  expect_same(
      [&](bool scheduled) {
        Func f("f");
        RDom r(0, width, 0, height);
        f(x, y) = x + y;
        f(x, r.y) += input(r.x, r.y) + x;
        if (scheduled) {
          Func partial = f.update().rfactor(r.y, u);
          partial.compute_root();
          const ir::Variable* kept = f.update_args()[1].as<ir::Variable>();
          EXPECT_TRUE(kept && graph::domain_of(*kept));
        }
        return f;
      },
      {4, height});
}

// A kept coordinate that the predicate limits must not leave the output.
TEST_F(Rfactor, CoordinatesStayInsideWhatThePredicateAllows) {
  expect_same(
      [&](bool scheduled) {
        Func f("f");
        RDom r(0, width, 0, 30);
        r.where(r.x + r.y < 10);
        f(x) = x;
        f(r.y) += r.x;
        if (scheduled) f.update().rfactor(r.y, u).compute_root();
        return f;
      },
      {10});
}

TEST_F(Rfactor, ArgmaxAsATuple) {
  expect_same(
      [&](bool scheduled) {
        Func best("best");
        RDom r(0, width, 0, height);
        best(y) = Tuple(Expr(-1), Expr(-1), Expr(-1));
        const Expr value = input(r.x, r.y) * 64 + (r.x * 7 + r.y * 3 + y) % 64;
        const Expr better = value > best(y)[0];
        best(y) = Tuple(select(better, value, best(y)[0]), select(better, r.x, best(y)[1]),
                        select(better, r.y, best(y)[2]));
        if (scheduled) best.update().rfactor(r.y, u).compute_root().update().parallel(u);
        return best;
      },
      {3});
}

TEST_F(Rfactor, ComplexProduct) {
  expect_same(
      [&](bool scheduled) {
        Func f("f");
        RDom r(0, height);
        f(x) = Tuple(Expr(1), Expr(2));
        const Expr re = input(x, r) - 50, im = input(x + 1, r) - 40;
        f(x) = Tuple(f(x)[0] * re - f(x)[1] * im, f(x)[0] * im + f(x)[1] * re);
        if (scheduled) {
          f.update().split(r, rxo, rxi, 4);
          f.update().rfactor(rxi, u).compute_root();
        }
        return f;
      },
      {6});
}

TEST_F(Rfactor, NoncommutingMapsOverOuterLoops) {
  const auto make = [&](bool outer) {
    return [&, outer](bool scheduled) {
      Func f("f");
      RDom r(0, height);
      f(x) = Tuple(Expr(1), Expr(0));
      const Expr a = input(x, r) % 5, b = input(x + 1, r);
      f(x) = Tuple(f(x)[0] * a, f(x)[1] * a + b);
      if (scheduled) {
        f.update().split(r, rxo, rxi, 4);
        f.update().rfactor(outer ? rxo : rxi, u).compute_root();
      }
      return f;
    };
  };
  expect_same(make(true), {6});
  expect_error({"change the order", "outermost"}, [&] { make(false)(true); });
}

TEST_F(Rfactor, FusedVariables) {
  expect_same(
      [&](bool scheduled) {
        Func f("f");
        RDom r(2, width - 2, 1, height - 1);
        f() = 0;
        f() = f() ^ (input(r.x, r.y) + r.x * 3 - r.y);
        if (scheduled) {
          RVar t("t"), to("to"), ti("ti");
          f.update().fuse(r.x, r.y, t).split(t, to, ti, 16);
          f.update().rfactor(to, u).compute_root().update().parallel(u);
        }
        return f;
      },
      {});
}

TEST_F(Rfactor, ValuesThatAreLeftAloneStay) {
  expect_same(
      [&](bool scheduled) {
        Func f("f");
        RDom r(0, width, 0, height);
        f(x) = Tuple(x * 2, Expr(5));
        f(x)[1] += input(r.x, r.y);
        if (scheduled) f.update().rfactor(r.y, u).compute_root();
        return f;
      },
      {4});
}

TEST_F(Rfactor, LoopsKeepTheirNames) {
  Func f("f");
  RDom r(0, 64, "r");
  f() = 0;
  f() += input(r % width, 0);
  f.update().split(r, rxo, rxi, 8);
  Func partial = f.update().rfactor(rxo, u);
  partial.update().unroll(rxi);
  f.update().unroll(rxo);
  EXPECT_EQ(partial.update().dump_argument_list(), "rxi, u");
  EXPECT_EQ(f.update().dump_argument_list(), "rxo");
}

TEST_F(Rfactor, RefusesWhatIsNoReduction) {
  Func f("f");
  RDom r(0, 8, 0, 8);
  f(x) = 0;
  expect_error({"update that reduces", "first definition"},
               [&] { Stage(f.function(), 0).rfactor(r.x, u); });
  f(x) = f(x) * 2 + r.x + r.y;
  expect_error({"associative update", "form x = ", "keep its loops"},
               [&] { f.update().rfactor(r.x, u); });
}

TEST_F(Rfactor, RefusesReadsOfOtherElements) {
  Func f("f");
  RDom r(1, 8, 0, 8);
  f(x) = x;
  f(r.x) += f(r.x - 1);
  expect_error({"it reads f", "not the element that it writes"},
               [&] { f.update().rfactor(r.x, u); });
}

// rule: the new variables differ from each other and from the Func's
TEST_F(Rfactor, RefusesWrongNames) {
  Func f("f");
  RDom r(0, 8, 0, 8);
  f(x) = 0;
  f(x) += r.x * r.y;
  Stage update = f.update();
  expect_error({"must be a loop"}, [&] { update.rfactor(RVar("nowhere"), u); });
  expect_error({"named twice"}, [&] { update.rfactor({{r.x, u}, {r.x, v}}); });
  expect_error({"already exists"}, [&] { update.rfactor({{r.x, u}, {r.y, u}}); });
  expect_error({"\"x\""}, [&] { update.rfactor(r.x, x); });
}

TEST_F(Rfactor, RefusesSpecializedStages) {
  Func f("f");
  RDom r(0, 8, 0, 8);
  Param<bool> p("p");
  f(x) = 0;
  f(x) += r.x * r.y;
  f.update().specialize(p);
  expect_error({"specialized", "before specialize"}, [&] { f.update().rfactor(r.x, u); });
}

}  // namespace
}  // namespace retrograde
