#include "ahd.h"

#include <string>

#include "bayer.h"
#include "medians.h"

namespace demosaic {

using lang::Expr;
using lang::Func;

namespace {

constexpr int median_rounds = 3;
constexpr int ball = 2;  // radius of the neighbourhood in which homogeneity is counted

Expr linear_light(const Expr& v) {
  return lang::select(v <= 0.04045f, v / 12.92f,
                      lang::pow((lang::max(v, 0.0f) + 0.055f) / 1.055f, 2.4f));
}

// The nonlinear function of CIE 1976 L*a*b*.
Expr lightness_of(const Expr& t) {
  constexpr float edge = 6.0f / 29.0f;
  return lang::select(t > edge * edge * edge, lang::pow(lang::max(t, edge * edge * edge), 1.0f / 3),
                      t / (3 * edge * edge) + 4.0f / 29.0f);
}

}  // namespace

Ahd::Ahd(const Func& mosaic) : mosaic(mosaic) {
  define_candidates();
  define_lab();
  define_homogeneity();
  image = chosen;
  for (int round = 0; round < median_rounds; ++round) image = refined(image, round);
}

void Ahd::define_candidates() {
  const auto along = [&](int steps) {
    return lang::select(d == 0, mosaic(x + steps, y), mosaic(x, y + steps));
  };
  const Expr here = mosaic(x, y);
  const Expr between = (2.0f * (along(-1) + here + along(1)) - along(-2) - along(2)) / 4.0f;
  green(x, y, d) = by_place(x, y, between, here, here, between);
  ratio(x, y, d) = mosaic(x, y) - green(x, y, d);

  const auto r = [&](int dx, int dy) { return Expr(ratio(x + dx, y + dy, d)); };
  const Expr row = (r(-1, 0) + r(1, 0)) / 2, column = (r(0, -1) + r(0, 1)) / 2;
  const Expr corners = (r(-1, -1) + r(1, -1) + r(-1, 1) + r(1, 1)) / 4;
  const Expr red = by_place(x, y, r(0, 0), row, column, corners);
  const Expr blue = by_place(x, y, corners, column, row, r(0, 0));
  candidate(x, y, c, d) =
      green(x, y, d) + lang::select(c == 0, red, lang::select(c == 1, 0.0f, blue));
}

void Ahd::define_lab() {
  // sRGB's primaries, each row divided by the coordinate of the white point.
  constexpr float to_xyz[3][3] = {{0.433953f, 0.376219f, 0.189828f},
                                  {0.212671f, 0.715160f, 0.072169f},
                                  {0.017758f, 0.109477f, 0.872765f}};
  Func light("light"), curved("curved");
  light(x, y, c, d) = linear_light(candidate(x, y, c, d));
  const auto row = [&](int n) {
    return to_xyz[n][0] * light(x, y, 0, d) + to_xyz[n][1] * light(x, y, 1, d) +
           to_xyz[n][2] * light(x, y, 2, d);
  };
  curved(x, y, c, d) =
      lightness_of(lang::select(c == 0, row(0), lang::select(c == 1, row(1), row(2))));
  const Expr fx = curved(x, y, 0, d), fy = curved(x, y, 1, d), fz = curved(x, y, 2, d);
  lab(x, y, c, d) = lang::select(c == 0, 116.0f * fy - 16.0f,
                                 lang::select(c == 1, 500.0f * (fx - fy), 200.0f * (fy - fz)));
}

void Ahd::define_homogeneity() {
  // The difference of the pixel at (dx, dy) in lightness, and in colour (squared), in the image of direction k.
  const auto lightness_step = [&](int dx, int dy, const Expr& k) {
    return lang::abs(lab(x + dx, y + dy, 0, k) - lab(x, y, 0, k));
  };
  const auto colour_step = [&](int dx, int dy, const Expr& k) {
    const Expr a = lab(x + dx, y + dy, 1, k) - lab(x, y, 1, k);
    const Expr b = lab(x + dx, y + dy, 2, k) - lab(x, y, 2, k);
    return a * a + b * b;
  };
  const auto better = [&](const auto& step) {
    return lang::min(lang::max(step(-1, 0, 0), step(1, 0, 0)),
                     lang::max(step(0, -1, 1), step(0, 1, 1)));
  };
  tolerance(x, y, c) = lang::select(c == 0, better(lightness_step), better(colour_step));
  Expr count = 0.0f;
  for (int dy = -ball; dy <= ball; ++dy) {
    for (int dx = -ball; dx <= ball; ++dx) {
      if (dx * dx + dy * dy > ball * ball) continue;
      count += lang::select(lightness_step(dx, dy, d) <= tolerance(x, y, 0) &&
                                colour_step(dx, dy, d) <= tolerance(x, y, 1),
                            1.0f, 0.0f);
    }
  }
  near(x, y, d) = count;
  Expr sum = 0.0f;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) sum += near(x + dx, y + dy, d);
  }
  homogeneity(x, y, d) = sum;
  const Expr rows = homogeneity(x, y, 0), columns = homogeneity(x, y, 1);
  const Expr share = lang::select(rows > columns, 1.0f, lang::select(rows < columns, 0.0f, 0.5f));
  chosen(x, y, c) = share * candidate(x, y, c, 0) + (1.0f - share) * candidate(x, y, c, 1);
}

// First red and blue, by their differences from green; then green, by its differences from both.
Func Ahd::refined(const Func& before, int round) const {
  const auto name = [&](const char* what) { return what + std::to_string(round); };
  Func from_green(name("from_green")), coloured(name("coloured")), again(name("from_colours"));
  Func after(name("refined"));
  from_green(x, y, c) = before(x, y, 2 * c) - before(x, y, 1);  // 0: red, 1: blue
  const Func smooth = median_3x3(from_green, x, y, {c}, name("median"));
  const Expr colour = before(x, y, 1) + smooth(x, y, c), here = mosaic(x, y);
  coloured(x, y, c) = lang::select(c == 0, by_place(x, y, here, colour, colour, colour),
                                   by_place(x, y, colour, colour, colour, here));
  again(x, y, c) = before(x, y, 1) - coloured(x, y, c);
  const Func smooth_again = median_3x3(again, x, y, {c}, name("median_again"));
  const Expr green_again =
      (smooth_again(x, y, 0) + smooth_again(x, y, 1) + coloured(x, y, 0) + coloured(x, y, 1)) /
      2.0f;
  after(x, y, c) = lang::select(c == 1, by_place(x, y, green_again, here, here, green_again),
                                coloured(x, y, c / 2));
  return after;
}

}  // namespace demosaic
