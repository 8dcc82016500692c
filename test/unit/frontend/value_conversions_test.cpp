// Conversions of numbers in the language: weights of lerp, saturating casts, division by bytes.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cmath>
#include <limits>

using namespace retrograde;

namespace {

using Wide = __int128;

// ---- averages of 64-bit values ----

template <typename T>
std::vector<T> ends();

Wide floor_half(Wide sum) { return (sum - (sum & 1)) / 2; }

// All pairs of values at the ends of the range, compared with 128-bit arithmetic.
template <typename T>
void expect_means() {
  const std::vector<T> values = ends<T>();
  const int n = static_cast<int>(values.size());
  Buffer<T> data(n);
  for (int i = 0; i < n; ++i) data(i) = values[static_cast<size_t>(i)];
  Var x("x"), y("y");
  Func f("means");
  const Expr a = data(x), b = data(y);
  f(x, y) = Tuple(halving_add(a, b), rounding_halving_add(a, b), halving_sub(a, b));
  Realization means = f.realize({n, n});
  Buffer<T> down = means[0], up = means[1], difference = means[2];
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const Wide u = data(i), v = data(j);
      EXPECT_EQ(down(i, j), static_cast<T>(floor_half(u + v))) << i << " " << j;
      EXPECT_EQ(up(i, j), static_cast<T>(floor_half(u + v + 1))) << i << " " << j;
      EXPECT_EQ(difference(i, j), static_cast<T>(floor_half(u - v))) << i << " " << j;
    }
  }
}

TEST(WideIntegers, MeansOfSixtyFourBitsLoseNothing) {
  expect_means<int64_t>();
  expect_means<uint64_t>();
  expect_means<int16_t>();
}

// ---- lerp ----

Wide nearest(Wide sum, Wide divisor) {
  const Wide half = divisor / 2;
  return sum >= 0 ? (sum + half) / divisor : -((half - sum) / divisor);
}

// The weight at the width of the values.
template <typename T, typename W>
Wide fixed_point(W weight) {
  const Wide whole = (Wide{1} << 8 * sizeof(T)) - 1;
  if constexpr (std::is_floating_point_v<W>) {
    using Product = std::conditional_t<sizeof(T) == 4, double, W>;
    return static_cast<Wide>(static_cast<Product>(weight) * static_cast<Product>(whole));
  } else {
    const Wide range = std::numeric_limits<W>::max();
    return range >= whole ? weight / (range / whole) : weight * (whole / range);
  }
}

template <typename T>
std::vector<T> ends() {
  constexpr T low = std::numeric_limits<T>::min(), high = std::numeric_limits<T>::max();
  return {low, high, T(0), T(1), T(high / 3), T(low / 2 + 7), T(101), T(high - 1)};
}

template <typename T, typename W>
void expect_weights(const std::vector<W>& weights) {
  const std::vector<T> values = ends<T>();
  const int n = static_cast<int>(values.size());
  Buffer<T> table(n);
  Buffer<W> of(static_cast<int>(weights.size()));
  for (int i = 0; i < n; i++) table(i) = values[i];
  for (size_t i = 0; i < weights.size(); i++) of(static_cast<int>(i)) = weights[i];
  Var w("w"), a("a"), b("b");
  Func f("f");
  f(w, a, b) = lerp(table(a), table(b), of(w));
  f.vectorize(w, 8, TailStrategy::GuardWithIf);
  const Buffer<T> result = f.realize({of.width(), n, n});
  const Wide whole = (Wide{1} << 8 * sizeof(T)) - 1;
  for (int k = 0; k < of.width(); k++) {
    const Wide weight = fixed_point<T>(weights[k]);
    for (int i = 0; i < n; i++) {
      for (int j = 0; j < n; j++) {
        const Wide exact = Wide{values[i]} * (whole - weight) + Wide{values[j]} * weight;
        ASSERT_EQ(result(k, i, j), static_cast<T>(nearest(exact, whole)))
            << "between " << +values[i] << " and " << +values[j] << " by " << weights[k];
      }
    }
  }
}

