// look_ups.h -- loops of stages that read at places that data decide, which are the same for many
// elements or terms.
//
//   warped(x, y, c) = lerp(image(i(x, y), j(x, y), c), ...)      for y, x: 2 of c, unrolled
//   u_adj(x, y) += seed(x, y, c) * (image(i(x, y) + 1, j(x, y), c) - ...)
//                        for y by 32: for c by 2: for y, x: 2 of c, unrolled
//   toned(x, y, c) = picture(x, y, c) + curve(brightness(x, y))  for y, x: all of few c, unrolled
//
// A place costs more than what is read there: a few planes at once share it, few enough that the rows
// around a place stay in the near cache of all of them. Where the planes are terms of a sum, they are
// outside of the pixels: each step from plane to plane needs another page, and no prefetcher follows
// so many; a block of rows of the sums stays in the cache meanwhile.
#pragma once

#include "autoschedule/size_estimate.h"
#include "frontend/schedule/stage.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

// Gives the stage its loops, with so many lanes along its first dimension; false: it is none of
// these.
bool schedule_look_ups(const FuncContents& f, int index, Stage& stage, int lanes,
                       const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
