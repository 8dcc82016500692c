// paraxial.h -- paraxial optics: focal length, image position and pupil from rays near the axis.
//
// A ray has height y and reduced angle n u. A surface changes n u by -y c (n' - n); a spacing t changes y by t u (W.
// Welford, Aberrations of Optical Systems, 1986, section 3.2). Everything is linear in the incoming ray, so two rays
// determine all others.
#pragma once

#include "prescription.h"

namespace lens {

struct Paraxial {
  double power = 0;           // 1 / focal length
  double back_focus = 0;      // from the last vertex to the image of an infinitely far object
  double pupil_place = 0;     // position of the entrance pupil, from the first vertex
  double stop_per_pupil = 0;  // height at the stop divided by height in the entrance pupil
  double focal_length() const { return 1 / power; }
};

// At a wavelength in micrometres.
Paraxial paraxial(const Lens& lens, double wavelength = line_d);

}  // namespace lens
