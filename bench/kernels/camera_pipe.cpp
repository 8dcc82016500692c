// camera_pipe -- converts a raw Bayer mosaic of 10 bits to a colour picture of 8 bits, in 16-bit integers: hot pixels,
// demosaicking along the direction of the smallest gradient (Hamilton and Adams 1997), colour matrix, tone curve by a
// table, sharpening.
//
// Strips of rows slide down two rows at a time, like the period of the mosaic.
#include "kernel.h"

namespace kernels {

namespace {

Expr average(Expr a, Expr b) { return (a + b + cast<int16_t>(1)) >> 1; }

}  // namespace

Kernel camera_pipe(const Setup& setup) {
  const int width = setup.size(2560, 192), height = setup.size(1920, 128), border = 16;
  ImageParam raw(UInt(16), 2, "raw");
  Var x("x"), y("y"), c("c"), yi("yi"), yii("yii");

  // A pixel brighter or darker than all four neighbours of its colour gets the value of the nearest of them.
  Func sound("sound");
  auto at = [&](int dx, int dy) { return cast<int16_t>(raw(x + border + dx, y + border + dy)); };
  Expr least = min(min(at(-2, 0), at(2, 0)), min(at(0, -2), at(0, 2)));
  Expr most = max(max(at(-2, 0), at(2, 0)), max(at(0, -2), at(0, 2)));
  sound(x, y) = clamp(at(0, 0), least, most);

  // The mosaic: G R / B G, as four planes of half the size.
  Func planes("planes");
  planes(x, y, c) = mux(c, {sound(2 * x, 2 * y), sound(2 * x + 1, 2 * y), sound(2 * x, 2 * y + 1),
                            sound(2 * x + 1, 2 * y + 1)});
  auto plane = [&](int which) {
    return [=](Expr px, Expr py) -> Expr { return planes(px, py, which); };
  };
  auto g0 = plane(0), r = plane(1), b = plane(2), g1 = plane(3);

  // Green at red or blue samples: the mean of the two opposite neighbours that differ less.
  Func green_r("green_r"), green_b("green_b");
  auto steadier = [](Expr left, Expr right, Expr above, Expr below) {
    return select(absd(left, right) < absd(above, below), average(left, right),
                  average(above, below));
  };
  green_r(x, y) = steadier(g0(x, y), g0(x + 1, y), g1(x, y - 1), g1(x, y));
  green_b(x, y) = steadier(g1(x - 1, y), g1(x, y), g0(x, y), g0(x, y + 1));

  // Red and blue elsewhere: the green there, plus the mean difference of the neighbours.
  auto red_excess = [&](Expr px, Expr py) { return r(px, py) - green_r(px, py); };
  auto blue_excess = [&](Expr px, Expr py) { return b(px, py) - green_b(px, py); };
  Expr red_at[] = {g0(x, y) + average(red_excess(x - 1, y), red_excess(x, y)), r(x, y),
                   green_b(x, y) + average(average(red_excess(x - 1, y), red_excess(x, y)),
                                           average(red_excess(x - 1, y + 1), red_excess(x, y + 1))),
                   g1(x, y) + average(red_excess(x, y), red_excess(x, y + 1))};
  Expr blue_at[] = {
      g0(x, y) + average(blue_excess(x, y - 1), blue_excess(x, y)),
      green_r(x, y) + average(average(blue_excess(x, y - 1), blue_excess(x + 1, y - 1)),
                              average(blue_excess(x, y), blue_excess(x + 1, y))),
      b(x, y), g1(x, y) + average(blue_excess(x, y), blue_excess(x + 1, y))};
  Expr green_at[] = {g0(x, y), green_r(x, y), green_b(x, y), g1(x, y)};
  Func sites("sites"), mosaic("mosaic");
  auto four = [&](Expr* values) {
    return mux(c % 4, {values[0], values[1], values[2], values[3]});
  };
  sites(x, y, c) = mux(c / 4, {four(red_at), four(green_at), four(blue_at)});
  auto interleaved = [&](int colour) {
    auto site = [&](int which) -> Expr { return sites(x / 2, y / 2, 4 * colour + which); };
    return select(y % 2 == 0, select(x % 2 == 0, site(0), site(1)),
                  select(x % 2 == 0, site(2), site(3)));
  };
  mosaic(x, y, c) = mux(c, {interleaved(0), interleaved(1), interleaved(2)});

  // Colour matrix in 1/256, then the tone curve.
  Func curve("curve"), toned("toned");
  Expr bright = cast<uint32_t>(x);
  curve(x) = cast<uint8_t>(bright * 255 * (1023 + 300) / (1023 * (bright + 300)));
  const int matrix[3][3] = {{420, -120, -44}, {-60, 380, -64}, {-20, -150, 426}};
  auto corrected = [&](int row) {
    Expr sum = 128;
    for (int i = 0; i < 3; i++) sum = sum + matrix[row][i] * cast<int>(mosaic(x, y, i));
    return clamp(sum >> 8, 0, 1023);
  };
  toned(x, y, c) = curve(mux(c, {corrected(0), corrected(1), corrected(2)}));

  Func sharp("sharp");
  auto wide = [&](int dx, int dy) { return cast<int16_t>(toned(x + dx, y + dy, c)); };
  auto row = [&](int dy) { return wide(-1, dy) + 2 * wide(0, dy) + wide(1, dy); };
  Expr smooth = (row(-1) + 2 * row(0) + row(1) + 8) >> 4;
  sharp(x, y, c) = cast<uint8_t>(clamp(wide(0, 0) + ((3 * (wide(0, 0) - smooth)) >> 2), 0, 255));

  const int lanes = setup.lanes<uint16_t>();
  if (setup.by_hand()) {
    Var xi("xi"), pair("pair");
    sharp.bound(c, 0, 3).split(y, y, yi, 64).split(yi, yi, yii, 2);
    sharp.reorder(x, c, yii, yi, y).parallel(y).vectorize(x, lanes);
    curve.compute_root();
    // Two rows per step: an even one and the following odd one.
    toned.store_at(sharp, y).compute_at(sharp, yi).align_bounds(y, 2);
    toned.bound(c, 0, 3).reorder(c, x, y).unroll(c).vectorize(x, lanes);
    mosaic.compute_at(sharp, yi).align_bounds(x, 2).align_bounds(y, 2).bound(c, 0, 3);
    mosaic.split(x, x, xi, 2).split(y, y, pair, 2).reorder(xi, pair, c, x, y);
    mosaic.unroll(xi).unroll(pair).unroll(c).vectorize(x, lanes);
    sites.compute_at(sharp, yi).bound(c, 0, 12).reorder(c, x, y).unroll(c).vectorize(x, lanes);
    green_r.store_at(sharp, y).compute_at(sharp, yi).vectorize(x, lanes);
    green_b.store_at(sharp, y).compute_at(sharp, yi).vectorize(x, lanes);
    planes.store_at(sharp, y).compute_at(sharp, yi);
    planes.bound(c, 0, 4).reorder(c, x, y).unroll(c).vectorize(x, lanes);
    sound.store_at(sharp, y).compute_at(sharp, yi).vectorize(x, lanes);
  }

  Buffer<uint16_t> mosaic_image =
      make_image<uint16_t>({width + 2 * border, height + 2 * border}, 1023);
  bind(raw, mosaic_image);
  Buffer<uint8_t> output(width, height, 3);
  return {Pipeline(sharp), {mosaic_image}, {output}, (8 + 20 + 24 + 30.0) * width * height};
}

}  // namespace kernels
