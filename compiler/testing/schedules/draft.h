// draft.h -- a random schedule while it is drawn: the directives so far, the Funcs that they apply to, and the source
// of decisions, which the parts of the generator share.
#pragma once

#include <utility>

#include "testing/random_loops.h"
#include "testing/schedules/program_funcs.h"

namespace retrograde::fuzz {

struct Draft {
  Choices& random;
  ProgramFuncs funcs;
  LoopNames names = {};
  ScheduleLog log = {};

  void add(int f, graph::Directive directive, int stage = -1) {
    log.entries.push_back({funcs.name(f), stage, {}, std::move(directive)});
  }
};

}  // namespace retrograde::fuzz
