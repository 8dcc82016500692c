#include "gradient/adversary/auto_scheduled.h"

#include <algorithm>
#include <cstring>

#include "diagnostics/error.h"
#include "frontend/data/realization.h"
#include "frontend/run/pipeline.h"
#include "gradient/adversary/probe.h"
#include "graph/copy_graph.h"
#include "support/own_threads.h"
#include "support/same_numbers.h"
#include "testing/interpreter.h"

namespace retrograde::gradient {

namespace {

enum class Extents : uint8_t { Constant, One, Parameters, Huge };
constexpr int huge = 1 << 20;  // times as large along the last dimension

struct Scheduled {
  AdversaryProgram program;
  Extents extents;
};

Scheduled make(Choices& choices) {
  const int which = choices.below(10);
  const Extents extents = which == 9   ? Extents::Huge
                          : which == 8 ? Extents::One
                          : which >= 5 ? Extents::Parameters
                                       : Extents::Constant;
  const bool of_pieces = choices.chance(25);
  Scheduled result{make_adversary(choices, of_pieces ? fuzz::Style::pieces()  // images of any size
                                                     : fuzz::Style::gradients()),
                   extents};
  std::vector<int>& sides = result.program.runs.front().front().extents;
  if (extents == Extents::One) std::fill(sides.begin(), sides.end(), 1);
  return result;
}

using Buffers = std::vector<Buffer<>>;

class AutoScheduled {
 public:
  AutoScheduled(const Scheduled& scheduled, bool compiles_all)
      : p_(scheduled.program),
        extents_(scheduled.extents),
        compiles_all_(compiles_all),
        s_{p_, Weights(1)} {}

  std::map<std::string, uint64_t> run() {
    differentiate();
    if (extents_ == Extents::Huge) {
      compile_only();
      return {{"compiled", 1}};
    }
    interpret_all();
    const Pipeline scheduled = copy();
    const std::string error = error_of([&] { check(scheduled); });
    if (!error.empty()) explain_refused(error);
    if (compiles_all_) expect_right(realize(Pipeline(outputs_), 2), " by default");
    return {{"scheduled", 1},
            {"with parameters", extents_ == Extents::Parameters},
            {"one element", extents_ == Extents::One}};
  }

 private:
  // ---- the pipeline ----

  Region bounds() const {
    Region result = s_.bounds();
    for (Range& side : result) {
      if (extents_ != Extents::Parameters) continue;
      Param<int> min, extent;
      min.set(static_cast<int>(*ir::as_const_int(side.min)));
      extent.set(static_cast<int>(*ir::as_const_int(side.extent)));
      side = {min, extent};
    }
    if (extents_ == Extents::Huge && !result.empty())
      result.back().extent = result.back().extent * huge;
    return result;
  }

  void add(const Func& f, const oracle::Region& region) {
    for (const Func& other : outputs_) {
      if (other.function() == f.function()) return;
    }
    outputs_.push_back(f);
    regions_.push_back(region);
  }

  void differentiate() {
    const Motion inputs(p_, s_.weights, "v");
    for (int k = 0; k < p_.output().outputs(); ++k)
      s_.w.push_back(s_.weights.over(p_.region(), "w" + std::to_string(k)));
    AdjointOptions options = p_.options;
    options.wrt = s_.options().wrt;
    const Derivative d = propagate_adjoints(p_.output(), reading(s_.w, "w"), bounds(), options);
    add(p_.output(), p_.region());
    const std::vector<AdjointInput> by = inputs.inputs();
    for (size_t i = 0; i < by.size(); ++i) {
      const Func gradient = d.of(by[i]);
      if (gradient.defined()) add(gradient, inputs.region(i));
    }
  }

  Pipeline copy() const {
    std::vector<graph::FuncPtr> functions;
    for (const Func& f : outputs_) functions.push_back(f.function());
    std::vector<Func> result;
    for (const graph::FuncPtr& f : graph::copy_graph(functions).outputs) result.emplace_back(f);
    return Pipeline(result);
  }

  void interpret_all() {
    for (size_t i = 0; i < outputs_.size(); ++i) {
      oracle::InterpreterOptions options;
      options.rounding = oracle::Rounding::Contraction;
      options.max_points = max_points;
      options.max_operations = max_operations;
      try {
        expected_.push_back(
            oracle::Interpreter(options).realize(outputs_[i].function(), regions_[i]));
      } catch (const InternalError&) {
        throw;
      } catch (const std::exception& error) {
        decide(Judgement::Illegal, std::string("it cannot be evaluated: ") + error.what());
      }
    }
  }

  // ---- machine code ----

  Buffers realize(Pipeline pipeline, int threads, bool backward = false) const {
    Buffers results;
    for (size_t i = 0; i < outputs_.size(); ++i) {
      for (const Type& type : outputs_[i].types()) {
        results.push_back(room_for(type, regions_[i]));
        std::memset(results.back().data(), 0x7f, results.back().size_in_bytes());
      }
    }
    OwnThreads context(threads, backward);
    pipeline.realize(&context, Realization(results));
    return results;
  }

