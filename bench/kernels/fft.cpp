// fft -- complex Fourier transforms of a batch of 256 x 256 pictures: four passes of radix 4
// (Cooley and Tukey 1965) along y, then along x.
//
// A pass runs over vectors of adjacent columns, so that no butterfly crosses lanes. A task transforms a strip of
// columns in cache and stores it transposed for the other direction.
#include "kernel.h"

namespace kernels {

namespace {

struct Complex {
  Expr re, im;
  Complex(Expr r, Expr i) : re(r), im(i) {}
  explicit Complex(const FuncRef& at) : re(at[0]), im(at[1]) {}
};
Complex operator+(const Complex& a, const Complex& b) { return {a.re + b.re, a.im + b.im}; }
Complex operator-(const Complex& a, const Complex& b) { return {a.re - b.re, a.im - b.im}; }
Complex operator*(const Complex& a, const Complex& b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
Complex times_minus_i(const Complex& a) { return {a.im, -a.re}; }

constexpr int length = 256;

// Transforms the columns of f(x, y, n); the result is transposed. twiddle(k) is exp(-2 pi i k / 256).
//
// With y = 64 a + 16 b + 4 c + d in digits, the passes replace a, b, c and d in turn by digits of the frequency (the
// order of Stockham's method). After s passes a point is (x, i, k, o, n): i holds the s - 1 earlier digits of the
// frequency, k the newest one, and o the remaining digits of y. In that order, its position is (o * 4 + k) * 4^(s - 1)
// + i.
Func transform_columns(const Func& f, const Func& twiddle, const Setup& setup,
                       const std::string& name) {
  const int lanes = setup.lanes<float>();
  Var x("x"), y("y"), n("n"), i("i"), k("k"), o("o"), xi("xi"), yo("yo"), yi("yi");
  Var strip("strip");
  Func transposed(name);
  std::vector<Func> passes, butterflies;
  for (int s = 0, done = 1; s < 4; s++, done *= 4) {
    const std::string number = std::to_string(s);
    Func butterfly(name + "_butterfly_" + number), pass(name + "_pass_" + number);
    const int stride = length / 4 / done;  // of digit a in o
    auto input = [&](int a) {
      if (s == 0) return Complex(f(x, a * stride + o, n));
      Complex value(passes.back()(x, i % (done / 4), i / (done / 4), a * stride + o, n));
      return a == 0 ? value : value * Complex(twiddle(i * (a * stride)));
    };
    Complex i0 = input(0), i1 = input(1), i2 = input(2), i3 = input(3);
    Complex even_sum = i0 + i2, even_difference = i0 - i2;
    Complex odd_sum = i1 + i3, odd_difference = times_minus_i(i1 - i3);
    Complex out[] = {even_sum + odd_sum, even_difference + odd_difference, even_sum - odd_sum,
                     even_difference - odd_difference};
    butterfly(x, i, o, n) = Tuple(out[0].re, out[0].im, out[1].re, out[1].im, out[2].re, out[2].im,
                                  out[3].re, out[3].im);
    FuncRef four = butterfly(x, i, o, n);
    pass(x, i, k, o, n) = Tuple(mux(k, {four[0], four[2], four[4], four[6]}),
                                mux(k, {four[1], four[3], four[5], four[7]}));
    pass.bound(i, 0, done).bound(k, 0, 4);
    passes.push_back(pass);
    butterflies.push_back(butterfly);
  }
  FuncRef last = passes.back()(y, x % (length / 4), x / (length / 4), 0, n);
  transposed(x, y, n) = Tuple(last[0], last[1]);

  if (setup.by_hand()) {
    transposed.compute_root().bound(x, 0, length).bound(y, 0, length);
    transposed.split(y, strip, yo, lanes).split(yo, yo, yi, 8).split(x, x, xi, lanes);
    transposed.reorder(xi, yi, x, yo, strip, n).vectorize(xi).unroll(yi).parallel(n);
    for (int s = 0; s < 4; s++) {
      passes[s].compute_at(transposed, strip).reorder(x, k, i, o, n).vectorize(x, lanes).unroll(k);
      butterflies[s].compute_at(passes[s], i).vectorize(x, lanes);
    }
  }
  return transposed;
}

}  // namespace

Kernel fft(const Setup& setup) {
  const int batch = setup.size(24, 2);
  ImageParam input(Float(32), 4, "input");  // x, y, picture, real or imaginary part
  Var x("x"), y("y"), n("n"), k("k");
  Func source("source"), twiddle("twiddle");
  source(x, y, n) = Tuple(input(x, y, n, 0), input(x, y, n, 1));
  Expr angle = cast<float>(k) * static_cast<float>(-2 * 3.14159265358979 / length);
  twiddle(k) = Tuple(cos(angle), sin(angle));
  if (setup.by_hand()) twiddle.compute_root().vectorize(k, setup.lanes<float>());

  Func columns = transform_columns(source, twiddle, setup, "columns");
  Func rows = transform_columns(columns, twiddle, setup, "rows");

  Buffer<float> pictures = make_image<float>({length, length, batch, 2});
  bind(input, pictures);
  Buffer<float> re(length, length, batch), im(length, length, batch);
  // 4 passes of 64 butterflies along 2 x 256 lines; 16 additions and 3 complex products each.
  return {Pipeline(rows), {pictures}, {re, im}, 2.0 * 256 * 64 * (4 * 16 + 3 * 3 * 6) * batch};
}

}  // namespace kernels
