// Target::CheckedAccesses: an access outside of its storage is an error before it happens, which
// names Func, stage, element and extent. Programs without such accesses behave as before.
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "retrograde/retrograde.h"
#include "support/errors.h"

namespace retrograde {
namespace {

Target checked(Target::Feature feature = Target::CheckedAccesses) {
  return get_jit_target_from_environment().with_feature(feature);
}

class CheckedAccesses : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 16; ++i) places(i) = i % 10;
  }

  std::string error_of(Func f, const std::vector<int>& sizes, const Target& target = checked()) {
    try {
      f.realize(sizes, target);
    } catch (const RuntimeError& error) {
      return error.what();
    }
    return "";
  }
  static void expect_parts(const std::string& message, const std::vector<std::string>& parts) {
    for (const std::string& part : parts)
      EXPECT_NE(message.find(part), std::string::npos) << part << " is not in: " << message;
  }

  // table(0 .. 9), read at the indices in `places`.
  Func reader() {
    table(x) = x * 7;
    table.compute_root();
    read(x) = table(unsafe_promise_clamped(places(x), 0, 9));
    return read;
  }

  Var x{"x"}, y{"y"};
  Func table{"table"}, read{"read"}, counts{"counts"}, out{"out"};
  Buffer<int> places{16};
};

TEST_F(CheckedAccesses, LetLegalProgramsRun) {
  Buffer<int> result = reader().realize({16}, checked());
  for (int i = 0; i < 16; ++i) EXPECT_EQ(result(i), i % 10 * 7);
}

TEST_F(CheckedAccesses, NameFuncStageElementAndStorageOfALoad) {
  places(11) = 123;
  expect_parts(error_of(reader(), {16}),
               {"checked_accesses: \"table", "is read by stage 0 of \"read", "at element 123",
                "elements 0 to 9", "report"});
}

TEST_F(CheckedAccesses, CheckEveryLane) {
  places(13) = -5;
  Func f = reader();
  f.vectorize(x, 8);
  expect_parts(error_of(f, {16}), {"\"table", "at element -5 to"});
}

TEST_F(CheckedAccesses, CheckStoresOfUpdates) {
  places(3) = 77;
  RDom r(0, 16);
  counts(x) = 0;
  counts(unsafe_promise_clamped(places(r), 0, 9)) += 1;
  counts.compute_root();
  out(x) = counts(x);
  const std::string error = error_of(out, {10});
  expect_parts(error, {"\"counts", "by stage 1 of \"counts", "at element 77"});
}

TEST_F(CheckedAccesses, CheckAtomicUpdatesBeforeTheyHappen) {
  places(3) = 77;
  RDom r(0, 16);
  counts(x) = 0;
  counts(unsafe_promise_clamped(places(r), 0, 9)) += 1;
  counts.compute_root().update().atomic().parallel(r);
  out(x) = counts(x);
  expect_parts(error_of(out, {10}), {"\"counts", "at element 77"});
}

TEST_F(CheckedAccesses, CheckBuffersOfTheCaller) {
  Buffer<int> image(10);
  image.fill(1);
  Func f("f");
  f(x) = image(unsafe_promise_clamped(places(x), 0, 9));
  places(7) = 10;
  expect_parts(error_of(f, {16}),
               {"is read by stage 0 of \"f", "at element 10", "elements 0 to 9"});
}

TEST_F(CheckedAccesses, KnowBuffersThatRunBackwards) {
  std::vector<int> memory(10, 3);
  const halide_dimension_t backwards(0, 10, -1);
  Buffer<int> image(Runtime::Buffer<int>(memory.data() + 9, 1, &backwards));
  Func f("f");
  f(x) = image(unsafe_promise_clamped(places(x), 0, 9));
  EXPECT_EQ(error_of(f, {16}), "");
  places(2) = -1;
  expect_parts(error_of(f, {16}), {"at element 1", "elements -9 to 0"});
}

