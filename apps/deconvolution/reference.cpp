// reference.cpp -- see reference.h.
#include "reference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace deconvolution {

namespace {

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
  return sum;
}

// The bilateral grid of one image as a sparse table of sums.
class Grid {
 public:
  struct Sum {
    double value = 0, count = 0;
  };
  using Cell = std::array<int, 3>;

  Grid(int width, int height) : width_(width), height_(height) {}

  void splat(const double* image) {
    const int last_x = width_ / side + 4, last_y = height_ / side + 4;
    for (int Y = -3; Y <= last_y; ++Y) {
      for (int X = -3; X <= last_x; ++X) {
        for (int dy = 0; dy < side; ++dy) {
          for (int dx = 0; dx < side; ++dx) {
            const int x = std::clamp(X * side + dx - side / 2, 0, width_ - 1);
            const int y = std::clamp(Y * side + dy - side / 2, 0, height_ - 1);
            add(X, Y, image[y * width_ + x]);
          }
        }
      }
    }
  }

  void blur(int axis, double a) {
    std::map<Cell, Sum> next;
    for (const auto& [cell, sum] : sums_) {
      for (int step = -1; step <= 1; ++step) {
        Cell to = cell;
        to[static_cast<size_t>(axis)] += step;
        const double share = step == 0 ? 1 - 2 * a : a;
        next[to].value += share * sum.value;
        next[to].count += share * sum.count;
      }
    }
    sums_ = std::move(next);
  }

  double smooth(int x, int y, double own) const {
    const double z = place(own), fx = x % side / double(side), fy = y % side / double(side);
    const int below = static_cast<int>(z);
    Sum sum;
    for (int k = 0; k < 8; ++k) {
      const int dx = k & 1, dy = k >> 1 & 1, dz = k >> 2;
      const auto found = sums_.find({x / side + dx, y / side + dy, below + dz});
      if (found == sums_.end()) continue;
      const double share =
          (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy) * (dz ? z - below : 1 - z + below);
      sum.value += share * found->second.value;
      sum.count += share * found->second.count;
    }
    return (sum.value + 1e-3 * own) / (sum.count + 1e-3);
  }

 private:
  static constexpr int side = 20;
  static double place(double value) { return std::clamp((value + 0.25) / 0.033, 0.0, 45.999); }

  void add(int X, int Y, double value) {
    const double z = place(value);
    const int below = static_cast<int>(z);
    for (int k = 0; k < 2; ++k) {
      const double share = k == 0 ? 1 - (z - below) : z - below;
      Sum& sum = sums_[{X, Y, below + k}];
      sum.value += share * value;
      sum.count += share;
    }
  }

  int width_, height_;
  std::map<Cell, Sum> sums_;
};

}  // namespace

Reference::Reference(const Shape& shape, const Problem& problem, std::span<const float> numbers)
    : shape_(shape),
      problem_(problem),
      extent_(problem.extent),
      rows_(extent_.full_height() - shape.size + 1),
      columns_(extent_.full_width() - shape.size + 1) {
  std::array<Doubles*, 4> arrays{&filters_, &log_weights_, &shrinkage_, &smoothing_};
  for (const Array array : all_arrays) {
    const auto own = numbers.first(elements_of(shape, array));
    arrays[static_cast<size_t>(array)]->assign(own.begin(), own.end());
    numbers = numbers.subspan(own.size());
  }
  const auto taps = static_cast<size_t>(shape.size * shape.size);
  for (size_t f = 0; f < static_cast<size_t>(shape.filters); ++f) {
    double mean = 0;
    for (size_t k = 0; k < taps; ++k) mean += filters_[f * taps + k] / static_cast<double>(taps);
    for (size_t k = 0; k < taps; ++k) filters_[f * taps + k] -= mean;
  }
}

size_t Reference::at(int x, int y, int n) const {
  return static_cast<size_t>((n * extent_.full_height() + y) * extent_.full_width() + x);
}

size_t Reference::inner(int x, int y, int f, int n) const {
  return static_cast<size_t>(((n * shape_.filters + f) * rows_ + y) * columns_ + x);
}

double Reference::filter(int u, int v, int f) const {
  return filters_[static_cast<size_t>((f * shape_.size + v) * shape_.size + u)];
}

double Reference::weight(int f, int n) const {
  const double deviation = problem_.noises[static_cast<size_t>(n)] / usual_noise;
  return deviation * deviation * std::exp(log_weights_[static_cast<size_t>(f)]);
}

double Reference::shrunk(double d, int f) const {
  const double* numbers = shrinkage_.data() + f * (1 + shape_.bumps);
  if (shape_.bumps == 0) return d == 0 ? 0 : d / (1 + std::pow(numbers[0] / d, 4));
  double factor = numbers[0];
  for (int j = 0; j < shape_.bumps; ++j) {
    factor += numbers[j + 1] * std::exp(-0.5 * d * d / (bump_width(j) * bump_width(j)));
  }
  return d * factor;
}

std::vector<double> Reference::cleaned(const Doubles& before) const {
  Doubles result(before.size());
  const int width = extent_.full_width(), height = extent_.full_height();
  for (int n = 0; n < extent_.count; ++n) {
    Grid grid(width, height);
    grid.splat(before.data() + at(0, 0, n));
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < 2; ++k) grid.blur(axis, smoothing_[axis == 2 ? 2 : 1]);
    }
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double own = before[at(x, y, n)];
        result[at(x, y, n)] = own + smoothing_[0] * (grid.smooth(x, y, own) - own);
      }
    }
  }
  return result;
}

