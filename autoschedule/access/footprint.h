// footprint.h -- what an access touches while a piece of its nest runs, and how lanes along a loop lie in memory.
//
//   f(x + r, y)  with r from 0 to 2:   over 16 points of x and all of r 18 elements, overlapping windows once
//   f(2 x)       lanes along x are strided by 2
//   f(x, y)      lanes along y are strided by a row of f
//   f(x / 2)     a gather: two neighbours read one element
#pragma once

#include "autoschedule/access/cover.h"

namespace retrograde::planning {

// The line of a cache, in elements of what is accessed.
struct LineSize {
  int64_t elements;
};

struct Footprint {
  double elements = 1;
  double lines = 1;  // contiguous ones are merged
};
Footprint footprint(const Access& access, const Cover& cover, const SizeModel& sizes,
                    LineSize line);

// The data of one iteration of a loop over `iterator` that the next iteration uses again. One iteration covers `inner`;
// its points of the iterator are the step of the loop.
struct Reuse {
  bool temporal = false;  // the same elements
  bool spatial = false;   // elements of the same lines
  bool overlap = false;   // part of the box that one iteration touches
};
Reuse reuse(const Access& access, int iterator, const Cover& inner, const SizeModel& sizes,
            LineSize line);

struct LaneForm {
  enum class Kind : uint8_t { Uniform, Contiguous, Reversed, Strided, Gather };
  Kind kind = Kind::Gather;
  double stride = 0;  // of Strided: elements from lane to lane, in memory
  double lines = 1;   // that a vector touches; of a gather at most
};
LaneForm lane_form(const Access& access, int iterator, int lanes, const SizeModel& sizes,
                   LineSize line);

}  // namespace retrograde::planning
