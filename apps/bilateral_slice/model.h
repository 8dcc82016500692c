// model.h -- the model of a look: a bilateral grid of affine colour transforms, sliced along a learned guide.
//
//   light(x, y)      = mix . (r, g, b, 1)                                    learned mix
//   guide(x, y)      = sum over k of curve(k) * max(light(x, y) - k / knots, 0)    learned curve
//   depth(x, y)      = clamp(guide, 0, 1) * (grid_z - 1)
//   row_grid(i, o, gz, gx, y): the grid at the height of pixel row y (linear between grid rows)
//   transform(i, x, o, k, y): row_grid at pixel x (linear) and gz = floor(depth) + k
//   plane(x, y, o, k)  = sum over i of transform(i, x, o, k, y) * (r, g, b, 1)(i)
//   result(x, y, o)  = plane 0 and 1, linear in depth's fraction
//   loss             = mean squared difference of result and target
//
// This is trilinear interpolation of the grid, one axis at a time. A whole pixel row shares the step along y, so a
// pixel reads four transforms and not eight. Pixel coordinates appear in the grid's indices only as x / cell_width and
// y / cell_height, so the grid's gradient is a gather over (gx, gy); gz is data-dependent. A gray photo has (v, 1) in
// place of (r, g, b, 1): two coefficients and one output.
#pragma once

#include "groups.h"
#include "language.h"
#include "shape.h"

namespace bilateral_slice {

struct Model {
  // `scalar` is the type of all values: float for training, double for gradient checks.
  Model(const Shape& shape, lang::Type scalar);

  Shape shape;
  lang::Type scalar;

  // Inputs. The photo is homogeneous: its last plane holds ones.
  lang::ImageParam photo;   // [coefficients, height, width], width innermost
  lang::ImageParam target;  // [channels, height, width]
  lang::ImageParam grid;    // [grid_y, grid_x, grid_z, channels (o), coefficients (i)], i innermost
  lang::ImageParam mix;     // [coefficients]
  lang::ImageParam curve;   // [knots]

  lang::Var x{"x"}, y{"y"}, i{"i"}, o{"o"}, k{"k"}, gx{"gx"}, gy{"gy"}, gz{"gz"};

  // The parameters as Funcs, for which gradients are requested.
  lang::Func affine{"affine"}, mixture{"mixture"}, slopes{"slopes"};

  lang::Func row_mixture{"row_mixture"}, row_slopes{"row_slopes"};
  lang::Func light{"light"}, guide{"guide"}, depth{"depth"}, layer{"layer"};
  lang::Func row_grid{"row_grid"}, transform{"transform"}, plane{"plane"}, result{"result"};
  lang::Func row_loss{"row_loss"}, loss{"loss"};

  // The gradients of the loss with respect to the groups that move.
  lang::Derivative adjoints(const Groups& moves) const;

 private:
  lang::Expr number(double value) const;
  lang::Expr as_scalar(lang::Expr e) const;

  void define_parameters();
  void define_guide(const lang::Func& pixels);
  void define_slice(const lang::Func& pixels);
  void define_loss(const lang::Func& wanted);
};

}  // namespace bilateral_slice
