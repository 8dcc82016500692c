// paraxial.cpp -- see paraxial.h.
#include "paraxial.h"

namespace lens {

namespace {

struct ParaxialRay {
  double height, angle;  // angle times the index
};

}  // namespace

Paraxial paraxial(const Lens& lens, double wavelength) {
  // One ray parallel to the axis, and one through the first vertex.
  ParaxialRay along{1, 0}, through{0, 1};
  Paraxial out;
  double before = 1;
  for (size_t k = 0; k < lens.surfaces.size(); ++k) {
    const Surface& surface = lens.surfaces[k];
    if (surface.stop) {
      // A ray through the middle of the stop satisfies: height along.height + angle through.height = 0.
      out.pupil_place = through.height / along.height;
      out.stop_per_pupil = along.height;
    }
    const double after = lens.index(k, wavelength);
    for (ParaxialRay* ray : {&along, &through}) {
      ray->angle -= ray->height * surface.curvature * (after - before);
      if (k + 1 < lens.surfaces.size()) ray->height += surface.spacing * ray->angle / after;
    }
    before = after;
  }
  out.power = -along.angle;
  out.back_focus = along.height / out.power * before;
  return out;
}

}  // namespace lens
