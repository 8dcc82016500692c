// model.cpp -- see model.h. Compiled once with each language.
#include "model.h"

#include "dialect.h"

namespace bilateral_slice {

using lang::Expr;
using lang::Func;
using lang::RDom;

Model::Model(const Shape& shape, lang::Type scalar)
    : shape(shape),
      scalar(scalar),
      photo(scalar, 3, "photo"),
      target(scalar, 3, "target"),
      grid(scalar, 5, "grid"),
      mix(scalar, 1, "mix"),
      curve(scalar, 1, "curve") {
  const Func pixels = dialect::readable(photo), wanted = dialect::readable(target);
  define_parameters();
  define_guide(pixels);
  define_slice(pixels);
  define_loss(wanted);
}

Expr Model::number(double value) const { return lang::cast(scalar, Expr(value)); }
Expr Model::as_scalar(Expr e) const { return lang::cast(scalar, e); }

// Each row reads its own copy of the learned parameters. So their gradients are first summed within every row, in
// parallel, and then over the rows.
void Model::define_parameters() {
  affine(i, o, gz, gx, gy) = grid(i, o, gz, gx, gy);
  mixture(i) = mix(i);
  slopes(k) = curve(k);
  row_mixture(i, y) = mixture(i);
  row_slopes(k, y) = slopes(k);
}

void Model::define_guide(const Func& pixels) {
  const RDom channel(0, shape.coefficients(), "channel"), knot(0, shape.knots, "knot");
  light(x, y) = number(0);
  light(x, y) += row_mixture(channel, y) * pixels(x, y, channel);
  const Expr start = as_scalar(knot) * number(1.0 / shape.knots);
  guide(x, y) = number(0);
  guide(x, y) += row_slopes(knot, y) * lang::max(light(x, y) - start, number(0));
  depth(x, y) = lang::clamp(guide(x, y), number(0), number(1)) * number(shape.grid_z - 1);
  layer(x, y) = lang::clamp(lang::cast<int>(lang::floor(depth(x, y))), 0, shape.grid_z - 2);
}

void Model::define_slice(const Func& pixels) {
  const int width = shape.cell_width(), height = shape.cell_height();
  const Expr along_x = as_scalar(x % width) * number(1.0 / width);
  const Expr along_y = as_scalar(y % height) * number(1.0 / height);
  const Expr along_z = depth(x, y) - as_scalar(layer(x, y));

  row_grid(i, o, gz, gx, y) = (number(1) - along_y) * affine(i, o, gz, gx, y / height) +
                              along_y * affine(i, o, gz, gx, y / height + 1);

  // The contribution to a coefficient of node r: the node before (0) or after (1) pixel x.
  const Expr nearest = lang::unsafe_promise_clamped(layer(x, y) + k, 0, shape.grid_z - 1);
  const auto at_node = [&](const Expr& coefficient, const Expr& r) {
    return lang::select(r == 0, number(1) - along_x, along_x) *
           row_grid(coefficient, o, nearest, dialect::node(x, width, r, shape.grid_x), y);
  };
  plane(x, y, o, k) = number(0);
  if (dialect::stage_transforms) {
    const RDom node(0, 2, "node"), r(0, shape.coefficients(), "r");
    transform(i, x, o, k, y) = number(0);
    transform(i, x, o, k, y) += at_node(i, node);
    plane(x, y, o, k) += pixels(x, y, r) * transform(r, x, o, k, y);
  } else {
    const RDom r(0, shape.coefficients(), 0, 2, "r");
    plane(x, y, o, k) += pixels(x, y, r.x) * at_node(r.x, r.y);
  }
  result(x, y, o) = (number(1) - along_z) * plane(x, y, o, 0) + along_z * plane(x, y, o, 1);
}

void Model::define_loss(const Func& wanted) {
  const RDom sample(0, shape.width, 0, shape.channels, "sample"), row(0, shape.height, "row");
  const Expr error = result(sample.x, y, sample.y) - wanted(sample.x, y, sample.y);
  row_loss(y) = number(0);
  row_loss(y) += error * error;
  loss() = number(0);
  loss() += row_loss(row) * number(1.0 / static_cast<double>(shape.samples()));
}

lang::Derivative Model::adjoints(const Groups& moves) const {
  std::vector<Func> by;
  if (moves.grid) by.push_back(affine);
  if (moves.mix) by.push_back(mixture);
  if (moves.curve) by.push_back(slopes);
  return dialect::adjoints(loss, by);
}

}  // namespace bilateral_slice
