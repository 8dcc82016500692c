// One program against the oracle: builds it, schedules it, runs the machine code, compares.
#pragma once

#include <string>

#include "ir/target.h"
#include "testing/random_schedule.h"

namespace retrograde::fuzz {

enum class Verdict : uint8_t {
  Agrees,
  Differs,  // wrong results
  Refused,  // UserError or Unsupported: the generator does not know all rules of legality
  Broken,   // InternalError, or any other exception
};

struct Outcome {
  Verdict verdict = Verdict::Agrees;
  std::string detail;
  size_t compared = 0, unstable = 0;
};

const char* verdict_name(Verdict verdict);

// Floats may differ by twice the error that contraction to FMA and the stated ULP of math functions
// can cause in this very computation (tracked_value.h); everything else is compared bit for bit.
Outcome check_program(const PipelineSpec& pipeline, const ScheduleLog& schedule,
                      const Target& target);

}  // namespace retrograde::fuzz