template <typename W>
std::vector<W> shares_of(int whole) {
  std::vector<W> weights;
  for (int k = 0; k <= whole; k++) weights.push_back(static_cast<W>(k) / static_cast<W>(whole));
  for (int k = 0; k <= 1000; k++) weights.push_back(static_cast<W>(k) / static_cast<W>(1000));
  return weights;
}

TEST(Lerp, EveryShareOfTheRangeIsAWeightOfItsOwn) {
  expect_weights<uint8_t>(shares_of<float>(255));
  expect_weights<int8_t>(shares_of<float>(255));
  expect_weights<uint16_t>(shares_of<float>(65535));
  expect_weights<int16_t>(shares_of<float>(65535));
  expect_weights<uint16_t>(shares_of<double>(4096));
  expect_weights<int32_t>(shares_of<float>(4096));
  expect_weights<uint32_t>(shares_of<double>(4096));
}

TEST(Lerp, From0To65535AShareIsItsNumerator) {
  Buffer<float> share(65536);
  for (int k = 0; k < 65536; k++) share(k) = static_cast<float>(k) / 65535.0f;
  Var x;
  Func f;
  f(x) = lerp(cast<uint16_t>(0), cast<uint16_t>(65535), share(x));
  const Buffer<uint16_t> result = f.realize({65536});
  int wrong = 0;
  for (int k = 0; k < 65536; k++) wrong += result(k) != k;
  EXPECT_EQ(wrong, 0);
}

TEST(Lerp, WeightsWiderThanTheValuesAreNarrowed) {
  std::vector<uint16_t> words;
  for (int k = 0; k < 65536; k++) words.push_back(static_cast<uint16_t>(k));
  std::vector<uint32_t> longs{0, 1, 0x7fffffff, 0x80000000, 0x01010101, 0x01010100, 0xffffffff};
  for (uint32_t k = 1; k < 2000; k++) longs.push_back(k * 2654435761u);
  expect_weights<uint8_t>(words);
  expect_weights<int8_t>(words);
  expect_weights<uint8_t>(longs);
  expect_weights<int16_t>(longs);
}

// ---- saturating_cast ----

constexpr double infinity = std::numeric_limits<double>::infinity();

Buffer<double> extremes() {
  const double values[] = {infinity, -infinity, NAN, 1e300, -1e300, 1e6, 65504, 65520, -2.75, 0.0};
  Buffer<double> result(10);
  for (int i = 0; i < 10; i++) result(i) = values[i];
  return result;
}

template <typename T>
Buffer<double> saturated(Type type) {
  const Buffer<double> in = extremes();
  Var x;
  Func f;
  f(x) = cast<double>(saturating_cast(type, cast<T>(in(x))));
  return f.realize({10});
}

TEST(SaturatingCast, WideFloatsRangeFromInfinityToInfinity) {
  for (const Type type : {Float(32), BFloat(16)}) {
    const Buffer<double> out = saturated<double>(type);
    EXPECT_EQ(out(0), infinity);
    EXPECT_EQ(out(1), -infinity);
    EXPECT_TRUE(std::isnan(out(2)));
    EXPECT_EQ(out(3), infinity);
    EXPECT_EQ(out(4), -infinity);
    EXPECT_EQ(out(8), -2.75);
  }
  const Buffer<double> wider = saturated<float>(Float(64));
  EXPECT_EQ(wider(0), infinity);
  EXPECT_EQ(wider(1), -infinity);
}

TEST(SaturatingCast, Float16EndsAt65504) {
  for (const Buffer<double>& out : {saturated<double>(Float(16)), saturated<float>(Float(16)),
                                    saturated<bfloat16_t>(Float(16))}) {
    EXPECT_EQ(out(0), 65504);
    EXPECT_EQ(out(1), -65504);
    EXPECT_TRUE(std::isnan(out(2)));
    EXPECT_EQ(out(3), 65504);
    EXPECT_EQ(out(4), -65504);
    EXPECT_EQ(out(5), 65504);
    EXPECT_EQ(out(8), -2.75);
  }
}

