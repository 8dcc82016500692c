// objective.h -- what is minimized, in the language.
//
//   place(x, y, i)    where pixel (x, y) of frame i lies in the picture: its homography (homography.h)
//   sampled(x, y, i)  the picture there, bilinear, in the colour that the mosaic has at (x, y): M H_i R
//   loss              sum (sampled - frames)^2  +  smoothness (sum |dR/dx| + sum |dR/dy|)
//
// A pixel that lies beyond the picture counts nothing. The gradient by the picture is a scatter to places that
// data decide; that by the homographies is eight sums over each frame. At the kinks, derivatives are those of
// the side that floor takes, and 0 for a difference of 0.
#pragma once

#include <retrograde/retrograde.h>

#include "homography.h"

namespace burst {

namespace lang = retrograde;

struct Shape {
  FrameSize size;
  int frames = 1;

  size_t image_elems() const { return 3 * size.pixels(); }
  size_t motion_elems() const { return homography_params * static_cast<size_t>(frames); }
};

struct Objective {
  // With one frame there are no homographies, with no smoothness no differences, in what is compiled.
  Objective(const Shape& shape, double smoothness, lang::Type scalar = lang::Float(32));

  lang::ImageParam image;         // [3, height, width]
  lang::ImageParam homographies;  // [frames, 8]
  lang::ImageParam frames;        // [frames, height, width]
  lang::Func shift_x{"shift_x"}, shift_y{"shift_y"}, depth{"depth"};
  lang::Func sampled{"sampled"}, residual{"residual"}, loss{"loss"};

 private:
  void define_shift();
  void define_sampled();
  void define_loss(double smoothness);
  lang::Expr number(double value) const;

  Shape shape_;
  lang::Type scalar_;
  lang::Var x_{"x"}, y_{"y"}, i_{"i"};
};

}  // namespace burst
