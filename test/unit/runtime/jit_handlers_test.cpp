// JIT handlers for memory, errors, prints, tasks and loops. A failing allocation anywhere must give
// an error and leak nothing.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <set>

#include "frontend/include/retrograde/retrograde.h"
#include "support/errors.h"

namespace retrograde {
namespace {

// An allocator that counts, and fails on request.
struct Counting : JITUserContext {
  std::atomic<int> allocations{0}, live{0}, tasks{0}, loops{0};
  int fail_at = -1;
  std::string error, printed;
  Counting() {
    handlers.custom_malloc = [](JITUserContext* c, size_t bytes) -> void* {
      auto& self = *static_cast<Counting*>(c);
      if (self.allocations++ == self.fail_at) return nullptr;
      self.live++;
      return std::aligned_alloc(128, (bytes + 127) / 128 * 128);
    };
    handlers.custom_free = [](JITUserContext* c, void* block) {
      static_cast<Counting*>(c)->live--;
      std::free(block);
    };
  }
};

// Allocations of every kind: at root, in loops, in parallel loops, async, Tuples.
struct Program {
  Var x{"x"}, y{"y"};
  Func a{"a"}, b{"b"}, c{"c"}, d{"d"}, out{"out"};
  Program() {
    a(x, y) = x + y;
    b(x, y) = Tuple(a(x, y) + 1, a(x, y) * 2);
    c(x, y) = b(x, y)[0] + b(x, y + 1)[1];
    d(x, y) = a(x, y) * 3;
    out(x, y) = d(x, y) + c(x + 1, y);
    a.compute_root().store_in(MemoryType::Heap);
    b.compute_at(out, y).store_in(MemoryType::Heap);
    c.compute_at(out, y).store_in(MemoryType::Heap);
    d.compute_root().store_in(MemoryType::Heap).async();
    out.parallel(y);
  }
};

TEST(JITHandlers, AFailingAllocationAnywhereIsAnErrorAndLeaksNothing) {
  Program program;
  Counting all;
  program.out.realize(&all, {20, 6});
  EXPECT_GT(all.allocations, 8);
  EXPECT_EQ(all.live, 0);
  for (int k = 0; k < all.allocations; k++) {
    Counting context;
    context.fail_at = k;
    try {
      program.out.realize(&context, {20, 6});
      ADD_FAILURE() << "no error for allocation " << k;
    } catch (const RuntimeError& error) {
      EXPECT_EQ(error.code(), -11) << k;
      expect_mentions(error.what(), {"not enough memory"});
    }
    EXPECT_EQ(context.live, 0) << "after allocation " << k << " failed";
  }
}

TEST(JITHandlers, ErrorsGoToTheHandlerAndNothingIsThrown) {
  Var x("x");
  Func f("f");
  f(x) = require(x < 5, x, "x is", x);
  Counting context;
  context.handlers.custom_error = [](JITUserContext* c, const char* message) {
    static_cast<Counting*>(c)->error = message;
  };
  f.realize(&context, {10});
  expect_mentions(context.error, {"x is 5"});
}

struct Complaints : JITUserContext {
  std::vector<std::string> told;
  Complaints() {
    handlers.custom_error = [](JITUserContext* c, const char* message) {
      static_cast<Complaints*>(c)->told.emplace_back(message);
    };
  }
  void expect_one(std::initializer_list<std::string_view> parts) {
    ASSERT_EQ(told.size(), 1u);
    expect_mentions(told[0], parts);
    told.clear();
  }
};

TEST(JITHandlers, ErrorsOfArgumentsGoToTheHandler) {
  Var x("x");
  Param<int> offset("offset", 5, 0, 10);
  Func f("f"), pair("pair");
  f(x) = x + offset;
  pair(x) = Tuple(x, x);
  Complaints c;
  Buffer<int> out(3), longer(4), flat(3, 3);
  Buffer<float> floats(3);
  offset.set(20);
  f.realize(&c, out);
  c.expect_one({"\"offset\"", "20"});
  const Buffer<int> sized = f.realize(&c, {3});
  c.expect_one({"\"offset\"", "20"});
  EXPECT_EQ(sized.width(), 3);
  offset.set(3);
  f.realize(&c, floats);
  c.expect_one({"right element type"});
  f.realize(&c, flat);
  c.expect_one({"number of dimensions"});
  pair.realize(&c, {out, longer});
  c.expect_one({"one region"});
  EXPECT_THROW(f.realize(floats), RuntimeError);
  f.realize(&c, out);
  EXPECT_EQ(out(2), 5);
  EXPECT_TRUE(c.told.empty());
}

TEST(JITHandlers, ErrorsOfImagesThatAreMissingGoToTheHandler) {
  Var x("x");
  ImageParam in(Int(32), 1, "in");
  Func f("f");
  f(x) = in(x);
  Complaints c;
  f.realize(&c, {4});
  c.expect_one({"\"in\"", "needs a buffer"});
  Buffer<float> wrong(4);
  f.infer_input_bounds(&c, wrong);
  c.expect_one({"right element type"});
  EXPECT_FALSE(in.get().defined());
}

TEST(JITHandlers, ErrorsOfCallablesAreTheirCodes) {
  Var x("x");
  Param<int> offset("offset", 5, 0, 10);
  Func f("f");
  f(x) = x + offset;
  const Callable callable = f.compile_to_callable({offset});
  Complaints c;
  Buffer<int> out(3);
  EXPECT_NE(callable(&c, 20, out), 0);
  c.expect_one({"\"offset\"", "20"});
  EXPECT_NE(callable(&c, 1.0f, out), 0);
  c.expect_one({"must be of type int32"});
  EXPECT_EQ(callable(&c, 3, out), 0);
  EXPECT_EQ(out(2), 5);
}

TEST(JITHandlers, ThoseOfTheContextGoBeforeThoseOfTheFunc) {
  Var x("x");
  Func f("f");
  f(x) = print(x, "told");
  std::string own;
  f.jit_handlers().print = [&](const char* text) { own += text; };
  f.realize({1});
  EXPECT_EQ(own, "0 told\n");
  Counting context;
  context.handlers.custom_print = [](JITUserContext* c, const char* text) {
    static_cast<Counting*>(c)->printed += text;
  };
  f.realize(&context, {1});
  EXPECT_EQ(context.printed, "0 told\n");
  EXPECT_EQ(own, "0 told\n");
}

TEST(JITHandlers, TasksAndLoopsOfTheHostsOwn) {
  Var x("x"), y("y");
  Func f("f");
  f(x, y) = x * y;
  f.parallel(y);
  Counting context;
  context.handlers.custom_do_task = [](JITUserContext* c, JITTask task, int index,
                                       uint8_t* closure) {
    static_cast<Counting*>(c)->tasks++;
    return task(c, index, closure);
  };
  Buffer<int> result = f.realize(&context, {8, 12});
  EXPECT_EQ(context.tasks, 12);
  EXPECT_EQ(result(7, 11), 77);

  Counting other;
  other.handlers.custom_do_par_for = [](JITUserContext* c, JITTask task, int min, int extent,
                                        uint8_t* closure) {
    static_cast<Counting*>(c)->loops++;
    for (int i = min + extent - 1; i >= min; i--) {
      if (int code = task(c, i, closure)) return code;
    }
    return 0;
  };
  Buffer<int> again = f.realize(&other, {8, 12});
  EXPECT_EQ(other.loops, 1);
  EXPECT_EQ(again(7, 11), 77);
}

TEST(JITHandlers, HalfAnAllocatorIsAnError) {
  Var x("x");
  Func f("f");
  f(x) = x;
  f.jit_handlers().custom_malloc = [](JITUserContext*, size_t) -> void* { return nullptr; };
  EXPECT_THROW(f.realize({4}), UserError);
}

}  // namespace
}  // namespace retrograde
