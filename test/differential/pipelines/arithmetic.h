// Scalar arithmetic: every type, every operator, promotion.

template <typename T>
Built integer_arithmetic() {
  Buffer<T> a = edges<T>({61, 7}, 1), b = edges<T>({61, 7}, 2);
  Expr p = a(x, y), q = b(x, y);
  Func f("f");
  f(x, y) = Tuple(p + q, p - q, p * q, p / q, p % q, min(p, q), max(p, q), p & q, p | q, p ^ q, ~p);
  return {{f}, {{61, 7}}, {}};
}
PIPELINE(arithmetic_int8) { return integer_arithmetic<int8_t>(); }
PIPELINE(arithmetic_int16) { return integer_arithmetic<int16_t>(); }
PIPELINE(arithmetic_int32) { return integer_arithmetic<int32_t>(); }
PIPELINE(arithmetic_int64) { return integer_arithmetic<int64_t>(); }
PIPELINE(arithmetic_uint8) { return integer_arithmetic<uint8_t>(); }
PIPELINE(arithmetic_uint16) { return integer_arithmetic<uint16_t>(); }
PIPELINE(arithmetic_uint32) { return integer_arithmetic<uint32_t>(); }
PIPELINE(arithmetic_uint64) { return integer_arithmetic<uint64_t>(); }

// Chains of minima and maxima, some of negations; also as a loop.
template <typename T>
Built minima() {
  Buffer<T> a = edges<T>({61, 7}, 1), b = edges<T>({61, 7}, 2), c = edges<T>({61, 7}, 3);
  Expr p = a(x, y), q = -(b(x, y) / 2), s = c(x, y);
  RDom r(0, 7, "r");
  Func f("f"), g("g");
  f(x, y) = Tuple(min(min(p, q), s), max(max(p, q), s), max(max(q, -q), s),
                  min(min(p, q), -(s / 2)), max(min(max(p, q), s), q), min(min(min(p, s), q), ~s));
  g(x, y) = Tuple(a(x, y), a(x, y));
  Expr next = -(b(x, r) / 2);
  g(x, y) = Tuple(min(g(x, y)[0], next), max(g(x, y)[1], next));
  return {{f, g}, {{61, 7}, {61, 7}}, {}};
}
PIPELINE(minima_int8) { return minima<int8_t>(); }
PIPELINE(minima_int16) { return minima<int16_t>(); }
PIPELINE(minima_int32) { return minima<int32_t>(); }
PIPELINE(minima_uint32) { return minima<uint32_t>(); }

template <typename T>
Built float_arithmetic() {
  Buffer<T> a = noise<T>({61, 7}, 1), b = noise<T>({61, 7}, 2);
  Expr p = a(x, y), q = b(x, y);
  Func f("f");
  f(x, y) =
      Tuple(p + q, p - q, p * q, p / q, min(p, q), max(p, q), -p, abs(p), p * q + p, p * p - q * q);
  return {{f}, {{61, 7}}, {}};
}
PIPELINE(arithmetic_float32) { return float_arithmetic<float>(); }
PIPELINE(arithmetic_float64) { return float_arithmetic<double>(); }

PIPELINE(arithmetic_float16) {
  Buffer<float> a = noise<float>({61}, 1), b = noise<float>({61}, 2);
  Expr p = cast<float16_t>(a(x)), q = cast<float16_t>(b(x));
  Func f("f");
  f(x) = Tuple(p + q, p - q, p * q, p / q, min(p, q), cast<float>(p), p < q, cast<int32_t>(p),
               select(p > q, p, q));
  return {{f}, {{61}}, {}};
}

PIPELINE(arithmetic_bfloat16) {
  Buffer<float> a = noise<float>({61}, 1), b = noise<float>({61}, 2);
  Expr p = cast<bfloat16_t>(a(x)), q = cast<bfloat16_t>(b(x));
  Func f("f");
  f(x) = Tuple(p + q, p - q, p * q, max(p, q), cast<float>(p), p < q);
  return {{f}, {{61}}, {}};
}

