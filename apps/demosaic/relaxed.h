// relaxed.h -- adaptive homogeneity-directed demosaicking (ahd.h) with soft decisions and learned constants. A Bayer
// mosaic is treated as cells of two by two samples, R G over G B; a site q is the red (0) or the blue sample (1) of a
// cell (x, y).
//
//   green(x, y, q, i)   k candidates for the green at a site, each a filter of K x K samples
//   ratio               green - the site's own sample: a candidate's colour difference
//   close(x, y, q, i, d) = 1 / (1 + step^2): the similarity of a candidate to its neighbours. d = 0, 1: to
//                       itself at the previous site along a row or column; the step is that of ratio
//                       and of green, each with a learned scale. d = 2, 3: to the mean of the two
//                       measured greens next to it in the row or column
//   seen(x, y, q, i, d) a learned window of 3 x 3 cells over `close`
//   score(x, y, q, i)   the homogeneity of a candidate, compared with the others: a learned mix of all `seen`
//   mixed(x, y, q)      the candidates, weighted by softmax of the score over i
//   rough(x, y, t)      the colour difference, green - colour, at the position of missing sample t: a filter
//                       over 5 x 5 cells of mixed - own sample
//   smooth(x, y, t)     `rough` after a step towards the median of 3 x 3 cells: the mean of `rough` and its
//                       neighbours, each weighted less the more it differs from `rough`
//   estimate(x, y, t)   a missing green is own sample + smooth; a missing red or blue is green - smooth
//
// AHD is a special case: two filters [-1 2 2 2 -1] / 4 along rows and columns, steps that count as 0 or 1, equal
// weights, only the larger score, averages of two or four colour differences, and medians of them. The step towards the
// median is one step of iteratively reweighted least squares with Cauchy's weights (P. Holland, R. Welsch,
// Communications in Statistics 6 (9), 1977).
// Hirakawa, Parks: Adaptive homogeneity-directed demosaicing algorithm, IEEE Transactions on Image Processing 14 (3),
// 2005, sections III and IV. Li, Gharbi, Adams, Durand, Ragan-Kelley: Differentiable programming for image processing
// and deep learning in Halide, ACM Transactions on Graphics 37 (4), 2018, section 5, showed that relaxations of this
// kind can be learned; the form of ours is our own.
#pragma once

#include <retrograde/retrograde.h>

#include <array>
#include <vector>

namespace demosaic {

namespace lang = retrograde;

struct Shape {
  int filters = 9;  // k
  int size = 5;     // K, odd

  bool operator==(const Shape&) const = default;
};

// The missing samples of a cell, t = 0..7: green at red and at blue, blue at red, red at blue, red and blue at the
// green beside red, red and blue at the green beside blue.
inline constexpr int missing_greens = 2, lost_samples = 8;

// The learned arrays. Files and the vector that Adam optimizes have them in this order.
enum class Array { Green, Closeness, Selection, Cross, Bias, Chroma, Near, Steepness };
inline constexpr std::array<Array, 8> all_arrays{Array::Green, Array::Closeness, Array::Selection,
                                                 Array::Cross, Array::Bias,      Array::Chroma,
                                                 Array::Near,  Array::Steepness};

// Innermost dimension first:
//   Green      [2 (q), k, K, K], x innermost
//   Closeness  [3, k]: scales of the step of ratio, of green, and of that to the neighbouring greens
//   Selection  [2 (q), k, 4 (d), 2 (q of close), 3, 3]
//   Cross      [2 (q), k, 4 (d), k (of seen)]
//   Bias       [2 (q), k]
//   Chroma     [8 (t), 2 (q), 5, 5]
//   Near       [8 (t), 3, 3]: roots of the weights in the step towards the median
//   Steepness  [8 (t)]: how fast these weights fall
std::vector<int> sizes_of(const Shape& shape, Array array);
size_t elements_of(const std::vector<int>& sizes);
size_t elements_of(const Shape& shape, Array array);

struct Parameters {
  Parameters(const Shape& shape, lang::Type scalar);
  lang::ImageParam& of(Array array) { return arrays[static_cast<size_t>(array)]; }
  const lang::ImageParam& of(Array array) const { return arrays[static_cast<size_t>(array)]; }

  std::vector<lang::ImageParam> arrays;
};

struct Relaxed {
  // `mosaic` has dimensions x, y and those of `batch`, and is read `reach` samples around a cell. `scalar` is the type
  // of all values: float to run and to learn, double to check.
  Relaxed(const Shape& shape, const lang::Func& mosaic, const std::vector<lang::Var>& batch = {},
          lang::Type scalar = lang::Float(32));

  // Number of samples read on each side of a cell; always even.
  static int reach(const Shape& shape);

  Shape shape;
  lang::Type scalar;
  Parameters parameters;
  lang::Func mosaic;
  std::vector<lang::Var> batch;
  lang::Var x{"x"}, y{"y"}, q{"q"}, i{"i"}, d{"d"}, t{"t"}, c{"c"};

  // The learned arrays as Funcs, for which gradients are requested.
  lang::Func filters{"filters"}, scales{"scales"}, windows{"windows"}, biases{"biases"},
      crossings{"crossings"}, chroma{"chroma"}, nearness{"nearness"}, steepnesses{"steepnesses"};

  lang::Func green{"green"}, close{"close"}, seen{"seen"}, score{"score"}, top{"top"},
      share{"share"}, weighed{"weighed"}, mixed{"mixed"}, difference{"difference"}, rough{"rough"},
      pull{"pull"}, smooth{"smooth"}, estimate{"estimate"};
  lang::Func image;  // [3, height, width], and the batch

 private:
  using Exprs = std::vector<lang::Expr>;
  Exprs at(Exprs place) const;  // with the batch's variables
  lang::Expr number(double value) const { return lang::cast(scalar, lang::Expr(value)); }
  lang::Expr own(const lang::Expr& cell_x, const lang::Expr& cell_y, const lang::Expr& site) const;

  void define_parameters();
  void define_candidates();
  void define_homogeneity();
  void define_mixture();
  void define_colour_differences();
  void define_image();
};

// The Func of a learned array.
const lang::Func& learned_func(const Relaxed& model, Array array);

}  // namespace demosaic
