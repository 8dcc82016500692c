// check_program.h -- compiles, schedules and runs one random program, and compares its result with the interpreter.
#pragma once

#include <functional>
#include <vector>

#include "diagnostics/error.h"
#include "ir/target.h"
#include "testing/judgement.h"
#include "testing/random_schedule.h"
#include "testing/tracked_value.h"

namespace retrograde::fuzz {

// How accesses outside of allocated memory are detected.
enum class Watch {
  Accesses,  // the machine code checks accesses and promises (Target::CheckedAccesses)
  Pages,     // unmodified machine code, whose heap blocks end before a protected page
};

// Floats may differ by twice the error that contraction to FMA and the stated ULP of math functions can cause in this
// computation (tracked_value.h); everything else is compared bit for bit. Leaves the schedule on the program. The
// counts are "values" and, of these, "unstable" ones, which cannot be compared.
Judged check_program(const RandomProgram& program, const ScheduleLog& schedule,
                     const Target& target, Watch watch = Watch::Accesses);
// The same, where `schedule` schedules the program. The compiled program runs once after each of `preparations`, which
// set up how it runs; each run is compared. `rounding`: what may differ beside the schedule, such as the order of sums.
Judged check_with_schedule(const RandomProgram& program, const std::function<void()>& schedule,
                           const Target& target,
                           const std::vector<std::function<void()>>& preparations = {[] {}},
                           Watch watch = Watch::Accesses,
                           oracle::Rounding rounding = oracle::Rounding::Contraction);

// Whether a run failed because memory, for example of a device, was too small. That is no finding.
bool lacks_memory(const RuntimeError&);
// Whether Target::CheckedAccesses raised the error: an access outside of its memory, or a broken promise. That is a
// finding.
bool is_access_outside(const UserError&);

}  // namespace retrograde::fuzz
