// Sliding windows: Funcs stored in an outer loop of the one that computes them. Every point is
// computed once, storage is folded, and results equal those of the unscheduled pipeline.
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "ir/build.h"
#include "ir/visit.h"
#include "lower/lower.h"
#include "retrograde/retrograde.h"
#include "support/errors.h"

namespace retrograde {
namespace {

// Points computed, by Func: each tested definition prints its name.
std::map<std::string, int> computed;
std::mutex lock;
void count_line(void*, const char* text) {
  std::lock_guard<std::mutex> guard(lock);
  std::string line(text);  // "<value> <name>\n"
  line.erase(line.find_last_not_of('\n') + 1);
  computed[line.substr(line.rfind(' ') + 1)]++;
}

// Elements allocated for a Func, when constant.
int64_t stored_elements(const Func& output, const std::string& name) {
  int64_t elements = -1;
  lower::LowerOptions options;
  options.stop_after = "simplify_storage";
  ir::LoweredFunction lowered = lower::lower("test", {output.function()},
                                             lower::infer_arguments({output.function()}), options);
  ir::walk(
      lowered.body, [](const Expr&) { return false; },
      [&](const Stmt& s) {
        const ir::Allocate* n = s.as<ir::Allocate>();
        if (n && n->name.substr(0, n->name.find('$')) == name)
          elements = ir::as_const_int(n->elements).value_or(-1);
        return true;
      });
  return elements;
}

Expr counted(const char* name, const Expr& e) { return print(e, name); }

constexpr int width = 24, height = 17;

class SlidingWindow : public testing::Test {
 protected:
  void SetUp() override { computed.clear(); }

  // `make(false)` is the program without a schedule. Returns the scheduled program.
  static Func expect_same(const std::function<Func(bool)>& make, int w = width, int h = height) {
    Buffer<int> expected = make(false).realize({w, h});
    Func scheduled = make(true);
    scheduled.set_custom_print(count_line);
    computed.clear();
    Buffer<int> found = scheduled.realize({w, h});
    expected.for_each_element(
        [&](int i, int j) { EXPECT_EQ(expected(i, j), found(i, j)) << i << " " << j; });
    return scheduled;
  }

  // The same for a chain of two stencils, f and g.
  void expect_same_stencils(const std::function<void(Func& f, Func& g, Func& out)>& schedule) {
    expect_same([&](bool scheduled) {
      Func f("f"), g("g"), out("out");
      f(x, y) = x * 3 + y * y;
      g(x, y) = f(x - 1, y) + f(x, y + 1) * 2 + f(x + 1, y - 1);
      out(x, y) = g(x, y - 1) + g(x + 1, y + 1);
      if (scheduled) schedule(f, g, out);
      return out;
    });
  }

