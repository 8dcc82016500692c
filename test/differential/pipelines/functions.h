// Math functions, compared within the ULP that the interpreter states.

PIPELINE(rounding_functions) {
  Buffer<float> a = noise<float>({256}, 1);
  Buffer<double> b = noise<double>({256}, 2);
  Expr halves = cast<float>(x - 128) / 2.0f;
  Func f("f");
  f(x) = Tuple(floor(a(x)), ceil(a(x)), round(a(x)), trunc(a(x)), fract(a(x)), floor(halves),
               ceil(halves), round(halves), trunc(halves), floor(b(x)), round(b(x)), ceil(b(x)));
  return {{f}, {{256}}, {}};
}

PIPELINE(exponentials) {
  Buffer<float> a = noise<float>({256}, 1);
  Expr p = abs(a(x)) + 0.125f;
  Func f("f");
  f(x) = Tuple(exp(a(x)), log(p), sqrt(p), pow(p, a(x)), pow(p, 3), hypot(a(x), p));
  return {{f}, {{256}}, {}};
}

PIPELINE(exponentials_double) {
  Buffer<double> a = noise<double>({128}, 1);
  Expr p = abs(a(x)) + cast<double>(0.125f);
  Func f("f");
  f(x) = Tuple(exp(a(x)), log(p), sqrt(p), pow(p, a(x)));
  return {{f}, {{128}}, {}};
}

PIPELINE(trigonometry) {
  Buffer<float> a = noise<float>({256}, 1), b = noise<float>({256}, 2);
  Expr unit = a(x) / 4.5f;
  Func f("f");
  f(x) =
      Tuple(sin(a(x)), cos(a(x)), tan(unit), asin(unit), acos(unit), atan(a(x)), atan2(a(x), b(x)));
  return {{f}, {{256}}, {}};
}

PIPELINE(hyperbolics) {
  Buffer<float> a = noise<float>({256}, 1);
  Expr unit = a(x) / 4.5f;
  Func f("f");
  f(x) =
      Tuple(sinh(a(x)), cosh(a(x)), tanh(a(x)), asinh(a(x)), acosh(abs(a(x)) + 1.0f), atanh(unit));
  return {{f}, {{256}}, {}};
}

PIPELINE(fast_functions) {
  Buffer<float> a = noise<float>({256}, 1);
  Expr p = abs(a(x)) + 0.125f;
  Func f("f");
  f(x) = Tuple(fast_exp(a(x)), fast_log(p), fast_pow(p, a(x)), fast_inverse(p),
               fast_inverse_sqrt(p), erf(a(x)));
  return {{f}, {{256}}, {}};
}

PIPELINE(classification) {
  Buffer<float> a = noise<float>({64}, 1);
  Expr p = strict_float(select(x % 4 == 0, a(x) / 0.0f, x % 4 == 1, sqrt(-1.0f - abs(a(x))), a(x)));
  Func f("f"), g("g");
  g(x) = p;
  f(x) =
      Tuple(strict_float(is_nan(g(x))), strict_float(is_inf(g(x))), strict_float(is_finite(g(x))));
  g.compute_root();
  return {{f}, {{64}}, {}};
}
