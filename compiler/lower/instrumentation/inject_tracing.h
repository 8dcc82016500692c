// inject_tracing -- insert trace events for loads, stores and realizations.
#pragma once

#include <string>

#include "ir/target.h"
#include "lower/nests/build_loop_nests.h"
#include "lower/program.h"

namespace retrograde::lower {

// Changes nests.body, whose names need not be unique yet.
void inject_tracing(LoopNests& nests, const Program& program, const std::string& pipeline,
                    const Target& target);

}  // namespace retrograde::lower
