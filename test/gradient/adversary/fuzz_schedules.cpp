// fuzz_schedules -- searches for programs whose gradients the compiler schedules wrongly. support/fuzz.h describes its
// arguments; this program adds
//
//   --memory PERCENT    report a large program that uses more than this share of its memory limit
#include <cstdlib>

#include "gradient/adversary/auto_scheduled.h"
#include "support/fuzz.h"

int main(int argc, char** argv) {
  using namespace retrograde::gradient;
  return retrograde::fuzz::fuzz_main({.judge = judge_auto_scheduled,
                                      .text = auto_scheduled_text,
                                      .limits = {60, 240, 0},
                                      .most_refused = 1.0 / 3,
                                      .compile = 25,
                                      .take =
                                          [](const std::string& name, const std::string& value) {
                                            if (name != "--memory") return false;
                                            limit_memory(std::atoi(value.c_str()));
                                            return true;
                                          }},
                                     argc, argv);
}
