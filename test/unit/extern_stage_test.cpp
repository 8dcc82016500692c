// define_extern: stages that C functions compute, and C functions in expressions.
#include <HalideRuntime.h>
#include <gtest/gtest.h>

#include "frontend/include/retrograde/retrograde.h"
#include "support/errors.h"

#define EXPORTED extern "C" __attribute__((visibility("default")))

namespace {
int queries = 0;

bool is_query(const halide_buffer_t* b) { return !b->host && !b->device; }
int& element(halide_buffer_t* b, int x, int y = 0) {
  int64_t index = int64_t{x - b->dim[0].min} * b->dim[0].stride;
  if (b->dimensions > 1) index += int64_t{y - b->dim[1].min} * b->dim[1].stride;
  return reinterpret_cast<int*>(b->host)[index];
}
}  // namespace

// out(x) = x * scale
EXPORTED int extern_test_iota(int scale, halide_buffer_t* out) {
  if (is_query(out)) return 0;
  for (int i = 0; i < out->dim[0].extent; i++)
    element(out, out->dim[0].min + i) = scale * (out->dim[0].min + i);
  return 0;
}

// out(x, y) = in(x - 1, y) + in(x + 1, y)
EXPORTED int extern_test_stencil(halide_buffer_t* in, halide_buffer_t* out) {
  if (is_query(in)) {
    queries++;
    in->dim[0].min = out->dim[0].min - 1;
    in->dim[0].extent = out->dim[0].extent + 2;
    in->dim[1].min = out->dim[1].min;
    in->dim[1].extent = out->dim[1].extent;
    return 0;
  }
  for (int j = 0; j < out->dim[1].extent; j++) {
    for (int i = 0; i < out->dim[0].extent; i++) {
      const int x = out->dim[0].min + i, y = out->dim[1].min + j;
      element(out, x, y) = element(in, x - 1, y) + element(in, x + 1, y);
    }
  }
  return 0;
}

// Both values of a Tuple.
EXPORTED int extern_test_divide(halide_buffer_t* in, int by, halide_buffer_t* quotient,
                                halide_buffer_t* remainder) {
  if (is_query(in)) {
    in->dim[0] = quotient->dim[0];
    return 0;
  }
  for (int i = 0; i < quotient->dim[0].extent; i++) {
    const int x = quotient->dim[0].min + i;
    element(quotient, x) = element(in, x) / by;
    element(remainder, x) = element(in, x) % by;
  }
  return 0;
}

EXPORTED int extern_test_fails(halide_buffer_t* in, int on_query, halide_buffer_t* out) {
  if (is_query(in)) {
    in->dim[0] = out->dim[0];
    return on_query ? -1234 : 0;
  }
  return -4321;
}

EXPORTED int extern_test_twice(int value) { return 2 * value; }

