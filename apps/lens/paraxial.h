// paraxial.h -- what rays near the axis do: focal length, image, pupil.
//
// A ray of height y and reduced angle n u: a surface changes n u by -y c (n' - n), a spacing t changes y by
// t u (W. Welford, Aberrations of Optical Systems, 1986, section 3.2). Everything is linear in the ray
// that enters, so two rays say it all.
#pragma once

#include "prescription.h"

namespace lens {

struct Paraxial {
  double power = 0;           // 1 / focal length
  double back_focus = 0;      // from the last vertex to the image of an infinitely far object
  double pupil_place = 0;     // the entrance pupil, from the first vertex
  double stop_per_pupil = 0;  // heights at the stop over heights in the entrance pupil
  double focal_length() const { return 1 / power; }
};

// At a wavelength in micrometres.
Paraxial paraxial(const Lens& lens, double wavelength = line_d);

}  // namespace lens
