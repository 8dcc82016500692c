// The target of this machine, detected by cpuid, and targets that environment variables choose.
#include <cstdlib>

#include "diagnostics/error.h"
#include "ir/target.h"

namespace retrograde {

namespace {

#if defined(__x86_64__)
void add_host_features(Target& target) {
  __builtin_cpu_init();
  const auto add = [&](bool supported, Target::Feature feature) {
    if (supported) target.set_feature(feature);
  };
  add(__builtin_cpu_supports("sse4.1"), Target::SSE41);
  add(__builtin_cpu_supports("avx"), Target::AVX);
  add(__builtin_cpu_supports("f16c"), Target::F16C);
  add(__builtin_cpu_supports("fma"), Target::FMA);
  add(__builtin_cpu_supports("avx2"), Target::AVX2);
  const bool avx512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd");
  const bool skylake = avx512 && __builtin_cpu_supports("avx512vl") &&
                       __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
  const bool cannonlake =
      skylake && __builtin_cpu_supports("avx512ifma") && __builtin_cpu_supports("avx512vbmi");
  add(avx512, Target::AVX512);
  add(skylake, Target::AVX512_Skylake);
  add(cannonlake, Target::AVX512_Cannonlake);
  add(cannonlake && __builtin_cpu_supports("avx512bf16") && __builtin_cpu_supports("avx512vnni"),
      Target::AVX512_SapphireRapids);
}
constexpr Target::Arch host_arch = Target::X86;
#else
void add_host_features(Target&) {}
constexpr Target::Arch host_arch = Target::ARM;
#endif

Target from_environment(const char* first, const char* second) {
  for (const char* name : {first, second}) {
    if (const char* text = std::getenv(name); text && *text) return Target(text);
  }
  return get_host_target();
}

}  // namespace

Target get_host_target() {
  Target target(Target::Linux, host_arch, 64);
  add_host_features(target);
  return target;
}

Target get_target_from_environment() { return from_environment("RG_TARGET", "HL_TARGET"); }

Target get_jit_target_from_environment() {
  const Target target = from_environment("RG_JIT_TARGET", "HL_JIT_TARGET"),
               host = get_host_target();
  if (target.os != host.os || target.arch != host.arch || target.bits != host.bits) {
    user_error("compile in this process for " + quoted(target.to_string()),
               "the target of HL_JIT_TARGET is one that this machine can run",
               "this machine is " + quoted(host.to_string()),
               "Change features only, or compile ahead of time");
  }
  return target.with_feature(Target::JIT);
}

}  // namespace retrograde