namespace retrograde {
namespace {

using Kind = graph::ExternArgument::Kind;

TEST(ExternStage, AnOutputWithoutInputs) {
  Var x("x");
  Param<int> scale("scale");
  Func f("f");
  f.define_extern("extern_test_iota", {Expr(scale)}, Int(32), {x});
  scale.set(7);
  Buffer<int> result = f.realize({10});
  for (int i = 0; i < 10; i++) EXPECT_EQ(result(i), 7 * i);
}

TEST(ExternStage, TheRegionOfAnInputIsWhatTheFunctionAsksFor) {
  Var x("x"), y("y");
  Func in("in"), f("f"), out("out");
  in(x, y) = 10 * x + y;
  f.define_extern("extern_test_stencil", {in}, Int(32), {x, y});
  out(x, y) = f(x, y) + f(x, y + 1);
  in.compute_root();
  f.compute_root();
  queries = 0;
  Buffer<int> result = out.realize({12, 9});
  EXPECT_GT(queries, 0);
  result.for_each_element(
      [&](int i, int j) { EXPECT_EQ(result(i, j), 40 * i + 4 * j + 2) << i << " " << j; });
}

TEST(ExternStage, ComputedInsideALoop) {
  Var x("x"), y("y");
  for (bool parallel : {false, true}) {
    Func in("in"), f("f"), out("out");
    in(x, y) = 10 * x + y;
    f.define_extern("extern_test_stencil", {in}, Int(32), {x, y});
    out(x, y) = f(x, y) + 1;
    in.compute_at(out, y);
    f.compute_at(out, y);
    if (parallel) out.parallel(y);
    Buffer<int> result = out.realize({12, 9});
    result.for_each_element(
        [&](int i, int j) { EXPECT_EQ(result(i, j), 20 * i + 2 * j + 1) << i << " " << j; });
  }
}

TEST(ExternStage, ReordersOfStorageShowInTheStrides) {
  Var x("x"), y("y");
  Func in("in"), f("f"), out("out");
  in(x, y) = 10 * x + y;
  f.define_extern("extern_test_stencil", {in}, Int(32), {x, y});
  out(x, y) = f(x, y);
  in.compute_root().reorder_storage(y, x);
  f.compute_root().reorder_storage(y, x);
  Buffer<int> result = out.realize({6, 5});
  result.for_each_element([&](int i, int j) { EXPECT_EQ(result(i, j), 20 * i + 2 * j); });
}

TEST(ExternStage, TuplesAreOneBufferForEachValue) {
  Var x("x");
  Func in("in"), f("f"), out("out");
  in(x) = x * x;
  f.define_extern("extern_test_divide", {in, Expr(5)}, std::vector<Type>{Int(32), Int(32)}, {x});
  out(x) = f(x)[0] * 100 + f(x)[1];
  in.compute_root();
  f.compute_root();
  Buffer<int> result = out.realize({20});
  for (int i = 0; i < 20; i++) EXPECT_EQ(result(i), i * i / 5 * 100 + i * i % 5);
}

TEST(ExternStage, AnImageIsAskedByTheFunctionItself) {
  Var x("x"), y("y");
  ImageParam in(Int(32), 2, "in");
  Func f("f"), out("out");
  f.define_extern("extern_test_stencil", {in}, Int(32), {x, y});
  out(x, y) = f(x, y);
  f.compute_root();
  Buffer<int> data(14, 9);
  data.set_min(-1, 0);
  for (int j = 0; j < 9; j++) {
    for (int i = -1; i < 13; i++) data(i, j) = 10 * i + j;
  }
  in.set(data);
  Buffer<int> result = out.realize({12, 9});
  result.for_each_element([&](int i, int j) { EXPECT_EQ(result(i, j), 20 * i + 2 * j); });
}

TEST(ExternStage, ErrorCodesPropagate) {
  Var x("x");
  for (int on_query : {0, 1}) {
    Func in("in"), f("f"), out("out");
    in(x) = x;
    f.define_extern("extern_test_fails", {in, Expr(on_query)}, Int(32), {x});
    out(x) = f(x);
    in.compute_root();
    f.compute_root();
    try {
      out.realize({5});
      FAIL() << "no error";
    } catch (const RuntimeError& error) {
      EXPECT_EQ(error.code(), on_query ? -1234 : -4321);
      expect_mentions(error.what(), {"\"extern_test_fails\""});
    }
  }
}

// rule: a Func that a C function reads has memory
TEST(ExternStage, AnInlinedInputIsAnError) {
  Var x("x"), y("y");
  Func in("in"), f("f"), out("out");
  in(x, y) = x;
  f.define_extern("extern_test_stencil", {in}, Int(32), {x, y});
  out(x, y) = f(x, y);
  f.compute_root();
  expect_error<UserError>({"is inlined"}, [&] { out.compile_jit(); });
}

// ---- functions in expressions ----

int thrice(int value) { return 3 * value; }

TEST(ExternFunction, IsFoundInTheProcessOrAmongTheExterns) {
  Var x("x");
  Func f("f");
  f(x) = ir::call_extern("extern_test_twice", Int(32), {x});
  Buffer<int> result = f.realize({5});
  EXPECT_EQ(result(4), 8);
  f.set_jit_externs({{"extern_test_twice", JITExtern(thrice)}});
  Buffer<int> other = f.realize({5});
  EXPECT_EQ(other(4), 12);
  f.set_jit_externs({});
  Buffer<int> again = f.realize({5});
  EXPECT_EQ(again(4), 8);
}

TEST(ExternFunction, ArgumentsHaveTheDeclaredTypes) {
  Var x("x");
  Func f("f");
  f(x) = call_c_function<int, int>("extern_test_twice", x + 1);
  f.vectorize(x, 4, TailStrategy::GuardWithIf);
  Buffer<int> result = f.realize({7});
  EXPECT_EQ(result(6), 14);
  const auto wrong = [&] { return call_c_function<int, int>("extern_test_twice", cast<float>(x)); };
  EXPECT_THROW(wrong(), UserError);
}

TEST(ExternFunction, AnUnknownOneIsAnError) {
  Var x("x");
  Func f("f");
  f(x) = ir::call_extern("extern_test_nowhere", Int(32), {x});
  try {
    f.compile_jit();
    FAIL() << "no error";
  } catch (const UserError& error) {
    expect_mentions(error.what(), {"\"extern_test_nowhere\"", "set_jit_externs"});
  }
}

}  // namespace
}  // namespace retrograde
