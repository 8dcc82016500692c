// Tests which of a target's features this processor has, for functions compiled for several targets.
#include <atomic>

#include "halide/weak.h"

#if defined(__aarch64__)
#include <asm/hwcap.h>
#include <sys/auxv.h>
#endif

namespace {

constexpr int words = (halide_target_feature_end + 63) / 64;

// `known`: features that a processor may or may not have; all others are ignored.
struct Features {
  uint64_t known[words] = {}, available[words] = {};
  void add(halide_target_feature_t feature, bool has) {
    known[feature / 64] |= uint64_t{1} << feature % 64;
    if (has) available[feature / 64] |= uint64_t{1} << feature % 64;
  }
};

Features find_features() {
  Features f;
#if defined(__x86_64__)
  __builtin_cpu_init();
  f.add(halide_target_feature_sse41, __builtin_cpu_supports("sse4.1"));
  f.add(halide_target_feature_avx, __builtin_cpu_supports("avx"));
  f.add(halide_target_feature_avx2, __builtin_cpu_supports("avx2"));
  f.add(halide_target_feature_fma, __builtin_cpu_supports("fma"));
  f.add(halide_target_feature_fma4, __builtin_cpu_supports("fma4"));
  f.add(halide_target_feature_f16c, __builtin_cpu_supports("f16c"));
  const bool base = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512cd");
  const bool skylake = base && __builtin_cpu_supports("avx512vl") &&
                       __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq");
  const bool cannonlake =
      skylake && __builtin_cpu_supports("avx512ifma") && __builtin_cpu_supports("avx512vbmi");
  f.add(halide_target_feature_avx512, base);
  f.add(halide_target_feature_avx512_knl, base && __builtin_cpu_supports("avx512er"));
  f.add(halide_target_feature_avx512_skylake, skylake);
  f.add(halide_target_feature_avx512_cannonlake, cannonlake);
  f.add(halide_target_feature_avx512_sapphirerapids,
        cannonlake && __builtin_cpu_supports("avx512bf16") && __builtin_cpu_supports("avx512vnni"));
#elif defined(__aarch64__)
  const unsigned long has = getauxval(AT_HWCAP), has2 = getauxval(AT_HWCAP2);
  f.add(halide_target_feature_arm_dot_prod, has & HWCAP_ASIMDDP);
  f.add(halide_target_feature_arm_fp16, has & HWCAP_ASIMDHP);
  f.add(halide_target_feature_armv81a, has & HWCAP_ATOMICS);
  f.add(halide_target_feature_sve, has & HWCAP_SVE);
  f.add(halide_target_feature_sve2, has2 & HWCAP2_SVE2);
#endif
  return f;
}

std::atomic<halide_can_use_target_features_t> handler{halide_default_can_use_target_features};

}  // namespace

RETROGRADE_WEAK int halide_default_can_use_target_features(int count, const uint64_t* features) {
  static const Features mine = find_features();
  if (count != words) {
    halide_error(nullptr,
                 "cannot choose among the variants of a function: it was compiled for another "
                 "version of the runtime. Compile it again");
    return 0;
  }
  for (int i = 0; i < words; i++) {
    if (features[i] & mine.known[i] & ~mine.available[i]) return 0;
  }
  return 1;
}
RETROGRADE_WEAK int halide_can_use_target_features(int count, const uint64_t* features) {
  return handler.load()(count, features);
}
RETROGRADE_WEAK halide_can_use_target_features_t
halide_set_custom_can_use_target_features(halide_can_use_target_features_t wanted) {
  return handler.exchange(wanted ? wanted : halide_default_can_use_target_features);
}
