// fuzz_adjoints -- searches for programs that propagate_adjoints differentiates wrongly. support/fuzz.h describes its
// arguments.
#include "support/fuzz.h"
#include "gradient/adversary/check.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr size_t memory_bytes = 0;  // no limit: the sanitizers' shadow memory takes address space
#else
constexpr size_t memory_bytes = size_t{6} << 30;
#endif

int main(int argc, char** argv) {
  using namespace retrograde::gradient;
  const auto text = [](Choices& choices) { return to_text(make_adversary(choices)); };
  return retrograde::fuzz::fuzz_main({.judge = static_cast<Judged (*)(Choices&, bool)>(judge),
                                      .text = text,
                                      .limits = {60, 600, memory_bytes},
                                      .most_refused = 1.0 / 3,
                                      .compile = 25},
                                     argc, argv);
}
