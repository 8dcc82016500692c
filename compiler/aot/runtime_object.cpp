// Embeds the static runtime through the assembler, so that the compiler needs no files at run time.
#include "aot/runtime_object.h"

#include "diagnostics/error.h"

#define RETROGRADE_EMBED(symbol, path)                                                 \
  __asm__(".section .rodata\n.balign 16\n" #symbol ":\n.incbin \"" path "\"\n" #symbol \
          "_end:\n"                                                                    \
          ".byte 0\n.previous\n");                                                     \
  extern "C" __attribute__((visibility("hidden"))) const char symbol[], symbol##_end[];

RETROGRADE_EMBED(retrograde_embedded_runtime, RETROGRADE_RUNTIME_OBJECT)
#ifdef RETROGRADE_ARM_RUNTIME_OBJECT
RETROGRADE_EMBED(retrograde_embedded_arm_runtime, RETROGRADE_ARM_RUNTIME_OBJECT)
#endif

namespace retrograde::aot {

namespace {

// Empty if there is none for the target.
std::string embedded_object(const Target& target) {
  const Target host = get_host_target();
  if (target.os != host.os || target.bits != host.bits) return {};
  if (target.arch == host.arch)
    return {retrograde_embedded_runtime, retrograde_embedded_runtime_end};
#ifdef RETROGRADE_ARM_RUNTIME_OBJECT
  if (target.arch == Target::ARM)
    return {retrograde_embedded_arm_runtime, retrograde_embedded_arm_runtime_end};
#endif
  return {};
}

}  // namespace

bool has_runtime_object(const Target& target) { return !embedded_object(target).empty(); }

std::string runtime_object(const Target& target) {
  if (std::string object = embedded_object(target); !object.empty()) return object;
  unsupported("add the runtime for target " + quoted(target.to_string()),
              "the compiler was built with a runtime for the target",
              "there is none for this target",
              "Add \"no_runtime\" to the target, compile the folder runtime for it and link that");
}

}  // namespace retrograde::aot
