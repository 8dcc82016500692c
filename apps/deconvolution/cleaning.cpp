// cleaning.cpp -- see cleaning.h.
#include "cleaning.h"

namespace deconvolution {

using retrograde::Expr;
using retrograde::Func;
using retrograde::ImageParam;
using retrograde::RDom;
using retrograde::Tuple;
using retrograde::Type;
using retrograde::Var;

namespace {

constexpr int cell_pixels = 20;
constexpr double bin = 0.033;  // of brightness
constexpr double darkest =
    -0.25;  // what lies further out, as rings may, counts as this and as 1.25
constexpr int bins = 47;
// Added to each cell: this many pixels of the image's own brightness, to avoid a division by 0 in empty cells.
constexpr double prior = 1e-3;

class BilateralGrid {
 public:
  BilateralGrid(Func image, const ImageParam& smoothing, int width, int height, Type scalar)
      : image_(std::move(image)),
        smoothing_(smoothing),
        width_(width),
        height_(height),
        scalar_(scalar) {
    const Expr bright = (image_(x_, y_, n_) - number(darkest)) * number(1 / bin);
    place_(x_, y_, n_) = clamp(bright, number(0), number(bins - 1.001));
  }

  Func cleaned() {
    Func grid = splat();
    for (int axis = 2; axis >= 0; --axis) {
      for (int time = 0; time < 2; ++time) grid = blurred(grid, axis);
    }
    const Tuple sum = slice(grid);
    const Expr own = image_(x_, y_, n_);
    const Expr smooth = (sum[0] + number(prior) * own) / (sum[1] + number(prior));
    Func result("cleaned");
    result(x_, y_, n_) = own + smoothing_(0) * (smooth - own);
    return result;
  }

 private:
  Expr number(double value) const { return retrograde::cast(scalar_, Expr(value)); }

  // The border's pixels are repeated where a cell extends beyond it.
  Func splat() {
    const RDom r(0, cell_pixels, 0, cell_pixels, 0, 2, "pixel");
    const Expr x = clamp(x_ * cell_pixels + r.x - cell_pixels / 2, 0, width_ - 1);
    const Expr y = clamp(y_ * cell_pixels + r.y - cell_pixels / 2, 0, height_ - 1);
    const Expr below = floor(place_(x, y, n_)), above = place_(x, y, n_) - below;
    const Expr share = select(r.z == 0, number(1) - above, above);
    const Expr z = clamp(retrograde::cast<int>(below), 0, bins - 2) + r.z;
    Func grid("grid");
    grid(x_, y_, z_, n_) = Tuple(number(0), number(0));
    grid(x_, y_, z, n_) =
        Tuple(grid(x_, y_, z, n_)[0] + share * image_(x, y, n_), grid(x_, y_, z, n_)[1] + share);
    return grid;
  }

  Func blurred(const Func& grid, int axis) {
    const Expr a = smoothing_(axis == 2 ? 2 : 1);
    const auto at = [&](int step) {
      return Tuple(grid(x_ + (axis == 0 ? step : 0), y_ + (axis == 1 ? step : 0),
                        z_ + (axis == 2 ? step : 0), n_));
    };
    const auto mixed = [&](int k) {
      return a * (at(-1)[k] + at(1)[k]) + (number(1) - number(2) * a) * at(0)[k];
    };
    Func result("grid_blurred");
    result(x_, y_, z_, n_) = Tuple(mixed(0), mixed(1));
    return result;
  }

  // Interpolates linearly between the cells and bins around a pixel.
  Tuple slice(const Func& grid) {
    const Expr below = floor(place_(x_, y_, n_)), above = place_(x_, y_, n_) - below;
    const Expr z = clamp(retrograde::cast<int>(below), 0, bins - 2);
    const Expr fx = retrograde::cast(scalar_, x_ % cell_pixels) * number(1.0 / cell_pixels);
    const Expr fy = retrograde::cast(scalar_, y_ % cell_pixels) * number(1.0 / cell_pixels);
    const auto mix = [](const Expr& a, const Expr& b, const Expr& f) { return a + f * (b - a); };
    const auto value = [&](int k) {
      const auto at = [&](int dx, int dy, int dz) {
        return Expr(Tuple(grid(x_ / cell_pixels + dx, y_ / cell_pixels + dy, z + dz, n_))[k]);
      };
      const auto along_z = [&](int dx, int dy) { return mix(at(dx, dy, 0), at(dx, dy, 1), above); };
      return mix(mix(along_z(0, 0), along_z(1, 0), fx), mix(along_z(0, 1), along_z(1, 1), fx), fy);
    };
    return Tuple(value(0), value(1));
  }

  Func image_;
  const ImageParam& smoothing_;
  int width_, height_;
  Type scalar_;
  Func place_{"place"};
  Var x_{"x"}, y_{"y"}, n_{"n"}, z_{"z"};
};

}  // namespace

Func clean(const Func& image, const ImageParam& smoothing, int width, int height, Type scalar) {
  return BilateralGrid(image, smoothing, width, height, scalar).cleaned();
}

}  // namespace deconvolution