TEST(SaturatingCast, InfinitiesBecomeTheEndsOfIntegers) {
  const Buffer<double> bytes = saturated<float>(UInt(8)), ints = saturated<double>(Int(32));
  EXPECT_EQ(bytes(0), 255);
  EXPECT_EQ(bytes(1), 0);
  EXPECT_EQ(ints(0), INT32_MAX);
  EXPECT_EQ(ints(1), INT32_MIN);
  EXPECT_EQ(ints(3), INT32_MAX);
}

template <typename To, typename From>
To nearest_integer(From value) {
  constexpr To low = std::numeric_limits<To>::min(), high = std::numeric_limits<To>::max();
  if (std::isnan(value)) return 0;
  if (value <= static_cast<From>(low)) return low;
  return value >= static_cast<From>(high) ? high : static_cast<To>(value);
}

// The ends of the type and their neighbours, as vectors and as scalars.
template <typename To, typename From>
void expect_saturated() {
  const From inf = std::numeric_limits<From>::infinity();
  std::vector<From> values{inf,        -inf,         From(NAN),    -From(NAN),
                           From(-0.0), From(0.999f), From(-0.999f)};
  for (const To end : {std::numeric_limits<To>::min(), std::numeric_limits<To>::max()}) {
    const From middle = static_cast<From>(end);
    for (const From v :
         {middle, middle + 1, middle - 1, middle + From(0.5), middle - From(0.5),
          std::nextafter(middle, inf), std::nextafter(middle, -inf), middle * 2, middle / 2})
      values.push_back(v);
  }
  while (values.size() % 16) values.push_back(static_cast<From>(values.size()));
  const int n = static_cast<int>(values.size());
  Buffer<From> in(n);
  for (int i = 0; i < n; i++) in(i) = values[static_cast<size_t>(i)];
  for (const int lanes : {1, 4, 8, 16}) {
    Var x("x"), xo("xo"), xi("xi");
    Func f("f");
    f(x) = saturating_cast<To>(in(x));
    f.split(x, xo, xi, lanes).serial(xo);
    if (lanes > 1) f.vectorize(xi);
    const Buffer<To> out = f.realize({n});
    for (int i = 0; i < n; i++)
      EXPECT_EQ(out(i), (nearest_integer<To>(in(i)))) << in(i) << " in vectors of " << lanes;
  }
}

template <typename From>
void expect_all_saturated() {
  expect_saturated<int8_t, From>(), expect_saturated<uint8_t, From>();
  expect_saturated<int16_t, From>(), expect_saturated<uint16_t, From>();
  expect_saturated<int32_t, From>(), expect_saturated<uint32_t, From>();
  expect_saturated<int64_t, From>(), expect_saturated<uint64_t, From>();
}

TEST(SaturatingCast, IntegersOfFloatsEndAtTheirEnds) {
  expect_all_saturated<float>();
  expect_all_saturated<double>();
}

TEST(SaturatingCast, ConstantsFoldToTheSame) {
  EXPECT_EQ(*ir::as_const_float(saturating_cast<float>(Expr(1e300))), infinity);
  EXPECT_EQ(*ir::as_const_float(saturating_cast<float>(Expr(-infinity))), -infinity);
  EXPECT_EQ(*ir::as_const_float(saturating_cast<float16_t>(Expr(infinity))), 65504);
}

// ---- division by bytes ----

template <typename T>
void expect_divisions() {
  constexpr int count = 600;
  Buffer<T> numerator(count);
  Buffer<uint8_t> divisor(256);
  for (int i = 0; i < count; i++) {
    numerator(i) = static_cast<T>(i < 256 ? i - 128 : i * 2654435761ll);
    if (i < 256) divisor(i) = static_cast<uint8_t>(i);
  }
  Var x("x"), d("d");
  Func f("f");
  f(x, d) = Tuple(fast_integer_divide(numerator(x), divisor(d)),
                  fast_integer_modulo(numerator(x), divisor(d)),
                  fast_integer_divide_round_to_zero(numerator(x), divisor(d)));
  f.vectorize(x, 8);
  Realization out = f.realize({count, 256});
  const Buffer<T> quotient = out[0], remainder = out[1], truncated = out[2];
  for (int i = 0; i < count; i++) {
    for (int k = 0; k < 256; k++) {
      const int64_t n = numerator(i), by = k ? k : 256;
      const int64_t q = n / by - (n % by < 0);
      ASSERT_EQ(quotient(i, k), static_cast<T>(q)) << n << " / " << by;
      ASSERT_EQ(remainder(i, k), static_cast<T>(n - q * by)) << n << " % " << by;
      ASSERT_EQ(truncated(i, k), static_cast<T>(n / by)) << n << " / " << by;
    }
  }
}

