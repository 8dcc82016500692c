// The text of plans, their equality and hash.
#include <gtest/gtest.h>

#include <functional>
#include <set>

#include "support/errors.h"
#include "unit/plan/plan_testing.h"

namespace retrograde::planning {
namespace {

struct PlanText : ::testing::Test {
  PlanText() {
    blur(x, y) = x + y;
    sum(x, y) = 0;
    sum(x, y) += blur(x + r.x, y + r.y);
    out(x, y) = sum(x, y) + blur(x, y);
    program = make_program(functions({out}));
  }
  Var x{"x"}, y{"y"};
  RDom r{0, 5, 0, 5, "r"};
  Func blur{"blur"}, sum{"sum"}, out{"out"};
  ProgramPtr program;
};

TEST_F(PlanText, IsReadAndWrittenAlike) {
  const std::string text =
      "out  root  parallel y:8 GuardWithIf, (x:4*16 y):4 RoundUp, (x:4*16 y), x:16 Predicate, "
      "vector x\n"
      "sum  at out/y:8  store root  hoist root  heap  (y, x)  fold y by 16\n"
      "  .0  y, x:8, vector x\n"
      "  .1  shared with sum.0/x:8  vouched  y, x:8 AlignStart, r.y, r.x, vector x\n"
      "blur  at each sum.0/y  register  fold x by 2  fold y by 4 backward\n";
  const Plan plan = parsed(text, program);
  EXPECT_EQ(plain_text(plan), text);
  EXPECT_TRUE(parse_plan(to_text(plan), program) == plan);
  EXPECT_EQ(hash_of(parse_plan(to_text(plan), program)), hash_of(plan));
}

TEST_F(PlanText, LinesMayBeInAnyOrderAndMissing) {
  const Plan plan = parsed("blur  at out/y:8\n\nout root y:8, y, x\n", program);
  EXPECT_EQ(plain_text(plan), "out  root  y:8, y, x\nsum  undecided\nblur  at out/y:8\n");
}

TEST_F(PlanText, NamesLikeWordsAreQuoted) {
  Var vector("vector"), root("root");
  Func odd("odd");
  odd(vector, root) = vector + root;
  odd.compute_root().vectorize(vector).reorder_storage(root, vector);
  expect_plan({odd}, "odd  root  (`root`, `vector`)  `root`, vector `vector`\n");
}

// One program for all, so that no numbers make its names longer.
struct PlanErrors : ::testing::Test {
  static void SetUpTestSuite() {
    Var x("x"), y("y");
    RDom r(0, 5, 0, 5, "r");
    Func soft("soft"), add("add"), now("now");
    soft(x, y) = x + y;
    add(x, y) = 0;
    add(x, y) += soft(x + r.x, y + r.y);
    now(x, y) = add(x, y) + soft(x, y);
    program = make_program(functions({now}));
  }
  static void TearDownTestSuite() { program = nullptr; }
  std::string error(const std::string& text) {
    return error_of([&] { parse_plan(text, program); });
  }
  static ProgramPtr program;
};
ProgramPtr PlanErrors::program;

TEST_F(PlanErrors, ErrorsNameLineAndColumn) {
  expect_mentions(error("now  root\nsun  root\n"),
                  {"line 2, column 1", "a Func of the program must stand here", "sun  root"});
  expect_mentions(error("now  somewhere\n"), {"line 1, column 6", "a place (undecided, inline"});
  expect_mentions(error("now  root  y, z\n"),
                  {"line 1, column 15", "a loop of \"now", "\"x\", \"y\""});
  expect_mentions(error("now  root  y, x:0, x\n"), {"line 1, column 17", "a number of points"});
  expect_mentions(error("now  root  y x\n"), {"line 1, column 14", "a comma or the end"});
  expect_mentions(error("now  root\nnow  root\n"), {"line 2, column 1", "no line above"});
  expect_mentions(error("soft  at now/z\n"), {"line 1, column 14", "a loop of \"now", "\"y\""});
  expect_mentions(error("soft  at add/x\n"), {"line 1, column 10", "a Func and its stage"});
  expect_mentions(error("soft  at add.2/x\n"), {"line 1, column 10", "a Func and its stage"});
  expect_mentions(error("soft  at now y\n"), {"line 1, column 14", "\"/\" and a loop"});
  expect_mentions(error("  .0 x\n"), {"line 1, column 3", "a Func; only those of several stages"});
  expect_mentions(error("add  root\n  .2  x\n"), {"line 2, column 3", "a stage of \"add"});
  expect_mentions(error("add  root\n  .1  shared y\n"), {"line 2, column 14", "\"with\""});
  expect_mentions(error("now  root  (y, y)\n"), {"line 1, column 12", "each once"});
  expect_mentions(error("now  root  (y, z)\n"), {"line 1, column 16", "a dimension of \"now"});
  expect_mentions(error("now  root  fold y 8\n"), {"line 1, column 19", "\"by\""});
  expect_mentions(error("now  root  opaque quirk\n"), {"line 1, column 19", "the reason why"});
  expect_mentions(error("now  root  (x y, x\n"), {"\")\" behind two loops"});
  expect_mentions(error("now  root  `y\n"), {"line 1, column 12", "the second back quote"});
}

TEST_F(PlanErrors, StepsAreWrittenAsTheOtherLoopsSay) {
  expect_mentions(error("now  root  y, x, x:8\n"), {"line 1, column 15", "\"x%8\""});
  expect_mentions(error("now  root  y, x%4, x:8\n"), {"line 1, column 15", "\"x%8\""});
  expect_mentions(error("now  root  y, x:2*8, x:4, x\n"), {"line 1, column 15", "\"x:4*4\""});
  expect_mentions(error("now  root  y, x:2*8\n"), {"line 1, column 15", "without blocks"});
}

// Each change of one field makes another plan, with another hash.
TEST_F(PlanText, PlansDifferInEachField) {
  const Plan plan = parsed("out  root  y:8, y, x:16, x\nblur  at out/y:8\n", program);
  const std::vector<std::function<void(FuncPlan&)>> changes{
      [](FuncPlan& f) { f.placement.compute.kind = Level::Kind::Inline; },
      [](FuncPlan& f) { f.placement.compute.in_each_stage = true; },
      [](FuncPlan& f) { f.placement.compute.loop.depth = 1; },
      [](FuncPlan& f) { f.placement.compute.loop.stage.stage = 1; },
      [](FuncPlan& f) { f.placement.store.kind = Level::Kind::Root; },
      [](FuncPlan& f) { f.placement.hoist.kind = Level::Kind::Root; },
      [](FuncPlan& f) {
        f.storage.order = {1, 0};
      },
      [](FuncPlan& f) {
        f.storage.folds.push_back({1, 4});
      },
      [](FuncPlan& f) {
        f.storage.folds.push_back({1, 4, false});
      },
      [](FuncPlan& f) { f.storage.memory = MemoryType::Stack; },
      [](FuncPlan& f) { f.opacity = Opacity::Async; },
      [](FuncPlan& f) { f.nests[0].concurrency = Concurrency::Atomic; },
      [](FuncPlan& f) {
        f.nests[0].shared_with = LoopRef{{0, 0}, 0};
      },
      [](FuncPlan& f) { f.nests[0].fusions.push_back({}); },
      [](FuncPlan& f) { f.nests[0].loops[0].step = 4; },
      [](FuncPlan& f) { f.nests[0].loops[0].in_blocks = true; },
      [](FuncPlan& f) { f.nests[0].loops[0].tail = TailStrategy::RoundUp; },
      [](FuncPlan& f) { f.nests[0].loops[0].kind = ForType::Parallel; },
      [](FuncPlan& f) { f.nests[0].loops[0].align = LoopAlignStrategy::AlignEnd; },
      [](FuncPlan& f) { std::swap(f.nests[0].loops[0], f.nests[0].loops[1]); }};
  std::set<uint64_t> hashes{hash_of(plan)};
  for (size_t i = 0; i < changes.size(); ++i) {
    FuncPlan changed = *plan.funcs[2];
    changes[i](changed);
    Plan other = plan;
    other.funcs[2] = std::make_shared<FuncPlan>(changed);
    EXPECT_FALSE(other == plan) << "change " << i;
    EXPECT_TRUE(hashes.insert(hash_of(other)).second) << "change " << i;
  }
  Plan same = plan;
  same.funcs[2] = std::make_shared<FuncPlan>(*plan.funcs[2]);
  EXPECT_TRUE(same == plan);
  EXPECT_EQ(hash_of(same), hash_of(plan));
}

TEST_F(PlanText, NestsAndLoopsHaveTextsOfTheirOwn) {
  const Plan plan = parsed("out  root  parallel y:8, x, y\n", program);
  EXPECT_EQ(to_text(plan, StageId{2, 0}), "parallel y:8, x, y");
  EXPECT_EQ(graph::without_numbers(to_text(plan, LoopRef{{2, 0}, 0})), "out/y:8");
  EXPECT_EQ(graph::without_numbers(to_text(plan, LoopRef{{1, 1}, around_all_loops})), "sum.1/once");
}

}  // namespace
}  // namespace retrograde::planning