  Var x{"x"}, y{"y"}, xi{"xi"}, yi{"yi"}, xo{"xo"}, yo{"yo"};
};

TEST_F(SlidingWindow, ComputesEachRowOnce) {
  Func g = expect_same([&](bool scheduled) {
    Func f("f"), g("g");
    f(x, y) = counted("f", x * 3 + y * y);
    g(x, y) = f(x, y - 1) + f(x, y + 1) * 2;
    g.bound(x, 0, width);
    if (scheduled) f.store_root().compute_at(g, y);
    return g;
  });
  EXPECT_EQ(computed["f"], width * (height + 2));
  EXPECT_EQ(stored_elements(g, "f"), width * 4);  // three rows are alive
}

// Selects between a loop's first iteration and the others that remain after lowering.
int choices_left(const Func& output) {
  lower::LowerOptions options;
  options.stop_after = "simplify_vectors";
  ir::LoweredFunction lowered = lower::lower("test", {output.function()},
                                             lower::infer_arguments({output.function()}), options);
  int choices = 0;
  ir::walk(
      lowered.body, [&](const Expr& e) { return choices += e.as<ir::Select>() != nullptr, true; },
      [](const Stmt&) { return true; });
  return choices;
}

// The first row of a strip computes three rows of f, every other row just its last one: no
// iteration along the row tests which it is. For a large body, a second copy would cost more than
// that test.
TEST_F(SlidingWindow, FirstRowsOfStripsAreLoopsOfTheirOwn) {
  const auto strips = [&](int taps) {
    ImageParam in(Int(32), 2, "in");
    Func f("f"), g("g");
    Expr sum = 0;
    for (int tap = 0; tap < taps; tap++) sum += in(x + tap, y) * (tap + 1);
    f(x, y) = sum;
    g(x, y) = f(x, y) + f(x, y + 1) * f(x, y + 2);
    g.split(y, y, yi, 16).vectorize(x, 8);
    f.store_at(g, y).compute_at(g, x).vectorize(x, 8);
    return g;
  };
  EXPECT_EQ(choices_left(strips(3)), 0);
  EXPECT_GT(choices_left(strips(300)), 0);
}

// The loop of a split that stays within 5 of its 8 iterations. The iterations before them fill the
// window, and know nothing of where the others lie.
TEST_F(SlidingWindow, FillsTheWindowBeforeASplitThatStaysInside) {
  for (const auto& [extent, is_twice] :
       {std::pair(5, false), {9, false}, {16, false}, {5, true}, {9, true}, {16, true}}) {
    Buffer<int> image(extent, 3);
    image.for_each_element([&](int i, int j) { image(i, j) = 7 * i * i + 3 + j; });
    const auto summed = [&, extent = extent, is_twice = is_twice](bool is_scheduled) {
      Var x("x"), y("y");
      RVar outer("outer"), inner("inner"), lane("lane"), both("both");
      RDom r(0, extent, 0, 3);
      Func f("f"), g("g"), sum("sum");
      f(x, y) = select(x < extent, image(clamp(x, 0, extent - 1), y), 0);
      g(x, y) = f(x, y) + 10 * f(x + 3, y);
      sum() = 0;
      sum() += g(r.x, r.y);
      if (is_scheduled) {
        sum.update().split(r.x, outer, inner, 8, TailStrategy::GuardWithIf);
        if (is_twice) sum.update().split(inner, inner, lane, 8, TailStrategy::GuardWithIf);
        sum.update().fuse(outer, r.y, both);
        g.compute_at(sum, inner);
        f.store_root().compute_at(sum, inner);
      }
      return Buffer<int>(sum.realize())();
    };
    EXPECT_EQ(summed(true), summed(false)) << extent;
  }
}

// If all Funcs are clamped to an image, the first and last rows are read repeatedly. In strips of 8
// rows, a strip recomputes the rows that it needs beyond itself, and no row twice.
TEST_F(SlidingWindow, ClampedChainsInStripsComputeEachRowOnceAStrip) {
  Func out = expect_same([&](bool scheduled) {
    Func f("f"), g("g"), h("h"), out("out");
    const auto inside = [](const Expr& e) { return clamp(e, 0, height - 1); };
    f(x, y) = counted("f", x * 3 + y * y);
    g(x, y) = counted("g", f(x, inside(y - 1)) + f(x, inside(y + 1)) * 2);
    h(x, y) = counted("h", g(x, inside(y - 1)) - g(x, inside(y)) * 3 + g(x, inside(y + 1)));
    out(x, y) = h(x, inside(y - 1)) + h(x, inside(y + 1));
    out.bound(x, 0, width);
    if (scheduled) {
      out.split(y, yo, yi, 8, TailStrategy::GuardWithIf);
      for (Func* stage : {&f, &g, &h}) stage->store_at(out, yo).compute_at(out, yi);
    }
    return out;
  });
  const auto rows = [](int beyond) {
    int count = 0;
    for (int first = 0; first < height; first += 8)
      count += std::min(first + 7 + beyond, height - 1) - std::max(first - beyond, 0) + 1;
    return count;
  };
  EXPECT_EQ(computed["h"], width * rows(1));
  EXPECT_EQ(computed["g"], width * rows(2));
  EXPECT_EQ(computed["f"], width * rows(3));
  for (const char* name : {"f", "g", "h"}) EXPECT_EQ(stored_elements(out, name), width * 4) << name;
}

TEST_F(SlidingWindow, SlidesInBothDimensions) {
  expect_same([&](bool scheduled) {
    Func f("f"), g("g");
    f(x, y) = counted("f", x * 3 + y * y);
    g(x, y) = f(x - 1, y - 1) + f(x + 1, y + 1) * 2;
    if (scheduled) f.store_root().compute_at(g, x);
    return g;
  });
  EXPECT_EQ(computed["f"], (width + 2) * (height + 2));
}

TEST_F(SlidingWindow, ChainsSlideTogether) {
  expect_same([&](bool scheduled) {
    Func f("f"), g("g"), h("h"), out("out");
    f(x, y) = counted("f", x * 3 + y * y);
    g(x, y) = counted("g", f(x, y - 1) + f(x, y + 1) * 2);
    h(x, y) = counted("h", g(x, y - 2) + g(x, y) + f(x, y + 3));
    out(x, y) = h(x, y) - h(x, y + 1);
    if (scheduled) {
      for (Func* stage : {&f, &g, &h}) stage->store_root().compute_at(out, y);
    }
    return out;
  });
  EXPECT_EQ(computed["h"], width * (height + 1));
  EXPECT_EQ(computed["g"], width * (height + 3));
  EXPECT_EQ(computed["f"], width * (height + 1 + 6));  // from y - 3 to y + 4
}

TEST_F(SlidingWindow, InsideAStrip) {
  for (TailStrategy tail : {TailStrategy::ShiftInwards, TailStrategy::GuardWithIf}) {
    Func g = expect_same([&](bool scheduled) {
      Func f("f"), g("g");
      f(x, y) = counted("f", x * 3 + y * y);
      g(x, y) = f(x, y - 1) + f(x, y + 1) * 2;
      g.bound(x, 0, width);
      if (scheduled) {
        g.split(y, yo, yi, 8, tail).parallel(yo);
        f.store_at(g, yo).compute_at(g, yi);
      }
      return g;
    });
    int strips = (height + 7) / 8;
    EXPECT_EQ(computed["f"],
              width * (tail == TailStrategy::ShiftInwards ? strips * 10 : height + 2 * strips));
    EXPECT_EQ(stored_elements(g, "f"), width * 4);
  }
}

TEST_F(SlidingWindow, FromStripToStrip) {
  expect_same([&](bool scheduled) {
    Func f("f"), g("g");
    f(x, y) = counted("f", x * 3 + y * y);
    g(x, y) = f(x, y - 1) + f(x, y + 1) * 2;
    if (scheduled) {
      g.split(y, yo, yi, 4, TailStrategy::GuardWithIf);
      f.store_root().compute_at(g, yo);
    }
    return g;
  });
  EXPECT_EQ(computed["f"], width * (height + 2));
}

TEST_F(SlidingWindow, Upsampling) {
  expect_same([&](bool scheduled) {
    Func f("f"), g("g");
    f(x, y) = counted("f", x * 3 + y * y);
    g(x, y) = f(x, y / 2) + f(x, y / 2 + 1) * 2;
    if (scheduled) f.store_root().compute_at(g, y);
    return g;
  });
  EXPECT_EQ(computed["f"], width * ((height - 1) / 2 + 2));
}

TEST_F(SlidingWindow, Downsampling) {
  expect_same([&](bool scheduled) {
    Func f("f"), g("g");
    f(x, y) = counted("f", x * 3 + y * y);
    g(x, y) = f(x, 2 * y) + f(x, 2 * y + 3) * 2;
    if (scheduled) f.store_root().compute_at(g, y);
    return g;
  });
  EXPECT_EQ(computed["f"], width * (2 * height + 2));
}

TEST_F(SlidingWindow, GapsAreNotComputed) {
  expect_same([&](bool scheduled) {
    Func f("f"), g("g");
    f(x, y) = counted("f", x * 3 + y * y);
    g(x, y) = f(x, 4 * y) + f(x, 4 * y + 1) * 2;
    if (scheduled) f.store_root().compute_at(g, y);
    return g;
  });
  EXPECT_EQ(computed["f"], width * 2 * height);
}

TEST_F(SlidingWindow, Downwards) {
  Func g = expect_same([&](bool scheduled) {
    Func f("f"), g("g");
    f(x, y) = counted("f", x * 3 + y * y);
    g(x, y) = f(x, 100 - y) + f(x, 102 - y) * 2;
    g.bound(x, 0, width);
    if (scheduled) f.store_root().compute_at(g, y);
    return g;
  });
  EXPECT_EQ(computed["f"], width * (height + 2));
  EXPECT_EQ(stored_elements(g, "f"), width * 4);
}

TEST_F(SlidingWindow, AlignedPairsOfRows) {
  Func g = expect_same(
      [&](bool scheduled) {
        Func f("f"), g("g");
        f(x, y) = counted("f", x * 3 + y * y);
        g(x, y) = f(x, y - 1) + f(x, y + 1) * 2;
        g.bound(x, 0, width);
        if (scheduled) {
          g.split(y, yo, yi, 2, TailStrategy::RoundUp);
          f.store_root().compute_at(g, yo).align_bounds(y, 2).unroll(y, 2);
        }
        return g;
      },
      width, 16);
  EXPECT_EQ(computed["f"], width * (16 + 4));
  EXPECT_EQ(stored_elements(g, "f"), width * 8);  // rows -2 to 3 at once
}

TEST_F(SlidingWindow, ClampedCoordinates) {
  expect_same([&](bool scheduled) {
    Func f("f"), g("g");
    f(x, y) = counted("f", x * 3 + y * y);
    g(x, y) = f(x, clamp(y - 1, 0, height - 1)) + f(x, clamp(y + 1, 0, height - 1)) * 2;
    if (scheduled) f.store_root().compute_at(g, y);
    return g;
  });
  EXPECT_EQ(computed["f"], width * height);
}

TEST_F(SlidingWindow, UpdatesThatStayInTheirRow) {
  expect_same([&](bool scheduled) {
    Func f("f"), g("g");
    RDom r(0, 5);
    f(x, y) = counted("f", x * 3 + y * y);
    f(x, y) += counted("u", r.x * x);
    g(x, y) = f(x, y - 1) + f(x, y + 1) * 2;
    if (scheduled) f.store_root().compute_at(g, y);
    return g;
  });
  EXPECT_EQ(computed["f"], width * (height + 2));
  EXPECT_EQ(computed["u"], width * (height + 2) * 5);
}

// Where the new part of a row is empty, no stage may run: the first one would undo the update.
TEST_F(SlidingWindow, PartsThatAreEmptyForUpdatesAreEmptyForAllStages) {
  expect_same([&](bool scheduled) {
    Var z("z"), zo("zo"), zi("zi");
    Func f("f"), out("out");
    f(x, y, z) = 93;
    f(x, y, z) = 1;
    out(x, y) = f(0, x, x) + 1000 * f(x, x, y);
    if (!scheduled) {
      f.compute_root();
      return out;
    }
    f.update(0).split(z, zo, zi, 8, TailStrategy::GuardWithIf);
    out.split(x, xo, xi, 5, TailStrategy::GuardWithIf);
    f.store_root().compute_at(out, xo);
    return out;
  });
}

TEST_F(SlidingWindow, UpdatesAcrossRowsAreComputedAgain) {
  expect_same([&](bool scheduled) {
    Func f("f"), g("g");
    RDom r(0, 2);
    f(x, y) = counted("f", x * 3 + y * y);
    f(x, 3 + r) = f(x, 2 + r) + 1;
    g(x, y) = f(x, y - 1) + f(x, y + 1) * 2;
    if (scheduled) f.store_root().compute_at(g, y);
    return g;
  });
  EXPECT_GE(computed["f"], width * height * 3);
}

TEST_F(SlidingWindow, SharedByConsumersThatStartAtDifferentTimes) {
  expect_same([&](bool scheduled) {
    Func f("f"), g("g"), h("h"), out("out");
    f(x, y) = counted("f", x * 3 + y * y);
    g(x, y) = counted("g", f(x, y) * 2 + f(x, y - 5));
    h(x, y) = counted("h", f(x, y) + f(x, y + 2));  // used only by the current row
    out(x, y) = g(x, y) + g(x, y - 4) + h(x, y);
    if (scheduled) {
      g.store_root().compute_at(out, y);
      h.compute_at(out, y);
      f.compute_at(out, y);
    }
    return out;
  });
  EXPECT_EQ(computed["g"], width * (height + 4));
}

TEST_F(SlidingWindow, VectorsAndUnrolledRows) {
  expect_same_stencils([&](Func& f, Func& g, Func& out) {
    out.split(y, yo, yi, 4).unroll(yi).vectorize(x, 8);
    g.store_at(out, yo).compute_at(out, yi).vectorize(x, 8);
    f.store_at(out, yo).compute_at(out, yi).vectorize(x, 8);
  });
}

TEST_F(SlidingWindow, TilesThatKeepRows) {
  expect_same_stencils([&](Func& f, Func& g, Func& out) {
    out.tile(x, y, xo, yo, xi, yi, 8, 4).parallel(yo).vectorize(xi, 4);
    g.store_at(out, xo).compute_at(out, yi).vectorize(x, 4);
    f.store_at(out, yo).compute_at(out, yi).vectorize(x, 4);
  });
}

TEST_F(SlidingWindow, FoldsOfConsumersInsideProducers) {
  expect_same_stencils([&](Func& f, Func& g, Func& out) {
    g.store_root().compute_at(out, y);
    f.store_root().compute_at(g, y);
  });
}

TEST_F(SlidingWindow, FoldsBesideVectorsButNotAlongThem) {
  expect_same([&](bool scheduled) {
    Func f("f"), g("g");
    f(x, y) = x * 3 + y * y;
    g(x, y) = f(x - 1, y) + f(x, y) * 2 + f(x + 1, y);
    if (scheduled) {
      g.split(x, xo, xi, 8).vectorize(xi);
      f.store_at(g, y).compute_at(g, xo).vectorize(x, 8);
    }
    return g;
  });
}

// ---- storage directives ----

class StorageDirectives : public SlidingWindow {
 protected:
  // f is read at y - 1 .. y + 1 by one row of g.
  Func rows(const std::function<void(Func&, Func&)>& schedule) {
    Func f("f"), g("g");
    f(x, y) = x * 3 + y * y;
    g(x, y) = f(x, y - 1) + f(x, y + 1) * 2;
    g.bound(x, 0, width);
    schedule(f, g);
    return g;
  }

