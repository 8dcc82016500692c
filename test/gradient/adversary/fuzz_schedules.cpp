// fuzz_schedules -- searches for programs whose gradients the compiler schedules wrongly. support/fuzz.h describes its
// arguments; this program adds
//
//   --memory PERCENT    report a large program that uses more than this share of its memory limit
//   --style STYLE       workloads instead, as for fuzz_adjoints
#include <cstdlib>

#include "gradient/adversary/auto_scheduled.h"
#include "gradient/adversary/workload_kinds.h"
#include "support/fuzz.h"

int main(int argc, char** argv) {
  using namespace retrograde;
  using namespace retrograde::gradient;
  std::optional<fuzz::Workload> workload;
  const auto judge_one = [&](Choices& choices, bool machine_code) {
    return judge_auto_scheduled(choices, machine_code, workload);
  };
  const auto text = [&](Choices& choices) { return auto_scheduled_text(choices, workload); };
  const auto take = [&](fuzz::Fuzzer& fuzzer, const std::string& name, const std::string& value) {
    if (name == "--memory") return limit_memory(std::atoi(value.c_str())), true;
    return take_style(fuzzer, name, value, workload);
  };
  return fuzz::fuzz_main({.judge = judge_one,
                          .text = text,
                          .limits = {60, 240, 0},
                          .most_refused = 1.0 / 3,
                          .compile = 25,
                          .take = take},
                         argc, argv);
}
