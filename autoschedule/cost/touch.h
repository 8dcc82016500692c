// touch.h -- what a stage reads or writes of one buffer: cache lines while some of its loops run, and how the lanes of a
// vector lie in memory.
//
// Accesses that differ in constants alone are one touch: the nine reads of a 3x3 stencil are a window of 3 by 3 elements.
// Unlike a lane form (access/lane_form.h), it knows the order of storage and the motion of data-dependent indices.
#pragma once

#include <vector>

#include "autoschedule/access/cover.h"
#include "autoschedule/cost/motion.h"

namespace retrograde::planning {

// One dimension.
struct TouchedSide {
  struct Move {
    int16_t iterator;
    double slope;       // elements from one point to the next
    double period = 0;  // points after which it begins again; 0: never
    bool operator==(const Move&) const = default;
  };
  double taps = 1, reach = 1;  // of one iteration: elements, and from the first to the last
  std::vector<Move> moves;     // the smallest slope first
  IteratorSet data = 0;        // the iterators that move a data-dependent part
  bool is_displaced = false;   // the data only displace the index
  bool is_clamped = false;     // at borders
  double divisor = 1;          // of taps, reach and slopes
  double modulus = 0;          // 0: it does not wrap
  double most = 1;             // elements between the ends of the index
  bool operator==(const TouchedSide&) const = default;
};

struct Touch {
  int buffer = 0;  // a Func, or an image after all Funcs
  bool writes = false;
  bool is_own = false;      // an update reads the element that it writes
  IteratorSet carried = 0;  // a stage reads its own elements at other points: along these iterators
  double element_bytes = 4;
  double components = 1;  // of a Tuple, each in an array of its own
  double count = 1;       // loads or stores of an iteration
  std::vector<TouchedSide> sides;
  IteratorSet moved = 0, data = 0;
  bool operator==(const Touch&) const = default;
};

// How a buffer is stored.
struct Layout {
  std::vector<int16_t> order;   // dimensions, innermost first
  std::vector<double> extents;  // by dimension
  double elements() const;
};

// The lanes of a vector, along one iterator or, if that is shorter, along two.
struct LaneLoop {
  int iterator = -1, outer = -1;
  int depth = 0;  // of the loop
  double count = 1, inner = 1, step = 1;
  IteratorSet moves = 0;
  // The points of the iterator in one iteration of the innermost loop along it that is no lane and no copy. Lowering
  // gives whole iterations of that loop to a border.
  double block = 1;
};

// Instructions of a load or store of all lanes.
struct LaneMoves {
  double vectors = 1, shuffles = 0;
  bool is_by_lane = false;    // an element at a time
  bool is_bent = false;       // lanes are in another order than elements: they are computed apart
  bool is_unaligned = false;  // vectors begin anywhere in a cache line
  bool is_shifted = false;    // and in a row of vectors
  double border_share = 0;    // of vectors, whose lanes are clamped one by one
};

// The iterations of some iterators, all together.
double iterations_of(IteratorSet iterators, const Cover& cover);
// Cache lines while the loops run over these points.
double touched_lines(const Touch& touch, const Layout& layout, const Cover& cover);
// The bytes of a cache that would have to be touched evenly for as many lines in each set as the fullest sets have now.
// `set_stride`: bytes from a line to the next one of its set.
double bytes_by_sets(const Touch& touch, const Layout& layout, const Cover& cover,
                     int64_t set_stride);
// `vectors`: of the machine, that the lanes fill.
LaneMoves lane_moves(const Touch& touch, const Layout& layout, const LaneLoop& lanes,
                     double vectors);

// The touches of the accesses of one stage.
std::vector<Touch> touches_of(const std::vector<const Access*>& accesses, const SizeModel& sizes,
                              const Motions& motions);

}  // namespace retrograde::planning
