#include "reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "photographs.h"

namespace demosaic::reference {

namespace {

// An image that is mirrored beyond its borders before anything is computed from it, so derived values there come from
// mirrored samples. Every stage is thus a function of any position; its values are cached.
class Stage {
 public:
  using Rule = std::function<double(int x, int y)>;
  Stage(const Mosaic& mosaic, int border, const Rule& rule)
      : Stage(mosaic.width, mosaic.height, border, rule) {}
  Stage(int width, int height, int border, const Rule& rule)
      : border_(border), width_(width + 2 * border) {
    for (int y = -border; y < height + border; ++y) {
      for (int x = -border; x < width + border; ++x) values_.push_back(rule(x, y));
    }
  }
  double operator()(int x, int y) const {
    return values_.at(static_cast<size_t>(y + border_) * static_cast<size_t>(width_) +
                      static_cast<size_t>(x + border_));
  }

 private:
  int border_, width_;
  std::vector<double> values_;
};

// 0: red, 1: green beside red, 2: green beside blue, 3: blue.
int place_of(int x, int y) { return (x & 1) + 2 * (y & 1); }

Stage sensor(const Mosaic& mosaic, int border) {
  return Stage(mosaic, border, [&](int x, int y) {
    return mosaic.samples[static_cast<size_t>(mirrored(y, mosaic.height)) *
                              static_cast<size_t>(mosaic.width) +
                          static_cast<size_t>(mirrored(x, mosaic.width))];
  });
}

double row_mean(const Stage& f, int x, int y) { return (f(x - 1, y) + f(x + 1, y)) / 2; }
double column_mean(const Stage& f, int x, int y) { return (f(x, y - 1) + f(x, y + 1)) / 2; }
double corner_mean(const Stage& f, int x, int y) {
  return (column_mean(f, x - 1, y) + column_mean(f, x + 1, y)) / 2;
}

// Red (c = 0) or blue (2) at a position; the stage is defined where the mosaic has that colour.
double colour_mean(const Stage& f, int x, int y, int c) {
  const int place = c == 0 ? place_of(x, y) : 3 - place_of(x, y);
  if (place == 0) return f(x, y);
  if (place == 3) return corner_mean(f, x, y);
  return place == 1 ? row_mean(f, x, y) : column_mean(f, x, y);
}

using Rgb = std::array<Stage, 3>;

std::vector<double> planes_of(const Mosaic& mosaic, const Rgb& image) {
  std::vector<double> planes;
  for (const Stage& colour : image) {
    for (int y = 0; y < mosaic.height; ++y) {
      for (int x = 0; x < mosaic.width; ++x) planes.push_back(colour(x, y));
    }
  }
  return planes;
}

// The candidate interpolated along rows (d = 0) or columns.
Rgb candidate(const Mosaic& mosaic, const Stage& m, int d, int border) {
  const Stage green(mosaic, border + 1, [&](int x, int y) {
    const auto at = [&](int n) { return d == 0 ? m(x + n, y) : m(x, y + n); };
    return place_of(x, y) % 3 != 0 ? m(x, y) : (2 * (at(-1) + at(0) + at(1)) - at(-2) - at(2)) / 4;
  });
  const Stage ratio(mosaic, border + 1, [&](int x, int y) { return m(x, y) - green(x, y); });
  const auto colour = [&](int c) {
    return Stage(mosaic, border,
                 [&](int x, int y) { return green(x, y) + colour_mean(ratio, x, y, c); });
  };
  return {colour(0), green, colour(2)};
}

using Lab = std::array<double, 3>;

Lab lab_of(double r, double g, double b) {
  const auto light = [](double v) {
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  const auto curve = [](double t) {
    constexpr double edge = 6.0 / 29.0;
    return t > edge * edge * edge ? std::cbrt(t) : t / (3 * edge * edge) + 4.0 / 29.0;
  };
  r = light(r), g = light(g), b = light(b);
  const double x = curve(0.433953 * r + 0.376219 * g + 0.189828 * b);
  const double y = curve(0.212671 * r + 0.715160 * g + 0.072169 * b);
  const double z = curve(0.017758 * r + 0.109477 * g + 0.872765 * b);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

// The difference between two positions of one candidate.
struct Step {
  double light, colour;
};

class Homogeneity {
 public:
  Homogeneity(const Mosaic& mosaic, const Rgb& rows, const Rgb& columns, int border)
      : labs_{labs(mosaic, rows, border), labs(mosaic, columns, border)} {}

  Step step(int d, int x, int y, int dx, int dy) const {
    const auto at = [&](int n, int u, int v) { return labs_[d][n](u, v); };
    const double a = at(1, x + dx, y + dy) - at(1, x, y), b = at(2, x + dx, y + dy) - at(2, x, y);
    return {std::abs(at(0, x + dx, y + dy) - at(0, x, y)), a * a + b * b};
  }

  double near(int d, int x, int y) const {
    const Step left = step(0, x, y, -1, 0), right = step(0, x, y, 1, 0);
    const Step up = step(1, x, y, 0, -1), down = step(1, x, y, 0, 1);
    const double light =
        std::min(std::max(left.light, right.light), std::max(up.light, down.light));
    const double colour =
        std::min(std::max(left.colour, right.colour), std::max(up.colour, down.colour));
    double count = 0;
    for (int dy = -2; dy <= 2; ++dy) {
      for (int dx = -2; dx <= 2; ++dx) {
        if (dx * dx + dy * dy > 4) continue;
        const Step s = step(d, x, y, dx, dy);
        count += s.light <= light && s.colour <= colour;
      }
    }
    return count;
  }

 private:
  static Rgb labs(const Mosaic& mosaic, const Rgb& rgb, int border) {
    const auto part = [&](size_t n) {
      return Stage(mosaic, border, [&](int x, int y) {
        return lab_of(rgb[0](x, y), rgb[1](x, y), rgb[2](x, y))[n];
      });
    };
    return {part(0), part(1), part(2)};
  }
  std::array<Rgb, 2> labs_;
};

double median_difference(const Stage& a, const Stage& b, int x, int y) {
  std::vector<double> values;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) values.push_back(a(x + dx, y + dy) - b(x + dx, y + dy));
  }
  std::nth_element(values.begin(), values.begin() + 4, values.end());
  return values[4];
}

Rgb refined(const Mosaic& mosaic, const Stage& m, const Rgb& before, int border) {
  const auto colour = [&](int c) {
    return Stage(mosaic, border + 1, [&](int x, int y) {
      if (colour_at(x, y) == c) return m(x, y);
      return before[1](x, y) + median_difference(before[c], before[1], x, y);
    });
  };
  const Stage red = colour(0), blue = colour(2);
  const Stage green(mosaic, border, [&](int x, int y) {
    if (colour_at(x, y) == 1) return m(x, y);
    return (median_difference(before[1], red, x, y) + median_difference(before[1], blue, x, y) +
            red(x, y) + blue(x, y)) /
           2;
  });
  return {red, green, blue};
}

}  // namespace

std::vector<double> bilinear(const Mosaic& mosaic) {
  const Stage m = sensor(mosaic, 1);
  const auto colour = [&](int c) {
    return Stage(mosaic, 0, [&](int x, int y) {
      if (c != 1) return colour_mean(m, x, y, c);
      return colour_at(x, y) == 1 ? m(x, y) : (row_mean(m, x, y) + column_mean(m, x, y)) / 2;
    });
  };
  return planes_of(mosaic, {colour(0), colour(1), colour(2)});
}

std::vector<double> ahd(const Mosaic& mosaic) {
  constexpr int rounds = 3, medians = 2 * rounds, reach = medians + 4;
  const Stage m = sensor(mosaic, reach + 3);
  const Rgb rows = candidate(mosaic, m, 0, reach), columns = candidate(mosaic, m, 1, reach);
  const Homogeneity homogeneity(mosaic, rows, columns, reach);
  const auto near = [&](int d) {
    return Stage(mosaic, medians + 1, [&](int x, int y) { return homogeneity.near(d, x, y); });
  };
  const std::array<Stage, 2> nears{near(0), near(1)};
  const Stage share(mosaic, medians, [&](int x, int y) {
    double difference = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        difference += nears[0](x + dx, y + dy) - nears[1](x + dx, y + dy);
      }
    }
    return difference > 0 ? 1.0 : difference < 0 ? 0.0 : 0.5;
  });
  const auto chosen = [&](size_t c) {
    return Stage(mosaic, medians, [&](int x, int y) {
      return share(x, y) * rows[c](x, y) + (1 - share(x, y)) * columns[c](x, y);
    });
  };
  Rgb image{chosen(0), chosen(1), chosen(2)};
  for (int round = 1; round <= rounds; ++round) {
    image = refined(mosaic, m, image, medians - 2 * round);
  }
  return planes_of(mosaic, image);
}

