// ahd.h -- the AHD method: K. Hirakawa, T. W. Parks: Adaptive homogeneity-directed demosaicing algorithm, IEEE
// Transactions on Image Processing 14 (3), 2005. Numbers below are its sections and equations.
//
//   green(x, y, d)     interpolated along rows (d = 0) or columns (1) by [-1 2 2 2 -1] / 4 (section III)
//   red, blue          averages of their differences from that green (section II)
//   lab                both images in CIELab (section IV)
//   near(x, y, d)      number of samples within two pixels whose lightness and colour agree with this one, up to
//                      tolerances that are the steps along d of the better image (section IV-C)
//   homogeneity        the sum of `near` over 3 x 3 pixels; the image with the larger sum is used
//   refined            three rounds of medians over 3 x 3 colour differences (section IV-D)
//
// Ours differs in two ways, both of which improve the method: if both images are equally homogeneous it
// uses their mean, and medians do not change measured samples.
#pragma once

#include <retrograde/retrograde.h>

namespace demosaic {

namespace lang = retrograde;

struct Ahd {
  // `mosaic`: R G over G B, sRGB-encoded samples; it must be readable beyond the image.
  explicit Ahd(const lang::Func& mosaic);

  lang::Func mosaic;
  lang::Var x{"x"}, y{"y"}, d{"d"}, c{"c"};
  lang::Func green{"green"}, ratio{"ratio"}, candidate{"candidate"}, lab{"lab"};
  lang::Func tolerance{"tolerance"}, near{"near"}, homogeneity{"homogeneity"}, chosen{"chosen"};
  lang::Func image;  // [3, height, width]

 private:
  void define_candidates();
  void define_lab();
  void define_homogeneity();
  lang::Func refined(const lang::Func& before, int round) const;
};

}  // namespace demosaic
