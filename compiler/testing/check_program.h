// One program against the oracle: builds it, schedules it, runs the machine code, compares.
#pragma once

#include <functional>
#include <vector>

#include "diagnostics/error.h"
#include "ir/target.h"
#include "testing/judgement.h"
#include "testing/random_schedule.h"

namespace retrograde::fuzz {

// How an access outside of its storage becomes a finding.
enum class Watch {
  Accesses,  // the machine code checks accesses and promises (Target::CheckedAccesses)
  Pages,     // the machine code as users get it; its heap blocks end before a forbidden page
};

// Floats may differ by twice the error that contraction to FMA and the stated ULP of math functions
// can cause in this very computation (tracked_value.h); everything else is compared bit for bit. The
// program has the schedule afterwards. Counts: "values", and those "unstable", which say nothing.
Judged check_program(const RandomProgram& program, const ScheduleLog& schedule,
                     const Target& target, Watch watch = Watch::Accesses);
// The same; `schedule` gives the schedule. What is compiled runs once after each of `preparations`, which
// set how it runs: each run is compared.
Judged check_with_schedule(const RandomProgram& program, const std::function<void()>& schedule,
                           const Target& target,
                           const std::vector<std::function<void()>>& preparations = {[] {}},
                           Watch watch = Watch::Accesses);

// Of a run: what there is of some memory, of a device among others, was not enough. No finding.
bool lacks_memory(const RuntimeError&);
// Whether Target::CheckedAccesses gave the error: an access outside of its memory, or a false promise. A finding.
bool is_access_outside(const UserError&);

}  // namespace retrograde::fuzz
