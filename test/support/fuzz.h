// fuzz.h -- the driver that all fuzzers share: options, limits, shrinking and reports.
//
// Machine code checks its accesses (Target::CheckedAccesses) unless RG_JIT_TARGET names a target. Each program runs in
// a separate process with limits of time and memory, so a crash or a hang is a finding like a wrong result. A finding
// is shrunk (testing/choices.h) and printed with its choices. Refusals are counted by their rule.
//
//   --seed N | --from N, --count N | --seconds N    one program, or several from N on; prints progress every 30 s
//   --choices LIST       the program that a finding was shrunk to
//   --compile PERCENT    the share of programs for which the checks that need machine code run, too
//   --no-shrink, --print, --refusals                print the programs, print refusals
//   --want TEXT          a refusal whose message contains TEXT is a finding, to show what is refused
//
// Exit code: 0 nothing found, 1 something found, too much refused or nothing tried, 2 bad arguments.
#pragma once

#include <functional>
#include <optional>

#include "support/run_apart.h"
#include "testing/choices.h"
#include "testing/judgement.h"

namespace retrograde::fuzz {

struct Fuzzer {
  std::function<Judged(Choices& choices, bool machine_code)> judge;
  std::function<std::string(Choices& choices)> text;
  ApartLimits limits = {};
  double most_refused =
      0.1;  // largest share of legal programs that may be refused; beyond it, too little is tested
  double most_slow = 0;  // largest share of programs that may time out without being a finding
  unsigned compile = 100;
  // Handles an additional argument and its value, which may change the limits.
  std::function<bool(Fuzzer& fuzzer, const std::string& name, const std::string& value)> take = {};
  // Programs that the options exclude are not counted.
  std::function<bool(Choices& choices)> passes_over = {};
};

int fuzz_main(Fuzzer fuzzer, int argc, char** argv);

}  // namespace retrograde::fuzz
