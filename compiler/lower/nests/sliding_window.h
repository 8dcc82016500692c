// sliding_window -- what of a Func is new in each iteration of a loop that its storage outlives.
//
//   f stored outside, computed inside of the loop over y, and read at y - 1 .. y + 1:
//
//   for y in [0, n):                  for y in [-2, n):
//     f over [y - 1, y + 1]     =>      f over [y + 1, y + 1]
//     body(y)                           if (y >= 0) body(y)
//
// Method: along a serial loop on which the required box depends in one dimension only, and whose
//         ends there never move back, what earlier iterations computed is kept. The loop starts
//         early enough that the new parts alone add up to what its first iteration needs; where
//         they do not add up exactly, as where clamps stop at a border, the first iteration
//         computes all from there on that it needs: few, when it is early enough, too. Where the loop
//         is not the one directly around, that is its whole box.
// Legal:  every update is pure in the dimension; no loop of f runs past the part that it is given.
// Source: the scheduling model of Ragan-Kelley et al., PLDI 2013, section 4.3; starting loops early
//         is known from later versions of its compiler. Tests: test/unit/sliding_window_test.cpp.
#pragma once

#include <vector>

#include "analysis/interval.h"
#include "lower/nests/stage_nest.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

// What is known of the variables of `loops`.
BoundsMap facts_of(const std::vector<Loop>& loops);

struct Slide {
  int dimension = 0;
  Loop loop;
  int lead = 0;      // iterations before the loop's first in which the Func is computed already
  Interval whole;    // what an iteration needs
  Interval part;     // what it computes
  Interval touched;  // no less than the part, without the choice between the first and others
};

// The same from the loop's first iteration on; before it as in the first.
Interval held_from_first(const Interval& side, const Loop& loop);

// `box`: what one iteration needs of f. `loops`: between f's computation and its storage, innermost
// first. `around`: all loops of the consumer from there on, whose ranges may be relied upon.
// `lead`: how many iterations before the first of loops[0] f is wanted already.
std::vector<Slide> slides_of(const LoopedFunc& f, const Box& box, const std::vector<Loop>& loops,
                             const std::vector<Loop>& around, int lead);

}  // namespace retrograde::lower
