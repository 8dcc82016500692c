// Illegal uses of compute_with are rejected before lowering, with messages that give the reason.
#include <gtest/gtest.h>

#include "retrograde/retrograde.h"
#include "support/errors.h"

namespace retrograde {
namespace {

class ComputeWithErrors : public testing::Test {
 protected:
  Var x{"x"}, y{"y"}, z{"z"}, xo{"xo"}, xi{"xi"};
  Func f{"f"}, g{"g"}, out{"out"};

  ComputeWithErrors() {
    f(x, y) = x + y;
    g(x, y) = x * y;
    f.compute_root();
    g.compute_root();
  }

  template <class Kind = CompileError>
  void expect_refused(std::initializer_list<std::string_view> phrases) {
    if (!out.defined()) out(x, y) = f(x, y) + g(x, y);
    expect_mentions(error_of<Kind>([&] { out.realize({8, 8}); }), phrases);
  }
};

TEST_F(ComputeWithErrors, OneReadsTheOther) {
  Func k("k"), h("h");
  k(x, y) = g(x, y) + 1;
  h(x, y) = k(x, y) * 2;
  k.compute_root();
  h.compute_root().compute_with(g, y);
  out(x, y) = h(x, y);
  expect_refused({"do not depend on each other", "which reads \"g"});
}

TEST_F(ComputeWithErrors, GroupsNeedEachOther) {
  Func h("h"), k("k");
  h(x, y) = f(x, y) * 2;
  k(x, y) = g(x, y) + 1;
  h.compute_root();
  k.compute_root();
  h.compute_with(g, y);
  k.compute_with(f, y);
  out(x, y) = h(x, y) + k(x, y);
  expect_refused({"after all that any of it reads", "again", "Drop one"});
}

TEST_F(ComputeWithErrors, InACircle) {
  f.compute_with(g, y);
  g.compute_with(f, y);
  expect_refused({"one of the stages that share loops is the first", "a circle"});
}

TEST_F(ComputeWithErrors, StagesInAnotherOrder) {
  f(x, y) += 1;
  g(x, y) += 2;
  g.compute_with(f.update(), y);
  g.update().compute_with(f, y);
  expect_refused({"one after another", "in the order of both Funcs"});
}

TEST_F(ComputeWithErrors, TwoStagesOfOneFuncInOneNest) {
  g(x, y) += 2;
  g.compute_with(f, y);
  g.update().compute_with(f, y);
  expect_refused({"one after another"});
}

// rule: within one Func, a stage joins the stage before it
TEST_F(ComputeWithErrors, AStageThatIsNotTheOneBefore) {
  f(x, y) += 1;
  f(x, y) *= 2;
  expect_error({"within one Func, a stage joins the stage before it", "update(0)"},
               [&] { f.update(1).compute_with(f, y); });
  expect_error({"Stages of one Func run in their order"}, [&] { f.compute_with(f.update(0), y); });
}

// rule: stages of one Func that share loops touch the same elements in each iteration
TEST_F(ComputeWithErrors, AnUpdateThatReadsOrWritesElsewhere) {
  RDom r(1, 7, "r");
  f(r, y) += 1;
  f(r, y) += f(r - 1, y);
  f.update(1).compute_with(f.update(0), r);
  expect_refused({"touch the same elements in each iteration", "it writes to", "along \"x\""});
}

TEST_F(ComputeWithErrors, TilesOfOtherSizes) {
  f(x, y) += 1;
  f.split(y, y, xo, 4, TailStrategy::GuardWithIf);
  f.update().split(y, y, xi, 8).reorder(x, xi, y).compute_with(f, y);
  expect_refused({"touch the same elements", "split in another way"});
}

TEST_F(ComputeWithErrors, TilesThatOverlap) {
  f(x, y) += 1;
  f.split(y, y, xo, 4, TailStrategy::ShiftInwards);
  f.update().split(y, y, xi, 4).reorder(x, xi, y).compute_with(f, y);
  expect_refused({"touch the same elements", "lets tiles overlap", "GuardWithIf"});
}

TEST_F(ComputeWithErrors, FusedLoopsOfOneFunc) {
  f(x, y) += 1;
  f.fuse(x, y, xo);
  f.update().fuse(x, y, xo).compute_with(f, xo);
  expect_refused({"touch the same elements", "is fused of several"});
}

TEST_F(ComputeWithErrors, AStageBeforeThatIsSpecialized) {
  Param<bool> p("p");
  f(x, y) += 1;
  f.specialize(p);
  f.update().compute_with(f, y);
  expect_refused({"touch the same elements", "specializations"});
}

TEST_F(ComputeWithErrors, OtherPlaces) {
  g.compute_with(f, y);
  g.compute_at(out, y);
  expect_refused({"at the same place", "is computed at \"y\" of \"out", "is computed at root"});
}

// rule: both stages are computed at one place
TEST_F(ComputeWithErrors, OneIsInlined) {
  f.compute_inline();
  g.compute_with(f, y);
  expect_refused({"inlined, or nothing reads it", "compute level"});
}

TEST_F(ComputeWithErrors, TheStageItselfIsInlined) {
  g.compute_inline();
  g.compute_with(f, y);
  expect_refused({"inlined", "compute"});
}

TEST_F(ComputeWithErrors, NotPartOfThePipeline) {
  g.compute_with(f, y);
  out(x, y) = g(x, y);
  expect_refused({"belong to the pipeline", "nothing reads it"});
}

TEST_F(ComputeWithErrors, NoSuchLoop) {
  g.compute_with(f, z);
  expect_refused({"a loop of both stages", "has no loop \"z\"", "\"y\", \"x\""});
}

TEST_F(ComputeWithErrors, OtherNames) {
  Func h("h");
  h(x, z) = x * z;
  h.compute_root().compute_with(f, x);
  out(x, y) = f(x, y) + h(x, y);
  expect_refused({"the same loops", "\"z\" would run with \"y\""});
}

TEST_F(ComputeWithErrors, FewerLoops) {
  Func h("h");
  h(y) = y;
  h.compute_root().compute_with(f, x);
  out(x, y) = f(x, y) + h(y);
  expect_refused({"the same loops", "name a loop further out"});
}

TEST_F(ComputeWithErrors, OtherKindsOfLoops) {
  f.parallel(y);
  g.compute_with(f, y);
  expect_refused({"are of one kind", "\"y\" is serial", "is parallel"});
}

TEST_F(ComputeWithErrors, OtherPartitions) {
  g.never_partition(y).compute_with(f, y);
  expect_refused({"compute \"g", "are partitioned alike",
                  "\"y\" was given another partition than that of \"f",
                  "Give the directive to \"f"});
}

TEST_F(ComputeWithErrors, OnlyOneIsVectorized) {
  f.split(x, xo, xi, 8).vectorize(xi);
  g.split(x, xo, xi, 8).compute_with(f, xi);
  expect_refused({"are of one kind", "is vectorized"});
}

TEST_F(ComputeWithErrors, OtherLoopsInASpecialization) {
  Param<bool> p("p");
  f.specialize(p).reorder(y, x);
  g.compute_with(f, y);
  expect_refused({"the same loops"});
}

TEST_F(ComputeWithErrors, AStageThatIsNotNamed) {
  f(x, y) += 1;
  g.compute_with(LoopLevel(f, y));
  expect_refused({"names one stage", "has 2 stages"});
}

TEST_F(ComputeWithErrors, ALevelThatIsNeverSet) {
  LoopLevel level;
  g.compute_with(level);
  expect_refused({"is set before the pipeline is compiled", "never was"});
  expect_error({"within one Func"}, [&] { level.set(LoopLevel(g, x)); });
}

TEST_F(ComputeWithErrors, AProducerAtALoopOfTheGuest) {
  Func p("p"), h("h");
  p(x, y) = x - y;
  h(x, y) = p(x, y);
  h.compute_root().compute_with(f, y);
  p.compute_at(h, y);
  out(x, y) = f(x, y) + h(x, y);
  expect_refused({"run in the loops of \"f"});
}

// rule: what is prefetched in shared loops is prefetched by the stage
TEST_F(ComputeWithErrors, PrefetchedInSharedLoops) {
  Func p("p"), h("h");
  p(x, y) = x - y;
  h(x, y) = p(x, y);
  p.compute_root();
  h.compute_root().prefetch(p, y, y, 2).compute_with(f, y);
  out(x, y) = f(x, y) + h(x, y);
  expect_refused({"prefetch", "Give the prefetch to"});
}

TEST_F(ComputeWithErrors, MemoizedOrAsynchronous) {
  g.memoize();
  g.compute_with(f, y);
  expect_refused<Unsupported>({"is memoized", "Drop memoize"});
}

// rule: Funcs that share loops are computed whenever any of them is needed
TEST_F(ComputeWithErrors, Asynchronous) {
  f.async();
  g.compute_with(f, y);
  expect_refused<Unsupported>({"computed asynchronously", "Drop async"});
}

}  // namespace
}  // namespace retrograde
