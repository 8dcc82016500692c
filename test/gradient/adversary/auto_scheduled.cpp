#include "gradient/adversary/auto_scheduled.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "diagnostics/error.h"
#include "gradient/adversary/schedule_rules.h"
#include "gradient/adversary/scheduled_program.h"
#include "support/measured_threads.h"
#include "support/same_numbers.h"
#include "testing/check_program.h"
#include "testing/interpreter.h"

namespace retrograde::gradient {

namespace {

int memory_limit_percent = 0;

// Threads' private memory is negligible compared with this size.
constexpr int64_t small_memory = 4 << 20;

// Tolerances for two schedules that add in different orders, relative to the element and to its whole image. The
// gradient by a parameter is one sum of millions of terms, which may cancel each other.
constexpr double other_rounding = 5e-3, of_few_sums = 5e-2;
constexpr size_t few_sums = 64;

std::string error_of(const std::function<void()>& f) {
  try {
    f();
    return "";
  } catch (const UserError& error) {
    decide_by_access(error);
    return error.what();
  } catch (const Unsupported& error) {
    return error.what();
  }
}

void expect_same(const Buffers& a, const Buffers& b, const std::string& how) {
  for (size_t i = 0; i < a.size(); ++i) {
    if (std::memcmp(a[i].data(), b[i].data(), a[i].size_in_bytes()) != 0)
      decide(Judgement::Wrong, text("result ", i, " has other bits ", how));
  }
}

// A program at one size, and its schedule.
class AutoScheduled {
 public:
  AutoScheduled(const ScheduledProgram& scheduled, const AdversaryProgram& program,
                bool compiles_all)
      : told_(scheduled.told),
        is_whole_(scheduled.is_whole),
        compiles_all_(compiles_all),
        extents_(scheduled.extents),
        all_(program, scheduled.extents),
        has_fast_(uses_fast_functions(program.output())) {}

  void compare_interpreted() {
    const Pipeline scheduled = all_.copy();
    if (extents_ == Extents::Huge) return compile_only(scheduled);
    interpret_all();
    const std::string error = error_of([&] { check_small(scheduled); });
    if (!error.empty()) explain_refused(error);
    if (compiles_all_) expect_right(run(all_.own(), 2), " by default");
  }
  // Returns the number of bytes that are allocated for intermediate results.
  int64_t compare_with_serial_loops() {
    const Pipeline scheduled = all_.copy();
    int64_t bytes = 0;
    const std::string error = error_of([&] { bytes = check_large(scheduled); });
    if (!error.empty()) explain_refused(error);
    return bytes;
  }
  const std::set<std::string>& rules() const { return rules_; }
  const GradientPipeline& pipeline() const { return all_; }

 private:
  // ---- the interpreter ----

  void interpret_all() {
    oracle::InterpreterOptions options;
    options.rounding = oracle::Rounding::Contraction;
    options.max_points = max_points;
    options.max_operations = max_operations;
    for (size_t i = 0; i < all_.outputs().size(); ++i) {
      try {
        expected_.push_back(
            oracle::Interpreter(options).realize(all_.outputs()[i].function(), all_.regions()[i]));
      } catch (const InternalError&) {
        throw;
      } catch (const std::exception& error) {
        decide(Judgement::Illegal, std::string("it cannot be evaluated: ") + error.what());
      }
    }
  }
  void expect_right(const Buffers& found, const std::string& how) const {
    size_t b = 0;
    for (size_t i = 0; i < all_.outputs().size(); ++i) {
      for (const oracle::Array& expected : expected_[i]) {
        const Buffer<> buffer = found[b++];
        if (has_fast_ && !is_finite(expected)) continue;
        const auto compared =
            oracle::compare(expected, *const_cast<Buffer<>&>(buffer).raw_buffer(), 4);
        if (compared.agrees()) continue;
        decide(Judgement::Wrong, text(all_.outputs()[i].name(), how, ": ", compared.mismatches,
                                      " differ, first ", compared.first_mismatch));
      }
    }
  }

  // ---- schedules ----

