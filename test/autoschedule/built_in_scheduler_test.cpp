// Pipeline::auto_schedule() without a plugin: its decisions on inlining and storage.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include <functional>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "graph/graph.h"
#include "ir/target.h"
#include "support/errors.h"
#include "support/loop_nest.h"
#include "support/rules_schedule.h"

namespace retrograde {
namespace {

struct BuiltInScheduler : ::testing::Test {
  BuiltInScheduler() {
    brighter(x, y) = input(x, y) * 1.5f + 0.25f;
    heavy(x, y) = exp(brighter(x, y)) * sin(brighter(x, y));
    blur(x, y) = heavy(x - 1, y) + heavy(x, y) + heavy(x + 1, y);
    sums(x) = 0.0f;
    sums(x) += blur(x, rows);
    out(x) = sums(x) * 2.0f;
    out.set_estimate(x, 0, 1000);
  }
  std::string schedule() { return schedule_by_rules(Pipeline(out)).to_cpp(); }
  static bool is_at_root(const Func& f) {
    return f.function()->schedule.compute_level.kind == graph::LoopLevel::Kind::Root;
  }
  static ForType outermost(const Func& f) { return f.get_schedule().dims.back().runs; }
  static ForType innermost(const Func& f) { return f.get_schedule().dims.front().runs; }