  void expect_right(const Buffers& found, const std::string& how) const {
    size_t b = 0;
    for (size_t i = 0; i < outputs_.size(); ++i) {
      for (const oracle::Array& expected : expected_[i]) {
        const Buffer<> buffer = found[b++];
        if (has_fast_ && !is_finite(expected)) continue;
        const auto compared =
            oracle::compare(expected, *const_cast<Buffer<>&>(buffer).raw_buffer(), 4);
        if (compared.agrees()) continue;
        decide(Judgement::Wrong, text(outputs_[i].name(), how, ": ", compared.mismatches,
                                      " differ, first ", compared.first_mismatch));
      }
    }
  }

  void expect_same(const Buffers& a, const Buffers& b, const std::string& how) const {
    for (size_t i = 0; i < a.size(); ++i) {
      if (std::memcmp(a[i].data(), b[i].data(), a[i].size_in_bytes()) != 0)
        decide(Judgement::Wrong, text("result ", i, " has other bits ", how));
    }
  }

  static std::string error_of(const std::function<void()>& f) {
    try {
      f();
      return "";
    } catch (const UserError& error) {
      return error.what();
    } catch (const Unsupported& error) {
      return error.what();
    }
  }

  // What has no machine code must have none under the default schedule either. (Without any, it may
  // take forever to compile.)
  [[noreturn]] void explain_refused(const std::string& why) const {
    const std::string also = error_of([&] {
      Pipeline plain(outputs_);
      extents_ == Extents::Huge ? plain.compile_jit() : (void)realize(plain, 1);
    });
    decide(also.empty() ? Judgement::Wrong : Judgement::Refused, "no machine code: " + why);
  }

  void check(const Pipeline& scheduled) const {
    const Pipeline replayed = replay_of(scheduled);
    const Buffers found = realize(scheduled, 1);
    expect_right(found, ", scheduled");
    expect_same(found, realize(scheduled, 1), "when run again");
    expect_same(found, realize(scheduled, 2), "on 2 threads");
    expect_same(found, realize(scheduled, 3, true), "on 3 threads");
    if (compiles_all_)
      expect_same(found, realize(replayed, 2), "under the replayed schedule");
    else if (same_numbers(replayed.loop_nest()) != same_numbers(scheduled.loop_nest()))
      decide(Judgement::Wrong, "replayed, it has other loops: " + replayed.loop_nest());
  }

  // Schedules it, and a fresh copy by the text of its log.
  Pipeline replay_of(const Pipeline& scheduled) const {
    const std::string source =
        scheduled.auto_schedule(get_jit_target_from_environment()).schedule_source;
    const ScheduleLog log = scheduled.schedule_log();
    if (source.empty() && log.size() > 0)
      decide(Judgement::Wrong, "the schedule has no statements");
    if (!(ScheduleLog::parse(log.to_text()) == log))
      decide(Judgement::Wrong, "the log is another when parsed: " + log.to_text());
    Pipeline replayed = copy();
    replayed.apply_schedule(ScheduleLog::parse(log.to_text()));
    if (same_numbers(replayed.schedule_log().to_text()) != same_numbers(log.to_text()))
      decide(Judgement::Wrong, "the log is another when replayed: " + log.to_text());
    return replayed;
  }

  void compile_only() const {
    const Pipeline scheduled = copy();
    const std::string error = error_of([&] {
      replay_of(scheduled);
      Pipeline(scheduled).compile_jit();
    });
    if (!error.empty()) explain_refused(error);
  }

  const AdversaryProgram& p_;
  const Extents extents_;
  const bool compiles_all_;
  Subject s_;
  const bool has_fast_ = uses_fast_functions(p_.output());
  std::vector<Func> outputs_;
  std::vector<oracle::Region> regions_;
  std::vector<std::vector<oracle::Array>> expected_;
};

}  // namespace

Judged judge_auto_scheduled(Choices& choices, bool compiles_all) {
  std::optional<Scheduled> made;
  try {
    made.emplace(make(choices));
  } catch (const UserError& error) {
    return {Judgement::Illegal, error.what()};
  }
  try {
    return {Judgement::Right, "", AutoScheduled(*made, compiles_all).run()};
  } catch (const Verdict& verdict) {
    return verdict.judged;
  } catch (const UserError& error) {
    return {Judgement::Refused, error.what()};
  } catch (const Unsupported& error) {
    return {Judgement::Refused, error.what()};
  } catch (const std::exception& error) {
    return {Judgement::Broken, std::string(error.what()).substr(0, 600)};
  }
}

std::string auto_scheduled_text(Choices& choices) {
  const Scheduled made = make(choices);
  const char* const extents[] = {"constant", "one", "parameters", "huge"};
  return to_text(made.program) + "extents: " + extents[static_cast<int>(made.extents)] + "\n";
}

}  // namespace retrograde::gradient
