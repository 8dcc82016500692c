// stage.h -- a stage of the method as a pipeline: the energy that it minimizes over the sharp image x.
//
//   energy(x) = 1/2 sum (k * x - b)^2 + 1/2 noise sum over filters f of w_f sum (f * x - target_f)^2
//   target_f  = shrink_f(f * cleaned(before))        before: the image of the previous stage
//
// b is observed at positions where the point-spread function k lies within x: x has a margin of half a k on each side,
// so nothing is assumed about pixels beyond the borders of b. Filters have mean zero. Their weights are positive (e to
// the power of the learned number) and are multiplied by the image's noise, a variance relative to usual_noise.
//
// shrink is that of sparse adaptive priors, d / (1 + (t / d)^4), which keeps large derivatives; or a learned mixture, d
// (c_0 + sum over j of c_j exp(-d^2 / 2 tau_j^2)), with tau doubling from j to j + 1. The first form, with five filters
// and two stages, is the method of H. Fortunato, M. Oliveira: Fast high-quality non-blind deconvolution using sparse
// adaptive priors, The Visual Computer 30, 2014, section 3; its first stage does not use `before`. Shrinkage by learned
// mixtures for deconvolution comes from U. Schmidt, S. Roth, Shrinkage fields for effective image restoration, CVPR
// 2014, section 3. Their mixture has even spacing and any parity. Ours is odd, because derivatives of photographs are
// negative as often as positive, and finest around 0.
#pragma once

#include <retrograde/retrograde.h>

#include <array>
#include <vector>

namespace deconvolution {

namespace lang = retrograde;

// The shape of a stage's learned numbers.
struct Shape {
  int filters = 5;
  int size = 3;   // samples along a filter; odd
  int bumps = 0;  // terms of the mixture; 0: a threshold
  bool operator==(const Shape&) const = default;
};

// The images of a batch: `count` images of width x height, each with its own k of psf x psf samples; psf is odd.
struct Extent {
  int width = 0, height = 0, count = 1, psf = 1;
  int margin() const { return psf / 2; }
  int full_width() const { return width + 2 * margin(); }
  int full_height() const { return height + 2 * margin(); }
  size_t seen_elems() const { return elems(width, height); }
  size_t full_elems() const { return elems(full_width(), full_height()); }
  bool operator==(const Extent&) const = default;

 private:
  size_t elems(int w, int h) const {
    return static_cast<size_t>(w) * static_cast<size_t>(h) * static_cast<size_t>(count);
  }
};

inline constexpr double usual_noise = 0.01;  // standard deviation, of samples in [0, 1]
double bump_width(int j);                    // tau_j

// The learned arrays of a stage. Files and the vector that Adam optimizes have them in this order. Innermost first:
//   Filters     [filters, size, size]
//   LogWeights  [filters]
//   Shrinkage   [filters, 1 + bumps], c_0 first; or [filters, 1], t
//   Smoothing   [3], see cleaning.h
enum class Array { Filters, LogWeights, Shrinkage, Smoothing };
inline constexpr std::array<Array, 4> all_arrays{Array::Filters, Array::LogWeights,
                                                 Array::Shrinkage, Array::Smoothing};
std::vector<int> sizes_of(const Shape& shape, Array array);
size_t elements_of(const Shape& shape, Array array);
size_t elements_of(const Shape& shape);  // of all arrays

struct Stage {
  Stage(const Shape& shape, const Extent& extent, lang::Type scalar = lang::Float(32));

  Shape shape;
  Extent extent;
  lang::Type scalar;

  lang::ImageParam image, before;  // [count, full height, full width]
  lang::ImageParam blurred;        // [count, height, width]
  lang::ImageParam psf;            // [count, psf, psf]
  lang::ImageParam noise;          // [count]
  std::vector<lang::ImageParam> arrays;
  lang::ImageParam& of(Array array) { return arrays[static_cast<size_t>(array)]; }

  lang::Func kernel{"kernel"}, cleaned{"cleaned"}, target{"target"};
  lang::Func energy{"energy"};

 private:
  lang::Expr number(double value) const { return lang::cast(scalar, lang::Expr(value)); }
  lang::Expr shrunk(const lang::Expr& d) const;
  lang::Func response(const lang::Func& of, const std::string& name) const;
  void define_kernel();
  void define_target();
  void define_energy();

  lang::Var x_{"x"}, y_{"y"}, n_{"n"}, f_{"f"}, u_{"u"}, v_{"v"};
};

}  // namespace deconvolution