TEST_F(CheckedAccesses, AreWhatHalidesAsanAsksFor) {
  places(11) = 123;
  expect_parts(error_of(reader(), {16}, checked(Target::ASAN)), {"checked_accesses"});
}

TEST_F(CheckedAccesses, StayWithNoAsserts) {
  places(11) = 123;
  expect_parts(error_of(reader(), {16}, checked().with_feature(Target::NoAsserts)),
               {"checked_accesses"});
}

// Lanes of an atomic update run in turn, each under the tail condition of the split. Promises of
// disabled lanes are not checked.
TEST_F(CheckedAccesses, LetPromisesOfLanesThatAreOffBe) {
  RVar outer("outer"), inner("inner");
  RDom r(0, 5);
  Var u("u");
  out(x, y) = Tuple(cast<int8_t>(x), cast<uint8_t>(y));
  out(r, r) = Tuple(out(r, r)[0] + cast<int8_t>(places(clamp(r, 0, 4))), out(r, r)[1]);
  out.update().split(r, outer, inner, 2);
  Func parts = out.update().rfactor(outer, u);
  parts.compute_root().update().atomic().vectorize(inner).parallel(u);
  Realization result = out.realize({8, 8}, checked());
  for (int i = 0; i < 8; ++i) EXPECT_EQ(Buffer<int8_t>(result[0])(i, i), i < 5 ? 2 * i : i);
}

TEST_F(CheckedAccesses, LetWhatIsNotComputedBe) {
  places(11) = 123;
  table(x) = x * 7;
  table.compute_root();
  read(x) = table(unsafe_promise_clamped(places(x), 0, 9));
  read.compute_root();
  out(x) = read(x);
  EXPECT_EQ(error_of(out, {8}), "");
}

// The end of a loop's steady state is computed before the guard under which its promise holds.
TEST_F(CheckedAccesses, TakePromisesBeforeSeveralGuardsAsTheyAreUnderThem) {
  Var x("x"), block("block"), i("i"), group("group"), j("j"), both("both"), k("k"), xo("xo"),
      xi("xi"), xio("xio"), lane("lane");
  const auto make = [&](bool is_scheduled) {
    Func f("f"), g("g"), h("h"), out("out");
    f(x) = x * 7;
    g(x) = f(x - 1) + f(x / 4 - 1);
    h(x) = g(x + 1);
    out(x) = h(x / 2) + h(x);
    if (!is_scheduled) return out;
    h.compute_root()
        .split(x, block, i, 8, TailStrategy::PredicateLoads)
        .split(block, group, j, 3)
        .fuse(j, group, both)
        .split(both, both, k, 5, TailStrategy::GuardWithIf);
    g.compute_at(h, i);
    f.hoist_storage(h, both).compute_at(h, k);
    f.split(x, xo, xi, 4, TailStrategy::Predicate)
        .split(xi, xio, lane, 2, TailStrategy::ShiftInwards)
        .vectorize(lane);
    return out;
  };
  for (const int size : {1, 14, 50}) {
    const Buffer<int> expected = make(false).realize({size});
    const Buffer<int> found =
        make(true).realize({size}, get_host_target().with_feature(Target::CheckedAccesses));
    for (int at = 0; at < size; at++) ASSERT_EQ(found(at), expected(at)) << at << " of " << size;
  }
}

