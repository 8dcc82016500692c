// All pipelines. Include inside a namespace that sees a language, and has a function jit_target().
#include "differential/pipelines/common.h"

// Not to be sorted above.
#include "differential/pipelines/arithmetic.h"
#include "differential/pipelines/functions.h"
#include "differential/pipelines/images.h"
#include "differential/pipelines/reductions.h"
#include "differential/pipelines/schedules.h"
#include "differential/pipelines/updates.h"

// Not realized, only shown.
#include "differential/pipelines/loop_nests.h"

// Nor this.
#include "differential/realize.h"
