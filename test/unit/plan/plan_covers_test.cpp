// The points that pieces of nests cover, and the boxes of Funcs that are computed in loops.
#include <gtest/gtest.h>

#include "autoschedule/plan/covers.h"
#include "frontend/language/integer_ops.h"
#include "unit/plan/plan_testing.h"

namespace retrograde::planning {
namespace {

struct PlanCovers : ::testing::Test {
  // The cover inside of each loop of a Func's stage, outermost first; the first one is that of all loops.
  std::vector<Cover> covers(const std::vector<Func>& outputs, const std::string& text,
                            const Func& f, int stage = 0) {
    const Plan plan = parsed(text, outputs);
    EXPECT_EQ(broken_invariant(plan), "");
    const AccessGraph graph(functions(outputs));
    const SizeModel sizes(graph, {1000});
    const StageId id{graph.find(f.function().get()), static_cast<int16_t>(stage)};
    std::vector<Cover> result;
    for (int d = around_all_loops; d < static_cast<int>(plan.nest(id).loops.size()); ++d)
      result.push_back(cover_inside(plan, id, d, sizes));
    return result;
  }
  using Covers = std::vector<Cover>;
  Var x{"x"}, y{"y"};
};

TEST_F(PlanCovers, FollowSteps) {
  Func out("out");
  out(x, y) = x + y;
  out.bound(x, 0, 100).bound(y, 0, 60);
  EXPECT_EQ(covers({out}, "out  root  y, x\n", out), (Covers{{100, 60}, {100, 1}, {1, 1}}));
  EXPECT_EQ(covers({out}, "out  root  parallel y:8, x:16, y, vector x\n", out),
            (Covers{{100, 60}, {100, 8}, {16, 8}, {16, 1}, {1, 1}}));
  EXPECT_EQ(covers({out}, "out  root  y, x:200, x\n", out),
            (Covers{{100, 60}, {100, 1}, {100, 1}, {1, 1}}));
  EXPECT_EQ(covers({out}, "out  root  y, x:16, x:5, x\n", out),
            (Covers{{100, 60}, {100, 1}, {16, 1}, {5, 1}, {1, 1}}));
  EXPECT_EQ(covers({out}, "out  root  x%8, y, x:8\n", out),
            (Covers{{100, 60}, {13, 60}, {13, 1}, {1, 1}}))
      << "a loop over remainders";
}

TEST_F(PlanCovers, FollowFusedLoops) {
  Func out("out");
  out(x, y) = x + y;
  out.bound(x, 0, 16).bound(y, 0, 60);
  EXPECT_EQ(covers({out}, "out  root  (x y):4, (x y)\n", out), (Covers{{16, 60}, {4, 1}, {1, 1}}));
  EXPECT_EQ(covers({out}, "out  root  (x y):32, (x y)\n", out),
            (Covers{{16, 60}, {16, 2}, {1, 1}}));
  EXPECT_EQ(covers({out}, "out  root  (x:4 y:6):8, (x:4 y:6), y, x\n", out),
            (Covers{{16, 60}, {16, 12}, {4, 6}, {4, 1}, {1, 1}}));
}

TEST_F(PlanCovers, HoldAllPointsThatOneIterationUpdates) {
  Func out("out");
  RDom r(0, 20, 0, 10, "r");
  out(x, y) = 0;
  out(x, 2 * r.x + scatter(0, 1)) = out(x, 2 * r.x + gather(1, 0)) + r.y;
  out.bound(x, 0, 16).bound(y, 0, 60);
  EXPECT_EQ(covers({out}, "out  root\n  .1  (r.x r.y):4, x, (r.x r.y)\n", out, 1),
            (Covers{{16, 20, 10, 2}, {16, 4, 1, 2}, {1, 4, 1, 2}, {1, 1, 1, 2}}));
}

TEST_F(PlanCovers, OfADimensionWithABoundAreAllOfIt) {
  Func rows("rows"), out("out");
  rows(x, y) = x + y;
  out(x, y) = rows(x, y) + rows(x + 1, y);
  out.bound(x, 0, 100).bound(y, 0, 60);
  const std::string plan = "out  root  y:8, x:16, y, x\nrows  at out/x:16  y, x\n";
  EXPECT_EQ(covers({out}, plan, rows)[0], (Cover{17, 8}));
  rows.bound(x, 0, 101).align_bounds(y, 5);
  EXPECT_EQ(covers({out}, plan, rows)[0], (Cover{101, 10}));
}

TEST_F(PlanCovers, OfAFuncInALoopAreThePointsThatItsConsumersNeed) {
  Func rows("rows"), blur("blur"), out("out");
  rows(x, y) = x + y;
  blur(x, y) = rows(x, y - 1) + rows(x, y + 1);
  out(x, y) = blur(x, y) + blur(x + 1, y);
  out.bound(x, 0, 128).bound(y, 0, 64);
  const std::string placed =
      "out  root  y:8, x:16, y, x\n"
      "blur  at out/x:16  y, x:4, x\n"
      "rows  at out/y:8\n";
  EXPECT_EQ(covers({out}, placed, blur), (Covers{{17, 8}, {17, 1}, {4, 1}, {1, 1}}));
  EXPECT_EQ(covers({out}, placed, rows), (Covers{{129, 10}, {129, 1}, {1, 1}}))
      << "in all iterations of x:16";
  const std::string inlined =
      "out  root  y:8, x:16, y, x\n"
      "blur  inline\n"
      "rows  at out/x:16\n";
  EXPECT_EQ(covers({out}, inlined, rows), (Covers{{17, 10}, {17, 1}, {1, 1}}));
  const std::string inner =
      "out  root  y:8, x:16, y, x\n"
      "blur  at out/x:16  x, y\n"
      "rows  at blur/x\n";
  EXPECT_EQ(covers({out}, inner, rows), (Covers{{1, 10}, {1, 1}, {1, 1}}));
}

TEST_F(PlanCovers, HoldTheReadsOfAllConsumers) {
  Func rows("rows"), left("left"), right("right"), out("out");
  rows(x, y) = x + y;
  left(x, y) = rows(x - 3, y);
  right(x, y) = rows(2 * x, y) + rows(2 * x + 1, y);
  out(x, y) = left(x, y) + right(x / 2, y);
  out.bound(x, 0, 128).bound(y, 0, 64);
  EXPECT_EQ(covers({out}, "out  root  y, x:16, x\nrows  at out/x:16\n", rows),
            (Covers{{19, 1}, {19, 1}, {1, 1}}))
      << "from x - 3 to x + 15";
  Func all("all"), same("same"), twice("twice"), both("both");
  all(x, y) = x + y;
  same(x, y) = all(x, y);
  twice(x, y) = all(x, 2 * y);
  both(x, y) = same(x, y) + twice(x, y);
  both.bound(x, 0, 128).bound(y, 0, 64);
  EXPECT_EQ(covers({both}, "both  root\nall  at both/y\n", all)[0], (Cover{128, 64}))
      << "in the last row, from 63 to 126";
}

TEST_F(PlanCovers, HoldWhatUpdatesAccess) {
  Func places("places"), bins("bins"), scan("scan"), out("out");
  RDom r(0, 50, "r"), s(1, 19, "s");
  places(x) = (x * 7) % 30;
  bins(x, y) = 0;
  bins(clamp(places(r.x), 0, 29), y) += 1;
  scan(x, y) = x + y;
  scan(x, s.x) = scan(x, s.x - 1) + places(x + s.x);
  out(x, y) = bins(clamp(x, 0, 29), y) + scan(x, y);
  out.bound(x, 0, 128).bound(y, 0, 20);
  const std::string placed =
      "out  root  y, x:16, x\n"
      "scan  at out/x:16\n"
      "bins  at out/x:16\n"
      "places  at out/y\n";
  EXPECT_EQ(covers({out}, placed, bins)[0], (Cover{30, 1})) << "not 16";
  EXPECT_EQ(covers({out}, placed, bins, 1)[0], (Cover{1, 50}));
  EXPECT_EQ(covers({out}, placed, scan, 1)[0], (Cover{16, 19}));
  EXPECT_EQ(covers({out}, placed, scan)[0], (Cover{16, 20}));
}

TEST_F(PlanCovers, ReachToWhereUpdatesStand) {
  Func rows("rows"), out("out");
  rows(x, y) = x + y;
  rows(x, 3) += 1;
  out(x, y) = rows(x, y);
  out.bound(x, 0, 128).bound(y, 0, 64);
  const std::string placed =
      "out  root  y, x:16, x\n"
      "rows  at out/x:16\n";
  EXPECT_EQ(covers({out}, placed, rows)[0], (Cover{16, 61})) << "in row 63, rows 3 to 63";
  EXPECT_EQ(covers({out}, placed, rows, 1)[0], (Cover{16}));
}

TEST_F(PlanCovers, FollowLoopsThatStagesShare) {
  Func rows("rows"), sum("sum"), out("out");
  RDom r(0, 4, 0, 3, "r");
  rows(x, y) = x + y;
  sum(x, y) = rows(x, y);
  sum(x, y) += rows(x + r.x, y + r.y);
  out(x, y) = sum(x, y);
  out.bound(x, 0, 128).bound(y, 0, 64);
  EXPECT_EQ(covers({out},
                   "out  root\n"
                   "sum  root\n"
                   "  .1  shared with sum.0/y  y, x, r.y, r.x\n"
                   "rows  at sum.0/y\n",
                   rows)[0],
            (Cover{131, 3}));
  EXPECT_EQ(covers({out}, "out  root\nsum  root\nrows  at each sum.0/y\n", rows)[0],
            (Cover{131, 3}));
}

}  // namespace
}  // namespace retrograde::planning
