// define_extern: stages that C functions compute, and C functions in expressions.
#include <HalideRuntime.h>
#include <gtest/gtest.h>

#include <atomic>

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

// Returns value and counts a call of `which`.
namespace {
std::atomic<int> calls[4];
}
EXPORTED int extern_test_count(int which, int value) {
  calls[which]++;
  return value;
}

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

// Computes both values of a Tuple.
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

// out(x) = x, in blocks of 16 only.
EXPORTED int extern_test_blocks(halide_buffer_t* out) {
  if (is_query(out)) {
    out->dim[0].extent = (out->dim[0].extent + 15) / 16 * 16;
    return 0;
  }
  if (out->dim[0].extent % 16 != 0) return -77;
  for (int i = 0; i < out->dim[0].extent; i++)
    element(out, out->dim[0].min + i) = out->dim[0].min + i;
  return 0;
}

// out(x) = in(x) + x, in blocks of 17 only; never reads beyond the given region.
EXPORTED int extern_test_rounds(halide_buffer_t* in, halide_buffer_t* out) {
  if (is_query(in) || is_query(out)) {
    if (is_query(out)) out->dim[0].extent = (out->dim[0].extent + 16) / 17 * 17;
    if (is_query(in)) {
      in->dim[0].min = out->dim[0].min;
      in->dim[0].extent = out->dim[0].extent;
    }
    return 0;
  }
  const halide_dimension_t &from = in->dim[0], &to = out->dim[0];
  if (to.extent % 17 != 0) return -77;
  if (from.min > to.min || from.min + from.extent < to.min + to.extent) return -78;
  for (int x = to.min; x < to.min + to.extent; x++) element(out, x) = element(in, x) + x;
  return 0;
}

// Requires more of its input the less of its output is requested.
EXPORTED int extern_test_insatiable(halide_buffer_t* in, halide_buffer_t* out) {
  if (is_query(in)) {
    in->dim[0].min = 0;
    in->dim[0].extent = out->dim[0].extent == 1 ? 10 : out->dim[0].extent < 20 ? 1000 : 20;
  }
  return 0;
}

