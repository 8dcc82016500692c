// fuzz_pipelines -- looks for random programs whose machine code disagrees with the interpreter.
//
//   fuzz_pipelines [--seed N | --from N] [--count N | --seconds N] [--no-shrink] [--print]
//                  [--refusals] [--without DIRECTIVE]... [--only DIRECTIVE]
//
// Each program runs in a process of its own, so that a crash or a hang is a finding like any other.
// A finding is shrunk and printed as C++. A program that is refused with an error for its author is
// counted, and is a finding only when refusals are asked for or make up more than a tenth of all.
// So is one that computes for too long, when there are more of these than one in a hundred: a
// random schedule may well ask for a thousand times the work. Only a directive: seeds whose
// schedules do not use it are passed over and not counted. Exit code: 0 nothing found, 1 something
// found or nothing tried.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "diagnostics/error.h"
#include "ir/target.h"
#include "support/fuzz_options.h"
#include "support/run_apart.h"
#include "testing/check_program.h"
#include "testing/print_program.h"
#include "testing/reducer.h"

namespace {

using namespace retrograde;
using namespace retrograde::fuzz;

// A program that computes for longer, or that stands still for longer, on a machine however busy.
constexpr unsigned max_cpu_seconds = 60, max_seconds = 240;
constexpr double max_refused_fraction = 0.1, max_slow_fraction = 0.01;
constexpr int crashed = 100;  // codes of findings: a Verdict, or this plus the signal (0: exited)

struct Options : FuzzOptions {
  std::vector<std::string> without;
  std::string only;
};

void check_name(const std::string& directive) {
  const std::vector<std::string> known = ir::directive_names();
  if (std::find(known.begin(), known.end(), directive) != known.end()) return;
  std::fprintf(stderr, "fuzz_pipelines: no directive is called %s\n", directive.c_str());
  std::exit(2);
}

// Takes every use of it out of the schedule, with what hangs on it.
ScheduleLog leave_out(ScheduleLog log, const std::string& directive) {
  for (size_t i = log.size(); i-- > 0;) {
    if (i < log.size() && name_of(log.entries[i].directive) == directive) log = log.without(i);
  }
  return log;
}

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    if (options.take(i, argc, argv)) continue;
    const std::string name = argv[i];
    const bool has_value = i + 1 < argc;
    if (name == "--without" && has_value) {
      check_name(options.without.emplace_back(argv[++i]));
    } else if (name == "--only" && has_value) {
      check_name(options.only = argv[++i]);
    } else {
      std::fprintf(stderr, "fuzz_pipelines: unknown argument, or no number: %s\n", argv[i]);
      std::exit(2);
    }
  }
  return options;
}

struct Finding {
  int code = 0;  // a Verdict, or `crashed` + signal
  std::string detail;
};

Finding run_program(const Program& program) {
  const ApartLimits limits{max_cpu_seconds, max_seconds};
  const ApartResult result = run_apart(limits, [&](std::string& detail) {
    const Outcome outcome =
        check_program(program.pipeline, program.schedule, get_jit_target_from_environment());
    detail = outcome.detail;
    return static_cast<int>(outcome.verdict);
  });
  if (result.is_crash()) return {crashed + result.signal, result.crash()};
  return {result.code, result.detail};
}

std::string describe(const Finding& finding) {
  if (finding.code >= crashed) return finding.detail;
  return std::string(verdict_name(static_cast<Verdict>(finding.code))) + ": " + finding.detail;
}

// A refusal is the same finding only with the same kind of message: how it begins.
std::string kind_of(const Finding& finding) {
  const bool by_text = finding.code == static_cast<int>(Verdict::Refused) ||
                       finding.code == static_cast<int>(Verdict::Broken);
  return std::to_string(finding.code) + (by_text ? finding.detail.substr(0, 24) : "");
}

void report(uint64_t seed, const Program& program, const Finding& finding, bool may_shrink) {
  std::printf("seed %llu %s\n", static_cast<unsigned long long>(seed), describe(finding).c_str());
  std::fflush(stdout);
  if (!may_shrink) return;
  const std::string kind = kind_of(finding);
  const Program small =
      shrink(program, [&](const Program& p) { return kind_of(run_program(p)) == kind; });
  std::printf("shrunk, it %s\n%s\n", describe(run_program(small)).c_str(),
              to_cpp(small.pipeline, small.schedule).c_str());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  const auto start = std::chrono::steady_clock::now();
  uint64_t found = 0, tried = 0, refused = 0, slow = 0;
  for (uint64_t seed = options.seed; tried < options.count; ++seed) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (elapsed.count() > options.seconds) break;
    Program program{random_pipeline(seed), {}};
    program.schedule = random_schedule(program.pipeline, seed);
    for (const std::string& directive : options.without)
      program.schedule = leave_out(program.schedule, directive);
    if (!options.only.empty() && leave_out(program.schedule, options.only) == program.schedule)
      continue;
    ++tried;
    if (options.print) std::puts(to_cpp(program.pipeline, program.schedule).c_str());
    const Finding finding = run_program(program);
    if (finding.code == static_cast<int>(Verdict::Agrees)) continue;
    if (finding.code == static_cast<int>(Verdict::Refused)) {
      ++refused;
      if (!options.refusals) continue;
    }
    if (finding.code == crashed + SIGXCPU && options.count > 1) {
      ++slow;
      report(seed, program, finding, false);
      continue;
    }
    ++found;
    report(seed, program, finding, options.shrink);
  }
  std::printf("%llu programs, %llu findings, %llu refused, %llu too slow\n",
              static_cast<unsigned long long>(tried), static_cast<unsigned long long>(found),
              static_cast<unsigned long long>(refused), static_cast<unsigned long long>(slow));
  const bool refuses_much = tried >= 50 && refused > tried * max_refused_fraction;
  if (refuses_much) std::puts("too many are refused: the generator or a check is wrong");
  const bool is_slow = tried >= 100 && slow > tried * max_slow_fraction;
  if (is_slow) std::puts("too many are slow: the generator or the compiler is wrong");
  return !options.has_tried(tried) || found > 0 || refuses_much || is_slow ? 1 : 0;
}