  // Schedules now, or, by default, when the pipeline is compiled.
  void schedule(const Pipeline& pipeline) {
    if (!is_whole_) return Pipeline(pipeline).set_autoschedule(told_);
    source_ = pipeline.auto_schedule(get_jit_target_from_environment(), told_).schedule_source;
    std::vector<graph::FuncPtr> outputs;
    for (const Func& f : pipeline.outputs()) outputs.push_back(f.function());
    for (const std::string& rule : rules_seen_in(outputs)) rules_.insert(rule);
  }

  // A fresh copy, scheduled from the text of the log.
  Pipeline replay_of(const Pipeline& scheduled) const {
    const ScheduleLog log = scheduled.schedule_log();
    if (source_.empty() && log.size() > 0)
      decide(Judgement::Wrong, "the schedule has no statements");
    if (!(ScheduleLog::parse(log.to_text()) == log))
      decide(Judgement::Wrong, "the log is another when parsed: " + log.to_text());
    Pipeline replayed = all_.copy();
    replayed.apply_schedule(ScheduleLog::parse(log.to_text()));
    if (same_numbers(replayed.schedule_log().to_text()) != same_numbers(log.to_text()))
      decide(Judgement::Wrong, "the log is another when replayed: " + log.to_text());
    return replayed;
  }
  void check_replayed(const Pipeline& scheduled, const Buffers& found) const {
    const Pipeline replayed = replay_of(scheduled);
    if (compiles_all_)
      expect_same(found, run(replayed, 2), "under the replayed schedule");
    else if (same_numbers(replayed.loop_nest()) != same_numbers(scheduled.loop_nest()))
      decide(Judgement::Wrong, "replayed, it has other loops: " + replayed.loop_nest());
  }

  // A pipeline that is refused here must also be refused under the default schedule. (Without any schedule, it may take
  // forever to compile.)
  [[noreturn]] void explain_refused(const std::string& why) const {
    const std::string also = error_of(
        [&] { extents_ == Extents::Huge ? all_.own().compile_jit() : (void)run(all_.own(), 1); });
    decide(also.empty() ? Judgement::Wrong : Judgement::Refused, "no machine code: " + why);
  }

  // ---- machine code ----

  Buffers run(const Pipeline& pipeline, int threads, bool backward = false) const {
    OwnThreads context(threads, backward);
    return all_.realize(pipeline, &context);
  }

  void expect_same_on_any_threads(const Pipeline& scheduled, const Buffers& found) const {
    expect_same(found, run(scheduled, 1), "when run again");
    expect_same(found, run(scheduled, 2), "on 2 threads");
    expect_same(found, run(scheduled, 3, true), "on 3 threads");
    expect_same(found, run(scheduled, 7), "on 7 threads");
  }

  void check_small(const Pipeline& scheduled) {
    schedule(scheduled);
    const Buffers found = run(scheduled, 1);
    expect_right(found, ", scheduled");
    expect_same_on_any_threads(scheduled, found);
    if (is_whole_) check_replayed(scheduled, found);
  }

  void compile_only(const Pipeline& scheduled) {
    const std::string error = error_of([&] {
      schedule(scheduled);
      if (is_whole_) replay_of(scheduled);
      Pipeline(scheduled).compile_jit();
    });
    if (!error.empty()) explain_refused(error);
  }

  int64_t check_large(const Pipeline& scheduled) {
    std::vector<graph::FuncPtr> outputs;
    const Pipeline model = is_whole_ ? scheduled : all_.copy();
    for (const Func& f : model.outputs()) outputs.push_back(f.function());
    const auto funcs = graph::topological_order(outputs);  // before sums get parts
    schedule(scheduled);
    if (!is_whole_) model.auto_schedule(get_jit_target_from_environment(), told_);
    const Buffers serial = run(all_.in_serial_loops_like(funcs), 1);
    MeasuredThreads measured(2);
    const Buffers found = all_.realize(scheduled, &measured);
    expect_near(found, serial);
    if (measured.bytes() != 0)
      decide(Judgement::Wrong, text(measured.bytes(), " bytes are not given back"));
    expect_same_on_any_threads(scheduled, found);
    return measured.peak_bytes();
  }

