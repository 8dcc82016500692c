#include "tuning/kernels_taken.h"

#include "codegen/device/kernel_code.h"
#include "diagnostics/error.h"
#include "ir/lists.h"
#include "jit/ptxas.h"
#include "lower/lower.h"

namespace retrograde {

namespace {

using Kernel = KernelReport::Kernel;

Kernel described(const codegen::KernelCode::Kernel& code) {
  Kernel kernel;
  kernel.name = code.name;
  kernel.threads = code.threads;
  kernel.shared_bytes = code.shared_bytes;
  kernel.local_bytes = code.local_bytes;
  return kernel;
}

void add_figures(const codegen::KernelCode& code, KernelReport& report) {
  const std::string program = jit::find_ptxas();
  if (program.empty()) {
    report.assembler = "no figures of registers: ptxas is not installed";
    return;
  }
  const jit::Assembly assembly = jit::assemble(program, code.ptx, code.capability);
  report.assembler = text("ptxas ", jit::ptxas_version(program), " for sm_",
                          jit::assembled_capability(code.capability));
  if (!assembly.problem.empty()) report.assembler += " failed: " + assembly.problem;
  for (size_t i = 0; i < code.kernels.size(); ++i) {
    const auto* figures = ir::find_or_null(assembly.kernels, code.kernels[i].symbol);
    if (!figures) continue;
    report.kernels[i].registers = figures->registers;
    report.kernels[i].stack_bytes = figures->stack_bytes;
    report.kernels[i].spill_bytes = figures->spill_store_bytes + figures->spill_load_bytes;
  }
}

std::string spill_note(const Kernel& kernel) {
  return text("performance note: each thread of the kernel ", quoted(kernel.name),
              " stores and loads ", *kernel.spill_bytes, " bytes that found none of its ",
              *kernel.registers,
              " registers. Give it less to do: smaller tiles of a thread, fewer unrolled "
              "iterations, or blocks of fewer threads, which leave each more registers.");
}

void add_notes(KernelReport& report) {
  for (const Kernel& kernel : report.kernels) {
    const int64_t frame = kernel.stack_bytes.value_or(kernel.local_bytes);
    if (kernel.spill_bytes.value_or(0) > 0)
      report.notes.push_back(spill_note(kernel));
    else if (frame > 0)
      report.notes.push_back(codegen::local_memory_note(kernel.name, frame));
  }
}

}  // namespace

tuning::LoweredForReport tuning::lower_for_report(const PipelineSpec& pipeline,
                                                  const std::vector<graph::FuncPtr>& scheduled,
                                                  const Target& target) {
  LoweredForReport result;
  lower::LowerOptions options;
  options.target = target;
  Stmt last;
  options.observe = [&](const std::string& pass, double, const Stmt& after) {
    if (pass == "make_kernels") result.kernel_loops = lower::loops_of_kernels(last, after);
    last = after;
  };
  result.function =
      lower::lower(pipeline.name, scheduled, lower::infer_arguments(pipeline.outputs), options);
  return result;
}

KernelReport tuning::kernels_taken(const LoweredForReport& lowered, const Target& target) {
  codegen::Options options;
  options.target = target;
  options.kernels_for_executor = false;
  const codegen::KernelCode code = codegen::compile_kernels(lowered.function, options);
  KernelReport report;
  if (code.kernels.empty()) return report;
  for (const auto& kernel : code.kernels) {
    report.kernels.push_back(described(kernel));
    report.kernels.back().loops = ir::value_or(lowered.kernel_loops, kernel.name, {});
  }
  add_figures(code, report);
  add_notes(report);
  return report;
}

}  // namespace retrograde
