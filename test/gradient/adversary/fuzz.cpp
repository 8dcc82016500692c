// fuzz_adjoints -- looks for programs that propagate_adjoints gets wrong.
//
//   fuzz_adjoints [--seed N | --from N] [--count N | --seconds N] [--compile PERCENT] [--no-shrink]
//                 [--print] [--refusals]
//
// Each program runs in a process of its own under a limit of processor time, so that a crash or a
// hang is a finding like a wrong gradient. A finding is shrunk and printed. Refusals are counted,
// and printed when asked for; they are a finding when they make up more than a third of all: then
// little is tested. --compile: of how many programs the gradient runs as machine code, too (25).
// Exit code: 0 nothing found, 1 something found.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "gradient/adversary/check.h"
#include "support/fuzz_options.h"
#include "support/run_apart.h"

namespace {

using namespace retrograde;
using namespace retrograde::gradient;
using fuzz::ApartResult;

constexpr fuzz::ApartLimits limits = {20, 240};
constexpr double max_refused_fraction = 1.0 / 3;

struct Options : fuzz::FuzzOptions {
  unsigned compile = 25;
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    if (options.take(i, argc, argv)) continue;
    if (std::string(argv[i]) == "--compile" && i + 1 < argc) {
      options.compile = static_cast<unsigned>(std::strtoul(argv[++i], nullptr, 10));
    } else {
      std::fprintf(stderr, "fuzz_adjoints: unknown argument %s\n", argv[i]);
      std::exit(2);
    }
  }
  return options;
}

ApartResult run(Choices choices, bool machine_code) {
  return fuzz::run_apart(limits, [&](std::string& detail) {
    const Judged judged = judge(choices, machine_code);
    detail = judged.detail;
    return static_cast<int>(judged.judgement);
  });
}

bool is_finding(const ApartResult& result) {
  return result.signal || result.code >= static_cast<int>(Judgement::Wrong);
}
std::string describe(const ApartResult& result) {
  if (result.is_slow()) return "takes too long";
  if (result.signal) return result.crash();
  return std::string(name_of(static_cast<Judgement>(result.code))) + ": " + result.detail;
}
// Findings of one kind: how their messages begin.
std::string kind_of(const ApartResult& result) {
  return text(result.is_slow() ? -1 : result.signal, " ", result.code, " ",
              result.detail.substr(0, 18));
}

// The choices that a seed stands for: making the program takes them.
std::vector<uint32_t> choices_of(uint64_t seed) {
  Choices choices(seed);
  try {
    make_program(choices);
  } catch (const std::exception&) {
  }
  return choices.taken();
}

std::string text_of(const std::vector<uint32_t>& list) {
  Choices choices(list);
  try {
    return to_text(make_program(choices));
  } catch (const std::exception& error) {
    return std::string(error.what()) + "\n";
  }
}

void report(uint64_t seed, const ApartResult& found, bool machine_code, bool may_shrink) {
  std::printf("seed %llu %s\n", static_cast<unsigned long long>(seed), describe(found).c_str());
  std::fflush(stdout);
  if (!may_shrink) return;
  const std::string kind = kind_of(found);
  const auto small = shrink_choices(choices_of(seed), [&](const std::vector<uint32_t>& list) {
    return kind_of(run(Choices(list), machine_code)) == kind;
  });
  std::printf("shrunk, it %s\n%s\n", describe(run(Choices(small), machine_code)).c_str(),
              text_of(small).c_str());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  const auto start = std::chrono::steady_clock::now();
  std::map<std::string, uint64_t> counts;
  uint64_t tried = 0, found = 0, refused = 0, illegal = 0;
  for (uint64_t seed = options.seed; tried < options.count; ++seed, ++tried) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (elapsed.count() > options.seconds) break;
    const bool machine_code = seed * 7919 % 100 < options.compile;
    if (options.print) std::puts(text_of(choices_of(seed)).c_str());
    const ApartResult result = run(Choices(seed), machine_code);
    if (is_finding(result)) {
      ++found;
      report(seed, result, machine_code, options.shrink);
      continue;
    }
    const auto judgement = static_cast<Judgement>(result.code);
    ++counts[name_of(judgement)];
    refused += judgement == Judgement::Refused;
    illegal += judgement == Judgement::Illegal;
    if (options.refusals && (judgement == Judgement::Refused || judgement == Judgement::Illegal))
      std::printf("seed %llu %s\n", static_cast<unsigned long long>(seed),
                  describe(result).c_str());
  }
  std::printf("%llu programs, %llu findings", static_cast<unsigned long long>(tried),
              static_cast<unsigned long long>(found));
  for (const auto& [name, count] : counts)
    std::printf(", %llu %s", static_cast<unsigned long long>(count), name.c_str());
  std::puts("");
  const bool refuses_much =
      tried >= 50 &&
      static_cast<double>(refused) > max_refused_fraction * static_cast<double>(tried - illegal);
  if (refuses_much) std::puts("too many are refused: the generator or a check is wrong");
  return found > 0 || refuses_much ? 1 : 0;
}