// The index of a store is computed before its condition, which disables all lanes beyond the
// domain.
TEST_F(CheckedAccesses, LetPlacesOfStoresThatDoNotHappenBe) {
  Var u("u"), yo("yo"), yi("yi");
  RVar outer("outer"), inner("inner");
  const auto make = [&](bool is_scheduled) {
    Func f("f"), sums("sums");
    f(x, y) = x + 2 * y;
    f.compute_root();
    RDom r(0, 5, 0, 3);
    r.where(!(f(abs(y), r.x + 2) < r.y));
    sums(x, y) = x + y;
    sums(r.x - 2, y) += r.y + 1;
    if (!is_scheduled) return sums;
    sums.update().split(r.x, outer, inner, 4);
    Func parts = sums.update().rfactor(outer, u);
    parts.compute_root().update().split(y, yo, yi, 4, TailStrategy::GuardWithIf).vectorize(yi);
    return sums;
  };
  const Buffer<int> expected = make(false).realize({5, 6});
  const Buffer<int> found = make(true).realize({5, 6}, checked());
  for (int j = 0; j < 6; j++)
    for (int i = 0; i < 5; i++) EXPECT_EQ(found(i, j), expected(i, j)) << i << ", " << j;
}

// The end of the steady state is computed before the guard around its loop, and storage is freed
// after the guard.
TEST_F(CheckedAccesses, TakePromisesBeforeAGuardInsideAllocationsAsTheyAreUnderIt) {
  Var outer("outer"), inner("inner"), group("group"), member("member"), tile("tile"), i("i"),
      half("half"), j("j"), third("third"), k("k"), lane("lane");
  Param<int> selector("selector");
  const auto make = [&](bool is_scheduled) {
    Func f("f"), g("g"), h("h"), l("l"), out("out");
    f(x, y) = x + 37 * (y / 3) + x * (y / 2);
    g(x, y) = f(x + 1, y);
    h(x, y) = g(x, y / 2 + 2);
    l(x, y) = h(x - 2, y);
    out(x) = l(x, 1) + 2 * l(x, x);
    if (!is_scheduled) return out;
    l.compute_at(out, x)
        .split(y, outer, inner, 8, TailStrategy::PredicateStores)
        .split(outer, group, member, 3, TailStrategy::GuardWithIf)
        .split(inner, tile, i, 3, TailStrategy::ShiftInwards);
    h.store_at(l, member).compute_at(l, tile);
    h.split(y, half, j, 2, TailStrategy::RoundUp)
        .split(half, third, k, 3, TailStrategy::GuardWithIf);
    g.compute_at(h, third);
    f.store_root().compute_at(l, member);
    f.specialize(selector == 2).split(y, y, lane, 2, TailStrategy::PredicateLoads).vectorize(lane);
    return out;
  };
  for (const int chosen : {0, 2}) {
    selector.set(chosen);
    const Buffer<int> expected = make(false).realize({45});
    const Buffer<int> found = make(true).realize({45}, checked());
    for (int at = 0; at < 45; at++) ASSERT_EQ(found(at), expected(at)) << at;
  }
}

// Where one of two fused stages does not run, the promises of its splits must not select anything.
TEST_F(CheckedAccesses, LetWhatIsNotChosenBe) {
  Func f("f"), g("g"), copy("copy");
  Var outer("outer"), inner("inner");
  f(x, y) = x + 37 * y;
  g(x, y) = f(x, y / 4) + f(x, 2 * y + 1);
  out(x, y) = g(x, y - 3);
  copy(x, y) = f(x, y);
  copy.split(y, outer, inner, 4, TailStrategy::GuardWithIf).parallel(outer);
  g.compute_root().split(y, outer, inner, 4, TailStrategy::GuardWithIf).parallel(outer);
  f.compute_at(g, inner);
  copy.compute_with(g, inner);
  for (const int rows : {1, 2, 7}) {
    Buffer<int> first(5, rows), second(5, 9);
    second.set_min(-4, -4);
    Pipeline({out, copy}).realize({first, second}, checked());
    first.for_each_element([&](int i, int j) {
      EXPECT_EQ(first(i, j), 2 * i + 37 * ((j < 3 ? -1 : (j - 3) / 4) + 2 * (j - 3) + 1));
    });
    second.for_each_element([&](int i, int j) { EXPECT_EQ(second(i, j), i + 37 * j); });
  }
}

}  // namespace
}  // namespace retrograde