PIPELINE(division_by_constants) {
  Buffer<int8_t> a = edges<int8_t>({256}, 3);
  Buffer<uint16_t> b = edges<uint16_t>({256}, 4);
  Buffer<int32_t> w = edges<int32_t>({256}, 5);
  Func f("f");
  f(x) = Tuple(a(x) / 3, a(x) % 3, a(x) / -5, a(x) % -5, b(x) / 7, b(x) % 7, b(x) / 641, w(x) / 2,
               w(x) % 2, w(x) / -4, w(x) % -4, w(x) / 1000, w(x) % 10, 100 / w(x), 100 % w(x));
  return {{f}, {{256}}, {}};
}

template <typename T>
Built comparisons() {
  Buffer<T> a = edges<T>({61, 7}, 1), b = edges<T>({61, 7}, 2);
  Expr p = a(x, y), q = b(x, y);
  Func f("f");
  f(x, y) = Tuple(p == q, p != q, p<q, p <= q, p> q, p >= q, (p < q) && (p != 0),
                  (p < q) || !(q == 1), select(p < q, p, q));
  return {{f}, {{61, 7}}, {}};
}
PIPELINE(comparisons_int8) { return comparisons<int8_t>(); }
PIPELINE(comparisons_uint32) { return comparisons<uint32_t>(); }
PIPELINE(comparisons_int64) { return comparisons<int64_t>(); }
PIPELINE(comparisons_float32) { return comparisons<float>(); }

template <typename T>
Built shifts() {
  Buffer<T> a = edges<T>({64, 8}, 1);
  const int bits = sizeof(T) * 8;
  Expr p = a(x, y), amount = cast<T>(x % bits), either = cast<int8_t>(x % bits - y % 3);
  Func f("f");
  f(x, y) = Tuple(p << amount, p >> amount, p << cast<uint8_t>(x % bits), p >> 3, p << 2,
                  p << clamp(either, cast<int8_t>(1 - bits), cast<int8_t>(bits - 1)),
                  p >> clamp(either, cast<int8_t>(1 - bits), cast<int8_t>(bits - 1)));
  return {{f}, {{64, 8}}, {}};
}
PIPELINE(shifts_uint8) { return shifts<uint8_t>(); }
PIPELINE(shifts_int16) { return shifts<int16_t>(); }
PIPELINE(shifts_uint32) { return shifts<uint32_t>(); }
PIPELINE(shifts_int64) { return shifts<int64_t>(); }

template <typename T>
Built bit_counts() {
  Buffer<T> a = edges<T>({64, 4}, 9);
  Expr p = a(x, y) | cast<T>(1);
  Func f("f");
  f(x, y) = Tuple(popcount(a(x, y)), count_leading_zeros(p), count_trailing_zeros(p));
  return {{f}, {{64, 4}}, {}};
}
PIPELINE(bit_counts_uint8) { return bit_counts<uint8_t>(); }
PIPELINE(bit_counts_int16) { return bit_counts<int16_t>(); }
PIPELINE(bit_counts_uint32) { return bit_counts<uint32_t>(); }
PIPELINE(bit_counts_uint64) { return bit_counts<uint64_t>(); }

// The result types are compared, too; they are the point of this case.
PIPELINE(promotion) {
  Buffer<uint8_t> u8 = noise<uint8_t>({64}, 1);
  Buffer<int8_t> i8 = noise<int8_t>({64}, 2);
  Buffer<uint16_t> u16 = noise<uint16_t>({64}, 3);
  Buffer<int16_t> i16 = noise<int16_t>({64}, 4);
  Buffer<uint32_t> u32 = noise<uint32_t>({64}, 5);
  Buffer<int32_t> i32 = noise<int32_t>({64}, 6);
  Buffer<float> f32 = noise<float>({64}, 7);
  Buffer<double> f64 = noise<double>({64}, 8);
  Func f("f");
  f(x) = Tuple(u8(x) + i8(x), u8(x) + u16(x), i8(x) * u16(x), i16(x) - u8(x), u8(x) + 1,
               i8(x) + 100, u16(x) * x, u32(x) - i8(x), i32(x) + u32(x), u8(x) * 0.5f,
               i32(x) + f32(x), f32(x) * 2, f32(x) * f64(x), u8(x) < i8(x), 1 - u8(x),
               select(x > 3, u8(x), 7), min(u8(x), i32(x)), u16(x) & 255, i8(x) / u8(x));
  return {{f}, {{64}}, {}};
}

