// Outputs are realized into crops of larger buffers that are filled with a canary: a store outside
// of an output is a wrong result, too.
#include "testing/check_program.h"

#include <cstring>

#include "diagnostics/error.h"
#include "frontend/run/pipeline.h"
#include "testing/build_pipeline.h"

namespace retrograde::fuzz {

namespace {

constexpr int margin = 3;  // elements around the output in every dimension
constexpr uint8_t canary = 0xa5;
constexpr size_t longest_detail = 400;  // internal errors carry whole programs

struct GuardedOutput {
  Runtime::Buffer<> whole, inner;  // of the same memory
};

GuardedOutput make_output(Type type, const OutputSpec& output) {
  std::vector<int> mins, extents;
  for (size_t d = 0; d < output.mins.size(); ++d) {
    mins.push_back(output.mins[d] - margin);
    extents.push_back(output.extents[d] + 2 * margin);
  }
  GuardedOutput result;
  result.whole = Runtime::Buffer<>(to_halide_type(type), extents);
  result.whole.set_min(mins);
  std::memset(result.whole.data(), canary, result.whole.size_in_bytes());
  result.inner = result.whole;
  for (size_t d = 0; d < output.mins.size(); ++d) {
    result.inner.crop(static_cast<int>(d), output.mins[d], output.extents[d]);
  }
  return result;
}

bool is_intact(const GuardedOutput& output, const OutputSpec& spec) {
  const halide_buffer_t& raw = *output.whole.raw_buffer();
  bool intact = true;
  oracle::region_of(raw).for_each([&](const std::vector<int>& point) {
    bool inside = true;
    int64_t offset = 0;
    for (size_t d = 0; d < point.size(); ++d) {
      inside &= point[d] >= spec.mins[d] && point[d] < spec.mins[d] + spec.extents[d];
      offset += static_cast<int64_t>(point[d] - raw.dim[d].min) * raw.dim[d].stride;
    }
    if (inside) return;
    for (int b = 0; b < raw.type.bytes(); ++b) {
      intact &= raw.host[offset * raw.type.bytes() + b] == canary;
    }
  });
  return intact;
}

// One for each value of each output.
std::vector<GuardedOutput> run(Pipeline& compiled, const std::vector<OutputSpec>& regions,
                               const BuiltPipeline& built, const Target& target) {
  std::vector<GuardedOutput> outputs;
  std::vector<Buffer<>> buffers;
  for (const OutputSpec& output : regions) {
    for (const Type& type : built.funcs[output.func].output_types()) {
      outputs.push_back(make_output(type, output));
      buffers.push_back(Buffer<>(outputs.back().inner));
    }
  }
  compiled.realize(buffers, target);
  return outputs;
}

std::string describe(const OutputSpec& output, int value) {
  std::string region;
  for (size_t d = 0; d < output.mins.size(); ++d) {
    region += text(d ? ", " : "", "[", output.mins[d], " + ", output.extents[d], "]");
  }
  return text("f", output.func, "[", value, "] over ", region);
}

void compare_outputs(const std::vector<OutputSpec>& regions, const BuiltPipeline& built,
                     const std::vector<GuardedOutput>& actual, Outcome& outcome) {
  const auto expected = interpret(regions, built, oracle::Rounding::Contraction);
  size_t value = 0;
  for (const OutputSpec& output : regions) {
    for (int v = 0; v < built.funcs[output.func].outputs(); ++v, ++value) {
      const auto comparison = oracle::compare(expected[value], *actual[value].inner.raw_buffer());
      outcome.compared += comparison.compared;
      outcome.unstable += comparison.unstable;
      const std::string where = describe(output, v);
      if (!comparison.agrees()) {
        outcome.verdict = Verdict::Differs;
        outcome.detail += text(where, ": ", comparison.mismatches, " of ", comparison.compared,
                               " differ, first ", comparison.first_mismatch, "\n");
      }
      if (!is_intact(actual[value], output)) {
        outcome.verdict = Verdict::Differs;
        outcome.detail += where + ": stores outside of the output\n";
      }
    }
  }
}

Pipeline outputs_of(const PipelineSpec& pipeline, const BuiltPipeline& built) {
  std::vector<Func> funcs;
  for (const OutputSpec& output : pipeline.outputs) funcs.push_back(built.funcs[output.func]);
  return Pipeline(funcs);
}

int ignore_event(void*, const halide_trace_event_t*) { return 0; }

}  // namespace

const char* verdict_name(Verdict verdict) {
  switch (verdict) {
    case Verdict::Agrees:
      return "agrees";
    case Verdict::Differs:
      return "differs";
    case Verdict::Refused:
      return "is refused";
    case Verdict::Broken:
      break;
  }
  return "breaks the compiler";
}

Outcome check_program(const PipelineSpec& pipeline, const ScheduleLog& schedule,
                      const Target& target) {
  Outcome outcome;
  try {
    const BuiltPipeline built = build(pipeline);
    apply(schedule, built);
    Pipeline compiled = outputs_of(pipeline, built);
    compiled.set_custom_trace(ignore_event);
    for (const std::vector<OutputSpec>& regions : all_runs(pipeline)) {
      compare_outputs(regions, built, run(compiled, regions, built, target), outcome);
    }
  } catch (const UserError& error) {
    outcome = {Verdict::Refused, error.what()};
  } catch (const Unsupported& error) {
    outcome = {Verdict::Refused, error.what()};
  } catch (const std::exception& error) {
    outcome = {Verdict::Broken, std::string(error.what()).substr(0, longest_detail)};
  }
  return outcome;
}

}  // namespace retrograde::fuzz
