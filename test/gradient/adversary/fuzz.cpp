// fuzz_adjoints -- searches for programs that propagate_adjoints differentiates wrongly. support/fuzz.h describes its
// arguments; this program adds
//
//   --style STYLE    programs in the forms of users' programs (testing/programs/workloads.h) instead of expressions of
//                    every kind: `workloads`, or only `loops`, `strides` or `indices`. At most 6 % may be refused
#include "support/fuzz.h"
#include "gradient/adversary/check.h"
#include "gradient/adversary/workload_kinds.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr size_t memory_bytes = 0;  // no limit: the sanitizers' shadow memory takes address space
#else
constexpr size_t memory_bytes = size_t{6} << 30;
#endif

int main(int argc, char** argv) {
  using namespace retrograde;
  using namespace retrograde::gradient;
  std::optional<fuzz::Workload> workload;
  const auto judge_one = [&](Choices& choices, bool machine_code) {
    return workload ? judge_workload(choices, machine_code, *workload)
                    : judge(choices, machine_code);
  };
  const auto text = [&](Choices& choices) {
    return to_text(workload ? make_workload_adversary(choices, *workload)
                            : make_adversary(choices));
  };
  const auto take = [&](fuzz::Fuzzer& fuzzer, const std::string& name, const std::string& value) {
    return take_style(fuzzer, name, value, workload);
  };
  return fuzz::fuzz_main({.judge = judge_one,
                          .text = text,
                          .limits = {60, 600, memory_bytes},
                          .most_refused = 1.0 / 3,
                          .compile = 25,
                          .take = take},
                         argc, argv);
}
