// sliding_window -- find the part of a Func's region that is new in each iteration of a loop inside of its storage.
//
//   f is stored outside and computed inside of the loop over y, and read at y - 1 .. y + 1:
//
//   for y in [0, n):                  for y in [-2, n):
//     f over [y - 1, y + 1]     =>      f over [y + 1, y + 1]
//     body(y)                           if (y >= 0) body(y)
//
// Method: slides along a serial loop on which the required box depends in one dimension only, with ends that never move
//         back; values computed in earlier iterations are kept. The loop starts early enough that the new parts
//         together cover the box of its first iteration. If they do not cover it exactly, for example because clamps
//         stop at a border, the first iteration computes all remaining coordinates, which are few after an early
//         start. If the loop is not the innermost one around, the first iteration computes its complete box.
// Legal:  every update is pure in the dimension; no loop of f runs beyond the part that it computes.
// Source: the scheduling model of Ragan-Kelley et al., PLDI 2013, section 4.3; starting loops early
//         is known from later versions of its compiler. Tests: test/unit/lower/sliding_window_test.cpp.
#pragma once

#include <vector>

#include "analysis/interval.h"
#include "lower/nests/stage_nest.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

// The ranges of the variables of `loops`.
BoundsMap facts_of(const std::vector<Loop>& loops);

struct Slide {
  int dimension = 0;
  Loop loop;
  int lead = 0;      // iterations before the loop's first in which the Func is already computed
  Interval whole;    // the interval that an iteration needs
  Interval part;     // the interval that it computes
  Interval touched;  // covers the part, without the choice between the first iteration and others
};

// The interval from the loop's first iteration on; before it, the interval of the first iteration.
Interval held_from_first(const Interval& side, const Loop& loop);

// `box`: the region of f that one iteration needs. `loops`: between f's computation and its storage, innermost first.
// `around`: all loops of the consumer from there on, whose ranges may be assumed. `lead`: how many iterations before
// the first of loops[0] f is already needed.
std::vector<Slide> slides_of(const LoopedFunc& f, const Box& box, const std::vector<Loop>& loops,
                             const std::vector<Loop>& around, int lead);

}  // namespace retrograde::lower
