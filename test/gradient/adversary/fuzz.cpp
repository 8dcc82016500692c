// fuzz_adjoints -- looks for programs that propagate_adjoints gets wrong.
//
//   fuzz_adjoints [--seed N | --from N] [--count N | --seconds N] [--compile PERCENT] [--no-shrink]
//                 [--print] [--refusals] [--want TEXT]
//
// Each program runs in a process of its own under limits of processor time and memory, so that a
// crash or a hang is a finding like a wrong gradient. A finding is shrunk and printed. Refusals are
// counted by their rule, and printed when asked for; they are a finding when they make up more than
// a third of all: then little is tested. --compile: of how many programs the gradient runs as
// machine code, too (25). --want: a refusal whose message has this text is a finding, to see what
// is refused. Exit code: 0 nothing found, 1 something found or nothing tried.
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "diagnostics/error.h"
#include "gradient/adversary/check.h"
#include "gradient/adversary/tally.h"
#include "support/fuzz_options.h"
#include "support/run_apart.h"

namespace {

using namespace retrograde;
using namespace retrograde::gradient;
using fuzz::ApartResult;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr size_t memory_bytes = 0;  // their shadow takes address space
#else
constexpr size_t memory_bytes = size_t{6} << 30;
#endif
constexpr fuzz::ApartLimits limits = {60, 600, memory_bytes};

struct Options : fuzz::FuzzOptions {
  unsigned compile = 25;
  std::string want;
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    if (options.take(i, argc, argv)) continue;
    const std::string name = argv[i];
    if (name == "--compile" && i + 1 < argc && Options::is_number(argv[i + 1], options.compile)) {
      ++i;
    } else if (name == "--want" && i + 1 < argc) {
      options.want = argv[++i];
    } else {
      std::fprintf(stderr, "fuzz_adjoints: unknown argument, or no number: %s\n", argv[i]);
      std::exit(2);
    }
  }
  return options;
}

// What was checked comes back as the first character of the detail.
constexpr char first_flag = '@';

struct Outcome {
  ApartResult apart;
  Judged judged;
};

Outcome run(Choices choices, bool machine_code) {
  Outcome result;
  result.apart = fuzz::run_apart(limits, [&](std::string& detail) {
    const Judged judged = judge(choices, machine_code);
    detail = static_cast<char>(first_flag + static_cast<int>(judged.checked)) + judged.detail;
    return static_cast<int>(judged.judgement);
  });
  result.judged.judgement = static_cast<Judgement>(result.apart.code);
  const std::string& detail = result.apart.detail;
  if (result.apart.is_crash() || detail.empty()) return result;
  result.judged.checked = static_cast<unsigned>(detail[0] - first_flag);
  result.judged.detail = detail.substr(1);
  return result;
}

bool is_finding(const Outcome& result, const std::string& want) {
  if (result.apart.is_crash() || result.judged.judgement >= Judgement::Wrong) return true;
  return !want.empty() && result.judged.judgement == Judgement::Refused &&
         result.judged.detail.find(want) != std::string::npos;
}
std::string describe(const Outcome& result) {
  if (result.apart.is_slow()) return "takes too long";
  if (result.apart.is_crash()) return result.apart.crash();
  return std::string(name_of(result.judged.judgement)) + ": " + result.judged.detail;
}
// Findings of one kind: how their messages begin.
std::string kind_of(const Outcome& result, const std::string& want) {
  if (!want.empty() && is_finding(result, want)) return want;
  return text(result.apart.is_slow() ? -1 : result.apart.signal, " ", result.apart.code, " ",
              result.judged.detail.substr(0, 18));
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

void report(uint64_t seed, const Outcome& found, bool machine_code, const Options& options) {
  std::printf("seed %llu %s\n", static_cast<unsigned long long>(seed), describe(found).c_str());
  std::fflush(stdout);
  if (!options.shrink) return;
  const std::string kind = kind_of(found, options.want);
  const auto small = shrink_choices(choices_of(seed), [&](const std::vector<uint32_t>& list) {
    return kind_of(run(Choices(list), machine_code), options.want) == kind;
  });
  std::printf("shrunk, it %s\n%s\n", describe(run(Choices(small), machine_code)).c_str(),
              text_of(small).c_str());
  std::fflush(stdout);
}

void try_seed(uint64_t seed, const Options& options, Tally& tally) {
  const bool machine_code = seed * 7919 % 100 < options.compile;
  if (options.print) std::puts(text_of(choices_of(seed)).c_str());
  const Outcome result = run(Choices(seed), machine_code);
  if (is_finding(result, options.want)) {
    tally.add_finding();
    return report(seed, result, machine_code, options);
  }
  tally.add(result.judged);
  const Judgement judgement = result.judged.judgement;
  if (options.refusals && (judgement == Judgement::Refused || judgement == Judgement::Illegal))
    std::printf("seed %llu %s\n", static_cast<unsigned long long>(seed), describe(result).c_str());
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  Tally tally;
  for (uint64_t seed = options.seed; tally.tried() < options.count && elapsed() <= options.seconds;
       ++seed)
    try_seed(seed, options, tally);
  std::fputs(tally.summary(elapsed()).c_str(), stdout);
  if (tally.refuses_much()) std::puts("too many are refused: the generator or a check is wrong");
  const bool is_clean = tally.found() == 0 && !tally.refuses_much();
  return options.has_tried(tally.tried()) && is_clean ? 0 : 1;
}