  static void expect_values(Func g) {
    Buffer<int> found = g.realize({width, height});
    found.for_each_element([&](int i, int j) {
      ASSERT_EQ(found(i, j), i * 9 + (j - 1) * (j - 1) + 2 * (j + 1) * (j + 1));
    });
  }

  static void expect_refused(Func g, const std::string& phrase) {
    expect_error<Error>({phrase}, [&] { g.realize({width, height}); });
  }
};

TEST_F(StorageDirectives, FoldsAsAsked) {
  Func g = rows([&](Func& f, Func& g) { f.store_root().compute_at(g, y).fold_storage(y, 3); });
  EXPECT_EQ(stored_elements(g, "f"), width * 3);
  expect_values(g);
}

TEST_F(StorageDirectives, AFoldThatIsTooSmallIsReported) {
  expect_refused(
      rows([&](Func& f, Func& g) { f.store_root().compute_at(g, y).fold_storage(y, 2); }),
      "cannot fold the storage");
}

TEST_F(StorageDirectives, AFoldThatNoLoopCarriesMustHoldAll) {
  expect_values(rows([&](Func& f, Func& g) { f.compute_at(g, y).fold_storage(y, 4); }));
  expect_refused(rows([&](Func& f, Func&) { f.compute_root().fold_storage(y, 4); }),
                 "cannot fold the storage");
}

// rule: storage that the compiler lays out can be folded or bounded
TEST_F(StorageDirectives, OutputsAreNotFolded) {
  expect_refused(rows([&](Func&, Func& g) { g.fold_storage(y, 4); }), "is an output");
}

TEST_F(StorageDirectives, BoundsTheStorage) {
  Func g = rows([&](Func& f, Func&) { f.compute_root().bound_storage(y, height + 10); });
  EXPECT_EQ(stored_elements(g, "f"), width * (height + 10));
  expect_values(g);
  expect_refused(rows([&](Func& f, Func&) { f.compute_root().bound_storage(y, height); }),
                 "bounded to");
}

TEST_F(StorageDirectives, AlignsTheStorage) {
  Func g = rows([&](Func& f, Func& g) { f.compute_at(g, y).align_storage(x, 16); });
  EXPECT_EQ(stored_elements(g, "f"), 32 * 3);
  expect_values(g);
}

// ---- Funcs beside sliding ones, in warm-up iterations that run only for these: every access is
// checked ----

void expect_same_and_inside(const std::function<Func(bool)>& make,
                            std::initializer_list<int> sizes = {1, 2, 3, 7, 13, 50, 64}) {
  const Target target = get_jit_target_from_environment().with_feature(Target::CheckedAccesses);
  Func scheduled = make(true);
  for (const int size : sizes) {
    Buffer<int> expected = make(false).realize({size}), found = scheduled.realize({size}, target);
    expected.for_each_element(
        [&](int i) { EXPECT_EQ(expected(i), found(i)) << i << " of " << size; });
  }
}

TEST_F(SlidingWindow, WarmUpOfAnUpsampledFuncLeavesTheOthersInside) {
  expect_same_and_inside([&](bool scheduled) {
    Func in("in"), low("low"), out("out");
    in(y) = y;
    low(y) = in(y);
    out(y) = in(y) + low(y / 2) + low(y / 2 + 1);
    if (!scheduled) return out;
    out.split(y, yo, y, 4, TailStrategy::GuardWithIf);
    in.store_root().compute_at(out, y);
    low.store_root().compute_at(out, y);
    return out;
  });
}

TEST_F(SlidingWindow, WarmUpLeavesVectorsAlongTheWindowInside) {
  expect_same_and_inside([&](bool scheduled) {
    Func f0("f0"), f1("f1"), f2("f2"), f4("f4");
    f0(y) = y * 3;
    f1(y) = f0(y / 2 + 1) + f0(y / 2);
    f2(y) = f1(y / 2 + 1);
    f4(y) = f2(y - 1) + f2(y - 2) + f1(y + 1);
    for (Func* f : {&f0, &f1, &f2}) {
      f->compute_root();
      if (scheduled) f->store_root().compute_at(f4, y);
    }
    if (scheduled) f1.vectorize(y, 4);
    return f4;
  });
}

// l4 runs from the loop's first iteration on, l3 from twelve before it, and both read l1.
TEST_F(SlidingWindow, NamesOfWhatStartsLaterAreNotReadBeforeIt) {
  Var outer("outer"), inner("inner"), block("block"), lane("lane"), group("group"), rest("rest"),
      t("t");
  expect_same_and_inside([&](bool scheduled) {
    Func l1("l1"), l3("l3"), l4("l4"), l5("l5"), out("out");
    l1(x) = x * 9;
    l3(x) = l1(x / 2 + 2) + l1(x - 1) * 2;
    l4(x) = l3(x - 1) + l1(x + 2);
    l5(x) = l4(x - 1);
    out(x) = l5(x);
    for (Func* f : {&l1, &l3, &l4, &l5}) f->compute_root();
    if (!scheduled) return out;
    out.split(x, xo, xi, 3, TailStrategy::Predicate);
    l5.compute_at(out, xo).split(x, block, lane, 4, TailStrategy::ShiftInwards).vectorize(lane);
    for (Func* f : {&l1, &l3, &l4}) f->store_at(out, xo).compute_at(l5, block);
    l4.split(x, outer, inner, 16, TailStrategy::GuardWithIf)
        .split(outer, group, rest, 4, TailStrategy::ShiftInwards)
        .fuse(rest, group, t);
    l1.split(x, outer, inner, 4)
        .split(outer, group, lane, 4, TailStrategy::RoundUp)
        .vectorize(lane);
    return out;
  });
}

// A part of the window is empty in two of three iterations; values computed from its ends are not.
TEST_F(SlidingWindow, EmptyPartsAskForNothingOutside) {
  expect_same_and_inside([&](bool scheduled) {
    Func f("f"), g("g"), h("h"), out("out");
    f(x) = x * 5;
    g(x) = f(x + 2) + f(x / 4 - 1) + f(x - 1);
    h(x) = g(x - 1) + g(x + 1);
    out(x) = h(x / 3) * 3 + f(x / 3);
    for (Func* p : {&f, &g, &h}) {
      p->compute_root();
      if (scheduled) p->store_root().compute_at(out, x);
    }
    if (scheduled)
      f.split(x, xo, xi, 2, TailStrategy::ShiftInwards)
          .split(xo, xo, yi, 16, TailStrategy::ShiftInwards);
    return out;
  });
}

// Tiles of s4 that shift inwards recompute points that an earlier iteration stored, so they need
// their operands.
TEST_F(SlidingWindow, TilesThatShiftInwardsHaveTheOperandsOfWhatTheyRepeat) {
  expect_same(
      [&](bool scheduled) {
        Var x6("x6"), x7("x7"), x8("x8"), x9("x9"), lane("lane"), y13("y13"), y14("y14");
        Func s1("s1"), s3("s3"), s4("s4"), s5("s5"), out("out");
        s1(x, y) = (x + y) % 12 * 17 % 101;
        s3(x, y) = s1(x - 1, y) + s1(x, y - 1) + s1(x + 2, y + 2);
        s4(x, y) = s3(x, y - 1) + s3(x + 1, y);
        s5(x, y) = max(s4(x, y) + s4(x, y + 1), s4(x, y + 1)) / 3;
        out(x, y) = s5(x, y);
        for (Func* f : {&s1, &s3, &s4, &s5}) f->compute_root();
        if (!scheduled) return out;
        s5.split(x, x6, x7, 3, TailStrategy::PredicateStores)
            .split(x7, x8, x9, 5, TailStrategy::GuardWithIf)
            .vectorize(x9)
            .unroll(x8);
        s4.store_root().compute_at(s5, x8).split(x, x, lane, 3).vectorize(lane);
        s3.compute_at(s5, x8)
            .reorder(x, y)
            .split(y, y13, y14, 8, TailStrategy::PredicateStores)
            .vectorize(y14);
        s1.compute_at(s3, y13);
        return out;
      },
      23, 11);
}

// Past the end of a guarded split the window adds nothing, so producers in its loops are not
// computed.
TEST_F(SlidingWindow, WhatIsComputedInTheLoopsOfAnEmptyPartStaysInside) {
  Var block("block"), row("row"), a("a"), b("b"), c("c"), d("d"), e("e"), f("f"), lane("lane");
  const auto make = [&](bool scheduled) {
    Func l0("l0"), l1("l1"), l2("l2"), l3("l3"), out("out");
    l0(x, y) = x + y * 37;
    l1(x, y) = l0(x, y) + l0(x + 1, y) * 2;
    l2(x, y) = l1(x, y / 3);
    l3(x, y) = l2(x + 1, y);
    out(x, y) = l3(x, y);
    for (Func* p : {&l0, &l1, &l2, &l3}) p->compute_root();
    if (!scheduled) return out;
    l3.split(y, yo, yi, 8, TailStrategy::GuardWithIf).split(yi, block, row, 5).unroll(row);
    l2.store_at(l3, yo).compute_at(l3, row);
    l2.split(y, a, b, 4, TailStrategy::PredicateStores)
        .split(b, c, d, 5, TailStrategy::GuardWithIf)
        .split(a, e, f, 4, TailStrategy::GuardWithIf)
        .reorder(c, e, f, d, x)
        .split(e, a, lane, 4, TailStrategy::RoundUp)
        .vectorize(lane);
    l1.store_at(l3, yo).compute_at(l2, x).split(y, e, f, 5, TailStrategy::GuardWithIf);
    l0.store_at(l3, row).compute_at(l1, e);
    return out;
  };
  const Target target = get_jit_target_from_environment().with_feature(Target::CheckedAccesses);
  for (const int rows : {11, 13, 18}) {
    Buffer<int> expected = make(false).realize({20, rows}),
                found = make(true).realize({20, rows}, target);
    expected.for_each_element([&](int i, int j) { EXPECT_EQ(expected(i, j), found(i, j)); });
  }
}

// In the warm-up iterations, far from 0, f(y - 2) and f(y / 2 + 2) are further apart than in the
// loop itself.
TEST_F(SlidingWindow, FoldedStorageHoldsTheWindowsOfEarlyIterations) {
  const auto make = [&](bool slides) {
    Func f("f"), g("g"), h("h"), out("out");
    f(y) = y * 37;
    g(y) = f(y - 2) + f(y / 2 + 2);
    h(y) = g(2 * y) + g(2 * y - 1) + g(y / 8) * 2 + g(y / 2 + 4);
    out(y) = h(y);
    out.bound(y, -4, 6);
    if (slides) {
      h.compute_root();
      g.store_root().compute_at(h, y);
      f.store_root().compute_at(h, y);
    }
    Buffer<int> result(6);
    result.set_min(-4);
    out.realize(result);
    return result;
  };
  const Buffer<int> expected = make(false), found = make(true);
  for (int i = -4; i < 2; ++i) EXPECT_EQ(expected(i), found(i)) << i;
}

// g's tile of 8 ends with the new part of h, and begins far before anything that h reads.
TEST_F(SlidingWindow, TilesMovedInwardsRunOverAllThatAnIterationNeeds) {
  Var outer("outer"), inner("inner"), a("a"), b("b");
  const Target target = get_jit_target_from_environment().with_feature(Target::CheckedAccesses);
  const auto make = [&](bool slides) {
    Func f("f"), g("g"), h("h"), k("k"), l("l"), out("out");
    f(y) = y * 37;
    g(y) = f(y / 2) + f(y - 2) + f(y * 4);
    h(y) = g(y * 4 - 1) + f(y / 3 + 2);
    k(y) = h(y) + g(y * 4) * 2 + h(y + 1);
    l(y) = k(y + 2) + h(y / 3 + 1);
    out(y) = l(y / 9);
    out.bound(y, -5, 29);
    if (slides) {
      l.compute_root().split(y, outer, inner, 2, TailStrategy::RoundUp).reorder(outer, inner);
      for (Func* p : {&k, &h}) p->store_root().compute_at(l, inner);
      for (Func* p : {&g, &f}) p->compute_at(l, inner);
      g.split(y, a, b, 8, TailStrategy::ShiftInwards);
    }
    Buffer<int> result(29);
    result.set_min(-5);
    out.realize(result, target);
    return result;
  };
  const Buffer<int> expected = make(false), found = make(true);
  for (int i = -5; i < 24; ++i) EXPECT_EQ(expected(i), found(i)) << i;
}

// A tile of g begins in columns to the left, whose rows are kept for the following rows of h.
TEST_F(SlidingWindow, WhatTilesComputeAgainInKeptStorageIsRight) {
  Var column("column"), block("block"), z("z"), a("a"), b("b"), c("c"), d("d");
  const auto make = [&](bool slides) {
    Func f("f"), g("g"), h("h"), out("out");
    f(x, y) = x * 37 + y * 101;
    g(x, y) = f(x / 2 + 2, y) + f(x / 4 - 2, y);
    h(x, y) = g(x, y / 4 + 2) + g(x, y / 2 + 2) * 2;
    out(x, y, z) = h(x, y);
    if (!slides) return out;
    h.compute_at(out, z)
        .split(x, block, column, 8, TailStrategy::RoundUp)
        .reorder(block, column, y);
    g.store_at(out, z).compute_at(h, block);
    g.split(x, a, b, 4, TailStrategy::RoundUp).split(b, c, d, 16, TailStrategy::ShiftInwards);
    f.compute_at(h, column);
    return out;
  };
  Buffer<int> expected(5, 6, 2), found(5, 6, 2);
  for (Buffer<int>* result : {&expected, &found}) result->set_min(-8, 0, 0);
  make(false).realize(expected);
  make(true).realize(found);
  expected.for_each_element([&](int i, int j, int k) {
    EXPECT_EQ(expected(i, j, k), found(i, j, k)) << i << " " << j << " " << k;
  });
}

// A tile that begins before its region would reset elements that an update has finished, and that
// are kept for other columns, to their initial values.
TEST_F(SlidingWindow, UpdatesOfKeptElementsAreNotUndoneByTiles) {
  expect_same(
      [&](bool slides) {
        Var below("below"), block("block"), row("row");
        Func f("f"), g("g"), out("out");
        f(x, y) = x * 4 + y * 37;
        f(x, y) += x + y;
        g(x, y) = f(x, y + 1);
        out(x, y) = g(x, y);
        if (!slides) return out;
        out.split(y, yo, yi, 8, TailStrategy::Predicate);
        g.compute_at(out, yo)
            .split(x, xo, xi, 5, TailStrategy::ShiftInwards)
            .split(y, below, row, 8, TailStrategy::PredicateStores)
            .reorder(xo, row, below, xi);
        f.store_root().compute_at(g, row).split(y, block, y, 8);
        f.update().unscheduled();
        return out;
      },
      11, 11);
}

// A loop starts before its first iteration, where the box of the hoisted Func is largest.
TEST_F(SlidingWindow, HoistedStorageHasRoomForEarlyIterations) {
  const auto make = [&](bool slides) {
    Var tile("tile"), in_tile("in_tile"), part("part"), in_part("in_part"), block("block"),
        column("column");
    Func f("f"), g("g"), h("h"), out("out");
    f(x) = x * 7;
    g(x) = f(x / 3 + 1);
    h(x) = g(x / 3 + 2) + g(x + 2);
    out(x, y) = h(x);
    if (!slides) return out;
    h.compute_at(out, x)
        .split(x, tile, in_tile, 8, TailStrategy::GuardWithIf)
        .split(in_tile, part, in_part, 16, TailStrategy::ShiftInwards);
    g.store_root().compute_at(h, tile).split(x, block, column, 8, TailStrategy::PredicateStores);
    f.hoist_storage(LoopLevel::root()).store_at(h, tile).compute_at(g, column);
    f.vectorize(x, 16, TailStrategy::PredicateLoads);
    return out;
  };
  Buffer<int> expected(5, 3), found(5, 3);
  for (Buffer<int>* result : {&expected, &found}) result->set_min(-8, 0);
  make(false).realize(expected);
  make(true).realize(found, get_host_target().with_feature(Target::CheckedAccesses));
  expected.for_each_element(
      [&](int i, int j) { EXPECT_EQ(expected(i, j), found(i, j)) << i << " " << j; });
}

// The allocation covers the warm-up iterations, although a split promises coordinates from the
// first iteration on.
TEST_F(SlidingWindow, HoistedStorageHasRoomForIterationsBeforeASplit) {
  const auto make = [&](bool slides) {
    Var tile("tile"), in_tile("in_tile"), block("block"), column("column");
    Func f("f"), g("g"), h("h"), out("out");
    f(x) = x * 7;
    g(x) = f(x / 4 + 1);
    h(x) = g(x - 2) + g(x / 3) * 2 + g(x + 1);
    out(x) = h(x / 2);
    if (!slides) return out;
    h.compute_root().split(x, tile, in_tile, 2, TailStrategy::GuardWithIf);
    g.store_at(h, tile).compute_at(h, in_tile);
    g.split(x, block, column, 8, TailStrategy::Predicate);
    f.hoist_storage(h, tile).store_at(h, in_tile).compute_at(g, block);
    return out;
  };
  const Buffer<int> expected = make(false).realize({26});
  const Buffer<int> found =
      make(true).realize({26}, get_host_target().with_feature(Target::CheckedAccesses));
  for (int i = 0; i < 26; i++) EXPECT_EQ(expected(i), found(i)) << i;
}

// Iterations of the only loop over `var`, when constant.
int64_t iterations_of(const Func& output, const std::string& var) {
  int64_t iterations = -1;
  const ir::LoweredFunction lowered =
      lower::lower("test", {output.function()}, lower::infer_arguments({output.function()}), {});
  ir::walk(lowered.body, [&](const ir::For& loop) {
    if (loop.name.ends_with("." + var)) iterations = ir::as_const_int(loop.extent).value_or(-1);
  });
  return iterations;
}

// Strips of 16 steps of two rows each. Tiles of two rows that start at even rows stay inside what an iteration needs,
// and they do not slide, so starting the loop earlier than their consumer does gains nothing.
TEST_F(SlidingWindow, AlignedTilesBesideWindowsComputeWhatAnIterationNeeds) {
  const Var yii("yii"), pair("pair");
  const Func out = expect_same(
      [&](bool scheduled) {
        Func f("f"), tiles("tiles"), window("window"), out("out");
        f(x, y) = counted("f", x * 3 + y * y);
        tiles(x, y) = counted("tiles", f(x, y - 1) + f(x, y + 1));
        window(x, y) = tiles(x, y) * 2;
        out(x, y) = window(x, y - 1) + window(x, y + 1);
        if (!scheduled) return out;
        out.split(y, y, yi, 32).split(yi, yi, yii, 2).reorder(x, yii, yi, y);
        window.store_at(out, y).compute_at(out, yi).align_bounds(y, 2);
        tiles.compute_at(out, yi).align_bounds(y, 2).split(y, y, pair, 2).unroll(pair);
        f.store_at(out, y).compute_at(out, yi);
        return out;
      },
      4, 64);
  EXPECT_LE(computed["tiles"], 2 * (32 + 4) * 4);
  EXPECT_LE(computed["f"], 2 * (32 + 6) * 4);
  EXPECT_LE(iterations_of(out, "yi"), 16 + 4);
}

}  // namespace
}  // namespace retrograde