namespace {

// The relaxed method's stages over cells; each site, candidate or missing sample has a stage of its own.
class Cells {
 public:
  Cells(const Mosaic& mosaic, Weights& weights)
      : width_((mosaic.width + 1) / 2),
        height_((mosaic.height + 1) / 2),
        k_(weights.shape.filters),
        m_(sensor(mosaic, 2 * border + 8)),
        weights_(weights) {
    for (int q = 0; q < 2; ++q) {
      for (int i = 0; i < k_; ++i) {
        green_.push_back(stage(border, [&](int x, int y) { return filtered(q, i, x, y); }));
      }
    }
    for (int q = 0; q < 2; ++q) {
      difference_.push_back(
          stage(border - 2, [&](int x, int y) { return mixed(q, x, y) - own(q, x, y); }));
    }
    for (int t = 0; t < lost_samples; ++t) {
      smooth_.push_back(stage(0, [&](int x, int y) { return smooth(t, x, y); }));
    }
  }

  double estimate(int t, int x, int y) const {
    const auto at_site = [&](int q) {
      return own(q, x, y) + smooth_[static_cast<size_t>(q)](x, y);
    };
    if (t < 2) return at_site(t);
    const double green = t < 4   ? at_site(t - 2)
                         : t < 6 ? m_(2 * x + 1, 2 * y)
                                 : m_(2 * x, 2 * y + 1);
    return green - smooth_[static_cast<size_t>(t)](x, y);
  }
  const Stage& samples() const { return m_; }