PIPELINE(integer_casts) {
  Buffer<int16_t> a = edges<int16_t>({128}, 1);
  Buffer<uint32_t> b = noise<uint32_t>({128}, 2);
  Buffer<int64_t> w = noise<int64_t>({128}, 3);
  Func f("f");
  f(x) = Tuple(cast<int8_t>(a(x)), cast<uint8_t>(a(x)), cast<uint16_t>(a(x)), cast<int32_t>(a(x)),
               cast<uint32_t>(a(x)), cast<uint64_t>(a(x)), cast<int8_t>(b(x)), cast<int16_t>(w(x)),
               cast<uint8_t>(w(x)), cast<bool>(a(x) & 1), cast<int32_t>(a(x) > 0),
               cast<float>(a(x)), cast<double>(w(x)), cast<float>(b(x)));
  return {{f}, {{128}}, {}};
}

PIPELINE(float_to_integer_casts) {
  Buffer<float> a = noise<float>({128}, 1);
  Expr scaled = a(x) * 25.25f;
  Func f("f");
  f(x) =
      Tuple(cast<int8_t>(scaled), cast<uint8_t>(abs(scaled)), cast<int16_t>(a(x) * 1000.5f),
            cast<int32_t>(a(x) * 0x1p20f), cast<uint32_t>(abs(a(x)) * 0x1p20f),
            cast<int64_t>(a(x) * 0x1p30f), cast<double>(a(x)), cast<float>(cast<double>(a(x)) / 3));
  return {{f}, {{128}}, {}};
}

PIPELINE(saturating_casts) {
  Buffer<int16_t> a = edges<int16_t>({128}, 1);
  Buffer<float> b = noise<float>({128}, 2);
  Buffer<uint32_t> w = noise<uint32_t>({128}, 3);
  Func f("f");
  f(x) = Tuple(saturating_cast<uint8_t>(a(x)), saturating_cast<int8_t>(a(x)),
               saturating_cast<uint16_t>(a(x)), saturating_cast<int32_t>(a(x)),
               saturating_cast<uint8_t>(b(x) * 100.f), saturating_cast<int8_t>(b(x) * 100.f),
               saturating_cast<int16_t>(b(x) * 1e5f), saturating_cast<int8_t>(w(x)),
               saturating_cast<uint8_t>(w(x)), saturating_cast<uint64_t>(a(x)));
  return {{f}, {{128}}, {}};
}

PIPELINE(saturating_float_casts) {
  Buffer<double> d = noise<double>({128}, 1);
  Func f("f");
  f(x) = Tuple(saturating_cast<float>(d(x) * Expr(1e300)), saturating_cast<float>(d(x)),
               saturating_cast<double>(cast<float>(d(x))),
               saturating_cast<int32_t>(d(x) * Expr(1e300)),
               saturating_cast<uint8_t>(d(x) * Expr(1e300)));
  return {{f}, {{128}}, {}};
}

PIPELINE(absolute_differences) {
  Buffer<int8_t> a = edges<int8_t>({128}, 1), b = edges<int8_t>({128}, 2);
  Buffer<uint16_t> p = edges<uint16_t>({128}, 3), q = edges<uint16_t>({128}, 4);
  Buffer<float> r = noise<float>({128}, 5), s = noise<float>({128}, 6);
  Func f("f");
  f(x) = Tuple(abs(a(x)), absd(a(x), b(x)), absd(p(x), q(x)), absd(r(x), s(x)), abs(r(x)));
  return {{f}, {{128}}, {}};
}

