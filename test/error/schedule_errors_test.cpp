// Schedules that lowering rejects, and the messages.
#include <gtest/gtest.h>

#include "retrograde/retrograde.h"
#include "support/errors.h"

namespace retrograde {
namespace {

struct ScheduleErrors : testing::Test {
  Func f{"producer"}, g{"consumer"};
  Var x{"x"}, y{"y"};
  ScheduleErrors() {
    f(x, y) = x + y;
    g(x, y) = f(x, y) + f(x + 1, y);
  }
  template <class Kind = CompileError>
  std::string message() {
    return error_of<Kind>([&] { g.realize({8, 8}); });
  }
};

TEST_F(ScheduleErrors, compute_level_that_is_no_loop) {
  f.compute_at(g, Var("nowhere"));
  expect_mentions(message(), {"compute \"producer", "\"nowhere\"", "encloses every use",
                              "\"x\", \"y\"", "compute_root()"});
}

TEST_F(ScheduleErrors, compute_level_that_does_not_enclose_every_use) {
  Func h("second_consumer");
  h(x, y) = f(x, y) + g(x, y);
  f.compute_at(g, y);
  g.compute_root();
  expect_error({"encloses every use", "\"second_consumer"}, [&] { h.realize({8, 8}); });
}

TEST_F(ScheduleErrors, compute_level_in_an_inlined_func) {
  Func h("last");
  h(x, y) = g(x, y);
  f.compute_at(g, y);
  expect_error({"has no loops"}, [&] { h.realize({8, 8}); });
}

// rule: iterations of a parallel loop must not share the storage
TEST_F(ScheduleErrors, storage_outside_of_a_parallel_loop) {
  f.store_root().compute_at(g, y);
  g.parallel(y);
  expect_mentions(message(), {"parallel loop over \"y\"", "share"});
}

TEST_F(ScheduleErrors, unbounded_data_dependent_read) {
  Buffer<int> places(8);
  Func h("gather");
  h(x, y) = f(places(x), y);
  f.compute_root();
  expect_error({"without", "bound", "Clamp"}, [&] { h.realize({8, 8}); });
}

TEST_F(ScheduleErrors, vectorizing_a_loop_of_unknown_extent) {
  g.vectorize(x);
  expect_mentions(message(), {"\"x\"", "constant"});
}

TEST_F(ScheduleErrors, promised_bounds_that_are_too_small) {
  f.compute_root().bound(x, 0, 4);
  expect_mentions(message<RuntimeError>(), {"bounded to [0, 3]", "need [0, 8]"});
}

// ---- directives for inlined Funcs ----

struct InlinedErrors : ScheduleErrors {
  void expect_refused(std::initializer_list<std::string_view> phrases) {
    const std::string said = message();
    expect_mentions(said, phrases);
    expect_mentions(said,
                    {"is inlined into its users", "Compute \"producer", "at a loop or at root"});
  }
};

TEST_F(InlinedErrors, storage_of_its_own) {
  f.memoize();
  expect_refused({"memoize \"producer", "has storage of its own"});
}

TEST_F(InlinedErrors, async) {
  f.async();
  expect_refused({"compute \"producer", "asynchronously", "has storage of its own"});
}

TEST_F(InlinedErrors, store_level) {
  f.store_root();
  expect_refused({"store \"producer", "at a level", "has storage of its own"});
}

TEST_F(InlinedErrors, hoisted_storage) {
  f.hoist_storage_root();
  expect_refused({"hoist the storage of \"producer", "has storage of its own"});
}

TEST_F(InlinedErrors, storage_layout) {
  f.align_storage(x, 16);
  expect_refused({"lay out the storage of \"producer", "in \"x\"", "has storage of its own"});
}

TEST_F(InlinedErrors, parallel_loop) {
  f.parallel(y);
  expect_refused({"parallelize \"producer", "over \"y\"", "has loops"});
}

TEST_F(InlinedErrors, vectorized_loop) {
  f.vectorize(x);
  expect_refused({"vectorize \"producer", "over \"x\"", "has loops"});
}

TEST_F(InlinedErrors, unrolled_loop) {
  f.unroll(x);
  expect_refused({"unroll \"producer", "over \"x\"", "has loops"});
}

TEST_F(ScheduleErrors, recursion_among_funcs_is_named) {
  Func a("a"), b("b");
  EXPECT_NE(error_of([&] {
              b(x) = a(x);
              a(x) = b(x);
              a.realize({4});
            }),
            "no error");
}

}  // namespace
}  // namespace retrograde
