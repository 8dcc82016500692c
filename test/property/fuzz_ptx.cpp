// fuzz_ptx -- searches for random programs under random GPU schedules whose kernels LLVM's NVPTX back end cannot
// translate. Such a kernel aborts the process, which counts as a finding here. Each program is compiled for one of four
// chips. A share of them (--compile, 5 % by default) is also assembled by ptxas, if it is installed. support/fuzz.h
// describes the arguments.
#include <cstdio>

#include "codegen/device/kernel_code.h"
#include "lower/lower.h"
#include "support/fuzz.h"
#include "support/ptxas.h"
#include "testing/programs/program.h"
#include "testing/random_gpu_schedule.h"

namespace {

using namespace retrograde;
using namespace retrograde::fuzz;

struct Chip {
  const char* name;
  Target::Feature capability;
};
const std::vector<Chip> chips = {{"sm_80", Target::CUDACapability80},
                                 {"sm_75", Target::CUDACapability75},
                                 {"sm_86", Target::CUDACapability86},
                                 {"sm_90", Target::CUDACapability90}};

Judged judge(Choices& choices, bool assembles) {
  Judged judged;
  try {
    const RandomProgram program = make_program(choices, Style::pipelines());
    const Chip chip = choices.pick(chips);
    schedule_on_gpu(program, choices);
    const Target target =
        get_host_target().with_feature(Target::CUDA).with_feature(chip.capability);
    const std::vector<graph::FuncPtr> outputs = outputs_of(program);
    lower::LowerOptions lowering;
    lowering.target = target;
    codegen::Options options;
    options.target = target;
    const codegen::KernelCode code = codegen::compile_kernels(
        lower::lower("f", outputs, lower::infer_arguments(outputs), lowering), options);
    const uint64_t kernels = code.kernels.size();
    judged.counts["kernels"] = kernels;
    if (!assembles || kernels == 0) return judged;
    if (!has_ptxas()) {
      judged.counts["kernels not assembled, for there is no ptxas"] = kernels;
      return judged;
    }
    judged.counts["kernels assembled"] = kernels;
    const std::string problem = ptxas_problem(code.ptx, chip.name);
    if (!problem.empty()) judged = {Judgement::Broken, "ptxas: " + problem};
  } catch (const UserError& error) {
    judged = {Judgement::Refused, error.what()};
  } catch (const Unsupported& error) {
    judged = {Judgement::Refused, error.what()};
  }
  return judged;
}

}  // namespace

int main(int argc, char** argv) {
  const auto text = [&](Choices& choices) {
    const RandomProgram program = make_program(choices, Style::pipelines());
    choices.pick(chips);
    try {
      schedule_on_gpu(program, choices);
    } catch (const Error&) {
    }
    return to_text(program);
  };
  constexpr unsigned share_assembled = 5;
  return fuzz_main({.judge = judge, .text = text, .most_slow = 0.01, .compile = share_assembled},
                   argc, argv);
}
