// Runs programs into guarded outputs: crops of larger buffers that are filled with a canary value. A store outside of
// an output is thus a wrong result, too.
#include "testing/check_program.h"

#include <cstring>
#include <optional>

#include "frontend/run/pipeline.h"
#include "retrograde_runtime.h"
#include "testing/guarded_memory.h"
#include "testing/interpreter.h"

namespace retrograde::fuzz {

namespace {

constexpr int margin = 3;  // elements around the output in every dimension
constexpr uint8_t canary = 0xa5;
constexpr size_t longest_detail = 400;  // internal errors carry whole programs

struct GuardedOutput {
  Runtime::Buffer<> outer, inner;  // views of the same memory
};

using Regions = std::vector<oracle::Region>;  // for each output

GuardedOutput make_output(Type type, const oracle::Region& output) {
  std::vector<int> mins, extents;
  for (size_t d = 0; d < output.mins.size(); ++d) {
    mins.push_back(output.mins[d] - margin);
    extents.push_back(output.extents[d] + 2 * margin);
  }
  GuardedOutput result;
  result.outer = Runtime::Buffer<>(to_halide_type(type), extents);
  result.outer.set_min(mins);
  std::memset(result.outer.data(), canary, result.outer.size_in_bytes());
  result.inner = result.outer;
  for (size_t d = 0; d < output.mins.size(); ++d) {
    result.inner.crop(static_cast<int>(d), output.mins[d], output.extents[d]);
  }
  return result;
}

bool is_intact(const GuardedOutput& output, const oracle::Region& region) {
  const halide_buffer_t& raw = *output.outer.raw_buffer();
  bool intact = true;
  oracle::region_of(raw).for_each([&](const std::vector<int>& point) {
    bool inside = true;
    int64_t offset = 0;
    for (size_t d = 0; d < point.size(); ++d) {
      inside &= point[d] >= region.mins[d] && point[d] < region.mins[d] + region.extents[d];
      offset += static_cast<int64_t>(point[d] - raw.dim[d].min) * raw.dim[d].stride;
    }
    if (inside) return;
    for (int b = 0; b < raw.type.bytes(); ++b) {
      intact &= raw.host[offset * raw.type.bytes() + b] == canary;
    }
  });
  return intact;
}

// Returns one output for each value of each output Func.
std::vector<GuardedOutput> run(Pipeline& compiled, const Regions& regions,
                               const RandomProgram& program, const Target& target) {
  std::vector<GuardedOutput> outputs;
  std::vector<Buffer<>> buffers;
  for (size_t o = 0; o < regions.size(); ++o) {
    for (const Type& type : program.outputs[o].types()) {
      outputs.push_back(make_output(type, regions[o]));
      buffers.push_back(Buffer<>(outputs.back().inner));
    }
  }
  compiled.realize(buffers, target);
  for (Buffer<>& buffer : buffers) {
    if (buffer.device_dirty()) buffer.copy_to_host();
  }
  return outputs;
}

std::string describe(const Func& f, int value, const oracle::Region& over) {
  std::string region;
  for (size_t d = 0; d < over.mins.size(); ++d)
    region += text(d ? ", " : "", "[", over.mins[d], " + ", over.extents[d], "]");
  return text(f.name(), "[", value, "] over ", region);
}

void compare_outputs(const Regions& regions, const RandomProgram& program,
                     const std::vector<oracle::Array>& expected,
                     const std::vector<GuardedOutput>& actual, Judged& judged) {
  size_t value = 0;
  for (size_t o = 0; o < regions.size(); ++o) {
    for (int v = 0; v < program.outputs[o].outputs(); ++v, ++value) {
      const auto comparison = oracle::compare(expected[value], *actual[value].inner.raw_buffer());
      judged.counts["values"] += comparison.compared;
      judged.counts["unstable"] += comparison.unstable;
      const std::string where = describe(program.outputs[o], v, regions[o]);
      if (!comparison.agrees()) {
        judged.judgement = Judgement::Wrong;
        judged.detail += text("differs in ", where, ": ", comparison.mismatches, " of ",
                              comparison.compared, ", first ", comparison.first_mismatch, "\n");
      }
      if (!is_intact(actual[value], regions[o])) {
        judged.judgement = Judgement::Wrong;
        judged.detail += "stores outside of " + where + "\n";
      }
    }
  }
}

// Whether the error is a finding: an access outside of its memory or, for kernels, also a race.
bool is_finding(const RuntimeError& error, const Target& target) {
  return is_access_outside(error) || (target.has_feature(Target::CUDA) && !lacks_memory(error));
}

int ignore_event(void*, const halide_trace_event_t*) { return 0; }

}  // namespace

bool lacks_memory(const RuntimeError& error) {
  return error.code() == retrograde_error_out_of_memory ||
         std::string_view(error.what()).find("OUT_OF_MEMORY") != std::string_view::npos;
}

bool is_access_outside(const UserError& error) {
  return std::string_view(error.what()).find("checked_accesses") != std::string_view::npos;
}

Judged check_program(const RandomProgram& program, const ScheduleLog& schedule,
                     const Target& target, Watch watch) {
  return check_with_schedule(
      program, [&] { apply(schedule, program); }, target, {[] {}}, watch);
}

Judged check_with_schedule(const RandomProgram& program, const std::function<void()>& schedule,
                           const Target& target,
                           const std::vector<std::function<void()>>& preparations, Watch watch,
                           oracle::Rounding rounding) {
  Judged judged;
  const Target watched =
      watch == Watch::Accesses ? target.with_feature(Target::CheckedAccesses) : target;
  try {
    schedule();
    Pipeline compiled(program.outputs);
    compiled.set_custom_trace(ignore_event);
    if (watch == Watch::Pages) compiled.set_custom_allocator(allocate_guarded, free_guarded);
    for (const Regions& regions : program.runs) {
      oracle::Interpreter interpreter({.rounding = rounding});
      std::optional<std::vector<oracle::Array>> expected;  // of what runs at all
      for (const std::function<void()>& prepare : preparations) {
        prepare();
        const std::vector<GuardedOutput> actual = run(compiled, regions, program, watched);
        if (!expected) expected = interpreter.realize(outputs_of(program), regions);
        compare_outputs(regions, program, *expected, actual, judged);
      }
    }
  } catch (const RuntimeError& error) {
    judged = {is_finding(error, target) ? Judgement::Broken : Judgement::Refused, error.what()};
  } catch (const UserError& error) {
    judged = {Judgement::Refused, error.what()};
  } catch (const Unsupported& error) {
    judged = {Judgement::Refused, error.what()};
  } catch (const std::exception& error) {
    judged = {Judgement::Broken, std::string(error.what()).substr(0, longest_detail)};
  }
  return judged;
}

}  // namespace retrograde::fuzz