  // Compares float values.
  void expect_near(const Buffers& found, const Buffers& serial) const {
    for (size_t i = 0; i < found.size(); ++i) {
      const auto* a = reinterpret_cast<const float*>(found[i].data());
      const auto* b = reinterpret_cast<const float*>(serial[i].data());
      const size_t n = serial[i].number_of_elements();
      double squares = 0;
      for (size_t k = 0; k < n; ++k) squares += double(b[k]) * b[k];
      if (!std::isfinite(squares)) decide(Judgement::Illegal, "it is not finite");
      const double scale = std::sqrt(squares / static_cast<double>(std::max<size_t>(n, 1)));
      const double bound = n <= few_sums ? of_few_sums : other_rounding;
      for (size_t k = 0; k < n; ++k) {
        if (std::abs(double(a[k]) - b[k]) <= bound * (std::abs(double(b[k])) + scale)) continue;
        decide(Judgement::Wrong, text("result ", i, ", element ", k, " of ", n, ": ", a[k],
                                      " instead of ", b[k], " in serial loops"));
      }
    }
  }

  const AutoscheduleOptions& told_;
  const bool is_whole_, compiles_all_;
  const Extents extents_;
  const GradientPipeline all_;
  const bool has_fast_;
  std::string source_;
  std::set<std::string> rules_;
  std::vector<std::vector<oracle::Array>> expected_;
};

void note_memory(const AutoScheduled& large, int64_t bytes,
                 std::map<std::string, uint64_t>& counts) {
  if (bytes < small_memory) return;
  const int64_t callers = large.pipeline().callers_bytes();
  const int64_t all = callers + bytes, budget = callers + 2 * large.pipeline().largest_bytes();
  const auto percent = static_cast<int>(100 * all / budget);
  ++counts["with much memory"];
  for (const int most : {100, 200, 400}) {
    if (percent > most) ++counts[text("above ", most, " percent of it")];
  }
  if (memory_limit_percent > 0 && percent > memory_limit_percent)
    decide(Judgement::Wrong, text(all >> 10, " kB are ", percent, " percent of the ", budget >> 10,
                                  " kB that it may have"));
}

std::map<std::string, uint64_t> checked(const ScheduledProgram& made, bool compiles_all) {
  static const char* const extents[] = {"constant", "one element", "with parameters", "compiled",
                                        "with wrong estimates"};
  std::map<std::string, uint64_t> counts{{extents[static_cast<int>(made.extents)], 1}};
  counts[made.is_whole ? "scheduled" : "by default"] = 1;
  if (!(made.told == AutoscheduleOptions())) counts["with options"] = 1;
  AutoScheduled interpreted(made, made.small ? *made.small : made.program, compiles_all);
  interpreted.compare_interpreted();
  std::set<std::string> rules = interpreted.rules();
  for (const std::string& content : made.program.contents) counts[content] = 1;
  if (made.small) {
    AutoScheduled large(made, made.program, compiles_all);
    note_memory(large, large.compare_with_serial_loops(), counts);
    rules.insert(large.rules().begin(), large.rules().end());
    counts["large"] = 1;
  }
  for (const std::string& rule : rules) counts["with " + rule] = 1;
  return counts;
}

}  // namespace

Judged judge_auto_scheduled(Choices& choices, bool compiles_all,
                            std::optional<fuzz::Workload> workload) {
  std::optional<ScheduledProgram> made;
  try {
    made.emplace(make_scheduled(choices, workload));
  } catch (const UserError& error) {
    return {Judgement::Illegal, error.what()};
  }
  try {
    return {Judgement::Right, "", checked(*made, compiles_all)};
  } catch (const Verdict& verdict) {
    return verdict.judged;
  } catch (const UserError& error) {
    return {fuzz::is_access_outside(error) ? Judgement::Broken : Judgement::Refused, error.what()};
  } catch (const Unsupported& error) {
    return {Judgement::Refused, error.what()};
  } catch (const std::exception& error) {
    return {Judgement::Broken, std::string(error.what()).substr(0, 600)};
  }
}

std::string auto_scheduled_text(Choices& choices, std::optional<fuzz::Workload> workload) {
  return to_text(make_scheduled(choices, workload));
}

void limit_memory(int percent) { memory_limit_percent = percent; }

}  // namespace retrograde::gradient
