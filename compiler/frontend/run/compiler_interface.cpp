// compiler_interface.cpp -- weak definitions for programs that link the front end without the compiler; all throw.
#include "frontend/run/compiler_interface.h"

#include "diagnostics/error.h"

namespace retrograde {

[[noreturn]] static void no_compiler() {
  unsupported("compile a pipeline", "this program must be linked with the compiler",
              "it is linked with the front end alone", "Link libretrograde");
}

// If compiler/jit, compiler/aot and compiler/tuning are linked, their definitions replace these weak ones.
__attribute__((weak)) Compiler& default_compiler() { no_compiler(); }
__attribute__((weak)) ModuleCompiler& module_compiler() { no_compiler(); }
__attribute__((weak)) ScheduleReport explain_schedule(const PipelineSpec&,
                                                      const std::vector<halide_buffer_t*>&,
                                                      const Target&, const ExplainOptions&,
                                                      const JITHandlers&) {
  no_compiler();
}
__attribute__((weak)) double predicted_seconds(const std::vector<graph::FuncPtr>&, const Target&,
                                               int) {
  no_compiler();
}

}  // namespace retrograde
