// Checks gradients as machine code: within the rounding that the interpreter allows for, and with the same bits on any
// number of threads, both unscheduled and under a random schedule.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>

#include "diagnostics/error.h"
#include "frontend/data/realization.h"
#include "gradient/adversary/probe.h"
#include "graph/copy_graph.h"
#include "ir/visit.h"
#include "support/own_threads.h"
#include "testing/interpreter.h"
#include "testing/random_schedule.h"

namespace retrograde::gradient {

namespace {

class Compiled {
 public:
  Compiled(Subject& s, const Gradients& gradients)
      : s_(s), gradients_(gradients), has_fast_(uses_fast_functions(s.program.output())) {}

  // Returns false if no part of the program runs as machine code.
  bool compare_unscheduled() {
    for (const auto& [gradient, region] : gradients_) {
      oracle::InterpreterOptions options;
      options.rounding = oracle::Rounding::Contraction;
      options.max_points = max_points;
      expected_.emplace_back();
      if (!gradient.defined()) continue;
      expected_.back() = oracle::Interpreter(options).realize(gradient.function(), region)[0];
      try {
        compare(expected_.size() - 1, "");
      } catch (const UserError& error) {
        decide_by_access(error);
        // Machine code computes the bounds of all reads before it runs.
        if (!primal_runs()) return false;
        decide(Judgement::Refused,
               std::string("its gradient has no machine code: ") + error.what());
      }
    }
    return true;
  }

  // Returns the number of gradients that have machine code under a random schedule.
  int compare_scheduled(const Derivative& derivative) {
    std::vector<Func> funcs = derivative.funcs();
    if (s_.program.checks.primal)
      funcs.insert(funcs.begin(), s_.program.funcs.begin(), s_.program.funcs.end());
    int compared = 0;
    for (size_t i = 0; i < gradients_.size(); ++i) {
      if (!gradients_[i].first.defined()) continue;
      Choices choices(static_cast<uint64_t>(s_.program.checks.schedule) + i);
      try {
        compare(i, scheduled(gradients_[i], funcs, choices), ", scheduled");
        ++compared;
      } catch (const UserError& error) {  // the schedule is refused
        decide_by_access(error);
      } catch (const Unsupported&) {
      }
    }
    return compared;
  }

  // Compares the gradients with those of the same program with an extern stage.
  void compare_twin(const AdversaryProgram& twin) {
    AdjointOptions options = s_.program.options;
    for (size_t i = 0; i < twin.images.size(); ++i) options.wrt.push_back(twin.image(i));
    options.wrt.push_back(twin.scale);
    const Derivative d =
        propagate_adjoints(twin.output(), s_.first().seed, s_.first().bounds(), options);
    for (size_t i = 0; i < options.wrt.size(); ++i) {
      const Func gradient = d.of(options.wrt[i]);
      if (gradient.defined() && gradients_[i].first.defined())
        compare(i, gradient, ", by a C function");
    }
  }

 private:
  bool primal_runs() const {
    try {
      for (const SeededOutput& each : s_.outputs) {
        std::vector<Buffer<>> results;
        for (const Type& t : each.output.types()) results.push_back(room_for(t, each.region));
        Func(each.output).realize(Realization(results));
      }
      return true;
    } catch (const UserError& error) {
      decide_by_access(error);
      return false;
    }
  }

  // A copy of the gradient, with a random schedule for the Funcs that it consists of.
  static Func scheduled(const std::pair<Func, oracle::Region>& gradient,
                        const std::vector<Func>& funcs, Choices& choices) {
    const graph::GraphCopy copy = graph::copy_graph({gradient.first.function()});
    fuzz::RandomProgram program;
    program.outputs = {Func(copy.outputs[0])};
    program.runs = {{gradient.second}};
    for (const Func& f : funcs) {
      const auto found = copy.of.find(f.function().get());
      if (found != copy.of.end()) program.funcs.emplace_back(found->second);
    }
    ScheduleLog log = fuzz::random_schedule(program, choices);
    std::erase_if(log.entries, [](const ScheduleLog::Entry& entry) {
      return std::string_view(name_of(entry.directive)).starts_with("trace_");
    });
    fuzz::apply(log, program);
    return program.output();
  }

  void compare(size_t i, const std::string& how) { compare(i, gradients_[i].first, how); }
  void compare(size_t i, const Func& gradient, const std::string& how) {
    // Fast approximations stay finite where the exact functions have long overflowed.
    if (has_fast_ && !is_finite(expected_[i])) return;
    const oracle::Region& region = gradients_[i].second;
    const int threads = 1 << s_.weights.below(4);
    const Buffer<> first = realized(gradient, region, nullptr);
    OwnThreads context(threads, s_.weights.below(2) == 1);
    const Buffer<> second = realized(gradient, region, &context);
    const auto comparison =
        oracle::compare(expected_[i], *const_cast<Buffer<>&>(first).raw_buffer(), 4);
    if (!comparison.agrees()) {
      decide(Judgement::Wrong,
             text("machine code of ", gradient.name(), how, ": ", comparison.mismatches,
                  " differ, first ", comparison.first_mismatch));
    }
    if (std::memcmp(first.data(), second.data(), first.size_in_bytes()) != 0) {
      decide(Judgement::Wrong, text("machine code of ", gradient.name(), how, ": other bits on ",
                                    threads, " threads"));
    }
  }
  static Buffer<> realized(Func gradient, const oracle::Region& region, JITUserContext* context) {
    Buffer<> result = room_for(gradient.types()[0], region);
    std::memset(result.data(), 0x7f, result.size_in_bytes());
    if (context) {
      gradient.realize(context, result);
    } else {
      gradient.realize(result);
    }
    return result;
  }

  Subject& s_;
  const Gradients& gradients_;
  const bool has_fast_;
  std::vector<oracle::Array> expected_;
};

}  // namespace

int compare_machine_code(Subject& s, const Derivative& derivative, const Gradients& gradients,
                         const AdversaryProgram* twin) {
  Compiled code(s, gradients);
  if (!code.compare_unscheduled()) return -1;
  try {
    if (twin) code.compare_twin(*twin);
  } catch (const UserError& error) {  // operands of a C function must have bounds, and no versions
    decide_by_access(error);
  } catch (const Unsupported&) {
  }
  return s.program.checks.schedule > 0 ? code.compare_scheduled(derivative) : 0;
}

}  // namespace retrograde::gradient