// out(x, y) = in(x, y) + x, in tiles of one size only.
EXPORTED int extern_test_tile(halide_buffer_t* in, int width, int height, halide_buffer_t* out) {
  if (is_query(in)) {
    for (int d = 0; d < 2; d++) in->dim[d] = out->dim[d];
    return 0;
  }
  if (out->dim[0].extent != width || out->dim[1].extent != height) return -79;
  for (int y = out->dim[1].min; y < out->dim[1].min + height; y++) {
    for (int x = out->dim[0].min; x < out->dim[0].min + width; x++)
      element(out, x, y) = element(in, x, y) + x;
  }
  return 0;
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

TEST(ExternStage, MayComputeMoreThanIsNeeded) {
  Var x("x");
  Func f("f"), out("out");
  f.define_extern("extern_test_blocks", {}, Int(32), {x});
  out(x) = f(x) + f(x + 1);
  f.compute_root();
  const Buffer<int> result = out.realize({10});
  for (int i = 0; i < 10; i++) EXPECT_EQ(result(i), 2 * i + 1);
}

TEST(ExternStage, MayComputeMoreThanIsNeededInEachIteration) {
  Var x("x"), xo("xo"), xi("xi");
  for (const bool at_root : {false, true}) {
    for (const bool input_at_root : {false, true}) {
      Func base("base"), in("in"), f("f"), out("out");
      base(x) = 3 * x;
      in(x) = base(x - 1) + base(x + 1);
      f.define_extern("extern_test_rounds", {in}, Int(32), {x});
      out(x) = 2 * f(x);
      out.split(x, xo, xi, 10);
      base.compute_root();
      if (at_root) {
        in.compute_root();
        f.compute_root();
      } else {
        f.compute_at(out, xo);
        if (input_at_root)
          in.compute_root();
        else
          in.compute_at(out, xo);
      }
      const Buffer<int> result = out.realize({100});
      for (int i = 0; i < 100; i++) EXPECT_EQ(result(i), 14 * i) << at_root << input_at_root;
    }
  }
}

// A producer computed outside of the loop covers everything that the function requires in any
// iteration.
TEST(ExternStage, InALoopReadsWhatIsComputedOutside) {
  Var x("x"), y("y");
  Func base("base"), in("in"), f("f"), out("out");
  base(x, y) = 10 * x + y;
  in(x, y) = base(x, y + 1);
  f.define_extern("extern_test_stencil", {in}, Int(32), {x, y});
  out(x, y) = f(x, y) + 1;
  base.compute_root();
  in.compute_root();
  f.compute_at(out, y);
  const Buffer<int> result = out.realize({12, 9});
  result.for_each_element(
      [&](int i, int j) { EXPECT_EQ(result(i, j), 20 * i + 2 * j + 3) << i << " " << j; });
}

TEST(ExternStage, MayBeSaidToBeStoredFurtherOut) {
  Var x("x"), y("y");
  for (const bool of_input : {false, true}) {
    Func in("in"), f("f"), out("out");
    in(x, y) = 10 * x + y;
    f.define_extern("extern_test_stencil", {in}, Int(32), {x, y});
    out(x, y) = f(x, y) + f(x, y + 1);
    in.compute_at(out, y);
    f.compute_at(out, y);
    (of_input ? in : f).store_root();
    const Buffer<int> result = out.realize({12, 9});
    result.for_each_element(
        [&](int i, int j) { EXPECT_EQ(result(i, j), 40 * i + 4 * j + 2) << i << " " << j; });
  }
}

TEST(ExternStage, IsCalledOnSlicesInItsOwnLoops) {
  Var x("x"), y("y"), xo("xo"), yo("yo");
  for (const bool is_output : {true, false}) {
    for (const bool in_loop : {true, false}) {
      Func in("in"), f("f"), out("out");
      in(x, y) = x * y;
      f.define_extern("extern_test_tile", {in, Expr(10), Expr(5)}, Int(32), {x, y});
      out(x, y) = f(x, y);
      f.compute_root().tile(x, y, xo, yo, x, y, 10, 5).parallel(yo);
      if (in_loop)
        in.compute_at(f, xo);
      else
        in.compute_root();
      // If tiles do not divide the extent, the last ones move inwards.
      const Buffer<int> result = (is_output ? f : out).realize({33, 22});
      result.for_each_element(
          [&](int i, int j) { ASSERT_EQ(result(i, j), i * j + i) << i << " " << j; });
    }
  }
}

TEST(ExternStage, HasTheLoopsThatFuncsAreComputedIn) {
  Var x("x"), y("y"), xo("xo"), yo("yo");
  for (const bool in_rows : {true, false}) {
    Func in("in"), f("f");
    in(x, y) = x * y;
    f.define_extern("extern_test_tile", {in, Expr(10), Expr(5)}, Int(32), {x, y});
    f.tile(x, y, xo, yo, x, y, 10, 5);
    in.compute_at(f, in_rows ? yo : xo);
    const Buffer<int> result = f.realize({30, 20});
    result.for_each_element(
        [&](int i, int j) { ASSERT_EQ(result(i, j), i * j + i) << i << " " << j; });
  }
}

TEST(ExternStage, HasShorterSlicesWhereATailIsGuarded) {
  Var x("x"), y("y"), xo("xo"), t("t");
  Func base("base"), in("in"), f("f"), out("out");
  base(x, y) = 10 * x + y;
  in(x, y) = base(x, y);
  f.define_extern("extern_test_stencil", {in}, Int(32), {x, y});
  out(x, y) = f(x, y) + f(x, y + 1);
  base.compute_root();
  f.compute_root().split(x, xo, x, 8, TailStrategy::GuardWithIf).serial(y).serial(xo);
  in.compute_at(f, y);
  const Buffer<int> result = out.realize({13, 7});
  result.for_each_element(
      [&](int i, int j) { EXPECT_EQ(result(i, j), 40 * i + 4 * j + 2) << i << " " << j; });
}

TEST(ExternStage, HasALoopForEachSplitOfItsOwn) {
  Var x("x"), y("y"), xo("xo"), yo("yo");
  Func in("in"), f("f");
  in(x, y) = x * y;
  f.define_extern("extern_test_tile", {in, Expr(10), Expr(20)}, Int(32), {x, y});
  f.split(x, xo, x, 10).reorder(y, x);
  in.compute_at(f, xo);
  const Buffer<int> result = f.realize({30, 20});
  EXPECT_EQ(result(29, 19), 29 * 19 + 29);
}

TEST(ExternStage, MustAskForNoMoreInAnIterationThanInAll) {
  Var x("x"), xo("xo"), xi("xi");
  Func in("in"), f("f"), out("out");
  in(x) = x;
  f.define_extern("extern_test_insatiable", {in}, Int(32), {x});
  out(x) = f(x);
  out.split(x, xo, xi, 10);
  in.compute_root();
  f.compute_at(out, xo);
  expect_error<RuntimeError>({"\"extern_test_insatiable\"", "for a part", "[0, 999]", "[0, 19]"},
                             [&] { out.realize({100}); });
}

TEST(ExternStage, AnImageThatNothingElseReadsHasTheRegionThatTheFunctionAsksFor) {
  Var x("x"), y("y");
  for (const bool in_a_loop : {false, true}) {
    ImageParam in(Int(32), 2, "in");
    Func f("f"), out("out");
    f.define_extern("extern_test_stencil", {in}, Int(32), {x, y});
    out(x, y) = f(x, y);
    if (in_a_loop)
      f.compute_at(out, y);
    else
      f.compute_root();
    out.infer_input_bounds({12, 9});
    Buffer<int> image = in.get();
    EXPECT_EQ(image.min(0), -1);
    EXPECT_EQ(image.width(), 14);
    EXPECT_EQ(image.height(), 9);
    image.for_each_element([&](int i, int j) { image(i, j) = 10 * i + j; });
    const Buffer<int> result = out.realize({12, 9});
    result.for_each_element([&](int i, int j) { EXPECT_EQ(result(i, j), 20 * i + 2 * j); });
  }
}

TEST(ExternStage, AnImageOfAnOutputIsAskedForToo) {
  Var x("x"), y("y");
  ImageParam in(Int(32), 2, "in");
  Func f("f");
  f.define_extern("extern_test_stencil", {in}, Int(32), {x, y});
  f.infer_input_bounds({12, 9});
  EXPECT_EQ(Buffer<int>(in.get()).width(), 14);
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

// ---- pipelines by name ----

// An extern stage "inner" that reads `source`, and its consumer.
struct CallsInner {
  Var x{"x"};
  Func source{"source"}, stage{"stage"}, out{"out"};
  CallsInner(const std::vector<ExternFuncArgument>& more, bool gives_context) {
    source(x) = 10 * x;
    std::vector<ExternFuncArgument> args;
    if (gives_context) args.emplace_back(user_context_value());
    args.emplace_back(source);
    args.insert(args.end(), more.begin(), more.end());
    stage.define_extern("extern_test_inner", args, Int(32), 1);
    out(x) = stage(x) + 1;
    source.compute_root();
    stage.compute_root();
  }
};

// inner(x) = in(x + 1) * factor + table(x % 2), with a Buffer of its own
struct Inner {
  Var x{"x"};
  ImageParam in{Int(32), 1, "in"};
  Param<int> factor{"factor"};
  Buffer<int> table{2};
  Func f{"inner"};
  Inner() {
    table(0) = 100, table(1) = 200;
    f(x) = in(x + 1) * factor + table(x % 2);
  }
};

TEST(ExternPipeline, IsCalledByName) {
  for (const bool gives_context : {false, true}) {
    Inner inner;
    CallsInner outer({Expr(3)}, gives_context);
    Pipeline p(outer.out);
    p.set_jit_externs({{"extern_test_inner", JITExtern(inner.f)}});
    const Buffer<int> found = p.realize({6});
    for (int i = 0; i < 6; i++) EXPECT_EQ(found(i), 30 * (i + 1) + 100 + i % 2 * 100 + 1) << i;
  }
}

TEST(ExternPipeline, MayCallOthersAndBeChanged) {
  Inner inner;
  Func middle("middle"), copy("copy");
  Var x("x");
  ImageParam of_middle(Int(32), 1, "of_middle");
  copy(x) = of_middle(x);
  middle.define_extern("extern_test_innermost", {copy, Expr(2)}, Int(32), 1);
  copy.compute_root();
  Pipeline called(middle);
  called.set_jit_externs({{"extern_test_innermost", JITExtern(inner.f)}});
  CallsInner outer({}, true);
  outer.out.set_jit_externs({{"extern_test_inner", JITExtern(called)}});
  Buffer<int> found = outer.out.realize({4});
  EXPECT_EQ(found(3), 20 * 4 + 200 + 1);
  RDom r(0, 2);
  inner.f(r) = 7;
  found = outer.out.realize({4});
  EXPECT_EQ(found(1), 8);
  EXPECT_EQ(found(3), 281);
}

TEST(ExternPipeline, ItsErrorsAreThoseOfTheCall) {
  Var x("x");
  ImageParam in(Int(32), 1, "in");
  Func f("inner");
  f(x) = require(in(x) < 30, in(x), "too large:", in(x));
  CallsInner outer({}, true);
  outer.out.set_jit_externs({{"extern_test_inner", JITExtern(f)}});
  expect_error<RuntimeError>({"too large: 30"}, [&] { outer.out.realize({6}); });
}

// rule: a call of a pipeline passes all its arguments
TEST(ExternPipeline, ArgumentsThatDoNotFitAreErrors) {
  Inner inner;
  CallsInner too_few({}, true), wrong({Expr(3.0f)}, true), too_many({Expr(3), Expr(4)}, true);
  for (const CallsInner* outer : {&too_few, &wrong, &too_many}) {
    Func out = outer->out;
    out.set_jit_externs({{"extern_test_inner", JITExtern(inner.f)}});
    expect_error<CompileError>(
        {"\"extern_test_inner\"", "\"factor\" (int32)", "order of their names"},
        [&] { out.compile_jit(); });
  }
  expect_error<CompileError>({"needs outputs"}, [] { JITExtern{Pipeline()}; });
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

// rule: its arguments have the types that it was declared with
TEST(ExternFunction, APureOneIsCalledOnceForWhatALoopDoesNotChange) {
  Var x("x"), y("y"), xo("xo");
  const auto counted = [](int which, const Expr& value) {
    return call_pure_c_function<int, int, int>("extern_test_count", Expr(which), value);
  };
  const auto expect_calls = [&](const char* schedule, int of_all, int of_rows, int of_points,
                                Func f) {
    std::ranges::fill(calls, 0);
    Buffer<int> result = f.realize({32, 8});
    for (int j = 0; j < 8; j++)
      for (int i = 0; i < 32; i++) EXPECT_EQ(result(i, j), 7 + j + 100 * i + j) << schedule;
    EXPECT_EQ(calls[0], of_all) << schedule;
    EXPECT_EQ(calls[1], of_rows) << schedule;
    EXPECT_EQ(calls[2], of_points) << schedule;
  };
  const auto make = [&] {
    Func f("f");
    f(x, y) = counted(0, 7) + counted(1, y) + counted(2, 100 * x + y);
    return f;
  };
  expect_calls("plain", 1, 8, 256, make());
  expect_calls("vectors", 1, 8, 256, make().vectorize(x, 8));
  expect_calls("threads", 1, 8, 256, make().parallel(y).split(x, xo, x, 8));
  Func none = make();
  none.realize({0, 8});
  none.realize({32, 0});
  EXPECT_EQ(calls[0], 1) << "loops that do not run call nothing";

  Func impure("impure");
  impure(x, y) = call_c_function<int, int, int>("extern_test_count", Expr(3), Expr(7));
  impure.realize({32, 8});
  EXPECT_EQ(calls[3], 256);
  EXPECT_THROW((call_pure_c_function<int, int, int>("extern_test_count", x, 2.0f)), CompileError);
  EXPECT_THROW((call_pure_c_function<int, int, int>("extern_test_count", x, Expr())), CompileError);
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
