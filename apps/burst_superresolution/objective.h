// objective.h -- the objective function as a pipeline.
//
//   place(x, y, i)    where pixel (x, y) of frame i lies in the picture: its homography (homography.h)
//   sampled(x, y, i)  the picture there, bilinear, in the colour that the mosaic has at (x, y): M H_i R
//   loss              sum (sampled - frames)^2  +  sum over axes a of  weight_a (sum |da.R/dx| + sum |da.R/dy|)
//
// Pixels that lie beyond the picture do not count. The gradient by the picture is a scatter with data-dependent
// indices; the gradient by the homographies is eight sums over each frame. At kinks, the derivative is that of the side
// that floor selects, and 0 for a difference of 0.
#pragma once

#include <retrograde/retrograde.h>

#include <array>
#include <vector>

#include "homography.h"

namespace burst {

namespace lang = retrograde;

// A direction in colour space (a unit vector), and the weight of neighbours' differences along it.
struct ColourAxis {
  std::array<double, 3> along{};
  double weight = 0;
};
// Red, green and blue, or light and two colour differences; empty: no smoothness.
using Smoothness = std::vector<ColourAxis>;

struct Shape {
  FrameSize size;
  int frames = 1;

  size_t image_elems() const { return 3 * size.pixels(); }
  size_t motion_elems() const { return homography_params * static_cast<size_t>(frames); }
};

struct Objective {
  // With one frame, the compiled code has no homographies; without axes, no differences. The weights are inputs.
  Objective(const Shape& shape, const Smoothness& smoothness, lang::Type scalar = lang::Float(32));

  lang::ImageParam image;         // [3, height, width]
  lang::ImageParam homographies;  // [frames, 8]
  lang::ImageParam frames;        // [frames, height, width]
  lang::ImageParam weights;       // one per axis, in order
  lang::Func shift_x{"shift_x"}, shift_y{"shift_y"}, depth{"depth"};
  lang::Func sampled{"sampled"}, residual{"residual"}, loss{"loss"};

 private:
  void define_shift();
  void define_sampled();
  void define_loss(const Smoothness& smoothness);
  void add_differences(const ColourAxis& axis, const lang::Expr& weight);
  lang::Expr number(double value) const;

  Shape shape_;
  lang::Type scalar_;
  lang::Var x_{"x"}, y_{"y"}, i_{"i"};
};

}  // namespace burst
