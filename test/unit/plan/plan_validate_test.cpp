// Each invariant, with plans that break just this one.
#include <gtest/gtest.h>

#include <functional>

#include "support/errors.h"
#include "unit/plan/plan_testing.h"

namespace retrograde::planning {
namespace {

struct PlanInvariants : ::testing::Test {
  PlanInvariants() {
    blur(x, y) = x + y;
    sum(x, y) = 0;
    sum(x, y) += blur(x + r.x, y + r.y);
    next(x, y) = sum(x, y);
    next(x, s) = next(x, s - 1) * 2 + next(x, s);
    out(x, y) = next(x, y);
    program = make_program(functions({out}));
  }
  // Only this Func's line or lines change.
  std::string broken(const std::string& text) {
    return graph::without_numbers(broken_invariant(parsed(text, program)));
  }
  // The second loop of out, y:8, y, x:16, x.
  std::string broken_nest(const std::function<void(Nest&)>& change) {
    Plan plan = parsed("out  root  y:8, y, x:16, x\n", program);
    FuncPlan changed = *plan.funcs.back();
    change(changed.nests[0]);
    plan.funcs.back() = std::make_shared<FuncPlan>(changed);
    return graph::without_numbers(broken_invariant(plan));
  }
  Var x{"x"}, y{"y"};
  RDom r{0, 5, 0, 5, "r"}, s{1, 20, "s"};
  Func blur{"blur"}, sum{"sum"}, next{"next"}, out{"out"};
  ProgramPtr program;
};

TEST_F(PlanInvariants, HoldForLegalPlans) {
  EXPECT_EQ(broken("out  root  parallel y:8, x:16, y, vector x\n"
                   "next  at out/y:8\n"
                   "  .1  s.x, x\n"
                   "sum  at next.0/y\n"
                   "  .1  y, x:4, r.x, r.y, vector x\n"
                   "blur  at sum.1/r.x\n"),
            "");
}

TEST_F(PlanInvariants, P1StepsDecreaseToOne) {
  EXPECT_EQ(broken_nest([](Nest&) {}), "");
  EXPECT_EQ(broken_nest([](Nest& n) { n.loops[1].step = 8; }),
            "P1: two loops over \"y\" of \"out\" have step 8; steps decrease");
  EXPECT_EQ(broken_nest([](Nest& n) { n.loops[1].step = 2; }),
            "P1: the smallest step over \"y\" of \"out\" is 2, not 1");
  EXPECT_EQ(broken_nest([](Nest& n) { n.loops.pop_back(); }),
            "P1: the smallest step over \"x\" of \"out\" is 16, not 1");
  EXPECT_EQ(broken_nest([](Nest& n) { n.loops.resize(2); }),
            "P1: no loop runs over \"x\" of \"out\"");
  EXPECT_EQ(broken_nest([](Nest& n) { n.loops[1].tail = TailStrategy::RoundUp; }),
            "P1: the loop over \"y\" of \"out\" with step 1 has a tail");
  EXPECT_EQ(broken_nest([](Nest& n) { n.loops[1].iterator = 7; }),
            "P1: loop 1 of \"out\" runs over no iterator of the stage");
  EXPECT_EQ(
      broken_nest([](Nest& n) { n.loops.push_back({{once}}); }),
      "P1: loop 4 of \"out\" runs once, but is not the outermost one over blocks of a device");
  EXPECT_EQ(broken_nest([](Nest& n) {
              n.loops.insert(n.loops.begin(), {{1, 12, true}});
            }),
            "P1: step 12 over \"y\" of \"out\" is in blocks of 8, which do not divide it");
  EXPECT_EQ(broken_nest([](Nest& n) {
              n.fusions.push_back({{0, 2}, {1, 2}});
            }),
            "P1: no loop runs over two loops that run as one of \"out\"");
}

TEST_F(PlanInvariants, P2ReadsAreInsideOfTheComputeLoop) {
  EXPECT_EQ(broken("next  root\nsum  at out/y\n"),
            "P2: \"sum\" is computed at \"out/y\", but \"next\" reads it outside of that loop");
  EXPECT_EQ(broken("out  root\nnext  at out/y\nsum  at out/x\n"),
            "P2: \"sum\" is computed at \"out/x\", but \"next\" reads it outside of that loop");
  EXPECT_EQ(broken("out  root\nnext  at out/x\nsum  at out/y\n"), "");
  EXPECT_EQ(broken("out  root\nsum  inline\nnext  at out/x\nblur  at out/y\n"), "");
  EXPECT_EQ(
      broken("out  root\nnext  root\nsum  root\nblur  at sum.0/y\n"),
      "P2: \"blur\" is computed at \"sum.0/y\", but \"sum.update(0)\" reads it outside of that "
      "loop");
  EXPECT_EQ(broken("out  root\nnext  root\nsum  root\n  .1  shared with sum.0/y  y, x, r.y, r.x\n"
                   "blur  at sum.0/y\n"),
            "");
  EXPECT_EQ(broken("out  root\nnext  root\nsum  root\nblur  at each sum.0/y\n"), "");
  // Loops alike at different depths.
  EXPECT_EQ(broken("out  root\nnext  root\nsum  root\n  .0  x, y\n  .1  y, x, r.y, r.x\n"
                   "blur  at each sum.0/y\n"),
            "");
  Plan plan = parsed("out  root\n", program);
  FuncPlan lost = *plan.funcs[0];
  lost.placement.compute = {Level::Kind::At, {{3, 0}, 9}};
  plan.funcs[0] = std::make_shared<FuncPlan>(lost);
  EXPECT_EQ(graph::without_numbers(broken_invariant(plan)),
            "P2: \"blur\" is placed at a loop that does not exist");
}

TEST_F(PlanInvariants, P3TheStoreLoopEnclosesTheComputeLoop) {
  EXPECT_EQ(broken("out  root\nnext  at out/x  store at out/y\n"), "");
  EXPECT_EQ(
      broken("out  root\nnext  at out/y  store at out/x\n"),
      "P3: \"next\" is stored at \"out/x\", which is not around the place where it is computed");
  EXPECT_EQ(
      broken("out  root  y, parallel x\nnext  at out/x  store at out/y\n"),
      "P3: between the loops where \"next\" is stored and computed, \"out/x\" runs in parallel");
  EXPECT_EQ(broken("out  root  parallel y, x\nnext  at out/x  store at out/y\n"), "");
  EXPECT_EQ(
      broken("out  root  parallel y, x\nnext  at out/x  store root\n"),
      "P3: between the loops where \"next\" is stored and computed, \"out/y\" runs in parallel");
  EXPECT_EQ(broken("out  root\nnext  at out/x\nsum  at next.0/y  store at out/x\n"), "");
  EXPECT_EQ(broken("out  root\nnext  at out/x\n  .0  parallel y, x\n"
                   "sum  at next.0/y  store at out/x\n"),
            "P3: between the loops where \"sum\" is stored and computed, \"next.0/y\" runs in "
            "parallel");
}

TEST_F(PlanInvariants, P4OneLoopRunsOverLanes) {
  EXPECT_EQ(broken("out  root  vector y:8, y, x\n"), "");
  EXPECT_EQ(broken("out  root  x:16, y:8, vector y, vector x\n"),
            "P4: \"out/x\" is the second loop over lanes of \"out\"");
  EXPECT_EQ(broken("out  root  y, x:8, vector x\nnext  at out/x\n"),
            "P4: \"next\" is computed at \"out/x\", inside of the loop over lanes \"out/x\"");
  Func long_sum("long_sum");
  Param<int> size("size");
  RDom k(0, size, "k");
  long_sum(x) = 0;
  long_sum(x) += blur(x, k);
  const Plan plan = parsed("long_sum  root\n  .1  atomic  x, vector k.x\n", {long_sum});
  EXPECT_EQ(graph::without_numbers(broken_invariant(plan)),
            "P4: \"long_sum.1/k.x\" runs over lanes, but its extent is not constant");
}

TEST_F(PlanInvariants, P5DependencesAreKept) {
  expect_mentions(broken("next  root\n  .1  x, parallel s.x\n"),
                  {"P5: ", "next.update(0)", "must not touch the same element"});
  EXPECT_EQ(broken("next  root\n  .1  s.x, parallel x\n"), "");
  EXPECT_EQ(broken("sum  root\n  .1  r.x, r.y, y, x\n"), "") << "sums commute";
  expect_mentions(broken("sum  root\n  .1  y, x, r.y, vector r.x\n"), {"P5: ", "sum.update(0)"});
  EXPECT_EQ(broken("sum  root\n  .1  atomic  y, x, r.y, vector r.x\n"), "");
}

TEST_F(PlanInvariants, P7StagesThatShareLoopsCanRunTogether) {
  Func a("a"), b("b"), after_a("after_a"), after_b("after_b"), last("last");
  for (Func* f : {&a, &b}) {
    (*f)(x, y) = 0;
    (*f)(x, y) += x + r.x;
  }
  after_a(x, y) = a(x, y);
  after_b(x, y) = b(x, y);
  last(x, y) = after_a(x, y) + after_b(x, y);
  program = make_program(functions({last}));
  const std::string with_b = "a  root\n  .1  shared with b.1/y  ", sums = "r.x, r.y\nb  root\n",
                    at_root = "after_a  root\nafter_b  root\n";
  EXPECT_EQ(broken(at_root + with_b + "y, x, " + sums), "");
  EXPECT_EQ(broken(at_root + with_b + "parallel y, x, " + sums),
            "P7: \"a.update(0)\" shares the loops of \"b.update(0)\", but has none of that kind");
  EXPECT_EQ(broken("last  root\nafter_a  root\nafter_b  at last/y\na  root\n"
                   "  .1  shared with b.1/y  y, x, r.x, r.y\nb  at last/y\n"),
            "P7: \"a.update(0)\" shares the loops of \"b.update(0)\", but is computed elsewhere");
  EXPECT_EQ(
      broken(at_root + "a  root\n  .0  shared with b.1/y  y, x\n  .1  shared with b.1/y  y, x, " +
             sums),
      "P7: stages of one Func would not run in their order");
  const std::string depends = "P7: of Funcs that run together, one depends on another";
  EXPECT_EQ(broken("after_a  root  shared with a.1/y  y, x\nafter_b  root\na  root\nb  root\n"),
            depends);
  EXPECT_EQ(broken("after_a  root  shared with b.0/y  y, x\nafter_b  root\n"
                   "a  root  \n  .0  shared with after_b/y  y, x\nb  root\n"),
            depends)
      << "each runs before what the other one reads";
  EXPECT_EQ(broken(at_root + "a  root\n  .0  shared with b.0/y  y, x\nb  root\n"
                             "  .0  shared with a.0/y  y, x\n"),
            "P7: \"a\" shares the loops of \"b\", but shares its own, through others");
}

TEST_F(PlanInvariants, BrokenOnesAreBugs) {
  expect_error<InternalError>({"a plan keeps its invariants", "P4"}, [&] {
    validate(parsed("out  root  x:16, y:8, vector y, vector x\n", program));
  });
}

}  // namespace
}  // namespace retrograde::planning