  ImageParam input{Float(32), 2, "input"};
  Var x{"x"}, y{"y"};
  RDom rows{0, 100, "rows"};
  Func brighter{"brighter"}, heavy{"heavy"}, blur{"blur"}, sums{"sums"}, out{"out"};
};

TEST_F(BuiltInScheduler, InlinesWhatIsCheapAndStoresTheRest) {
  EXPECT_EQ(Pipeline(out).auto_schedule(get_host_target()).scheduler_name, built_in_autoscheduler);
  EXPECT_FALSE(is_at_root(brighter));
  EXPECT_TRUE(is_at_root(heavy));
  EXPECT_TRUE(is_at_root(sums));
  EXPECT_TRUE(is_at_root(out));
  EXPECT_EQ(outermost(heavy), ForType::Parallel);
  EXPECT_EQ(innermost(heavy), ForType::Vectorized);
}

// Sums over windows for each of several shifts; only the sum over all shifts is an output.
struct Shifted {
  explicit Shifted(int shifts, int read_at_once = 1) {
    RDom r(-1, 3), each(0, shifts), near(-1, 3, 0, read_at_once);
    const Expr at = clamp(x, 0, 63);
    rows(x, y, d) = 0.0f;
    rows(x, y, d) += picture(clamp(x + r + d, 0, 63), clamp(y, 0, 31)) * picture(at, y % 32);
    windows(x, y, d) = 0.0f;
    if (read_at_once > 1)
      windows(x, y, d) += rows(x, y + near.x, d + near.y);
    else
      windows(x, y, d) += rows(x, y + r, d);
    out(x, y) = 0.0f;
    out(x, y) += windows(x, y, each);
    for (int py = 0; py < 32; py++) {
      for (int px = 0; px < 64; px++) picture(px, py) = static_cast<float>((px * 7 + py * 13) % 11);
    }
  }
  graph::LoopLevel place_of_rows() {
    schedule_by_rules(Pipeline(out));
    return rows.function()->schedule.compute_level;
  }
  Var x{"x"}, y{"y"}, d{"d"};
  Buffer<float> picture{64, 32};
  Func rows{"rows"}, windows{"windows"}, out{"out"};
};

TEST(SlicesOfAFunc, AreComputedInTheLoopsOfTheirOnlyReader) {
  Shifted scheduled(11), plain(11);
  const graph::LoopLevel place = scheduled.place_of_rows();
  ASSERT_EQ(place.kind, graph::LoopLevel::Kind::At);
  EXPECT_EQ(place.func, scheduled.windows.name());
  EXPECT_EQ(place.var, "d");
  const Buffer<float> found = scheduled.out.realize({50, 30}),
                      expected = plain.out.realize({50, 30});
  for (int y = 0; y < 30; y++) {
    for (int x = 0; x < 50; x++) EXPECT_EQ(found(x, y), expected(x, y)) << x << ", " << y;
  }
}

TEST(SlicesOfAFunc, AreNotWhereThereAreTooFewForTheThreads) {
  EXPECT_EQ(Shifted(4).place_of_rows().kind, graph::LoopLevel::Kind::Root);
}

TEST(SlicesOfAFunc, AreNotWhereSeveralReadThem) {
  Shifted program(11);
  program.out(program.x, program.y) += program.rows(program.x, program.y, 3);
  EXPECT_EQ(program.place_of_rows().kind, graph::LoopLevel::Kind::Root);
}

TEST(SlicesOfAFunc, AreNotWhereAnIterationReadsTwo) {
  EXPECT_EQ(Shifted(11, 2).place_of_rows().kind, graph::LoopLevel::Kind::Root);
}

// Histograms of tiles of several pictures, blurred along their bins and along rows of tiles.
struct BlurredHistograms {
  BlurredHistograms() {
    const RDom pixel(0, 4, 0, 4), near(-1, 3);
    const auto value = [&](const Expr& px, const Expr& py) {
      return (px * 7 + py * 13 + n) % bins;
    };
    counts(x, y, z, n) = 0.0f;
    counts(x, y, value(4 * x + pixel.x, 4 * y + pixel.y), n) += 1.0f;
    deep(x, y, z, n) = 0.0f;
    deep(x, y, z, n) += counts(x, y, clamp(z + near, 0, bins - 1), n);
    wide(x, y, z, n) = 0.0f;
    wide(x, y, z, n) += deep(x, y + near, z, n);
    out(x, y, z, n) = wide(x, y, z, n) + wide(x + 1, y, z, n);
  }
  static constexpr int bins = 24;
  Var x{"x"}, y{"y"}, z{"z"}, n{"n"};
  Func counts{"counts"}, deep{"deep"}, wide{"wide"}, out{"out"};
};

// Each bin of `wide` reads one of `deep`, but a histogram is computed all at once.
TEST(SlicesOfAFunc, AreNotWhereWhatIsInsideThemWouldBeComputedAgain) {
  BlurredHistograms scheduled, plain;
  scheduled.out.set_estimates({{0, 12}, {0, 12}, {0, 24}, {0, 16}});
  schedule_by_rules(Pipeline(scheduled.out));
  const auto place = [](const Func& f) { return f.function()->schedule.compute_level; };
  ASSERT_EQ(place(scheduled.counts).kind, graph::LoopLevel::Kind::At);
  EXPECT_EQ(place(scheduled.counts).var, "n");
  ASSERT_EQ(place(scheduled.deep).kind, graph::LoopLevel::Kind::At);
  EXPECT_EQ(place(scheduled.deep).var, "n");
  const Buffer<float> found = scheduled.out.realize({12, 12, 24, 16}),
                      expected = plain.out.realize({12, 12, 24, 16});
  expected.for_each_element([&](const int* at) { EXPECT_EQ(found(at), expected(at)); });
}

// A window around each pixel for each of many shifts; the output needs their sum at two places.
struct ShiftedWindows {
  explicit ShiftedWindows(int shifts, int apart = 1) {
    RDom near(-1, 3), each(0, shifts, 0, shifts);
    const auto at = [&](const Expr& px, const Expr& py) {
      return picture(clamp(px, 0, side - 1), clamp(py, 0, side - 1));
    };
    windows(x, y, u, v) = 0.0f;
    windows(x, y, u, v) += at(x + near, y) * at(x + near + u, y + v);
    out(x, y) = 0.0f;
    out(x, y) += windows(x, y, each.x, each.y) -
                 0.5f * windows(x - each.x, y - apart * each.y, each.x, each.y);
    out.bound(x, 0, side).bound(y, 0, side);
    for (int py = 0; py < side; py++) {
      for (int px = 0; px < side; px++)
        picture(px, py) = static_cast<float>((px * 7 + py * 13) % 11);
    }
  }
  graph::LoopLevel place_of_windows() {
    schedule_by_rules(Pipeline(out));
    return windows.function()->schedule.compute_level;
  }
  static constexpr int side = 264;
  Var x{"x"}, y{"y"}, u{"u"}, v{"v"};
  Buffer<float> picture{side, side};
  Func windows{"windows"}, out{"out"};
};

TEST(SlicesOfAReduction, AreComputedInItsLoopsForStripsOfTheResult) {
  ShiftedWindows scheduled(8), plain(8);
  const graph::LoopLevel place = scheduled.place_of_windows();
  ASSERT_EQ(place.kind, graph::LoopLevel::Kind::At);
  EXPECT_EQ(place.func, scheduled.out.name());
  EXPECT_EQ(place.stage, 1);
  const std::vector<graph::Dim> loops = scheduled.out.update().get_schedule().dims;
  EXPECT_EQ(loops.back().runs, ForType::Parallel);
  EXPECT_TRUE(loops[loops.size() - 2].is_reduction && loops[loops.size() - 3].is_reduction);
  constexpr int side = ShiftedWindows::side;
  plain.windows.compute_root();
  const Buffer<float> found = scheduled.out.realize({side, side}),
                      expected = plain.out.realize({side, side});
  for (int y = 0; y < side; y++) {
    for (int x = 0; x < side; x++) ASSERT_EQ(found(x, y), expected(x, y)) << x << ", " << y;
  }
}

TEST(SlicesOfAReduction, AreNotWhereTheyAreFewOrFit) {
  EXPECT_EQ(ShiftedWindows(2).place_of_windows().kind, graph::LoopLevel::Kind::Root);
  EXPECT_EQ(ShiftedWindows(4).place_of_windows().kind, graph::LoopLevel::Kind::Root);
}

TEST(SlicesOfAReduction, AreNotWhereAStripReadsManyMoreRows) {
  EXPECT_EQ(ShiftedWindows(8, 9).place_of_windows().kind, graph::LoopLevel::Kind::Root);
}

TEST(SlicesOfAReduction, AreNotWhereSeveralReadThem) {
  ShiftedWindows program(8);
  program.out(program.x, program.y) += program.windows(program.x, program.y, 3, 3);
  EXPECT_EQ(program.place_of_windows().kind, graph::LoopLevel::Kind::Root);
}

// Two sums over a Func that both would load from memory or recompute.
struct TwoSums {
  explicit TwoSums(int shifts) {
    RDom each(0, shifts, 0, shifts);
    const Expr there = picture(clamp(x + u, 0, side - 1), clamp(y + v, 0, side - 1));
    terms(x, y, u, v) = there * picture(x, y);
    plain(x, y) = 0.0f;
    plain(x, y) += terms(x, y, each.x, each.y);
    weighted(x, y) = 0.0f;
    weighted(x, y) += terms(x, y, each.x, each.y) * cast<float>(each.x - each.y);
    out(x, y) = plain(x, y) - weighted(x, y);
    out.bound(x, 0, side).bound(y, 0, side);
    for (int py = 0; py < side; py++) {
      for (int px = 0; px < side; px++)
        picture(px, py) = static_cast<float>((px * 5 + py * 3) % 13);
    }
  }
  bool run_together() {
    schedule_by_rules(Pipeline(out));
    return weighted.function()->stage(1).schedule.fuse_level.func == plain.name();
  }
  static constexpr int side = 264;
  Var x{"x"}, y{"y"}, u{"u"}, v{"v"};
  Buffer<float> picture{side, side};
  Func terms{"terms"}, plain{"plain"}, weighted{"weighted"}, out{"out"};
};

TEST(SumsOverALargeFunc, RunTogether) {
  TwoSums scheduled(8), apart(8);
  EXPECT_TRUE(scheduled.run_together());
  constexpr int side = TwoSums::side;
  apart.plain.compute_root();
  apart.weighted.compute_root();
  const Buffer<float> found = scheduled.out.realize({side, side}),
                      expected = apart.out.realize({side, side});
  for (int y = 0; y < side; y++) {
    for (int x = 0; x < side; x++) ASSERT_EQ(found(x, y), expected(x, y)) << x << ", " << y;
  }
}

TEST(SumsOverALargeFunc, RunApartWhereItIsSmall) { EXPECT_FALSE(TwoSums(3).run_together()); }

// Two sums over stored planes.
struct Planes {
  explicit Planes(int planes) {
    RDom near(-1, 3), each(0, planes);
    windows(x, y, d) = 0.0f;
    windows(x, y, d) += picture(clamp(x + near, 0, side - 1), clamp(y, 0, side - 1)) *
                        picture(clamp(x, 0, side - 1), clamp(y + d, 0, side - 1));
    sums(x, y) = 0.0f;
    sums(x, y) += windows(x, y, each);
    squares(x, y) = 0.0f;
    squares(x, y) += windows(x, y, each) * windows(x, y, each);
    out(x, y) = squares(x, y) - sums(x, y);
    out.bound(x, 0, side).bound(y, 0, side);
    for (int py = 0; py < side; py++) {
      for (int px = 0; px < side; px++) picture(px, py) = static_cast<float>((px * 5 + py * 3) % 9);
    }
  }
  // For each loop, innermost first: whether it runs over planes.
  std::vector<bool> loops_of_sums() {
    schedule_by_rules(Pipeline(out));
    std::vector<bool> result;
    for (const graph::Dim& loop : sums.update().get_schedule().dims)
      result.push_back(loop.is_reduction);
    return result;
  }
  static constexpr int side = 264;
  Var x{"x"}, y{"y"}, d{"d"};
  Buffer<float> picture{side, side};
  Func windows{"windows"}, sums{"sums"}, squares{"squares"}, out{"out"};
};

TEST(SumsOverPlanes, GoAlongTheirRows) {
  Planes scheduled(64), plain(64);
  EXPECT_EQ(scheduled.loops_of_sums(), (std::vector<bool>{false, false, true, false}));
  const auto is_joined = [](const Func& f) {
    return f.function()->stage(1).schedule.fuse_level.kind == graph::LoopLevel::Kind::At;
  };
  EXPECT_NE(is_joined(scheduled.sums), is_joined(scheduled.squares)) << "one joins the other";
  constexpr int side = Planes::side;
  for (Func* f : {&plain.windows, &plain.sums, &plain.squares}) f->compute_root();
  const Buffer<float> found = scheduled.out.realize({side, side}),
                      expected = plain.out.realize({side, side});
  for (int y = 0; y < side; y++) {
    for (int x = 0; x < side; x++) ASSERT_EQ(found(x, y), expected(x, y)) << x << ", " << y;
  }
}

TEST(SumsOverPlanes, KeepTheirSumsInRegistersWhereThereAreFew) {
  EXPECT_EQ(Planes(8).loops_of_sums(), (std::vector<bool>{true, false, false, false}));
}

// An expensive image and its consumer.
struct Rows {
  using Read = std::function<Expr(const Func& image, const Var& x, const Var& y)>;
  explicit Rows(const Read& read, int side = 1024) {
    const auto at = [&](const Expr& px, const Expr& py) {
      return picture(clamp(px, 0, 63), clamp(py, 0, 63));
    };
    image(x, y) = exp(at(x, y)) * sin(at(x + 1, y - 1)) + cos(at(x - 1, y + 1));
    out(x, y) = read(image, x, y);
    out.set_estimate(x, 0, side).set_estimate(y, 0, side);
    for (int py = 0; py < 64; py++) {
      for (int px = 0; px < 64; px++) picture(px, py) = static_cast<float>((px * 7 + py * 13) % 11);
    }
  }
  graph::LoopLevel place_of_image() {
    schedule_by_rules(Pipeline(out));
    return image.function()->schedule.compute_level;
  }
  Var x{"x"}, y{"y"};
  Buffer<float> picture{64, 64};
  Func image{"image"}, out{"out"};
};

void expect_rows_in_strips(const Rows::Read& read) {
  Rows scheduled(read), plain(read);
  const graph::LoopLevel place = scheduled.place_of_image();
  ASSERT_EQ(place.kind, graph::LoopLevel::Kind::At);
  EXPECT_EQ(place.func, scheduled.out.name());
  EXPECT_EQ(place.var, "yi");
  EXPECT_EQ(scheduled.image.function()->schedule.store_level.var, "y");
  for (const auto& [width, height] : {std::pair(50, 45), std::pair(3, 1)}) {
    const Buffer<float> found = scheduled.out.realize({width, height}),
                        expected = plain.out.realize({width, height});
    for (int y = 0; y < height; y++) {
      for (int x = 0; x < width; x++) ASSERT_EQ(found(x, y), expected(x, y)) << x << ", " << y;
    }
  }
}

TEST(StripsOfRows, KeepTheWindowThatAStencilReads) {
  expect_rows_in_strips([](const Func& f, const Var& x, const Var& y) {
    return f(x - 1, y - 1) + f(x + 1, y) + f(x, y + 2);
  });
}

TEST(StripsOfRows, KeepItThroughWhatIsInline) {
  expect_rows_in_strips([](const Func& f, const Var& x, const Var& y) {
    Func twice("twice");
    twice(x, y) = f(x, y) + f(x, y + 1);
    return twice(x, y - 1) - twice(x + 1, y);
  });
}

TEST(StripsOfRows, KeepItWhereRowsAreSkippedOrRepeated) {
  expect_rows_in_strips([](const Func& f, const Var& x, const Var& y) {
    Expr sum = 0.0f;
    for (int j = -1; j <= 2; j++) sum += f(2 * x - 1, 2 * y + j) + f(2 * x + 1, 2 * y + j);
    return sum;
  });
  expect_rows_in_strips([](const Func& f, const Var& x, const Var& y) {
    return f(x / 2, y / 2) + 0.5f * f(x / 2, y / 2 + 2 * (y % 2) - 1) + f(x / 2 + 1, y / 2);
  });
}

TEST(StripsOfRows, AreNotForWhatStaysInACache) {
  const auto read = [](const Func& f, const Var& x, const Var& y) { return f(x, y) + f(x, y + 1); };
  EXPECT_EQ(Rows(read, 256).place_of_image().kind, graph::LoopLevel::Kind::Root);
}

TEST(StripsOfRows, AreNotAcrossRows) {
  const auto turned = [](const Func& f, const Var& x, const Var& y) {
    return f(y, x) + f(y + 1, x);
  };
  EXPECT_EQ(Rows(turned).place_of_image().kind, graph::LoopLevel::Kind::Root);
  const auto upside_down = [](const Func& f, const Var& x, const Var& y) {
    return f(x, 2000 - y) + f(x + 1, y);
  };
  EXPECT_EQ(Rows(upside_down).place_of_image().kind, graph::LoopLevel::Kind::Root);
}

TEST(StripsOfRows, AreNotWhereSeveralReadThem) {
  const auto read = [](const Func& f, const Var& x, const Var& y) {
    RDom r(0, 100);
    Func sums("sums");
    sums(x) = 0.0f;
    sums(x) += f(x, r);
    return f(x, y) + f(x, y + 1) + sums(x);
  };
  EXPECT_EQ(Rows(read).place_of_image().kind, graph::LoopLevel::Kind::Root);
}

TEST(StripsOfRows, AreThoseOfAChainAsLongAsItsWindowsFit) {
  Var x("x"), y("y");
  std::vector<Func> stages(30);
  stages[0](x, y) = exp(cast<float>(x)) + exp(cast<float>(y));
  for (size_t s = 1; s < stages.size(); s++) {
    Func& f = stages[s - 1];
    stages[s](x, y) = exp(f(x - 1, y) + f(x + 1, y) + f(x, y - 1) + f(x, y + 1));
  }
  stages.back().set_estimate(x, 0, 2048).set_estimate(y, 0, 2048);
  schedule_by_rules(Pipeline(stages.back()));
  int at_root = 0;
  for (const Func& f : stages)
    at_root += f.function()->schedule.compute_level.kind == graph::LoopLevel::Kind::Root;
  EXPECT_GE(at_root, 2);
  EXPECT_LE(at_root, 8);
}

// Several sums over a window of planes, which later Funcs mix, up to a pure consumer.
struct WindowSums {
  explicit WindowSums(int taps = 3, int side = 1024) {
    const auto at = [&](const Expr& px, const Expr& py) {
      return picture(clamp(px, 0, 63), clamp(py, 0, 63));
    };
    heavy(x, y, i) = exp(at(x, y + i)) * sin(at(x + i, y - 1));
    const RDom r(0, taps, 0, taps), all(0, planes);
    around(x, y, i) = 0.0f;
    around(x, y, i) += heavy(x + r.x - 1, y + r.y - 1, i) * picture(r.x, r.y + i);
    largest(x, y) = around(x, y, 0);
    largest(x, y) = max(largest(x, y), around(x, y + 1, all));
    mixed(x, y) = Tuple(largest(x, y), 1.0f);
    mixed(x, y) = Tuple(mixed(x, y)[0] + around(x, y, all), mixed(x, y)[1] * 0.5f);
    out(x, y) = mixed(x / 2, y / 2)[0] * mixed(x / 2, y / 2 + 1)[1] + mixed(x / 2, y / 2 + 1)[0];
    out.set_estimate(x, 0, side).set_estimate(y, 0, side);
    for (int py = 0; py < 64; py++) {
      for (int px = 0; px < 64; px++)
        picture(px, py) = static_cast<float>((px * 7 + py * 13) % 11) / 16;
    }
  }
  void schedule() { schedule_by_rules(Pipeline(out)); }
  bool is_in_strips(const Func& f) const {
    const auto& placed = f.function()->schedule;
    return placed.store_level.kind == graph::LoopLevel::Kind::At &&
           placed.store_level.func == out.name() && placed.compute_level.func == out.name();
  }
  static constexpr int planes = 12;
  Var x{"x"}, y{"y"}, i{"i"};
  Buffer<float> picture{64, 64};
  Func heavy{"heavy"}, around{"around"}, largest{"largest"}, mixed{"mixed"}, out{"out"};
};

TEST(StripsOfRows, TakeSumsOverSmallWindowsAlong) {
  WindowSums scheduled, plain;
  scheduled.schedule();
  for (const Func* f : {&scheduled.heavy, &scheduled.around, &scheduled.largest, &scheduled.mixed})
    EXPECT_TRUE(scheduled.is_in_strips(*f)) << f->name();
  for (const auto& [width, height] : {std::pair(150, 301), std::pair(3, 1)}) {
    const Buffer<float> found = scheduled.out.realize({width, height}),
                        expected = plain.out.realize({width, height});
    for (int y = 0; y < height; y++) {
      for (int x = 0; x < width; x++)
        ASSERT_NEAR(found(x, y), expected(x, y), 1e-5 * std::abs(expected(x, y)) + 1e-6)
            << x << ", " << y;
    }
  }
}

TEST(StripsOfRows, ComputeSumsOneRowAtATime) {
  WindowSums sums;
  sums.schedule();
  for (const Func* f : {&sums.around, &sums.largest, &sums.mixed}) {
    for (const graph::Split& split : f->function()->updates[0].schedule.splits)
      EXPECT_NE(split.old_var, "y") << f->name();
  }
}

// Planes of several images, whose strips are separate parallel chunks.
TEST(StripsOfRows, ComputeSumsOneElementOfAllThatIsOutsideAtATime) {
  const auto stencil_of = [](Func& around) {
    Var x("x"), y("y"), c("c"), n("n");
    const RDom r(0, 3, 0, 3);
    around(x, y, c, n) += exp(cast<float>(x + r.x + n)) * cast<float>((y + r.y) * r.x + c);
    Func out("out");
    out(x, y, c, n) = around(x, y, c, n) - around(x, y + 1, c, n);
    out.set_estimates({{0, 300}, {0, 300}, {0, 16}, {0, 4}});
    return out;
  };
  Func around("around"), plain("plain");
  Func out = stencil_of(around), expected = stencil_of(plain);
  schedule_by_rules(Pipeline(out));
  EXPECT_EQ(around.function()->schedule.compute_level.func, out.name());
  for (const graph::Split& split : around.function()->updates[0].schedule.splits)
    EXPECT_EQ(split.old_var, "x");
  const Buffer<float> found = out.realize({70, 20, 5, 2}), all = expected.realize({70, 20, 5, 2});
  for (size_t i = 0; i < all.number_of_elements(); i++)
    ASSERT_NEAR(found.data()[i], all.data()[i], 1e-4 * std::abs(all.data()[i])) << i;
}

TEST(StripsOfRows, LeaveSumsOverLargeWindowsWhoseRowsAreDear) {
  WindowSums sums(21);
  sums.schedule();
  EXPECT_FALSE(sums.is_in_strips(sums.around));
}

// A chain of steps from an image to a loss (the last step's distance from zero), and the gradient
// by the image.
struct Steps {
  using Step =
      std::function<Expr(const Func& state, const Func& image, const Var& x, const Var& y)>;
  Steps(int count, const Step& step) {
    for (int py = 0; py < height; py++) {
      for (int px = 0; px < width; px++)
        picture(px, py) = static_cast<float>((px * 7 + py * 13) % 11) / 8;
    }
    Func image("image");
    image(x, y) = BoundaryConditions::repeat_edge(picture)(x, y);
    std::vector<Func> states{image};
    for (int s = 0; s < count; s++) {
      states.emplace_back("state");
      states.back()(x, y) = step(states[static_cast<size_t>(s)], image, x, y);
    }
    RDom r(0, width, 0, height);
    loss() = 0.0f;
    loss() += states.back()(r.x, r.y) * states.back()(r.x, r.y) * 0.5f;
    gradient = propagate_adjoints(loss)(picture);
    gradient.set_estimates({{0, width}, {0, height}});
  }
  std::vector<graph::FuncPtr> funcs() const {
    return graph::topological_order({gradient.function()});
  }
  Buffer<float> found() { return gradient.realize({width, height}); }
  static Func edge(const Func& f) {
    return BoundaryConditions::repeat_edge(f, {{0, width}, {0, height}});
  }
  static constexpr int width = 520, height = 531;
  Var x{"x"}, y{"y"};
  Buffer<float> picture{width, height};
  Func loss{"loss"}, gradient;
};

void expect_adjoints_in_strips(int steps, int least, const Steps::Step& step) {
  Steps scheduled(steps, step), plain(steps, step);
  schedule_by_rules(Pipeline(scheduled.gradient));
  int in_strips = 0;
  for (const graph::FuncPtr& f : scheduled.funcs())
    in_strips += f->made && f->schedule.store_level.kind == graph::LoopLevel::Kind::At;
  EXPECT_GE(in_strips, least);
  for (const graph::FuncPtr& f : plain.funcs()) Func(f).compute_root();
  const Buffer<float> found = scheduled.found(), expected = plain.found();
  for (int py = 0; py < Steps::height; py++) {
    for (int px = 0; px < Steps::width; px++)
      ASSERT_NEAR(found(px, py), expected(px, py), 1e-5f) << px << ", " << py;
  }
}

TEST(StripsOfRows, AreThoseOfTheAdjointsOfAChain) {
  expect_adjoints_in_strips(7, 6, [](const Func& state, const Func&, const Var& x, const Var& y) {
    const Func f = Steps::edge(state);
    return 0.25f * (f(x - 1, y) + f(x + 1, y) + f(x, y - 1) + f(x, y + 1));
  });
  expect_adjoints_in_strips(6, 5, [](const Func& f, const Func&, const Var& x, const Var& y) {
    const Expr sum = 0.2f * (f(x - 1, y) + 2 * f(x, y) + f(x + 1, y) + f(x, y + 1));
    return sum / (1.0f + sum * sum);
  });
}

// The gradient by the image reads the adjoints of all steps. An adjoint outside of its strips would
// be stored as a whole image, and so would all before it.
TEST(StripsOfRows, AreThoseOfAllStepsThatASumReads) {
  expect_adjoints_in_strips(
      14, 13, [](const Func& state, const Func& image, const Var& x, const Var& y) {
        const Func f = Steps::edge(state);
        return 0.25f * (f(x - 1, y) + f(x + 1, y) + f(x, y - 1) + f(x, y + 1) - image(x, y));
      });
}

// Sums down the columns of an image and back up, transposed.
struct TurnedScan {
  explicit TurnedScan(int columns, int rows) {
    RDom down(1, rows - 1);
    sums(x, y, c) = cast<float>((x * 7 + y * 13 + c) % 11);
    sums(x, down, c) = 0.5f * sums(x, down - 1, c) + sums(x, down, c);
    turned(x, y, c) = sums(y, x, c);
    turned.set_estimate(x, 0, rows).set_estimate(y, 0, columns).set_estimate(c, 0, 3);
  }
  graph::LoopLevel place_of_sums() {
    schedule_by_rules(Pipeline(turned));
    return sums.function()->schedule.compute_level;
  }
  Var x{"x"}, y{"y"}, c{"c"};
  Func sums{"sums"}, turned{"turned"};
};

TEST(BlocksOfColumns, RunInTheLoopsOfTheirOnlyReader) {
  TurnedScan scheduled(1100, 900), plain(1100, 900);
  const graph::LoopLevel place = scheduled.place_of_sums();
  ASSERT_EQ(place.kind, graph::LoopLevel::Kind::At);
  EXPECT_EQ(place.func, scheduled.turned.name());
  EXPECT_EQ(place.var, "y");
  const Buffer<float> found = scheduled.turned.realize({900, 75, 2}),
                      expected = plain.turned.realize({900, 75, 2});
  found.for_each_element(
      [&](int px, int py, int pc) { ASSERT_EQ(found(px, py, pc), expected(px, py, pc)); });
}

TEST(BlocksOfColumns, AreNotWhereTheyWouldNotFit) {
  EXPECT_EQ(TurnedScan(1100, 4000).place_of_sums().kind, graph::LoopLevel::Kind::Root);
}

TEST(BlocksOfColumns, AreNotOfSums) {
  Var x("x"), y("y");
  Func means("means"), out("out");
  RDom r(0, 9);
  means(x, y) = 0.0f;
  means(x, y) += cast<float>(x + r) * y;
  out(x, y) = means(y, x);
  out.set_estimate(x, 0, 2000).set_estimate(y, 0, 2000);
  schedule_by_rules(Pipeline(out));
  EXPECT_EQ(means.function()->schedule.compute_level.kind, graph::LoopLevel::Kind::Root);
}

TEST(BlocksOfColumns, AreNotWhereTheScanFits) {
  EXPECT_EQ(TurnedScan(200, 300).place_of_sums().kind, graph::LoopLevel::Kind::Root);
}

TEST(BlocksOfColumns, AreNotWhereSeveralReadThem) {
  TurnedScan program(1100, 900);
  Func both("both");
  both(program.x, program.y, program.c) = program.turned(program.x, program.y, program.c) +
                                          program.sums(program.x, program.y, program.c);
  both.set_estimate(program.x, 0, 900)
      .set_estimate(program.y, 0, 900)
      .set_estimate(program.c, 0, 3);
  program.turned.compute_root();
  schedule_by_rules(Pipeline(both));
  EXPECT_EQ(program.sums.function()->schedule.compute_level.kind, graph::LoopLevel::Kind::Root);
}

TEST_F(BuiltInScheduler, KeepsWhatAUserScheduled) {
  heavy.compute_at(blur, y).vectorize(x, 4);
  blur.compute_root().reorder(y, x);
  const ScheduleLog given = Pipeline(out).schedule_log();
  const std::string source = schedule();
  EXPECT_EQ(source.find("heavy"), std::string::npos) << source;
  EXPECT_EQ(source.find("blur."), std::string::npos) << source;
  EXPECT_EQ(Pipeline(out).schedule_log().first(given.size()), given);
  EXPECT_TRUE(is_at_root(sums));
}

TEST_F(BuiltInScheduler, MovesNothingOutOfTheLoopsThatItNeeds) {
  Func inside("inside"), between("between"), last("last");
  inside(x) = exp(input(x, 0));
  between(x) = exp(inside(x)) * sin(inside(x));
  last(x) = between(x) + between(x + 1) + between(x + 2);
  inside.compute_at(last, x);
  schedule_by_rules(Pipeline(last));
  EXPECT_FALSE(is_at_root(between));
  EXPECT_NO_THROW(Pipeline(last).loop_nest());
}

TEST_F(BuiltInScheduler, LeavesInlineWhatIsReadAtPlacesWithoutBounds) {
  ImageParam place(Int(32), 1, "place");
  Func computed("computed"), read("read");
  computed(x) = exp(cast<float>(x)) * sin(cast<float>(x));
  read(x) = computed(place(x)) + computed(place(x) + 1) + computed(place(x) + 2);
  schedule_by_rules(Pipeline(read));
  EXPECT_FALSE(is_at_root(computed));
  EXPECT_NO_THROW(Pipeline(read).compile_jit());
}

TEST_F(BuiltInScheduler, SaysItAsCpp) {
  std::vector<std::string> levels;
  std::istringstream source(schedule());
  for (std::string line; std::getline(source, line);) {
    if (std::regex_match(line, std::regex("\\w+\\.compute_at\\(.*"))) levels.push_back(line);
  }
  EXPECT_EQ(levels,
            (std::vector<std::string>{
                "heavy.compute_at(LoopLevel::root());", "sums.compute_at(LoopLevel::root());",
                "out.compute_at(LoopLevel::root());", "brighter.compute_at(LoopLevel::inlined());",
                "blur.compute_at(LoopLevel::inlined());"}));
  EXPECT_EQ(schedule(), "") << "nothing is left";
}

TEST_F(BuiltInScheduler, SchedulesGradients) {
  Func loss("loss");
  RDom all(0, 1000);
  loss() = 0.0f;
  loss() += out(all) * out(all);
  Pipeline gradient({propagate_adjoints(loss, {.wrt = {input}})(input)});
  const std::string by_default = gradient.loop_nest();
  gradient.auto_schedule(get_host_target());
  EXPECT_EQ(gradient.loop_nest(), by_default);
}

TEST_F(BuiltInScheduler, UnscheduledGradientsStaySo) {
  Func loss("loss");
  RDom all(0, 1000);
  loss() = 0.0f;
  loss() += out(all) * out(all);
  Pipeline gradient({propagate_adjoints(loss, {.wrt = {input}})(input)});
  EXPECT_FALSE(names_in_nest(gradient.loop_nest(), "parallel").empty());
  gradient.unscheduled();
  EXPECT_EQ(names_in_nest(gradient.loop_nest(), "parallel"), std::vector<std::string>());
}

}  // namespace
}  // namespace retrograde
