#include "worker.h"

#include <algorithm>
#include <chrono>
#include <cstring>

#include "diagnostics/error.h"
#include "retrograde/retrograde.h"
#include "support/gpu_programs.h"
#include "testing/interpreter.h"
#include "testing/random_gpu_schedule.h"

namespace device_check {
namespace {

using namespace retrograde;

// Which NaN it is, nobody says.
template <typename T, int exponent_bits, int mantissa_bits>
void make_one_nan(std::string& bytes) {
  constexpr T mantissa = (T{1} << mantissa_bits) - 1, exponent = ((T{1} << exponent_bits) - 1)
                                                                 << mantissa_bits;
  for (size_t at = 0; at + sizeof(T) <= bytes.size(); at += sizeof(T)) {
    T value;
    std::memcpy(&value, &bytes[at], sizeof value);
    if ((value & exponent) != exponent || (value & mantissa) == 0) continue;
    value = exponent | (T{1} << (mantissa_bits - 1));
    std::memcpy(&bytes[at], &value, sizeof value);
  }
}

std::string bytes_of(Buffer<>& buffer) {
  if (buffer.device_dirty()) buffer.copy_to_host();
  std::string bytes(reinterpret_cast<const char*>(buffer.data()), buffer.size_in_bytes());
  const Type type = buffer.type();
  if (type == Float(64)) make_one_nan<uint64_t, 11, 52>(bytes);
  if (type == Float(32)) make_one_nan<uint32_t, 8, 23>(bytes);
  if (type == Float(16)) make_one_nan<uint16_t, 5, 10>(bytes);
  if (type == BFloat(16)) make_one_nan<uint16_t, 8, 7>(bytes);
  return bytes;
}

// What is refused is refused for every device; what fails may fail on one.
template <typename Compute>
Record recorded(const std::string& name, Compute compute) {
  Record record;
  record.name = name;
  try {
    record.bytes = compute();
  } catch (const UserError& error) {
    record.state =
        dynamic_cast<const RuntimeError*>(&error) ? Record::State::Failed : Record::State::Refused;
    record.bytes = error.what();
  } catch (const Unsupported& error) {
    record.state = Record::State::Refused;
    record.bytes = error.what();
  } catch (const std::exception& error) {
    record.state = Record::State::Failed;
    record.bytes = error.what();
  }
  return record;
}

std::string run_program(fuzz::RandomProgram& program, const Target& target) {
  Pipeline compiled(program.outputs);
  compiled.set_custom_trace([](void*, const halide_trace_event_t*) { return 0; });
  std::string bytes;
  for (const std::vector<oracle::Region>& regions : program.runs) {
    std::vector<Buffer<>> outputs;
    for (size_t o = 0; o < regions.size(); ++o) {
      for (const Type& type : program.outputs[o].types()) {
        outputs.emplace_back(type, regions[o].extents);
        outputs.back().set_min(regions[o].mins);
        // Updates may leave elements as they are.
        std::memset(outputs.back().data(), 0, outputs.back().size_in_bytes());
      }
    }
    compiled.realize(outputs, target);
    for (Buffer<>& output : outputs) bytes += bytes_of(output);
  }
  return bytes;
}

}  // namespace

Target target_for(int capability) {
  Target target = get_host_target().with_feature(Target::CUDA);
  constexpr std::pair<int, Target::Feature> features[] = {{90, Target::CUDACapability90},
                                                          {86, Target::CUDACapability86},
                                                          {80, Target::CUDACapability80},
                                                          {75, Target::CUDACapability75}};
  for (const auto& [number, feature] : features) {
    if (capability >= number) return target.with_feature(feature);
  }
  return target;
}

void run_programs(const Target& target, const Names& only, RecordWriter& records) {
  for (const gpu_programs::Program& program : gpu_programs::all()) {
    if (!only.empty() && std::ranges::find(only, program.name) == only.end()) continue;
    records.add(recorded(program.name, [&] {
      Buffer<> result = Buffer<float>(program.build(true).realize(program.sizes, target));
      return bytes_of(result);
    }));
  }
}

void run_random(const Target& target, uint64_t first, int count, double seconds,
                RecordWriter& records) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  for (int i = 0; i < count && std::chrono::steady_clock::now() < end; ++i) {
    const uint64_t seed = first + static_cast<uint64_t>(i);
    records.add(recorded("seed " + std::to_string(seed), [&] {
      fuzz::Choices choices(seed);
      fuzz::RandomProgram program = fuzz::make_program(choices, fuzz::Style::pipelines());
      fuzz::schedule_on_gpu(program, choices);
      return run_program(program, target);
    }));
  }
}

}  // namespace device_check
