#include "worker.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <stdexcept>

#include "codegen/device/kernel_code.h"
#include "diagnostics/error.h"
#include "gpu/gpu_calls.h"
#include "gpu/gpu_image.h"
#include "outcome.h"
#include "retrograde/retrograde.h"
#include "support/every_kernel.h"
#include "support/gpu_programs.h"
#include "testing/interpreter.h"
#include "testing/random_gpu_schedule.h"

namespace device_check {
namespace {

using namespace retrograde;

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
        // Updates may leave elements unchanged.
        std::memset(outputs.back().data(), 0, outputs.back().size_in_bytes());
      }
    }
    compiled.realize(outputs, target);
    for (Buffer<>& output : outputs) bytes += bytes_of(output);
  }
  return bytes;
}

// Makes an image with PTX only. The simulated device loads it too, because no kernel has to run.
void load(const std::string& ptx) {
  const retrograde_gpu_image image = {RETROGRADE_GPU_IMAGE_MAGIC, ptx.size(), ptx.c_str(), 0,
                                      nullptr};
  static std::string problem;
  problem.clear();
  retrograde_context context = {};
  context.error_handler = [](retrograde_context*, int, const char* message) { problem = message; };
  void* state = nullptr;
  const int32_t code = retrograde_gpu_initialize_kernels(&context, &state, &image, sizeof image);
  retrograde_gpu_forget_kernels(&image);
  if (code != 0) throw std::runtime_error(problem);
}

std::string compiled(int chip, int lanes) {
  codegen::Options options;
  options.target = target_for(chip);
  options.kernels_for_executor = false;
  const codegen::KernelCode code =
      codegen::compile_kernels(every_kernel::of_everything(lanes, every_kernel::types()), options);
  load(code.ptx);
  std::string names;
  for (const auto& kernel : code.kernels) names += kernel.name + "\n";
  return names;
}

constexpr std::pair<int, Target::Feature> chips[] = {{90, Target::CUDACapability90},
                                                     {86, Target::CUDACapability86},
                                                     {80, Target::CUDACapability80},
                                                     {75, Target::CUDACapability75}};

}  // namespace

Target target_for(int capability) {
  Target target = get_host_target().with_feature(Target::CUDA);
  for (const auto& [number, feature] : chips) {
    if (capability >= number) return target.with_feature(feature);
  }
  return target;
}

void compile_kernels(int capability, bool is_simulated, double seconds, RecordWriter& records) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  bool is_first = true;
  for (const int lanes : {1, 4}) {
    for (const auto& [chip, feature] : chips) {
      if (chip > capability || (is_simulated && !is_first)) continue;
      if (!is_first && std::chrono::steady_clock::now() > end) return;
      is_first = false;
      records.add(recorded(text("sm_", chip, ", ", lanes, lanes == 1 ? " lane" : " lanes"),
                           [&, chip = chip] { return compiled(chip, lanes); }));
    }
  }
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