 private:
  static constexpr int border = 7;

  Stage stage(int around, const Stage::Rule& rule) const {
    return Stage(width_, height_, around, rule);
  }
  double own(int q, int x, int y) const { return m_(2 * x + q, 2 * y + q); }
  const Stage& green(int q, int i) const { return green_[static_cast<size_t>(q * k_ + i)]; }

  double filtered(int q, int i, int x, int y) const {
    const auto w = weights_.buffer(Array::Green);
    const int size = weights_.shape.size, half = size / 2;
    double sum = 0;
    for (int v = 0; v < size; ++v) {
      for (int u = 0; u < size; ++u) {
        sum += static_cast<double>(w(u, v, i, q)) * m_(2 * x + q + u - half, 2 * y + q + v - half);
      }
    }
    return sum;
  }

  double close(int q, int i, int d, int x, int y) const {
    const auto w = weights_.buffer(Array::Closeness);
    const double here = green(q, i)(x, y);
    if (d > 1) {
      const int u = d == 2, v = d == 3, sx = 2 * x + q, sy = 2 * y + q;
      const double step = 40.0 * w(i, 2) * (2 * here - m_(sx - u, sy - v) - m_(sx + u, sy + v));
      return 1 / (1 + step * step);
    }
    const int x0 = x - (d == 0), y0 = y - (d == 1);
    const double light = here - green(q, i)(x0, y0);
    const double ratio = light - (own(q, x, y) - own(q, x0, y0));
    const double a = 40.0 * w(i, 0) * ratio, b = 40.0 * w(i, 1) * light;
    return 1 / (1 + a * a + b * b);
  }