std::vector<double> Reference::responses(const Doubles& image) const {
  Doubles result(static_cast<size_t>(extent_.count * shape_.filters * rows_ * columns_), 0.0);
  for (int n = 0; n < extent_.count; ++n) {
    for (int f = 0; f < shape_.filters; ++f) {
      for (int y = 0; y < rows_; ++y) {
        for (int x = 0; x < columns_; ++x) {
          double& sum = result[inner(x, y, f, n)];
          for (int v = 0; v < shape_.size; ++v) {
            for (int u = 0; u < shape_.size; ++u)
              sum += filter(u, v, f) * image[at(x + u, y + v, n)];
          }
        }
      }
    }
  }
  return result;
}

std::vector<double> Reference::target(const Doubles& before) const {
  Doubles result = responses(cleaned(before));
  const size_t each = static_cast<size_t>(rows_ * columns_);
  for (size_t k = 0; k < result.size(); ++k) {
    result[k] = shrunk(result[k], static_cast<int>(k / each) % shape_.filters);
  }
  return result;
}

// k * x - b by the definition of a convolution, with the middle of k on the pixel.
std::vector<double> Reference::residual(const Doubles& image) const {
  const int side = extent_.psf;
  Doubles result(problem_.blurred.begin(), problem_.blurred.end());
  for (double& value : result) value = -value;
  for (int n = 0; n < extent_.count; ++n) {
    const float* psf = problem_.psfs.data() + n * side * side;
    for (int y = 0; y < extent_.height; ++y) {
      for (int x = 0; x < extent_.width; ++x) {
        double& sum = result[static_cast<size_t>((n * extent_.height + y) * extent_.width + x)];
        for (int v = 0; v < side; ++v) {
          for (int u = 0; u < side; ++u)
            sum += psf[v * side + u] * image[at(x + side - 1 - u, y + side - 1 - v, n)];
        }
      }
    }
  }
  return result;
}

double Reference::energy(const Doubles& image, const Doubles& before) const {
  const Doubles off = residual(image), filtered = responses(image), goal = target(before);
  double sum = dot(off, off) / 2;
  const size_t each = static_cast<size_t>(rows_ * columns_);
  for (size_t k = 0; k < filtered.size(); ++k) {
    const int f = static_cast<int>(k / each) % shape_.filters;
    const int n = static_cast<int>(k / each) / shape_.filters;
    sum += weight(f, n) * (filtered[k] - goal[k]) * (filtered[k] - goal[k]) / 2;
  }
  return sum;
}

std::vector<double> Reference::gradient_of(const Doubles& off, const Doubles& miss) const {
  Doubles result(extent_.full_elems(), 0.0);
  const int side = extent_.psf;
  for (int n = 0; n < extent_.count; ++n) {
    const float* psf = problem_.psfs.data() + n * side * side;
    for (int y = 0; y < extent_.height; ++y) {
      for (int x = 0; x < extent_.width; ++x) {
        const double here = off[static_cast<size_t>((n * extent_.height + y) * extent_.width + x)];
        for (int v = 0; v < side; ++v) {
          for (int u = 0; u < side; ++u)
            result[at(x + side - 1 - u, y + side - 1 - v, n)] += psf[v * side + u] * here;
        }
      }
    }
    for (int f = 0; f < shape_.filters; ++f) {
      for (int y = 0; y < rows_; ++y) {
        for (int x = 0; x < columns_; ++x) {
          const double here = weight(f, n) * miss[inner(x, y, f, n)];
          for (int v = 0; v < shape_.size; ++v) {
            for (int u = 0; u < shape_.size; ++u)
              result[at(x + u, y + v, n)] += filter(u, v, f) * here;
          }
        }
      }
    }
  }
  return result;
}

std::vector<double> Reference::gradient(const Doubles& image, const Doubles& before) const {
  Doubles miss = responses(image);
  const Doubles goal = target(before);
  for (size_t k = 0; k < miss.size(); ++k) miss[k] -= goal[k];
  return gradient_of(residual(image), miss);
}

// H p is the gradient at p minus that at 0, with b and the targets set to 0.
std::vector<double> Reference::minimum(const Doubles& before) const {
  Doubles x = before, r = gradient(x, before);
  for (double& value : r) value = -value;
  Doubles p = r;
  const Doubles none(x.size(), 0.0), at_zero = residual(none);
  double square = dot(r, r);
  const double enough = 1e-28 * square;
  for (size_t k = 0; k < 4 * x.size() && square > enough; ++k) {
    Doubles off = residual(p);
    for (size_t j = 0; j < off.size(); ++j) off[j] -= at_zero[j];
    const Doubles product = gradient_of(off, responses(p));
    const double length = square / dot(p, product);
    for (size_t j = 0; j < x.size(); ++j) {
      x[j] += length * p[j];
      r[j] -= length * product[j];
    }
    const double next = dot(r, r);
    for (size_t j = 0; j < x.size(); ++j) p[j] = r[j] + next / square * p[j];
    square = next;
  }
  return x;
}

}  // namespace deconvolution
