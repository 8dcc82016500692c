// All pipelines. Include this inside a namespace that sees one of the languages and has a function
// jit_target().
#include "differential/pipelines/common.h"

// These must follow common.h.
#include "differential/pipelines/arithmetic.h"
#include "differential/pipelines/functions.h"
#include "differential/pipelines/images.h"
#include "differential/pipelines/reductions.h"
#include "differential/pipelines/schedules.h"
#include "differential/pipelines/updates.h"

// Only printed, not realized.
#include "differential/pipelines/loop_nests.h"

// Must stay last.
#include "differential/realize.h"
