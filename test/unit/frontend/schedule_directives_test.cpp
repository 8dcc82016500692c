// Effects of directives on schedules, and uses that are rejected immediately.
#include <gtest/gtest.h>

#include <retrograde/retrograde.h>

#include "support/errors.h"
#include "support/loop_nest.h"

namespace retrograde {
namespace {

template <class Action>
void expect_refused(Action&& action, std::initializer_list<std::string_view> phrases) {
  expect_mentions(error_of<Error>(action), phrases);
}

struct Directives : testing::Test {
  Func f{"f"}, g{"g"};
  Var x{"x"}, y{"y"}, xo{"xo"}, xi{"xi"};
  RDom r{0, 8, 0, 8};
  Directives() {
    f(x, y) = x + y;
    g(x, y) = f(x, y) + f(x + 1, y);
  }
  const graph::FuncPlacement& schedule(const Func& func) { return func.function()->schedule; }
};

// ---- loop levels ----

TEST_F(Directives, ALevelMayBeSetLater) {
  LoopLevel compute, store;
  f.compute_at(compute).store_at(store);
  EXPECT_FALSE(compute.defined());
  compute.set(LoopLevel(g, x));
  store.set(LoopLevel(g, y));
  EXPECT_EQ(schedule(f).compute_level.var, x.name());
  EXPECT_EQ(schedule(f).store_level.var, y.name());
  EXPECT_EQ(compute.to_string(), g.name() + ".x");
  const Buffer<int> result = g.realize({4, 4});
  EXPECT_EQ(result(2, 3), 2 + 3 + 3 + 3);
  compute.set(LoopLevel::root());
  store.set(LoopLevel::root());
  EXPECT_EQ(schedule(f).compute_level.kind, graph::LoopLevel::Kind::Root);
  EXPECT_EQ(Buffer<int>(g.realize({4, 4}))(2, 3), 11);
}

TEST_F(Directives, ALevelThatWasReplacedIsNotFollowed) {
  LoopLevel level = LoopLevel::root();
  f.compute_at(level);
  f.compute_at(g, y);
  level.set(LoopLevel::inlined());
  EXPECT_EQ(schedule(f).compute_level.var, y.name());
}

TEST_F(Directives, ALevelThatIsNeverSetIsRefused) {
  LoopLevel level;
  f.compute_at(level);
  expect_refused([&] { g.realize({4, 4}); }, {"\"f", "never was", "level.set"});
  expect_refused([&] { level.to_string(); }, {"never set"});
}

TEST_F(Directives, ALockedLevelStays) {
  LoopLevel level(g, x);
  level.lock();
  expect_refused([&] { level.set(LoopLevel::root()); }, {"locked"});
}

TEST_F(Directives, StoringFollowsComputing) {
  f.compute_at(g, x);
  EXPECT_EQ(schedule(f).store_level.var, x.name());
  f.store_root().compute_at(g, y);
  EXPECT_EQ(schedule(f).store_level.kind, graph::LoopLevel::Kind::Root);
  EXPECT_EQ(schedule(f).compute_level.var, y.name());
}

TEST_F(Directives, OutermostIsOutsideOfAllLoops) {
  f.compute_at(g, Var::outermost());
  Func h("h");
  h(x, y) = g(x, y) * 2;
  g.compute_at(h, y);
  EXPECT_EQ(loops_around(h.loop_nest(), "f"), std::vector<std::string>{"y"});
  EXPECT_EQ(Buffer<int>(h.realize({4, 4}))(2, 3), 22);
}

// ---- storage and sizes ----

TEST_F(Directives, StorageRulesAreKeptByDimension) {
  f.compute_root().align_storage(x, 16).fold_storage(y, 4, false).bound_storage(x, 64);
  ASSERT_EQ(schedule(f).storage_rules.size(), 2u);
  EXPECT_EQ(ir::as_const_int(schedule(f).storage_rules[0].alignment), 16);
  EXPECT_EQ(ir::as_const_int(schedule(f).storage_rules[0].bound), 64);
  EXPECT_EQ(ir::as_const_int(schedule(f).storage_rules[1].fold), 4);
  EXPECT_FALSE(schedule(f).storage_rules[1].fold_forward);
}

// rule: is at least 1 and fits an int32
TEST_F(Directives, StorageRulesNeedADimensionAndAPositiveSize) {
  expect_refused([&] { f.align_storage(Var("z"), 8); }, {"\"z\"", "\"x\", \"y\""});
  expect_refused([&] { f.fold_storage(y, 0); }, {"fold", "at least 1", "it is 0"});
  expect_refused([&] { f.bound_storage(y, 2.5f); }, {"integer", "float32"});
}

TEST_F(Directives, BoundsOfOneVariableAreOneEntry) {
  f.bound(x, 0, 64).align_bounds(x, 8).align_extent(y, 4);
  ASSERT_EQ(schedule(f).bounds.size(), 2u);
  EXPECT_EQ(ir::as_const_int(schedule(f).bounds[0].extent), 64);
  EXPECT_EQ(ir::as_const_int(schedule(f).bounds[0].modulus), 8);
  EXPECT_EQ(ir::as_const_int(schedule(f).bounds[0].remainder), 0);
  EXPECT_FALSE(schedule(f).bounds[1].remainder.defined());
}

TEST_F(Directives, BoundsThatCannotHoldAreRefused) {
  f.bound(x, 3, 30);
  expect_refused([&] { f.align_bounds(x, 4); }, {"multiple of the modulus", "30"});
  expect_refused([&] { f.align_bounds(x, 10, 2); }, {"remainder 2", "the min is 3"});
  expect_refused([&] { f.align_bounds(x, 0); }, {"modulus is at least 1"});
  expect_refused([&] { f.align_extent(Var("z"), 4); }, {"\"z\""});
}

TEST_F(Directives, MemoizeTakesKeysOverParameters) {
  Param<uint64_t> key("key");
  f.compute_root().memoize(EvictionKey(key));
  EXPECT_TRUE(schedule(f).memoized);
  EXPECT_TRUE(schedule(f).eviction_key.defined());
  expect_refused([&] { f.memoize(EvictionKey(Expr(x))); }, {"parameters", "\"x\""});
  expect_refused([&] { f.memoize(EvictionKey(2.5f)); }, {"integer or a pointer"});
}

TEST_F(Directives, InlinedFuncsHaveNoStorageOrLoops) {
  const auto refused = [&](void (*give)(Func&, Directives&)) {
    Func a("a"), b("b");
    a(x) = x;
    b(x) = a(x);
    give(a, *this);
    return error_of<Error>([&] { b.realize({4}); });
  };
  expect_mentions(refused([](Func& a, Directives&) { a.memoize(); }), {"memoize"});
  expect_mentions(refused([](Func& a, Directives&) { a.async(); }), {"inlined"});
  expect_mentions(refused([](Func& a, Directives&) { a.store_root(); }), {"inlined"});
  expect_mentions(refused([](Func& a, Directives&) { a.hoist_storage_root(); }), {"inlined"});
  expect_mentions(refused([](Func& a, Directives& d) { a.align_storage(d.x, 8); }), {"inlined"});
  expect_mentions(refused([](Func& a, Directives& d) { a.parallel(d.x); }), {"parallelize"});
}

TEST_F(Directives, MemoryOfDevicesIsUnsupported) {
  f.compute_root().store_in(MemoryType::GPUTexture);
  EXPECT_THROW(g.realize({4, 4}), Unsupported);
  f.store_in(MemoryType::GPUShared);
  EXPECT_THROW(g.realize({4, 4}), UserError);
  ImageParam image(Int(32), 1, "image");
  EXPECT_THROW(image.store_in(MemoryType::GPUTexture), Unsupported);
}

TEST_F(Directives, HostAlignmentIsAPowerOfTwo) {
  ImageParam image(Float(32), 1, "image");
  EXPECT_EQ(image.host_alignment(), 4);
  image.set_host_alignment(64);
  EXPECT_EQ(image.host_alignment(), 64);
  expect_refused([&] { image.set_host_alignment(24); }, {"power of two", "24"});
}

// ---- specializations ----

TEST_F(Directives, ASpecializationCopiesTheScheduleSoFar) {
  Param<int> n("n");
  f.split(x, xo, xi, 8);
  Stage special = f.specialize(n > 8);
  special.vectorize(xi);
  f.unroll(xi);
  EXPECT_EQ(special.get_schedule().dims[0].runs, ForType::Vectorized);
  EXPECT_EQ(f.get_schedule().dims[0].runs, ForType::Unrolled);
  EXPECT_EQ(f.get_schedule().specializations.size(), 1u);
}

TEST_F(Directives, TheSameConditionIsTheSameSpecialization) {
  Param<int> n("n");
  f.specialize(n > 8).parallel(y);
  f.specialize(n > 3);
  f.specialize(n > 8).vectorize(x, 4);
  ASSERT_EQ(f.get_schedule().specializations.size(), 2u);
  EXPECT_EQ(f.get_schedule().specializations[0].dims.size(), 3u);
  EXPECT_EQ(f.get_schedule().specializations[0].dims[2].runs, ForType::Parallel);
}

TEST_F(Directives, SpecializationsNest) {
  Param<int> n("n"), m("m");
  Stage outer = f.specialize(n > 8);
  outer.specialize(m > 8).parallel(y);
  outer.vectorize(x, 4);
  const graph::StageLoops& first = f.get_schedule().specializations[0];
  ASSERT_EQ(first.specializations.size(), 1u);
  EXPECT_EQ(first.dims.size(), 3u);
  EXPECT_EQ(first.specializations[0].dims.size(), 2u);
}

// rule: has one value in each call
TEST_F(Directives, ConditionsAreOverParameters) {
  Param<int> n("n");
  ImageParam image(Int(32), 1, "image");
  expect_refused([&] { f.specialize(x > 8); }, {"\"x\"", "parameters"});
  expect_refused([&] { g.specialize(f(0, 0) > 8); }, {"Func", "parameters"});
  expect_refused([&] { g.specialize(image(0) > 8); }, {"image", "parameters"});
  expect_refused([&] { g.specialize(n + 1); }, {"bool", "int32"});
  g.specialize(image.dim(0).stride() == 1);
}

TEST_F(Directives, SpecializeFailIsTheLast) {
  Param<int> n("n");
  f.specialize(n > 1);
  f.specialize_fail("no such size");
  expect_refused([&] { f.specialize(n > 2); }, {"last", "before specialize_fail"});
  expect_refused([&] { f.specialize_fail("again"); }, {"last"});
  f.specialize(n > 1).parallel(y);  // an existing one
  EXPECT_EQ(f.get_schedule().specializations[1].failure, "no such size");
  expect_refused([&] { g.specialize_fail(""); }, {"message"});
}

// ---- reductions in parallel ----

TEST_F(Directives, AtomicAllowsParallelReductions) {
  Func h("h");
  h(x) = 0;
  h(x) += r.x * r.y;
  expect_refused([&] { h.update().parallel(r.x); }, {"same element", "atomic()"});
  h.update().atomic().parallel(r.x).vectorize(r.y, 4);
  EXPECT_TRUE(h.update().get_schedule().atomic);
}

TEST_F(Directives, AtomicUpdatesAreAssociative) {
  Func h("h");
  h(x) = 0;
  h(x) = h(x) * 2 + r.x;
  h.update().atomic();
  expect_refused([&] { h.update().parallel(r.x); },
                 {"associative and commutative", "form x = ", "atomic(true)"});
  h.update().atomic(true).parallel(r.x);
}

TEST_F(Directives, AtomicUpdatesCommute) {
  Func h("h");
  h(x) = Tuple(Expr(1), Expr(0));
  h(x) = Tuple(h(x)[0] * r.x, h(x)[1] * r.x + r.y);
  h.update().atomic();
  expect_refused([&] { h.update().parallel(r.x); }, {"depends on the order"});
}

TEST_F(Directives, RacesMayBeAllowed) {
  Func h("h");
  h(x) = 0;
  h(x) = h(x) * 2 + r.x;
  h.update().allow_race_conditions().parallel(r.x);
  EXPECT_TRUE(h.update().get_schedule().allow_races);
}

// ---- other stages ----

// rule: the stages belong to different Funcs
TEST_F(Directives, ComputeWithNamesALoopOfAnotherFunc) {
  Func h("h");
  h(x, y) = x;
  h.compute_with(f, y, {{y, LoopAlignStrategy::AlignEnd}});
  const graph::StageLoops& now = h.get_schedule();
  EXPECT_EQ(now.fuse_level.func, f.name());
  EXPECT_EQ(now.fuse_level.stage, 0);
  EXPECT_EQ(now.fuse_alignment.at("y"), LoopAlignStrategy::AlignEnd);
  h.compute_with(LoopLevel(f, x), LoopAlignStrategy::AlignStart);
  EXPECT_EQ(h.get_schedule().fuse_alignment.size(), 2u);
  expect_refused([&] { h.compute_with(LoopLevel::root()); }, {"down to a loop", "root"});
  expect_refused([&] { h.compute_with(h, y); }, {"within one Func"});
  Param<bool> p("p");
  expect_refused([&] { h.specialize(p); }, {"joins the loops", "compute_with"});
  f.specialize(p);
  expect_refused([&] { f.compute_with(h, y); }, {"no specializations"});
}

TEST_F(Directives, PrefetchNamesLoopsAndAnOffset) {
  ImageParam image(Int(32), 2, "image");
  g.prefetch(f, x, y, 2).prefetch(image, y, 3);
  ASSERT_EQ(g.get_schedule().prefetches.size(), 2u);
  EXPECT_EQ(g.get_schedule().prefetches[0].from, "y");
  EXPECT_EQ(g.get_schedule().prefetches[1].at, "y");
  expect_refused([&] { g.prefetch(f, y, x, 2); }, {"inside that loop", "Swap"});
  expect_refused([&] { g.prefetch(f, Var("z"), x, 2); }, {"\"z\"", "must be a loop"});
  expect_refused([&] { g.prefetch(f, x, x, 2.5f); }, {"integer"});
  Func undefined("undefined");
  expect_refused([&] { g.prefetch(undefined, x, x); }, {"definition first"});
}

TEST_F(Directives, PartitionIsAPropertyOfLoops) {
  f.never_partition(x).partition(y, Partition::Always);
  EXPECT_EQ(f.get_schedule().dims[0].partition, Partition::Never);
  EXPECT_EQ(f.get_schedule().dims[1].partition, Partition::Always);
  f.split(x, xo, xi, 8);
  EXPECT_EQ(f.get_schedule().dims[0].partition, Partition::Never);
  f.always_partition_all();
  EXPECT_EQ(f.get_schedule().dims[1].partition, Partition::Always);
  expect_refused([&] { f.never_partition(Var("z")); }, {"\"z\"", "must be a loop"});
}

TEST_F(Directives, AParallelLoopIsNotInsideOfAVectorizedOne) {
  f.compute_root().reorder(y, x).parallel(y).vectorize(x, 4);
  expect_refused(
      [&] {
        g.realize({4, 4});
      },
      {"parallelize", "inside of the vectorized loop", "Reorder"});
}

TEST_F(Directives, LoopsRunOverBlocksAndThreads) {
  const auto runs = [&](int loop) { return f.get_schedule().dims[loop].runs; };
  f.gpu_tile(x, y, xo, xi, 8, 8);
  EXPECT_EQ(runs(0), ForType::GpuThread);
  EXPECT_EQ(runs(1), ForType::GpuThread);
  EXPECT_EQ(runs(2), ForType::GpuBlock);
  EXPECT_EQ(runs(3), ForType::GpuBlock);
  EXPECT_TRUE(is_gpu(runs(2)) && !is_gpu_thread(runs(2)) && is_gpu_thread(runs(0)));
  EXPECT_TRUE(runs_at_once(runs(0)) && !runs_at_once(ForType::Vectorized));
  f.gpu_lanes(xo);
  EXPECT_EQ(runs(0), ForType::GpuLane);
  Func h("h");
  h(x, y) = x + y;
  h.gpu(y, x);
  EXPECT_EQ(h.get_schedule().dims[0].runs, ForType::GpuThread);
  EXPECT_EQ(h.get_schedule().dims[1].runs, ForType::GpuBlock);
  g.gpu_single_thread();
  EXPECT_EQ(g.get_schedule().dims.back().runs, ForType::GpuBlock);
  EXPECT_EQ(g.get_schedule().dims.size(), 3u);
  EXPECT_THROW(f.hexagon(), Unsupported);
  EXPECT_THROW(f.copy_to_device(), Unsupported);
  expect_refused([&] { f.gpu_threads(Var("nowhere")); }, {"\"nowhere\"", "must be a loop"});
}

// ---- extern stages ----

TEST_F(Directives, ExternStagesKeepTheirArguments) {
  Func h("h");
  Param<int> n("n");
  ImageParam image(Int(32), 1, "image");
  h.define_extern("compute_it", {f, image, Expr(n), 3}, {Int(32), Float(32)}, 2);
  EXPECT_TRUE(h.is_extern());
  EXPECT_EQ(h.extern_function_name(), "compute_it");
  EXPECT_EQ(h.dimensions(), 2);
  EXPECT_EQ(h.outputs(), 2);
  EXPECT_TRUE(f.function()->frozen);
  expect_refused([&] { f.extern_function_name(); }, {"define_extern"});
  expect_refused([&] { h.define_extern("again", {}, Int(32), 1); }, {"defined once"});
  expect_refused([&] { Func("k").define_extern("k", {Expr(x)}, Int(32), 1); }, {"\"x\""});
  expect_refused([&] { Func("k").define_extern("k", {Func("none")}, Int(32), 1); }, {"has none"});
  expect_refused([&] { Func("k").define_extern("k", {}, Int(32), {x, x}); }, {"twice"});
  EXPECT_THROW(Func("k").define_extern("k", {}, Int(32), 1, NameMangling::C, DeviceAPI::CUDA),
               Unsupported);
}

// ---- tracing ----

TEST_F(Directives, TracingIsKept) {
  f.trace_loads().trace_stores().add_trace_tag("one").add_trace_tag("two");
  EXPECT_TRUE(f.function()->trace.loads && f.function()->trace.stores);
  EXPECT_FALSE(f.function()->trace.realizations);
  EXPECT_EQ(f.function()->trace.tags, (std::vector<std::string>{"one", "two"}));
  expect_refused([&] { f.debug_to_file(""); }, {"has a name"});
}

TEST_F(Directives, FuncsKnowWhereTheyWereDeclared) {
  Func here;
  expect_mentions(here.source_location(), {"schedule_directives_test.cpp:"});
}

TEST_F(Directives, ExternStagesHaveNoExpressions) {
  Func h("h");
  h.define_extern("compute_it", {}, Int(32), 1);
  expect_refused([&] { h.value(); }, {"compute_it"});
  expect_refused([&] { h(x) += 1; }, {"no updates", "compute_it"});
  expect_refused([&] { h.parallel(x); }, {"its loops are", "\"_0\""});
  expect_refused([&] { h.vectorize(Var("_0")); }, {"calls of a C function", "\"h"});
}

// ---- orders of reductions ----

TEST_F(Directives, ReductionLoopsThatCommuteMayBeReordered) {
  Func h("h"), m("m");
  h(x) = Tuple(Expr(1), Expr(0));
  h(x) = Tuple(h(x)[0] * r.x - h(x)[1] * r.y, h(x)[0] * r.y + h(x)[1] * r.x);
  h.update().reorder(r.y, r.x);
  m(x) = Tuple(Expr(1), Expr(0));
  const Expr better = r.x * r.y < m(x)[0];
  m(x) = Tuple(select(better, r.x * r.y, m(x)[0]), select(better, r.x, m(x)[1]));
  expect_refused([&] { m.update().reorder(r.y, r.x); }, {"changes no result"});
}

TEST_F(Directives, IndependentReductionLoopsGoAnywhere) {
  Func h("h");
  h(x) = 0;
  h(r.y) = h(r.y) * 2 + r.x;
  h.update().reorder(r.y, r.x);
  h.compute_root();
  const Buffer<int> result = h.realize({8});
  for (int i = 0; i < 8; i++) EXPECT_EQ(result(i), 247);
}

// ---- splits of updates ----

TEST_F(Directives, TailsOfUpdatesRunNoPointTwice) {
  Func h("h");
  h(x) = 0;
  h(x) += r.x + r.y;
  Var a, b;
  RVar ra, rb;
  expect_refused([&] { h.update().split(x, a, b, 4, TailStrategy::ShiftInwards); },
                 {"does not run a point twice"});
  expect_refused([&] { h.update().split(r.x, ra, rb, 4, TailStrategy::RoundUp); },
                 {"reduction variable runs exactly"});
  expect_refused([&] { h.update().split(r.x, ra, rb, 4, TailStrategy::PredicateLoads); },
                 {"reduction variable runs exactly"});
  h.update().split(x, a, b, 4, TailStrategy::RoundUp);
}

}  // namespace
}  // namespace retrograde
