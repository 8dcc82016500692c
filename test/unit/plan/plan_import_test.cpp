// Directives as plans, and back.
#include <gtest/gtest.h>

#include "frontend/data/param.h"
#include "unit/plan/plan_testing.h"

namespace retrograde::planning {
namespace {

struct PlanImport : ::testing::Test {
  PlanImport() {
    producer(x, y) = x + y;
    out(x, y) = producer(x - 1, y) + producer(x + 1, y + 1);
  }
  Var x{"x"}, y{"y"}, xo{"xo"}, xi{"xi"}, xv{"xv"}, yo{"yo"}, yi{"yi"}, t{"t"}, to{"to"}, ti{"ti"};
  Func producer{"producer"}, out{"out"};
};

TEST_F(PlanImport, AProgramWithoutDirectivesIsUndecided) {
  expect_plan({out}, "out  undecided\nproducer  undecided\n");
  EXPECT_TRUE(imported({out}) == undecided_plan(make_program(functions({out}))));
  EXPECT_EQ(emitted_log(imported({out})), "");
}

TEST_F(PlanImport, SplitsAreSteps) {
  out.compute_root().split(x, x, xi, 32, TailStrategy::GuardWithIf).split(y, y, yi, 8);
  out.split(xi, xi, xv, 16).reorder(xv, xi, yi, x, y).vectorize(xv).unroll(xi).parallel(y);
  expect_plan({out},
              "out  root  parallel y:8, x:32 GuardWithIf, y, unroll x:16, vector x\n"
              "producer  undecided\n");
}

TEST_F(PlanImport, TheOrderOfSplitsOfOneIteratorIsKept) {
  out.compute_root().split(x, x, xi, 16, TailStrategy::GuardWithIf).split(x, xo, x, 4);
  expect_plan({out},
              "out  root  y, x:4*16, x:16 GuardWithIf, x\n"
              "producer  undecided\n");
  EXPECT_EQ(emitted_log(imported({out})),
            "out.split(x, x, x_2, 16, GuardWithIf)\n"
            "out.split(x, x, x_1, 4, Auto)\n"
            "out.compute_at(root)\n");
}

TEST_F(PlanImport, AnInnerLoopOutsideRunsOverRemainders) {
  out.compute_root().split(x, xo, xi, 2).split(xo, xo, xv, 16).reorder(xv, xo, y, xi).unroll(xi);
  expect_plan({out},
              "out  root  unroll x%2, y, x:16*2, x:2\n"
              "producer  undecided\n");
}

TEST_F(PlanImport, FusedLoopsAreIterators) {
  out.compute_root().split(x, xo, xi, 8, TailStrategy::RoundUp).fuse(xo, y, t);
  out.split(t, to, ti, 4).parallel(to);
  expect_plan({out},
              "out  root  parallel (x:8 RoundUp y):4, (x:8 RoundUp y), x\n"
              "producer  undecided\n");
}

TEST_F(PlanImport, PlacesAreLoopsByTheirSteps) {
  out.compute_root().split(y, yo, yi, 8).split(x, x, xi, 16);
  producer.compute_at(out, x).store_at(out, yo).hoist_storage(retrograde::LoopLevel::root());
  producer.store_in(MemoryType::Stack).reorder_storage(y, x).fold_storage(y, 4, false);
  expect_plan({out},
              "out  root  y:8, y, x:16, x\n"
              "producer  at out/x:16  store at out/y:8  hoist root  stack  (y, x)  fold y by 4 "
              "backward\n");
}

TEST_F(PlanImport, UpdatesHaveLinesOfTheirOwn) {
  Func sum("sum");
  RDom r(0, 100, "r");
  sum(x) = 0;
  sum(x) += out(x, r);
  RVar ro("ro"), ri("ri");
  sum.compute_root().update().split(r, ro, ri, 8).atomic().vectorize(ri).reorder(ri, x, ro);
  out.compute_at(sum, x).store_root();
  producer.compute_at(retrograde::LoopLevel(sum, ro, 1));
  expect_plan({sum},
              "sum  root\n"
              "  .1  atomic  r.x:8, x, vector r.x\n"
              "out  at each sum.0/x  store root\n"
              "producer  at sum.1/r.x:8\n");
}

// The Func that rfactor makes has an order of loops, but no directives.
TEST_F(PlanImport, FactoredFuncsAreScheduled) {
  Func sum("sum");
  RDom r(0, 8, 0, 8, "r");
  Var u("u");
  sum() = 0;
  sum() += out(r.x, r.y);
  sum.compute_root();
  Func parts = sum.update().rfactor(r.x, u);
  const Plan plan = imported({sum});
  const std::string text = plain_text(plan);
  EXPECT_NE(text.find("sum_intm  inline\n  .1  r.y, u\n"), std::string::npos) << text;
  EXPECT_EQ(to_text(import_plan(emit_plan(plan))), to_text(plan));
}

// While each has one loop, both orders are proven to keep that of all dependences.
TEST_F(PlanImport, ReductionVariablesAreOrderedBeforeTheyAreSplit) {
  Func table("table");
  RDom r(1, 20, 1, 20, "r");
  RVar ro("ro"), ri("ri");
  table(x, y) = x + y;
  table(r.x, r.y) = table(r.x - 1, r.y) * table(r.x, r.y - 1);
  table.compute_root().update().reorder(r.y, r.x).split(r.y, ro, ri, 4);
  expect_plan({table}, "table  root\n  .1  r.x, r.y:4, r.y\n");
}

TEST_F(PlanImport, LoopFusionNamesTheLoopsOfTheOther) {
  Func other("other"), both("both");
  Var u("u"), v("v"), row("row");
  other(u, v) = u - v;
  both(x, y) = out(x, y) + other(y, x);
  out.compute_root().split(x, x, xi, 8).rename(y, row).parallel(row);
  other.compute_root().rename(v, row).parallel(row).compute_with(out, row,
                                                                 LoopAlignStrategy::AlignEnd);
  expect_plan({both},
              "both  undecided\n"
              "other  root  shared with out/y  parallel v AlignEnd, u\n"
              "out  root  parallel y, x:8, x\n"
              "producer  undecided\n");
}

TEST_F(PlanImport, RacesAndVouchedUpdates) {
  Func careless("careless"), trusted("trusted"), careful("careful");
  RDom r(0, 100, "r");
  for (Func f : {careless, trusted, careful}) {
    f(x) = 0;
    f(r % 7) = f(r % 7) * 2 + r;
    f.compute_root();
  }
  careless.update().allow_race_conditions().parallel(r);
  trusted.update().atomic(true).parallel(r);
  careful.update().atomic().allow_race_conditions().parallel(r);
  expect_plan({careless, trusted, careful},
              "careful  root\n"
              "  .1  atomic_racing  parallel r.x\n"
              "trusted  root\n"
              "  .1  vouched  parallel r.x\n"
              "careless  root\n"
              "  .1  racing  parallel r.x\n");
}

TEST_F(PlanImport, OutputsWithDirectivesAreAtRootAndOtherFuncsInlined) {
  out.parallel(y);
  producer.store_in(MemoryType::Heap);
  expect_plan({out}, "out  root  parallel y, x\nproducer  inline  heap\n");
}

TEST_F(PlanImport, DirectivesAboutSizesStayWithTheFunc) {
  out.compute_root().bound(x, 0, 64).set_estimate(y, 0, 100).align_storage(x, 16);
  expect_plan({out}, "out  root\nproducer  undecided\n");
  EXPECT_EQ(emitted_log(imported({out})),
            "out.bound(x, 0, 64)\n"
            "out.set_estimate(y, 0, 100)\n"
            "out.align_storage(x, 16)\n"
            "out.compute_at(root)\n");
}

// A nest as `run` leaves it, and the reason why a plan cannot express it.
struct OpaqueCase {
  const char* reason;
  void (*run)(Func& f, const Var& x, const Var& y);
};
void PrintTo(const OpaqueCase& c, std::ostream* out) { *out << c.reason; }

class OpaqueFuncs : public ::testing::TestWithParam<OpaqueCase> {};

TEST_P(OpaqueFuncs, KeepTheirDirectivesAndLearnNewNames) {
  Var x("x"), y("y"), yo("yo"), yi("yi");
  Func producer("producer"), out("out");
  producer(x, y) = x + y;
  out(x, y) = producer(x, y) + producer(x + 1, y);
  out.compute_root().split(y, yo, yi, 8);
  producer.compute_at(out, yo);
  GetParam().run(producer, x, y);
  expect_plan({out}, std::string("out  root  y:8, y, x\nproducer  at out/y:8  opaque ") +
                         GetParam().reason + "\n");
  const std::string log = emitted_log(imported({out}));
  EXPECT_NE(log.find("producer.compute_at(loop(out, y, 0))"), std::string::npos) << log;
}

const Var xo("xo"), xi("xi");
Param<int> size("size");
const OpaqueCase opaque_cases[] = {
    {"async", [](Func& f, const Var&, const Var&) { f.async(); }},
    {"memoize", [](Func& f, const Var&, const Var&) { f.memoize(); }},
    {"ring", [](Func& f, const Var&, const Var&) { f.ring_buffer(2); }},
    {"specialize", [](Func& f, const Var&, const Var&) { f.specialize(size > 3); }},
    {"partition", [](Func& f, const Var& x, const Var&) { f.partition(x, Partition::Never); }},
    {"symbolic_factor", [](Func& f, const Var& x, const Var&) { f.split(x, xo, xi, size); }},
    {"symbolic_fold", [](Func& f, const Var&, const Var& y) { f.fold_storage(y, size); }},
    {"split_history", [](Func& f, const Var& x, const Var&) { f.split(x, xo, xi, 1); }},
    {"split_history",
     [](Func& f, const Var& x, const Var&) { f.split(x, xo, xi, 8).split(xi, xi, Var("xj"), 8); }},
    // x:64, x:16, x:4: the step of 16 is the last, but the step of 4 is before that of 64.
    {"split_history", [](Func& f, const Var& x, const Var&) {
       f.split(x, xo, xi, 4).split(xo, xo, Var("xj"), 16).split(Var("xj"), Var("xk"), Var("xl"), 4);
     }}};
INSTANTIATE_TEST_SUITE_P(Reasons, OpaqueFuncs, ::testing::ValuesIn(opaque_cases));

TEST_F(PlanImport, PrefetchesStay) {
  producer.compute_root();
  out.compute_root().split(y, y, yi, 4).prefetch(producer, y, y, 2);
  expect_plan({out}, "out  root  opaque prefetch\nproducer  root\n");
}

TEST_F(PlanImport, HostsOfOpaqueFuncsKeepTheNamesOfTheirLoops) {
  Func other("other"), both("both");
  other(x, y) = x - y;
  both(x, y) = out(x, y) + other(x, y);
  out.compute_root().split(y, yo, yi, 8);
  other.compute_root().split(y, yo, yi, 8).partition(x, Partition::Always).compute_with(out, yo);
  producer.compute_at(out, yi);
  expect_plan({both},
              "both  undecided\n"
              "other  root  opaque partition\n"
              "out  root  opaque shared_loops\n"
              "producer  at out/yi\n");
}

TEST_F(PlanImport, LoopsThatOnlyASpecializationHas) {
  out.compute_root().specialize(size > 3).split(y, yo, yi, 8);
  producer.compute_at(out, yo);
  expect_plan({out}, "out  root  opaque specialize\nproducer  undecided  opaque unknown_loop\n");
}

TEST_F(PlanImport, LoopsOfSeveralStagesMustBeAlike) {
  Func twice("twice");
  twice(x, y) = out(x, y);
  twice(x, y) += out(x + 1, y);
  twice.compute_root().split(y, t, yi, 8);
  twice.update().split(y, yo, yi, 4).split(yo, t, yo, 4);
  out.compute_at(twice, t);
  EXPECT_NE(plain_text(imported({twice})).find("out  at each twice.0/y:8"), std::string::npos);
  Func other("other");
  other(x, y) = out(x, y);
  other(x, y) += out(x + 1, y);
  other.compute_root().rename(x, t);
  other.update().rename(y, t);
  out.compute_at(other, t);
  EXPECT_NE(plain_text(imported({other})).find("out  undecided  opaque different_loops"),
            std::string::npos);
}

// The directives that a program has after its plan was changed.
std::string changed_log(const std::vector<Func>& outputs, const std::string& text) {
  const Plan kept = imported(outputs);
  const Plan changed = parsed(text, kept.program);
  const std::vector<graph::FuncPtr> emitted = emit_changes(changed, kept);
  EXPECT_EQ(plain_text(import_plan(emitted)), text);
  return graph::without_numbers(graph::schedule_log(emitted).to_text());
}

TEST_F(PlanImport, FuncsThatRunAsBeforeKeepTheirDirectives) {
  Func sum("sum"), all("all");
  RDom r({{0, 64}, {0, 4}}, "r");
  Var u("u");
  RVar ro("ro"), ri("ri");
  out.compute_root();
  sum(x) = 0;
  sum(x) += out(x, r.x) * r.y;
  sum.compute_root();
  sum.update().split(r.x, ro, ri, 8);
  Func parts = sum.update().rfactor(ro, u);
  parts.compute_root().split(x, xo, xi, 8);
  all(x) = sum(x);
  producer.compute_at(out, y);
  const std::string before = plain_text(imported({all}));
  const std::string after =
      std::regex_replace(before, std::regex("out  root"), "out  root  parallel y:8, y, x");
  ASSERT_NE(before, after);
  EXPECT_EQ(changed_log({all}, after),
            "sum.compute_at(root)\n"
            "sum.update(0).split(r.x, ro, ri, 8, Auto)\n"
            "sum.update(0).rfactor(sum_intm, ro, u)\n"
            "sum_intm.compute_at(root)\n"
            "sum_intm.split(x, xo, xi, 8, Auto)\n"
            "out.split(y, y, y_1, 8, Auto)\n"
            "out.run(y, Parallel)\n"
            "out.compute_at(root)\n"
            "producer.compute_at(loop(out, y_1, 0))\n");
}

// A sum of sums, with an rfactor between two other directives of its stage.
std::vector<Func> factored(bool scheduled) {
  Var x("x"), u("u"), v("v");
  RVar lane("lane"), row("row"), block("block");
  Func data("data"), sum("sum");
  RDom r({{0, 64}, {0, 40}}, "r");
  data(x) = x * x;
  sum(x) = 0;
  sum(x) += data(x + r.x) * r.y;
  if (!scheduled) return {sum};
  data.compute_root();
  sum.compute_root().update().split(r.x, r.x, lane, 16).reorder(lane, r.y, r.x);
  Func parts = sum.update().rfactor({{lane, u}, {r.y, v}});
  parts.compute_root().parallel(v).update().parallel(v).vectorize(u);
  sum.update().split(r.y, r.y, block, 8);
  Func blocks = sum.update().rfactor({{lane, u}, {block, v}});
  blocks.compute_root().vectorize(u, 16);
  return {sum};
}

TEST_F(PlanImport, ChangedFuncsKeepWhatMadeOthers) {
  const std::vector<Func> outputs = factored(true);
  const Plan kept = imported(outputs);
  for (const graph::FuncPtr& f : kept.program->funcs) EXPECT_TRUE(graph::can_reset_loops(*f));
  Plan changed = kept;
  for (std::shared_ptr<const FuncPlan>& func : changed.funcs) {
    FuncPlan own = *func;
    for (Nest& nest : own.nests) {
      ForType& kind = nest.loops.front().kind;
      kind = kind == ForType::Serial ? ForType::Parallel : ForType::Serial;
    }
    func = std::make_shared<const FuncPlan>(own);
  }
  const std::vector<graph::FuncPtr> emitted = emit_changes(changed, kept);
  const std::string text = plain_text(changed);
  EXPECT_EQ(plain_text(import_plan(emitted)), text);
  const ScheduleLog log = graph::schedule_log(emitted);
  EXPECT_EQ(graph::without_numbers(log.first(5).to_text()),
            "sum.update(0).split(r.x, r.x, lane, 16, Auto)\n"
            "sum.update(0).reorder(lane, r.y, r.x)\n"
            "sum.update(0).rfactor(sum_intm, lane, u, r.y, v)\n"
            "sum.update(0).split(r.y, r.y, block, 8, Auto)\n"
            "sum.update(0).rfactor(sum_intm, lane, u, block, v)\n");
  const std::vector<Func> again = factored(false);
  EXPECT_EQ(plain_text(import_plan(graph::with_log(log, {again[0].function()}))), text);
}

TEST_F(PlanImport, FuncsThatShareChangedLoopsChange) {
  Func other("other"), both("both");
  other(x, y) = x - y;
  both(x, y) = out(x, y) + other(x, y);
  out.compute_root().parallel(y);
  other.compute_root().rename(y, t).parallel(t).rename(t, y).compute_with(out, y);
  const std::string before = plain_text(imported({both}));
  const std::string after = std::regex_replace(before, std::regex("parallel y, x"), "y, x:8, x");
  ASSERT_NE(before, after);
  const std::string log = changed_log({both}, after);
  EXPECT_EQ(log.find("rename"), std::string::npos) << log;
}

}  // namespace
}  // namespace retrograde::planning
