// Requirements that the headers state for operands, sizes and handles: one short program against
// each. Without the checks these programs crashed, reported an internal error, or computed wrong
// values.
#include "error/rules.h"

#include "support/errors.h"

namespace retrograde {
namespace {

struct StatedRequirements : Rules {
  Var u{"u"}, xo{"xo"}, xi{"xi"};
  Func seven{"seven"};
  StatedRequirements() { seven() = 7; }
};

// ---- operands ----

TEST_F(StatedRequirements, OperandsAreDefined) {
  const Expr none;
  const char* rule = "every operand must be a defined expression";
  expect(rule, [&] { likely(none); });
  expect(rule, [&] { widening_add(none, x); });
  expect(rule, [&] { widening_sub(x, none); });
  expect(rule, [&] { widening_mul(x, none); });
  expect(rule, [&] { saturating_add(none, x); });
  expect(rule, [&] { saturating_sub(x, none); });
  expect(rule, [&] { extract_bits<uint8_t>(none, 0); });
  expect(rule, [&] { extract_bits<uint8_t>(x, none); });
}

TEST_F(StatedRequirements, TypesHaveTheWidthsOfTheMachine) {
  const char* rule = "integers have 1, 8, 16, 32 or 64 bits, floats 16, 32 or 64";
  for (const Type type : {Int(7), Int(128), UInt(24), Float(8)})
    expect(rule, [&] { cast(type, Expr(x)); });
}

TEST_F(StatedRequirements, WideResultsHaveSixtyFourBitsAtMost) {
  const Expr wide = cast<int64_t>(x);
  expect("its result has at most 64 bits", [&] { widening_mul(wide, wide); });
  expect("its result has at most 64 bits", [&] { widening_add(wide, x); });
  expect("its result has at most 64 bits", [&] { widening_sub(cast<double>(x), cast<double>(x)); });
  expect("its result has at most 64 bits", [&] { saturating_add(wide, wide); });
  expect("its result has at most 64 bits", [&] { saturating_sub(x, wide); });
}

TEST_F(StatedRequirements, ClampedSumsAndMeansAreOfIntegers) {
  const Expr real = cast<float>(x);
  expect("it takes integers", [&] { saturating_add(real, real); });
  expect("it takes integers", [&] { saturating_sub(x, real); });
  expect("it takes integers", [&] { halving_add(real, real); });
  expect("it takes integers", [&] { rounding_halving_add(real, real); });
  expect("it takes integers", [&] { halving_sub(real, real); });
  expect("it takes integers", [&] { extract_bits<uint8_t>(x, real); });
}

// ---- sizes that are known when a call begins ----

TEST_F(StatedRequirements, SizesInSchedulesAreOverParameters) {
  const char* rule = "has one value in each call";
  for (const Expr& size : {Expr(u), Expr(seven())}) {
    expect(rule, [&] { f.split(x, xo, xi, size); });
    expect(rule, [&] { f.parallel(y, size); });
    expect(rule, [&] { f.bound(x, 0, size); });
    expect(rule, [&] { f.bound(x, size, 4); });
    expect(rule, [&] { f.bound_extent(x, size); });
    expect(rule, [&] { f.align_bounds(x, size); });
    expect(rule, [&] { f.align_bounds(x, 4, size); });
    expect(rule, [&] { f.align_storage(x, size); });
    expect(rule, [&] { f.fold_storage(x, size); });
    expect(rule, [&] { f.bound_storage(x, size); });
    expect(rule, [&] { f.set_estimate(x, 0, size); });
  }
  expect(rule, [&] { f.bound(x, 0, f(0, 0)); });
  Func g("g");
  g(x, y) = f(x, y);
  expect(rule, [&] { g.prefetch(f, y, y, y); });
}

TEST_F(StatedRequirements, PromisesAndLimitsAreOverParameters) {
  const char* rule = "has one value in each call";
  ImageParam image(Int(32), 1, "image");
  expect(rule, [&] { image.dim(0).set_min(u); });
  expect(rule, [&] { image.dim(0).set_stride(seven()); });
  expect(rule, [&] { image.dim(0).set_extent(image(0)); });
  expect(rule, [&] { f.output_buffer().dim(0).set_bounds(u, 4); });
  Param<int> gain("gain");
  expect(rule, [&] { gain.set_range(0, u); });
}

TEST_F(StatedRequirements, MessagesOfRequirementsAreOverParameters) {
  Param<int> gain("gain");
  Pipeline pipeline(f);
  expect("a requirement is checked once, before anything is computed",
         [&] { pipeline.add_requirement(gain > 0, "not", x); });
  expect("every part of its message is a defined expression",
         [&] { pipeline.add_requirement(gain > 0, "not", Expr()); });
}

// Loops and strides are divided by these sizes; 0 or less would skip points.
TEST_F(StatedRequirements, SizesOfRunTimeArePositive) {
  for (const int bad : {0, -2}) {
    Param<int> size("size", bad);
    const auto call = [&](const std::function<void(Func&)>& schedule) {
      Func g("g"), h("h");
      g(x, y) = x + y;
      h(x, y) = g(x, y);
      g.compute_root();
      schedule(g);
      return error_of<RuntimeError>([&] { h.realize({5, 3}); });
    };
    expect_mentions(call([&](Func& g) { g.split(x, xo, xi, size); }),
                    {"a factor is at least 1", "it is"});
    expect_mentions(call([&](Func& g) { g.align_storage(x, size); }),
                    {"the alignment is at least 1"});
    expect_mentions(call([&](Func& g) { g.align_bounds(x, size); }), {"the modulus is at least 1"});
    EXPECT_EQ(call([&](Func& g) { g.specialize(size > 0).split(x, xo, xi, size); }), "no error");
  }
  Param<int> size("size", 3);
  f.split(x, xo, xi, size);
  Buffer<int> out = f.realize({5, 3});
  EXPECT_EQ(out(4, 2), 6);
}

// ---- borders ----

TEST_F(StatedRequirements, BoxesOfBordersAreIntegers) {
  using namespace BoundaryConditions;
  Func line("line");
  line(x) = x;
  expect("bounds are integers", [&] { repeat_edge(line, {{0.0f, 4.0f}}); });
  expect("an extent is not negative", [&] { mirror_image(line, {{0, -1}}); });
  expect("an extent is not negative", [&] { constant_exterior(line, Expr(0), {{0, -1}}); });
  expect("the value outside is a defined expression", [&] {
    constant_exterior(line, Expr(), {{0, 4}});
  });
}

// ---- handles ----

TEST_F(StatedRequirements, ShapesOfBuffers) {
  Buffer<int> row(3), plane(3, 4);
  expect("a new dimension is inserted before, between or after", [&] { row.embed(4, 0); });
  expect("a new dimension is inserted before, between or after", [&] { row.embedded(-1, 0); });
  expect("a storage order names each dimension once", [&] { plane.transpose({0, 0}); });
  expect("a storage order names each dimension once", [&] { plane.transpose({1}); });
  expect("all Buffers have the same extents",
         [&] { row.for_each_value([](int&, int&) {}, Buffer<int>(4)); });
  plane.transpose({1, 0});
  EXPECT_EQ(plane.width(), 4);
}

TEST_F(StatedRequirements, HandlesHaveWhatTheyStandFor) {
  Buffer<int> row(3);
  ParamMap map;
  expect("it needs a type and dimensions", [&] { map.set(ImageParam(), row); });
  expect("it needs a type and dimensions", [&] { ParamMap{{ImageParam(), &row}}; });
  expect("a level is a loop, root or inlined", [&] { LoopLevel().lock(); });
  expect("dimensions are not negative", [&] { Func(Float(32), -1); });
  expect("an autoscheduler is loaded from a plugin before it is used",
         [&] { Pipeline::set_default_autoscheduler_name("Mullapudi2016"); });
  int a = 0, b = 0;
  expect("there is one result for each value", [&] { evaluate(Tuple(1, 2, 3), &a, &b); });
}

}  // namespace
}  // namespace retrograde