// Weights no wider than the values: Halide rounds these exactly, as documented.
PIPELINE(lerp_integers) {
  Buffer<uint8_t> a = edges<uint8_t>({128}, 1), b = edges<uint8_t>({128}, 2),
                  w = edges<uint8_t>({128}, 3);
  Buffer<uint16_t> p = edges<uint16_t>({128}, 4), q = edges<uint16_t>({128}, 5),
                   v = edges<uint16_t>({128}, 6);
  Buffer<int8_t> m = edges<int8_t>({128}, 7), n = edges<int8_t>({128}, 8);
  Func f("f");
  f(x) = Tuple(lerp(a(x), b(x), w(x)), lerp(p(x), q(x), v(x)), lerp(p(x), q(x), w(x)),
               lerp(m(x), n(x), w(x)), lerp(a(x), b(x), cast<float>(w(x)) / 256.0f));
  return {{f}, {{128}}, {}};
}

// Weights that are fractions of the 16-bit range, and weights wider than the values.
PIPELINE(lerp_weights) {
  Buffer<uint16_t> p = edges<uint16_t>({4096}, 1), q = edges<uint16_t>({4096}, 2),
                   v = noise<uint16_t>({4096}, 3);
  Buffer<uint8_t> a = edges<uint8_t>({4096}, 4), b = edges<uint8_t>({4096}, 5);
  Buffer<uint32_t> w = noise<uint32_t>({4096}, 6);
  Buffer<float> share(4096);
  for (int i = 0; i < 4096; ++i) share(i) = static_cast<float>(16 * i + 5) / 65535.0f;
  Func f("f");
  f(x) = Tuple(lerp(p(x), q(x), share(x)), lerp(cast<int16_t>(p(x)), cast<int16_t>(q(x)), share(x)),
               lerp(a(x), b(x), share(x)), lerp(p(x), q(x), cast<double>(share(x))),
               lerp(cast<int32_t>(p(x)) * 30000, cast<int32_t>(q(x)) * 25000, share(x)),
               lerp(a(x), b(x), v(x)), lerp(a(x), b(x), w(x)), lerp(p(x), q(x), w(x)));
  return {{f}, {{4096}}, {}};
}

PIPELINE(lerp_floats) {
  Buffer<float> a = noise<float>({128}, 1), b = noise<float>({128}, 2);
  Func f("f");
  Expr weight = x / 127.0f;
  f(x) = Tuple(lerp(a(x), b(x), weight), lerp(cast<double>(a(x)), cast<double>(b(x)), weight),
               lerp(a(x), b(x), cast<uint8_t>(x)));
  return {{f}, {{128}}, {}};
}

PIPELINE(reinterpretation) {
  Buffer<float> a = noise<float>({64}, 1);
  Buffer<int16_t> b = edges<int16_t>({64}, 2);
  Func f("f");
  f(x) = Tuple(reinterpret<uint32_t>(a(x)), reinterpret<int32_t>(a(x)), reinterpret<uint16_t>(b(x)),
               reinterpret<float>(reinterpret<uint32_t>(a(x)) ^ 0x00400000u));
  return {{f}, {{64}}, {}};
}

PIPELINE(clamps_and_selects) {
  Buffer<int16_t> a = noise<int16_t>({64}, 1);
  Expr p = a(x);
  Func f("f");
  f(x) = Tuple(clamp(p, -100, 100), clamp(p, cast<int16_t>(x), cast<int16_t>(x + 50)),
               min(p, 3, cast<int16_t>(x)), max(p, 3, cast<int16_t>(x)),
               select(p < -1000, 1, p < 0, 2, p < 1000, 3, 4), mux(x % 4, {p, p + 1, p * 2, -p}),
               likely(p) + 1, unsafe_promise_clamped(x, 0, 63));
  return {{f}, {{64}}, {}};
}
