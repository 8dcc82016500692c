// Legal programs that a simpler rule would reject: outputs larger than requested, updates whose
// iterations never conflict, loops whose extent is bounded but not constant, promises that depend
// on themselves. Each is compared with its unscheduled form, or with known values.
#include <gtest/gtest.h>

#include <algorithm>
#include <climits>
#include <cmath>
#include <functional>

#include "retrograde/retrograde.h"
#include "support/errors.h"
#include "support/variables.h"

namespace retrograde {
namespace {

template <typename T = int>
std::vector<T> line(const Buffer<T>& buffer) {
  std::vector<T> values;
  for (int i = 0; i < buffer.width(); i++) values.push_back(buffer(i));
  return values;
}

std::vector<int> doubled(int n) {
  std::vector<int> values;
  for (int i = 0; i < n; i++) values.push_back(2 * i);
  return values;
}

// ---- A Func reads no more of an image where it is computed in tiles ----

// The tails of three splits, one in the loops of another. The last place that is read is 27 + 2 + 6.
TEST(TilesOfTiles, StayInsideOfTheImage) {
  Buffer<float> image({36, 12}, "image");
  image.for_each_element([&](int i, int j) { image(i, j) = static_cast<float>(i * 7 % 10 + j); });
  const auto values = [&](bool in_tiles) {
    Func source("source"), sum("sum"), wide("wide");
    source(x, y) = image(x, y);
    sum(x, y) = source(x, y) * source(x + 6, y) + source(x + 2, y + 1) * source(x + 8, y + 1);
    wide(x, y) = sum(x / 2, y) + sum(min(x / 2 + 1, 27), y);
    Var tile("tile"), inner("inner");
    if (in_tiles) {
      wide.split(x, tile, x, 8, TailStrategy::GuardWithIf).reorder(x, y, tile);
      sum.compute_at(wide, y).split(x, x, inner, 4, TailStrategy::GuardWithIf);
      source.compute_at(wide, tile).vectorize(x, 16, TailStrategy::GuardWithIf);
    }
    const Buffer<float> result = wide.realize({56, 11});
    return std::vector<float>(result.begin(), result.end());
  };
  EXPECT_EQ(values(true), values(false));
}

// ---- realize(sizes) returns that size, whatever the schedule or a promise does to it ----

Func twice() {
  Func f("f");
  f(x) = 2 * x;
  return f;
}

void expect_ten(Func f) {
  const Buffer<int> out = f.realize({10});
  EXPECT_EQ(out.min(0), 0);
  EXPECT_EQ(line(out), doubled(10));
}

TEST(RealizedSizes, OfLoopsThatRoundUp) {
  expect_ten(twice().vectorize(x, 8, TailStrategy::RoundUp));
  expect_ten(twice().vectorize(x, 16));
  expect_ten(twice().align_bounds(x, 16));
  expect_ten(twice().bound(x, 0, 16));
}

TEST(RealizedSizes, OfConstrainedOutputs) {
  Func wide = twice(), early = twice(), even = twice();
  wide.output_buffer().dim(0).set_bounds(0, 16);
  expect_ten(wide);
  early.output_buffer().dim(0).set_min(-4);
  expect_ten(early);
  Dimension dim = even.output_buffer().dim(0);
  dim.set_extent((dim.extent() + 7) / 8 * 8);
  expect_ten(even);
}

TEST(RealizedSizes, OfTuplesAndOfOutputsThatOthersRead) {
  Func pair("pair"), f("f"), g("g");
  pair(x) = Tuple(2 * x, x + 1);
  pair.vectorize(x, 8, TailStrategy::RoundUp);
  Realization both = pair.realize({10});
  EXPECT_EQ(line(Buffer<int>(both[0])), doubled(10));
  EXPECT_EQ(both[1].as<int>()(9), 10);
  f(x) = 2 * x;
  g(x) = f(x) + f(x + 3);
  f.compute_root().vectorize(x, 8, TailStrategy::RoundUp);
  Realization two = Pipeline({f, g}).realize({10});
  EXPECT_EQ(line(Buffer<int>(two[0])), doubled(10));
  EXPECT_EQ(two[1].as<int>()(9), 42);
  EXPECT_EQ(two[1].width(), 10);
}

TEST(RealizedSizes, KeepTheStridesThatWerePromised) {
  Func f("f");
  f(x, y, c) = x + 10 * y + 100 * c;
  f.output_buffer().dim(0).set_stride(3);
  f.output_buffer().dim(2).set_stride(1).set_bounds(0, 3);
  const Buffer<int> out = f.realize({4, 2, 3});
  EXPECT_EQ(out.stride(0), 3);
  EXPECT_EQ(out.stride(1), 12);
  EXPECT_EQ(out.stride(2), 1);
  EXPECT_EQ(out(3, 1, 2), 213);
}

TEST(RealizedSizes, GrowUntilTheirBoundsAreMet) {
  Func f = twice();
  const Expr extent = f.output_buffer().dim(0).extent();
  f.output_buffer().dim(0).set_bounds(0, select(extent < 52, extent + 1, extent));
  expect_ten(f);
}

// Two buffers whose bounds depend on each other and on themselves.
TEST(InferredBounds, OfOutputsGrowUntilTheirBoundsAreMet) {
  ImageParam in(Int(32), 2, "in");
  Func f("f");
  f(x, y) = in(x + 2, y);
  const OutputImageParam out = f.output_buffer();
  const Expr extent = out.dim(0).extent();
  out.dim(0).set_bounds(0, select(extent < 22, extent + 1, extent));
  in.dim(0).set_bounds(in.dim(1).min() - 3, out.dim(0).extent() + in.dim(1).extent() + 5);
  Buffer<int> wanted(nullptr, {7, 8});
  wanted.set_min(2, 4);
  f.infer_input_bounds(wanted);
  EXPECT_EQ(wanted.min(0), 0);
  EXPECT_EQ(wanted.width(), 22);
  EXPECT_EQ(wanted.min(1), 4);
  EXPECT_EQ(wanted.height(), 8);
  const Buffer<int> image = in.get();
  EXPECT_EQ(image.min(0), 1);
  EXPECT_EQ(image.width(), 35);
  EXPECT_EQ(image.height(), 8);
}

TEST(RealizedSizes, SmallerPromisesAreRefused) {
  Func f = twice();
  f.output_buffer().dim(0).set_bounds(0, 8);
  expect_error<RuntimeError>({"promised to be 8", "it is 10"}, [&] { f.realize({10}); });
}

// ---- arbitrary strides of dimensions with at most one element, as array libraries leave them ----

// Checks in(x, y) plus out's own coordinates, for buffers with these extents and strides.
void expect_any_strides(const std::function<void(Func&, ImageParam&)>& promise, int width,
                        int height, int stride_x, int stride_y) {
  ImageParam in(Int(32), 2, "in");
  Func f("f");
  f(x, y) = in(x, y) + x + 10 * y;
  promise(f, in);
  std::vector<int> read(64, 5), written(64, -1);
  const halide_dimension_t shape[] = {{0, width, stride_x}, {0, height, stride_y}};
  in.set(Buffer<int>(read.data(), 2, shape));
  Buffer<int> out(written.data(), 2, shape);
  ASSERT_NO_THROW(f.realize(out)) << width << " x " << height << ", strides " << stride_x << " "
                                  << stride_y;
  for (int j = 0; j < height; j++) {
    for (int i = 0; i < width; i++)
      EXPECT_EQ(written[static_cast<size_t>(i * stride_x + j * stride_y)], 5 + i + 10 * j);
  }
  EXPECT_EQ(std::count_if(written.begin(), written.end(), [](int v) { return v != -1; }),
            width * height);
}

TEST(StridesOfOneElement, MayBeAnything) {
  const auto nothing = [](Func&, ImageParam&) {};
  const auto vectors = [](Func& f, ImageParam&) { f.vectorize(x, 4, TailStrategy::GuardWithIf); };
  const auto rows = [](Func& f, ImageParam& in) {  // of 8 elements, stated twice
    in.dim(1).set_stride(8 * in.dim(0).stride());
    f.output_buffer().dim(1).set_stride(8);
  };
  for (const auto& promise :
       std::vector<std::function<void(Func&, ImageParam&)>>{nothing, vectors, rows}) {
    for (int stride : {0, -3, INT32_MAX}) {
      for (int height : {0, 2}) {
        expect_any_strides(promise, 1, height, stride, 8);
        expect_any_strides(promise, 0, height, stride, 8);
      }
      for (int width : {0, 7}) {
        expect_any_strides(promise, width, 1, 1, stride);
        expect_any_strides(promise, width, 0, 1, stride);
      }
      expect_any_strides(promise, 1, 1, stride, stride);
    }
  }
}

TEST(StridesOfOneElement, OfMoreAreStillChecked) {
  Func f("f");
  f(x, y) = x + y;
  f.output_buffer().dim(1).set_stride(8);
  std::vector<int> memory(64);
  const halide_dimension_t wide[] = {{0, 2, 2}, {0, 2, 8}}, low[] = {{0, 2, 1}, {0, 2, 4}};
  Buffer<int> of_wide(memory.data(), 2, wide), of_low(memory.data(), 2, low);
  expect_error<RuntimeError>({"stride of dimension 0", "promised to be 1, but it is 2"},
                             [&] { f.realize(of_wide); });
  expect_error<RuntimeError>({"stride of dimension 1", "promised to be 8, but it is 4"},
                             [&] { f.realize(of_low); });
}

// ---- updates whose iterations never access the same element ----

// Compares the update with and without its schedule.
void expect_same(const std::vector<int>& sizes, const std::function<Func()>& define,
                 const std::function<void(Func&)>& schedule) {
  Func plain = define(), scheduled = define();
  ASSERT_NO_THROW(schedule(scheduled));
  const Buffer<int> expected = plain.realize(sizes), found = scheduled.realize(sizes);
  for (int i = 0; i < static_cast<int>(expected.number_of_elements()); i++)
    ASSERT_EQ(found.begin()[i], expected.begin()[i]) << i;
}

TEST(DistinctWrites, OfDigits) {
  RDom r(0, 4, 0, 4);
  const auto define = [&] {
    Func f("f");
    f(x) = x;
    f(r.x * 4 + r.y) += r.x - 10 * r.y;
    return f;
  };
  expect_same({16}, define, [&](Func& f) { f.update().parallel(r.x); });
  expect_same({16}, define, [&](Func& f) { f.update().vectorize(r.y); });
}

TEST(DistinctWrites, OfShears) {
  RDom r(0, 4, 0, 4);
  const auto define = [&] {
    Func f("f");
    f(x, y) = 0;
    f(r.x + r.y, r.y) = f(r.x + r.y, r.y) * 2 + r.x + 10 * r.y;
    return f;
  };
  expect_same({8, 4}, define, [&](Func& f) { f.update().reorder(r.y, r.x).parallel(r.x); });
}

TEST(DistinctWrites, OfQuotientsAndRemainders) {
  RDom r(0, 16);
  const auto define = [&] {
    Func f("f");
    f(x, y) = 0;
    f(r % 4, r / 4) = cast<int>(r) * 3;
    return f;
  };
  expect_same({4, 4}, define, [&](Func& f) { f.update().parallel(r); });
}

TEST(DistinctWrites, ByPredicates) {
  RDom odd(0, 14), upper(0, 16), triangle(0, 5, 0, 5);
  odd.where(odd % 2 == 1);
  upper.where(upper >= 8);
  triangle.where(triangle.x < triangle.y);
  const auto of_odd = [&] {
    Func f("f");
    f(x) = x * x;
    f(odd) = f(odd - 1) + f(odd + 1);
    return f;
  };
  expect_same({16}, of_odd, [&](Func& f) { f.update().parallel(odd); });
  const auto of_upper = [&] {
    Func f("f");
    f(x) = x * x;
    f(upper) = f(upper - 8) + 1;
    return f;
  };
  expect_same({16}, of_upper, [&](Func& f) { f.update().parallel(upper); });
  const auto transposed = [&] {
    Func f("f");
    f(x, y) = x + 10 * y;
    f(triangle.x, triangle.y) = f(triangle.y, triangle.x);
    return f;
  };
  expect_same({5, 5}, transposed, [&](Func& f) { f.update().parallel(triangle.y); });
}

TEST(DistinctWrites, AreNotSeenWhereTheyMeet) {
  RDom r(0, 4, 0, 5), half(0, 9);
  Func digits("digits"), mirrored("mirrored");
  digits(x) = 0;
  digits(r.x * 4 + r.y) = r.x;  // 4 follows 0 + 4
  EXPECT_THROW(digits.update().parallel(r.y), CompileError);
  EXPECT_NO_THROW(digits.update().parallel(r.x));  // for one r.y after another
  mirrored(x) = x;
  mirrored(15 - half) = mirrored(half) * 2;  // 7 is read and written
  EXPECT_THROW(mirrored.update().parallel(half), CompileError);
  Param<int> n("n");
  RDom some(0, n);
  Func shifted("shifted");
  shifted(x) = x;
  shifted(some) = shifted(some + 8);
  EXPECT_THROW(shifted.update().parallel(some), CompileError);
  Func known("known");
  known(x) = x;
  known(some) = known(some + n);
  EXPECT_NO_THROW(known.update().parallel(some));
}

TEST(DistinctWrites, OfPlacesThatDataMove) {
  Buffer<int> row(4);
  row.fill(1);
  RDom r(0, 4, 0, 4);
  Func f("f");
  f(x, y) = 0;
  f(r.x + row(r.y), r.y) = r.x;
  EXPECT_NO_THROW(f.update().vectorize(r.x));
  EXPECT_NO_THROW(f.update().parallel(r.y));
}

// ---- updates whose order does not matter, or is declared not to ----

TEST(Orders, OfAScatteredConstant) {
  RDom r(0, 8, 0, 8);
  Func place("place");
  place(x) = x * x % 7;
  const auto define = [&] {
    Func f("f");
    f(x) = x;
    f(place(r.x) + place(r.y)) = 7;
    return f;
  };
  expect_same({14}, define, [&](Func& f) { f.update().reorder(r.y, r.x); });
  Func other("other");
  other(x) = x;
  other(place(r.x) + place(r.y)) = r.x;
  expect_error<CompileError>({"changes no result"}, [&] { other.update().reorder(r.y, r.x); });
}

TEST(Orders, OfLanesThatReadWhatOthersStore) {
  RDom r(2, 30);
  for (const int lanes : {2, 4, 8}) {
    const auto define = [&] {
      Func f("f");
      f(x) = x;
      f(r) = f(r - 2) + r;
      return f;
    };
    expect_same({32}, define, [&](Func& f) { f.update().atomic(true).vectorize(r, lanes); });
  }
}

// ---- loops whose extent has a bound that follows from the loops around them ----

// Halves of a vector at the end of a guarded loop, and the first part of a window.
TEST(BoundedLoops, AreVectorizedUnderTheirBound) {
  for (const int reach : {0, 1}) {
    const auto define = [&](Func& f) {
      Func out("out");
      f(x) = 3 * x;
      out(x) = f(x) + f(x + reach);
      out.vectorize(x, 8, TailStrategy::GuardWithIf);
      f.compute_at(out, x).vectorize(x);
      return out;
    };
    for (const int size : {1, 7, 8, 13, 27}) {
      Func f("f");
      const Buffer<int> out = define(f).realize({size});
      for (int i = 0; i < size; i++) EXPECT_EQ(out(i), 6 * i + 3 * reach) << i << " of " << size;
    }
  }
}

TEST(BoundedLoops, OfWindowsAreUnrolled) {
  for (const bool at_root : {false, true}) {
    Func f("f"), out("out");
    f(x, y) = x + 10 * y;
    out(x, y) = f(x, y) + f(x + 1, y) + f(x + 2, y);
    out.unroll(x, 3);
    f.compute_at(out, x).unroll(x);
    if (at_root)
      f.store_root();
    else
      f.store_at(out, y);
    const Buffer<int> found = out.realize({12, 6});
    for (int j = 0; j < 6; j++) {
      for (int i = 0; i < 12; i++) EXPECT_EQ(found(i, j), 3 * i + 3 + 30 * j) << i << ", " << j;
    }
  }
}

// f is required over [min(min, 0), max(max, 0)], which the condition limits to three coordinates.
TEST(BoundedLoops, OfHullsAreUnrolledWhereTheConditionSaysSo) {
  Func f("f"), out("out");
  f(x, c) = x + 10 * c;
  out(x, c) = f(x, c) + f(x + 1, 0);
  const Dimension channels = out.output_buffer().dim(1);
  f.compute_root().reorder(c, x);
  f.specialize(channels.extent() == 3 && channels.min() == 0).unroll(c);
  for (const int depth : {3, 4}) {
    const Buffer<int> found = out.realize({5, depth});
    for (int k = 0; k < depth; k++) EXPECT_EQ(found(4, k), 4 + 10 * k + 5) << depth;
  }
}

// ---- loops that are unrolled up to a bound ----

// rule: the extent of an unrolled loop must be a constant, or have a constant above it
TEST(BoundedLoops, AreUnrolledUnderTheirBound) {
  Param<int> n("n");
  RDom r(0, n);
  Func f("f"), g("g");
  f(x) = 0;
  f(x) += x * (r + 1);
  f.update().specialize(n <= 4).unroll(r);
  for (const int length : {0, 1, 3, 4, 7}) {
    n.set(length);
    const Buffer<int> out = f.realize({5});
    EXPECT_EQ(out(4), 4 * length * (length + 1) / 2) << length;
  }
  g(x) = 0;
  g(x) += x * r;
  g.update().unroll(r);
  n.set(3);
  expect_error({"constant above it"}, [&] { g.realize({5}); });
}

// ---- stages that share only the outermost loop ----

TEST(Outermost, StagesComputedTogetherThere) {
  Func f("f"), g("g"), h("h");
  f(x) = x;
  g(x, y) = 2 * x + y;
  h(x) = f(x) + g(x, 1);
  f.compute_root();
  g.compute_root().compute_with(f, Var::outermost());
  const Buffer<int> out = h.realize({6});
  EXPECT_EQ(out(5), 16);
}

// ---- buffers ----

// rule: a coordinate lies inside the buffer, or one past its end
TEST(Buffers, HaveAnAddressOnePastTheEnd) {
  Buffer<int> row(3), image(4, 2);
  EXPECT_EQ(&row(3) - &row(0), 3);
  EXPECT_EQ(&image(4, 1), image.end());
  EXPECT_EQ(&image(0, 2), image.end());
#ifndef NDEBUG
  EXPECT_THROW(row(4), CompileError);
  EXPECT_THROW(row(-1), CompileError);
#endif
}

// ---- coordinates ----

TEST(Coordinates, AreShiftedByLoops) {
  Func squares("squares"), f("f");
  squares(x) = x * x;
  RDom r(0, 4, 0, 3);
  f(x) = 0;
  f(r.x) += squares(r.x + (1 << r.y));
  squares.compute_at(f, r.x);
  EXPECT_EQ(line(Buffer<int>(f.realize({4}))), (std::vector<int>{21, 38, 61, 90}));
}

TEST(Coordinates, FromAbsoluteValuesAreNotNegative) {
  Func squares("squares"), f("f"), g("g");
  squares(x) = x * x;
  squares.compute_root();
  f(x) = squares(cast<int>(abs(cast<float>(x - 4))));
  EXPECT_EQ(line(Buffer<int>(f.realize({8}))), (std::vector<int>{16, 9, 4, 1, 0, 1, 4, 9}));
  Buffer<float> image(4);
  image(0) = -2.5f;
  image(1) = 100.0f;
  image(2) = -INFINITY;
  image(3) = NAN;
  g(x) = squares(min(cast<int>(min(abs(image(x)), 50.0f)), 20));
  const Buffer<int> out = g.realize({4});
  EXPECT_EQ(out(0), 4);
  EXPECT_EQ(out(1), 400);
  EXPECT_EQ(out(2), 400);
}

// ---- required regions of inputs ----

int inferred_extent(Func f, ImageParam in, int size) {
  f.infer_input_bounds({size});
  return in.get().width();
}

// Values that a rounded-up loop reads of a Func beyond its domain may be wrong, but must be
// allocated.
TEST(InputRegions, AreThoseOfTheLoopsThatReadThem) {
  ImageParam in(Int(32), 1);
  Func direct("direct"), g("g"), h("h"), f("f");
  direct(x) = in(x) + in(x + 2);
  direct.vectorize(x, 8, TailStrategy::RoundUp);
  Func user("user");
  user(x) = direct(x);
  direct.compute_root();
  EXPECT_EQ(inferred_extent(user, in, 12), 18);
  in.reset();
  g(x) = in(x);
  g.compute_root();
  h(x) = g(x) + 1;
  h.compute_root().vectorize(x, 8, TailStrategy::RoundUp);
  f(x) = h(x) + g(x);
  EXPECT_EQ(inferred_extent(f, in, 12), 12);
  Buffer<int> data(12);
  for (int i = 0; i < 12; i++) data(i) = i;
  in.set(data);
  const Buffer<int> out = f.realize({12});
  for (int i = 0; i < 12; i++) EXPECT_EQ(out(i), 2 * i + 1);
}

TEST(InputRegions, StayWhereValuesArePlaces) {
  ImageParam in(Int(32), 1);
  Func g("g"), h("h"), f("f");
  g(x) = in(x) % 8;
  g.compute_root();
  h(x) = in(g(x));
  h.compute_root().vectorize(x, 8, TailStrategy::RoundUp);
  f(x) = h(x);
  EXPECT_EQ(inferred_extent(f, in, 12), 16);
}

// a(x) = in(x) * 2, at root; `schedule` applies to b; only the required region of the input is
// requested.
void expect_exact_region(const std::function<Func(Func a)>& define, int size, int reach) {
  ImageParam in(Int(32), 1, "in");
  Func a("a");
  a(x) = in(x)*2;
  a.compute_root();
  Func out = define(a);
  out.infer_input_bounds({size});
  Buffer<int> data = in.get();
  EXPECT_EQ(data.min(0), 0) << size;
  EXPECT_EQ(data.width(), size + reach) << size;
  data.for_each_element([&](int i) { data(i) = i * i; });
  const Buffer<int> found = out.realize({size});
  for (int i = 0; i < size; i++) {
    int expected = 0;
    for (int k : {i, i + 1, i + 2, i + 3}) expected += 2 * k * k;
    ASSERT_EQ(found(i), expected) << i << " of " << size;
  }
}

// out(x) = b(x) + b(x + 1), b(x) = a(x) + a(x + 2)
TEST(InputRegions, EndWithWhatIsNeededOfVectorsThatShift) {
  for (const TailStrategy tail : {TailStrategy::Auto, TailStrategy::ShiftInwards}) {
    for (const int size : {4, 15, 16, 40}) {
      const auto define = [&](const Func& a) {
        Func b("b"), out("out");
        b(x) = a(x) + a(x + 2);
        out(x) = b(x) + b(x + 1);
        b.compute_root().vectorize(x, 16, tail);
        return out;
      };
      expect_exact_region(define, size, 3);
    }
  }
}

// The same, with a Func between b and a that is computed inside the loops of b.
TEST(InputRegions, EndWithWhatFuncsInsideOfSuchLoopsNeed) {
  for (const TailStrategy tail : {TailStrategy::RoundUp, TailStrategy::ShiftInwards}) {
    for (const int size : {4, 15, 16, 40}) {
      const auto define = [&](const Func& a) {
        Var xo("xo"), xi("xi");
        Func inside("inside"), b("b"), out("out");
        inside(x) = a(x) + a(x + 2);
        b(x) = inside(x);
        out(x) = b(x) + b(x + 1);
        b.compute_root().split(x, xo, xi, 16, tail).vectorize(xi);
        inside.compute_at(b, xo).vectorize(x);
        return out;
      };
      expect_exact_region(define, size, 3);
    }
  }
}

// b slides along y in tiles of two rows and keeps them; the required part of these rows along x
// must be right. The vectors along x run beyond it, and must not require more of the input.
TEST(InputRegions, EndWithWhatIsNeededOfTilesThatAreKept) {
  for (const int size : {16, 40}) {
    ImageParam in(Int(32), 2, "in");
    Func a("a"), b("b"), out("out");
    Var y("y"), strip("strip"), xi("xi"), yi("yi");
    a(x, y) = in(x, y) * 2;
    b(x, y) = a(x, y) + a(x + 2, y);
    out(x, y) = b(x, y) + b(x + 1, y + 1);
    out.split(y, strip, y, 8);
    b.store_at(out, strip)
        .compute_at(out, y)
        .tile(x, y, xi, yi, 16, 2, TailStrategy::RoundUp)
        .vectorize(xi);
    a.store_at(out, strip).compute_at(out, y).vectorize(x, 8, TailStrategy::RoundUp);
    out.infer_input_bounds({size, size});
    Buffer<int> data = in.get();
    EXPECT_EQ(data.min(0), 0);
    EXPECT_EQ(data.width(), (size + 3 + 7) / 8 * 8);
    data.for_each_element([&](int i, int j) { data(i, j) = i * i + 5 * j; });
    const Buffer<int> found =
        out.realize({size, size}, get_host_target().with_feature(Target::CheckedAccesses));
    const auto f = [](int i, int j) { return 2 * (i * i + 5 * j); };
    for (int j = 0; j < size; j++)
      for (int i = 0; i < size; i++)
        ASSERT_EQ(found(i, j), f(i, j) + f(i + 2, j) + f(i + 1, j + 1) + f(i + 3, j + 1))
            << i << ", " << j;
  }
}

// Storage has room for reads beyond a region, also if two stages share the outer loops.
TEST(InputRegions, HaveRoomForVectorsInsideOfSharedLoops) {
  Func a("a"), inside("inside"), one("one"), other("other");
  Var y("y");
  a(x, y) = x + 3 * y;
  inside(x, y) = a(x, y) + a(x + 1, y);
  one(x, y) = inside(x, y);
  other(x, y) = a(x, y) + 1;
  inside.compute_at(one, x).vectorize(x, 16, TailStrategy::RoundUp);
  a.compute_at(one, y);
  other.compute_with(one, y);
  Buffer<int> ones(20, 7), others(20, 5);
  Pipeline({one, other})
      .realize({ones, others}, get_host_target().with_feature(Target::CheckedAccesses));
  ones.for_each_element([&](int i, int j) { EXPECT_EQ(ones(i, j), 2 * i + 1 + 6 * j); });
  others.for_each_element([&](int i, int j) { EXPECT_EQ(others(i, j), i + 3 * j + 1); });
}

// A table is read inside its bounds, whatever the values beyond the region are.
TEST(InputRegions, EndWithThemWhereCoordinatesAreClamped) {
  for (const int size : {4, 16, 40}) {
    const auto define = [&](const Func& a) {
      Func table("table"), b("b"), out("out");
      table(x) = x;
      b(x) = table(clamp(a(x), 0, 5000)) + table(clamp(a(x + 2), 0, 5000));
      out(x) = b(x) + b(x + 1);
      table.compute_root();
      b.compute_root().vectorize(x, 16);
      return out;
    };
    expect_exact_region(define, size, 3);
  }
}

TEST(InputRegions, OfGuardedTilesInsideOfGuardedTilesEndWithThem) {
  Var y("y"), xi("xi"), yi("yi"), tile("tile");
  ImageParam in(Float(32), 2, "in");
  Func f("f"), turned("turned");
  f(x, y) = in(x, y) * 2.0f;
  turned(x, y) = f(y, x);
  turned.split(y, y, yi, 16, TailStrategy::GuardWithIf);
  turned.split(y, y, tile, 4, TailStrategy::GuardWithIf);
  f.split(x, x, xi, 16, TailStrategy::GuardWithIf).vectorize(xi).compute_at(turned, y);
  Buffer<float> image(100, 70);
  image.for_each_element([&](int px, int py) { image(px, py) = static_cast<float>(px * 70 + py); });
  in.set(image);
  const Buffer<float> out = turned.realize({70, 100});
  for (int py = 0; py < 100; py++) {
    for (int px = 0; px < 70; px++) ASSERT_EQ(out(px, py), 2 * image(py, px));
  }
}

// ---- promises ----

TEST(Promises, MaySpeakOfThemselves) {
  ImageParam a(Float(32), 1, "a"), b(Float(32), 1, "b");
  Buffer<float> ones(16);
  ones.fill(1.0f);
  a.set(ones);
  b.set(ones);
  a.dim(0).set_bounds(0, a.dim(0).extent() / 8 * 8);
  b.dim(0).set_bounds(0, a.dim(0).extent());
  RDom r(0, a.width());
  Func dot("dot");
  dot() = 0.0f;
  dot() += a(r) * b(r);
  const Buffer<float> out = dot.realize();
  EXPECT_EQ(out(), 16.0f);
  Func f = twice();
  f.bound(x, 0, f.output_buffer().width() / 8 * 8).vectorize(x, 8);
  Buffer<int> wide(16);
  f.realize(wide);
  EXPECT_EQ(line(wide), doubled(16));
}

// The buffers of a Tuple cover one region, so a promise about one holds for all.
TEST(Promises, OfTheSecondBufferOfATuple) {
  Func f("f");
  f(x) = Tuple(2 * x, cast<float>(x));
  f.output_buffers()[1].dim(0).set_min(4);
  Buffer<int> twice(8);
  Buffer<float> once(8);
  expect_error<RuntimeError>({"promised to be 4"}, [&] { f.realize({twice, once}); });
  twice.set_min(4);
  once.set_min(4);
  f.realize({twice, once});
  for (int i = 4; i < 12; i++) {
    EXPECT_EQ(twice(i), 2 * i);
    EXPECT_EQ(once(i), static_cast<float>(i));
  }
}

// ---- programs that Halide rejects ----

TEST(RealizedFuncs, TakeMoreUpdates) {
  Func f("f");
  f(x) = x;
  EXPECT_EQ(line(Buffer<int>(f.realize({3}))), (std::vector<int>{0, 1, 2}));
  f(x) += x;
  EXPECT_EQ(line(Buffer<int>(f.realize({10}))), doubled(10));
}

TEST(Splits, ArePredicatedAlsoWhereTheyAreSplitAgain) {
  const Var xo("xo"), xi("xi"), xio("xio"), xii("xii");
  using Schedule = std::function<void(Func&)>;
  for (const Schedule& schedule :
       {Schedule([&](Func& f) {
          f.split(x, xo, xi, 8, TailStrategy::PredicateStores).split(xi, xio, xii, 9);
        }),
        Schedule([&](Func& f) {
          f.split(x, xo, xi, 2).split(xi, xio, xii, 4, TailStrategy::PredicateLoads);
        })}) {
    for (const int size : {1, 7, 8, 10, 17}) {
      Func f = twice(), g("g");
      f.compute_root();
      schedule(f);
      g(x) = f(x);
      EXPECT_EQ(line(Buffer<int>(g.realize({size}))), doubled(size));
    }
  }
}

// Blending tails store the old values beyond the end in Halide; here they store nothing.
TEST(Splits, OfParallelUpdatesMayBlend) {
  const Var xo("xo"), xi("xi");
  using Schedule = std::function<void(Stage)>;
  for (const Schedule& schedule :
       {Schedule([&](Stage s) {
          s.split(x, xo, xi, 8, TailStrategy::RoundUp)
              .vectorize(xi, 16, TailStrategy::RoundUpAndBlend)
              .parallel(xo);
        }),
        Schedule(
            [&](Stage s) { s.vectorize(x, 8, TailStrategy::ShiftInwardsAndBlend).parallel(x); })}) {
    for (int round = 0; round < 20; round++) {
      Func f = twice();
      f(x) += 4;
      schedule(f.update());
      const Buffer<int> out = f.realize({64});
      for (int i = 0; i < 64; i++) ASSERT_EQ(out(i), 2 * i + 4);
    }
  }
}

TEST(Differences, AreFactoredAsSumsOfNegatives) {
  Param<int> columns("columns"), rows("rows");
  columns.set(7);
  rows.set(5);
  RDom r(3, columns, 2, rows);
  Func f("f");
  f(x) = 1000;
  f(x) -= r.x * r.y + x;
  f.update().rfactor(r.x, c);
  const Buffer<int> out = f.realize({2});
  EXPECT_EQ(out(0), 1000 - (3 + 4 + 5 + 6 + 7 + 8 + 9) * (2 + 3 + 4 + 5 + 6));
  EXPECT_EQ(out(1), out(0) - 35);
}

TEST(AsyncFuncs, ReadFuncsThatAreComputedOutsideOfThem) {
  for (int round = 0; round < 20; round++) {
    Func f("f"), g("g"), h("h");
    f(x) = x + 7;
    g(x) = f(x);
    h(x) = g(x);
    f.store_root().compute_at(h, x);
    g.store_root().compute_at(h, x).async();
    const Buffer<int> out = h.realize({32});
    for (int i = 0; i < 32; i++) ASSERT_EQ(out(i), i + 7);
  }
}

TEST(AsyncFuncs, ReadAsyncFuncsThatAreStoredInsideOfTheirLoop) {
  for (int round = 0; round < 20; round++) {
    Func f("f"), g("g"), h("h");
    f(x, y) = x + y;
    g(x, y) = f(x, y);
    h(x, y) = g(x, y - 1) + g(x, y + 1);
    f.compute_at(h, y).async();
    g.store_root().compute_at(h, y).async();
    const Buffer<int> out = h.realize({16, 16});
    for (int i = 0; i < 256; i++) ASSERT_EQ(out(i % 16, i / 16), 2 * (i % 16 + i / 16));
  }
}

TEST(SharedLoops, OfAnUpdateAndItsPureDefinition) {
  Func f("f");
  f(x, y) = x + y;
  f(x, y) += 2;
  f.update(0).compute_with(f, x);
  const Buffer<int> out = f.realize({10, 10});
  for (int i = 0; i < 100; i++) EXPECT_EQ(out(i % 10, i / 10), i % 10 + i / 10 + 2);
}

// Only the update reads "a", and only the pure definition reads the others.
TEST(SharedLoops, OfFuncsThatDifferentStagesRead) {
  Func a("a"), b("b"), d("d"), f("f");
  a(x, y) = x + y;
  b(x, y) = x - y;
  d(x, y) = x * y;
  f(x, y) = b(x + 2, y - 2) + d(x, y);
  f(x, y) += a(x - 1, y + 1);
  for (Func func : {a, b, d}) func.compute_at(f, y);
  d.compute_with(a, x);
  b.compute_with(a, x);
  const Buffer<int> out = f.realize({20, 20});
  for (int j = 0; j < 20; j++)
    for (int i = 0; i < 20; i++) ASSERT_EQ(out(i, j), (i - j + 4) + i * j + (i + j));
}

TEST(Inputs, OfOneNameWhereOneIsPartOfTheProgram) {
  ImageParam in(Int(32), 1, "input");
  Buffer<int> given(4), table(4, "input");
  given.fill(3);
  table.fill(5);
  in.set(given);
  Func f("f");
  f(x) = in(x) + 10 * table(x);
  EXPECT_EQ(line(Buffer<int>(f.realize({2}))), (std::vector<int>{53, 53}));
}

TEST(Levels, AreAskedAsSoonAsTheyAreSet) {
  EXPECT_EQ(LoopLevel::root().to_string(), "root");
  EXPECT_TRUE(LoopLevel::root().is_root());
}

TEST(AutoschedulerBesideTheUser, KeepsTheDirectivesThatThereAre) {
  Func f("f"), g("g");
  f(x, y) = x + y;
  g(x, y) = f(x + 10, y) + f(x, y);
  g.set_estimates({{0, 50}, {0, 40}});
  g.reorder(y, x);
  Pipeline(g).auto_schedule(get_jit_target_from_environment());
  const auto& loops = g.get_schedule().dims;
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_EQ(loops[0].var, "y");
  EXPECT_EQ(loops[1].runs, ForType::Serial);
  const Buffer<int> out = g.realize({50, 40});
  for (int i = 0; i < 2000; i++) ASSERT_EQ(out(i % 50, i / 50), 2 * (i % 50 + i / 50) + 10);
}

TEST(PartitionedLoops, MayHaveNothingToPartition) {
  Func f = twice();
  f.partition(x, Partition::Always);
  expect_ten(f);
}

}  // namespace
}  // namespace retrograde
