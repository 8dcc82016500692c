// compiler_interface.cpp -- the compiler of programs that link the front end alone: every use of it throws.
#include "frontend/run/compiler_interface.h"

#include "diagnostics/error.h"

namespace retrograde {

[[noreturn]] static void no_compiler() {
  unsupported("compile a pipeline", "this program must be linked with the compiler",
              "it is linked with the front end alone", "Link libretrograde");
}

std::shared_ptr<CompiledPipeline> Compiler::compile(const PipelineSpec&, const Target&) {
  no_compiler();
}
std::string Compiler::loop_nest(const PipelineSpec&, const Target&) { no_compiler(); }
ScheduleLog Compiler::schedule(const PipelineSpec&, const Target&) { no_compiler(); }
ScheduleReport Compiler::explain_schedule(const PipelineSpec&, const std::vector<halide_buffer_t*>&,
                                          const Target&, const ExplainOptions&,
                                          const JITHandlers&) {
  no_compiler();
}
KernelReport Compiler::explain_kernels(const PipelineSpec&, const Target&) { no_compiler(); }
ir::LoweredFunction Compiler::lower(const PipelineSpec&, const std::vector<ir::LoweredArgument>&,
                                    const Target&) {
  no_compiler();
}
std::vector<uint8_t> Compiler::object(const Module&) { no_compiler(); }
void Compiler::write(const Module&, const Files&) { no_compiler(); }
void Compiler::write_multitarget(const std::string&, const std::vector<Module>&,
                                 const std::vector<std::string>&, const Files&) {
  no_compiler();
}
void Compiler::write_runtime(const Files&, const Target&) { no_compiler(); }
void Compiler::write_text(const std::string&, const std::string&) { no_compiler(); }

// If compiler/driver is linked, its definition replaces this weak one.
__attribute__((weak)) Compiler& default_compiler() {
  static Compiler none;
  return none;
}

}  // namespace retrograde
