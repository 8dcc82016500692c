// fuzz_forms -- looks for pointwise expressions whose gradient is wrong.
//
//   fuzz_forms [--seed N | --from N] [--count N | --seconds N] [--compile PERCENT] [--no-shrink]
//              [--print]
//
// Every seed is tried in float32 and in double. A finding is shrunk and printed. Exit code: 0
// nothing found, 1 something found or nothing tried.
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "gradient/forms/check_form.h"
#include "gradient/forms/expressions.h"
#include "ir/print.h"
#include "support/fuzz_options.h"

namespace {

using namespace retrograde;
using namespace retrograde::gradient;

struct Options : fuzz::FuzzOptions {
  unsigned compile = 100;
};

Options parse(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    if (options.take(i, argc, argv)) continue;
    const std::string name = argv[i];
    if (name != "--compile" || i + 1 >= argc || !Options::is_number(argv[++i], options.compile)) {
      std::fprintf(stderr, "fuzz_forms: unknown argument, or no number: %s\n", argv[i]);
      std::exit(2);
    }
  }
  return options;
}

FormResult check(Choices choices, Type type, uint64_t seed, bool compile) {
  try {
    return check_form(make_form(choices, type), seed, compile);
  } catch (const std::exception& error) {
    FormResult result;
    result.finding = std::string("exception: ") + error.what();
    return result;
  }
}

void report(uint64_t seed, Type type, const FormResult& found, bool compile, bool shrink) {
  std::printf("seed %llu, %d bits: %s\n", static_cast<unsigned long long>(seed), type.bits(),
              found.finding.c_str());
  if (!shrink) return;
  Choices choices(seed);
  make_form(choices, type);
  const auto small = shrink_choices(choices.taken(), [&](const std::vector<uint32_t>& list) {
    return !check(Choices(list), type, seed, compile).finding.empty();
  });
  std::printf("shrunk: %s\n", check(Choices(small), type, seed, compile).finding.c_str());
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse(argc, argv);
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  FormResult total;
  uint64_t tried = 0, findings = 0;
  for (uint64_t seed = options.seed; tried < options.count && elapsed() <= options.seconds;
       ++seed, ++tried) {
    const bool compile = seed * 7919 % 100 < options.compile;
    for (const Type type : {Float(32), Float(64)}) {
      Choices choices(seed);
      if (options.print) std::puts(ir::print(make_form(choices, type)).c_str());
      const FormResult found = check(Choices(seed), type, seed, compile);
      if (!found.finding.empty()) {
        ++findings;
        report(seed, type, found, compile, options.shrink);
      }
      total += found;
    }
  }
  std::printf(
      "%llu expressions in float32 and double, %.0f s: %d slopes compared, %d ill-conditioned, %d "
      "places where a value is not finite or not normal, %llu expressions with a finding\n",
      static_cast<unsigned long long>(tried), elapsed(), total.checked, total.ill_conditioned,
      total.outside, static_cast<unsigned long long>(findings));
  return Options::has_tried(tried) && findings == 0 ? 0 : 1;
}