TEST(FastIntegerDivide, EveryDivisorOfEveryType) {
  expect_divisions<int8_t>();
  expect_divisions<uint8_t>();
  expect_divisions<int16_t>();
  expect_divisions<uint16_t>();
  expect_divisions<int32_t>();
  expect_divisions<uint32_t>();
}

TEST(FastIntegerDivide, LiteralDivisors) {
  Var x;
  Func f;
  f(x) = fast_integer_divide(cast<int8_t>(x - 100), 200);
  const Buffer<int8_t> out = f.realize({3});
  EXPECT_EQ(out(0), -1);
}

// ---- bounds of inputs ----

struct Query {
  ImageParam in{Int(32), 1, "in"};
  Func f{"f"};
  Var x{"x"};
  Query() { f(x) = in(x + 2); }
  void expect(int min, int extent) {
    f.infer_input_bounds({8});
    EXPECT_EQ(in.get().dim(0).min(), min);
    EXPECT_EQ(in.get().dim(0).extent(), extent);
    f.realize({8});
  }
};

TEST(InferInputBounds, PromisedBoundsStand) {
  Query q;
  q.in.dim(0).set_bounds(0, 32);
  q.expect(0, 32);
}

TEST(InferInputBounds, APromisedExtentBeginsWhereTheRegionDoes) {
  Query q;
  q.in.dim(0).set_extent(32);
  q.expect(2, 32);
}

TEST(InferInputBounds, APromisedMinReachesToTheRegionsEnd) {
  Query q;
  q.in.dim(0).set_min(0);
  q.expect(0, 10);
}

TEST(InferInputBounds, AnExtentPromisedToBeAMultipleIsRounded) {
  Query q;
  q.in.dim(0).set_extent((q.in.dim(0).extent() + 15) / 16 * 16);
  q.expect(2, 16);
}

TEST(InferInputBounds, PromisesAboutAnotherInput) {
  ImageParam a(Int(32), 1, "a"), b(Int(32), 1, "b");
  b.dim(0).set_bounds(a.dim(0).min(), a.dim(0).extent());
  Var x("x");
  Func f("f");
  f(x) = a(x) + a(x + 5) + b(x + 3);
  f.infer_input_bounds({8});
  EXPECT_EQ(b.get().dim(0).min(), 0);
  EXPECT_EQ(b.get().dim(0).extent(), 13);
  f.realize({8});
}

TEST(InferInputBounds, PromisesThatNeedMoreThanTheyAllow) {
  Query q;
  q.in.dim(0).set_bounds(0, 4);
  try {
    q.f.infer_input_bounds({8});
    q.f.realize({8});
    FAIL() << "no error";
  } catch (const RuntimeError& error) {
    EXPECT_EQ(error.code(), -7) << error.what();
  }
}

TEST(InferInputBounds, OutputsThatAreAsLongAsAParamSays) {
  for (const bool is_long : {false, true}) {
    Query q;
    Param<bool> p("p");
    p.set(is_long);
    q.f.output_buffer().dim(0).set_bounds(0, select(p, 16, 8));
    Buffer<int> out(is_long ? 16 : 8);
    q.f.infer_input_bounds(out);
    EXPECT_EQ(q.in.get().dim(0).min(), 2);
    EXPECT_EQ(q.in.get().dim(0).extent(), is_long ? 16 : 8);
    q.f.realize(out);
  }
}

}  // namespace
