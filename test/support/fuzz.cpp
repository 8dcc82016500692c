#include "support/fuzz.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <sstream>

#include "diagnostics/error.h"
#include "support/checked_accesses.h"

namespace retrograde::fuzz {

namespace {

constexpr size_t most_reasons = 12;
constexpr double seconds_between_lines = 30;

// Parses all of the text as a number, without leading spaces.
template <typename T>
bool is_number(const std::string& text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

// Removes names in quotes and digits, so that messages about different programs are equal.
std::string without_names(const std::string& message) {
  std::string result;
  bool quoted = false;
  for (char c : message) {
    if (c == '"') quoted = !quoted;
    if (!quoted && c != '"' && !(c >= '0' && c <= '9')) result += c;
  }
  return result;
}

// Messages have the form "cannot do A: the rule B; the evidence C. Do D"; this returns the text between ": " and "; ".
std::string reason_of(const std::string& message) {
  const std::string plain = without_names(message);
  const bool is_compiled = plain.find("no machine code") != std::string::npos;
  size_t begin = plain.find(": ");
  if (is_compiled && begin != std::string::npos) begin = plain.find(": ", begin + 2);
  const size_t end = plain.find("; ", begin == std::string::npos ? 0 : begin);
  const std::string rule =
      begin == std::string::npos ? plain : plain.substr(begin + 2, end - begin - 2);
  return (is_compiled ? "machine code: " : "") + rule.substr(0, 110);
}

struct Outcome {
  ApartResult apart;
  Judged judged;
};

class Fuzzing {
 public:
  explicit Fuzzing(Fuzzer fuzzer) : fuzzer_(std::move(fuzzer)) {}

  // Returns the index of the first bad argument; 0: all are good.
  int read(int argc, char** argv) {
    for (int i = 1; i < argc; ++i) {
      const std::string name = argv[i];
      if (take_flag(name)) continue;
      if (i + 1 >= argc || !take(name, argv[i + 1])) return i;
      ++i;
    }
    return 0;
  }

  int run() {
    const auto start = std::chrono::steady_clock::now();
    const auto elapsed = [&] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    double told = 0;
    for (uint64_t seed = seed_; tried_ < count_ && elapsed() <= seconds_; ++seed) {
      try_choices(choices_.empty() ? Choices(seed) : Choices(choices_), seed);
      if (elapsed() < told + seconds_between_lines) continue;
      told = elapsed();
      print_progress(seed, told);
    }
    print_summary(elapsed());
    const uint64_t legal = tried_ - judgements_[Judgement::Illegal];
    const bool is_many = tried_ >= 50;
    const bool refuses = is_many && judgements_[Judgement::Refused] > fuzzer_.most_refused * legal;
    const bool is_slow = is_many && slow_ > fuzzer_.most_slow * tried_;
    // A run that tried nothing must not look like a clean one.
    if (tried_ == 0) std::puts("no program was tried: nothing is known");
    if (refuses) std::puts("too many are refused: the generator or a check is wrong");
    if (is_slow) std::puts("too many are slow: the generator or the compiler is wrong");
    return tried_ == 0 || found_ > 0 || refuses || is_slow ? 1 : 0;
  }

 private:
  bool take_flag(const std::string& name) {
    shrinks_ &= name != "--no-shrink";
    prints_ |= name == "--print";
    prints_refusals_ |= name == "--refusals";
    return name == "--no-shrink" || name == "--print" || name == "--refusals";
  }
  bool take(const std::string& name, const std::string& value) {
    if (name == "--seed" || name == "--choices") count_ = 1;
    if (name == "--seconds") count_ = UINT64_MAX;
    if (name == "--want") want_ = value;
    if (name == "--seed" || name == "--from") return is_number(value, seed_);
    if (name == "--count") return is_number(value, count_);
    if (name == "--seconds") return is_number(value, seconds_);
    if (name == "--compile") return is_number(value, fuzzer_.compile);
    if (name == "--choices") return take_list(value);
    return name == "--want" || (fuzzer_.take && fuzzer_.take(fuzzer_, name, value));
  }
  bool take_list(const std::string& value) {
    std::istringstream in(value);
    bool is_good = true;
    for (std::string part; std::getline(in, part, ',');)
      is_good &= is_number(part, choices_.emplace_back());
    return is_good && !choices_.empty();
  }

  Judged guarded(Choices& choices, bool machine_code) const {
    try {
      return fuzzer_.judge(choices, machine_code);
    } catch (const UserError& error) {
      return {Judgement::Illegal, error.what()};
    } catch (const std::exception& error) {
      return {Judgement::Broken, error.what()};
    }
  }
  std::string text_of(Choices& choices) const {
    try {
      return fuzzer_.text(choices);
    } catch (const std::exception& error) {
      return error.what();
    }
  }

  // The process sends the counts as words before the detail.
  Outcome judge(Choices choices, bool machine_code) const {
    Outcome result;
    result.apart = run_apart(fuzzer_.limits, [&](std::string& detail) {
      const Judged judged = guarded(choices, machine_code);
      for (const auto& [what, n] : judged.counts) detail += text(n, " ", what, "\n");
      detail += "\n" + judged.detail;
      return static_cast<int>(judged.judgement);
    });
    if (result.apart.is_crash()) return result;
    result.judged.judgement = static_cast<Judgement>(result.apart.code);
    std::istringstream in(result.apart.detail);
    for (std::string line; std::getline(in, line) && !line.empty();) {
      const size_t space = line.find(' ');
      is_number(line.substr(0, space), result.judged.counts[line.substr(space + 1)]);
    }
    std::getline(in, result.judged.detail, '\0');
    return result;
  }

  bool is_wanted(const Outcome& result) const {
    return !want_.empty() && result.judged.judgement == Judgement::Refused &&
           result.judged.detail.find(want_) != std::string::npos;
  }
  bool is_finding(const Outcome& result) const {
    return result.apart.is_crash() || result.judged.judgement >= Judgement::Wrong ||
           is_wanted(result);
  }
  static std::string describe(const Outcome& result) {
    if (result.apart.is_slow()) return "takes too long";
    if (result.apart.is_crash()) return result.apart.crash();
    return text("is ", name_of(result.judged.judgement), ": ", result.judged.detail);
  }
  // The kind of a finding: the beginning of its message.
  std::string kind_of(const Outcome& result) const {
    if (is_wanted(result)) return want_;
    return text(result.apart.is_slow() ? -1 : result.apart.signal, " ", result.apart.code, " ",
                without_names(result.judged.detail).substr(0, 18));
  }

  // The choices that generating the program consumes.
  std::vector<uint32_t> taken_by(Choices choices) const {
    text_of(choices);
    return choices.taken();
  }

  void report(const Choices& choices, uint64_t seed, const Outcome& found,
              bool machine_code) const {
    std::printf("seed %llu %s\n", static_cast<unsigned long long>(seed), describe(found).c_str());
    std::fflush(stdout);
    if (!shrinks_) return;
    const std::string kind = kind_of(found);
    const auto small = shrink_choices(taken_by(choices), [&](const std::vector<uint32_t>& list) {
      return kind_of(judge(Choices(list), machine_code)) == kind;
    });
    Choices again(small);
    std::string list;
    for (uint32_t choice : small) list += (list.empty() ? "" : ",") + std::to_string(choice);
    std::printf("shrunk, it %s\n%s\n--choices %s\n",
                describe(judge(Choices(small), machine_code)).c_str(), text_of(again).c_str(),
                list.c_str());
    std::fflush(stdout);
  }

  void try_choices(Choices choices, uint64_t seed) {
    Choices probe = choices;
    if (fuzzer_.passes_over && fuzzer_.passes_over(probe)) return;
    ++tried_;
    const bool machine_code = seed * 7919 % 100 < fuzzer_.compile;
    Choices printed = choices;
    if (prints_) std::puts(text_of(printed).c_str());
    const Outcome result = judge(choices, machine_code);
    if (result.apart.is_slow() && fuzzer_.most_slow > 0 && count_ > 1) {
      ++slow_;
      std::printf("seed %llu takes too long\n", static_cast<unsigned long long>(seed));
    } else if (is_finding(result)) {
      ++found_;
      report(choices, seed, result, machine_code);
    } else {
      add(seed, result);
    }
  }
  void add(uint64_t seed, const Outcome& result) {
    const Judgement judgement = result.judged.judgement;
    ++judgements_[judgement];
    for (const auto& [what, n] : result.judged.counts) counts_[what] += n;
    const bool is_refused = judgement == Judgement::Refused;
    if (is_refused) ++reasons_[reason_of(result.judged.detail)];
    if (prints_refusals_ && (is_refused || judgement == Judgement::Illegal))
      std::printf("seed %llu %s\n", static_cast<unsigned long long>(seed),
                  describe(result).c_str());
  }

  void print_progress(uint64_t seed, double seconds) const {
    std::printf("to seed %llu: %llu programs, %llu findings, %.0f seconds\n",
                static_cast<unsigned long long>(seed), static_cast<unsigned long long>(tried_),
                static_cast<unsigned long long>(found_), seconds);
    std::fflush(stdout);
  }

  // Prints one line of counts, then one for each reason of refusals, the most frequent first.
  void print_summary(double seconds) const {
    std::string line = text(tried_, " programs, ", found_, " findings");
    for (const auto& [judgement, n] : judgements_) line += text(", ", n, " ", name_of(judgement));
    if (slow_ > 0) line += text(", ", slow_, " too slow");
    for (const auto& [what, n] : counts_) line += text(", ", n, " ", what);
    std::printf("%s, %.0f seconds\n", line.c_str(), seconds);
    std::vector<std::pair<uint64_t, std::string>> reasons;
    for (const auto& [reason, n] : reasons_) reasons.emplace_back(n, reason);
    std::sort(reasons.rbegin(), reasons.rend());
    if (reasons.size() > most_reasons) reasons.resize(most_reasons);
    const double share = 100.0 / static_cast<double>(std::max<uint64_t>(tried_, 1));
    for (const auto& [n, reason] : reasons)
      std::printf("  %llu refused (%.2f %%): %s\n", static_cast<unsigned long long>(n),
                  static_cast<double>(n) * share, reason.c_str());
  }

  Fuzzer fuzzer_;
  uint64_t seed_ = 1000, count_ = 100;
  double seconds_ = 1e9;
  bool shrinks_ = true, prints_ = false, prints_refusals_ = false;
  std::string want_;
  std::vector<uint32_t> choices_;
  uint64_t tried_ = 0, found_ = 0, slow_ = 0;
  std::map<Judgement, uint64_t> judgements_;
  std::map<std::string, uint64_t> counts_, reasons_;
};

}  // namespace

int fuzz_main(Fuzzer fuzzer, int argc, char** argv) {
  Fuzzing fuzzing(std::move(fuzzer));
  if (const int bad = fuzzing.read(argc, argv)) {
    std::fprintf(stderr, "%s: unknown argument, or no value that it takes: %s\n", argv[0],
                 argv[bad]);
    return 2;
  }
  return fuzzing.run();
}

}  // namespace retrograde::fuzz
