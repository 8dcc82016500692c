// lane_form.h -- how the lanes of a vector along a loop lie in memory.
//
//   f(2 x)       lanes along x are strided by 2
//   f(x, y)      lanes along y are strided by a row of f
//   f(x / 2)     a gather: two neighbours read one element
#pragma once

#include "autoschedule/access/sizes.h"

namespace retrograde::planning {

// The line of a cache, in elements of what is accessed.
struct LineSize {
  int64_t elements;
};

struct LaneForm {
  enum class Kind : uint8_t { Uniform, Contiguous, Reversed, Strided, Gather };
  Kind kind = Kind::Gather;
  double stride = 0;  // of Strided: elements from lane to lane, in memory
  double lines = 1;   // that a vector touches; of a gather at most
};
LaneForm lane_form(const Access& access, int iterator, int lanes, const SizeModel& sizes,
                   LineSize line);

}  // namespace retrograde::planning