  // The value of `seen` at site q, for candidate i.
  double seen(int q, int i, int d, int x, int y) const {
    const auto w = weights_.buffer(Array::Selection);
    double sum = 0;
    for (int p = 0; p < 2; ++p) {
      for (int v = 0; v < 3; ++v) {
        for (int u = 0; u < 3; ++u) {
          sum += w(u, v, p, d, i, q) * close(p, i, d, x + u - 1, y + v - 1);
        }
      }
    }
    return sum;
  }

  double mixed(int q, int x, int y) const {
    const auto cross = weights_.buffer(Array::Cross), bias = weights_.buffer(Array::Bias);
    std::vector<double> scores;
    for (int i = 0; i < k_; ++i) scores.push_back(bias(i, q));
    for (int of = 0; of < k_; ++of) {
      for (int d = 0; d < 4; ++d) {
        const double value = seen(q, of, d, x, y);
        for (int i = 0; i < k_; ++i) {
          scores[static_cast<size_t>(i)] += 0.25 * cross(of, d, i, q) * value;
        }
      }
    }
    const double top = *std::max_element(scores.begin(), scores.end());
    double sum = 0, total = 0;
    for (int i = 0; i < k_; ++i) {
      const double share = std::exp(scores[static_cast<size_t>(i)] - top);
      total += share;
      sum += share * green(q, i)(x, y);
    }
    return sum / total;
  }

  double rough(int t, int x, int y) const {
    const auto w = weights_.buffer(Array::Chroma);
    double sum = 0;
    for (int q = 0; q < 2; ++q) {
      for (int v = 0; v < 5; ++v) {
        for (int u = 0; u < 5; ++u) {
          sum += w(u, v, q, t) * difference_[static_cast<size_t>(q)](x + u - 2, y + v - 2);
        }
      }
    }
    return sum;
  }

  double smooth(int t, int x, int y) const {
    const auto near = weights_.buffer(Array::Near);
    const double steep = 40.0 * weights_.buffer(Array::Steepness)(t);
    const size_t site = t == 1 || t == 2 || t == 5 || t == 7;
    const double start = rough(t, x, y);
    double sum = start, total = 1;
    for (int v = 0; v < 3; ++v) {
      for (int u = 0; u < 3; ++u) {
        const double other = difference_[site](x + u - 1, y + v - 1);
        const double distance = steep * (other - start);
        const double weight =
            static_cast<double>(near(u, v, t)) * near(u, v, t) / (1 + distance * distance);
        sum += weight * other;
        total += weight;
      }
    }
    return sum / total;
  }

  int width_, height_, k_;
  Stage m_;
  Weights& weights_;
  std::vector<Stage> green_, difference_, smooth_;
};

}  // namespace

std::vector<double> relaxed(const Mosaic& mosaic, Weights weights) {
  const Cells cells(mosaic, weights);
  const Stage& m = cells.samples();
  // The index of the missing sample of a cell for colour c at a position; negative if it is measured.
  constexpr int lost[3][4] = {{-1, 4, 6, 3}, {0, -1, -1, 1}, {2, 5, 7, -1}};
  const auto plane = [&](int c) {
    return Stage(mosaic, 0, [&](int x, int y) {
      const int t = lost[c][place_of(x, y)];
      return t < 0 ? m(x, y) : cells.estimate(t, x >> 1, y >> 1);
    });
  };
  const Rgb image{plane(0), plane(1), plane(2)};
  return planes_of(mosaic, image);
}

}  // namespace demosaic::reference
