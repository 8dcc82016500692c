// Targets as text, and the target of this machine.
#include "ir/target.h"

#include <cstdlib>

#include "diagnostics/error.h"

namespace retrograde {

namespace {

template <class T>
struct Named {
  const char* name;
  T value;
};

constexpr Named<Target::OS> os_names[] = {{"os_unknown", Target::OSUnknown},
                                          {"linux", Target::Linux},
                                          {"windows", Target::Windows},
                                          {"osx", Target::OSX},
                                          {"noos", Target::NoOS}};
constexpr Named<Target::Arch> arch_names[] = {
    {"arch_unknown", Target::ArchUnknown}, {"x86", Target::X86}, {"arm", Target::ARM}};
constexpr Named<Target::Feature> feature_names[] = {
    {"jit", Target::JIT},
    {"debug", Target::Debug},
    {"no_asserts", Target::NoAsserts},
    {"no_bounds_query", Target::NoBoundsQuery},
    {"sse41", Target::SSE41},
    {"avx", Target::AVX},
    {"f16c", Target::F16C},
    {"fma", Target::FMA},
    {"avx2", Target::AVX2},
    {"avx512", Target::AVX512},
    {"avx512_skylake", Target::AVX512_Skylake},
    {"avx512_cannonlake", Target::AVX512_Cannonlake},
    {"avx512_sapphirerapids", Target::AVX512_SapphireRapids},
    {"user_context", Target::UserContext},
    {"no_runtime", Target::NoRuntime},
    {"profile", Target::Profile},
    {"trace_loads", Target::TraceLoads},
    {"trace_stores", Target::TraceStores},
    {"trace_realizations", Target::TraceRealizations},
    {"strict_float", Target::StrictFloat},
    {"large_buffers", Target::LargeBuffers},
};
static_assert(std::size(feature_names) == Target::FeatureEnd, "every feature has a name");

template <class T, size_t N>
const char* name_of(const Named<T> (&table)[N], T value) {
  for (const auto& entry : table) {
    if (entry.value == value) return entry.name;
  }
  return "unknown";
}

template <class T, size_t N>
bool find_name(const Named<T> (&table)[N], const std::string& name, T& value) {
  for (const auto& entry : table) {
    if (name != entry.name) continue;
    value = entry.value;
    return true;
  }
  return false;
}

std::vector<std::string> split_at_dashes(const std::string& text) {
  std::vector<std::string> words(1);
  for (char c : text) {
    if (c == '-') {
      words.emplace_back();
    } else {
      words.back() += c;
    }
  }
  return words;
}

// Reads one word into the target. `bits_unknown` is the third of the words that name a platform.
bool read_word(const std::string& word, Target& target) {
  Target::Feature feature;
  if (find_name(feature_names, word, feature)) {
    target.set_feature(feature);
    return true;
  }
  if (word == "32" || word == "64" || word == "bits_unknown" || word == "0") {
    target.bits = word == "32" ? 32 : word == "64" ? 64 : 0;
    return true;
  }
  return find_name(arch_names, word, target.arch) || find_name(os_names, word, target.os);
}

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

Target::Target(OS os, Arch arch, int bits, const std::vector<Feature>& features)
    : os(os), arch(arch), bits(bits) {
  for (Feature feature : features) set_feature(feature);
}

Target::Target(const std::string& text) {
  bool first = true;
  for (const std::string& word : split_at_dashes(text)) {
    if (first && word == "host") {
      *this = get_host_target();
    } else if (!read_word(word, *this)) {
      user_error("read the target " + quoted(text),
                 "a target is arch-bits-os or host, then features, joined by dashes",
                 quoted(word) + " is none of them",
                 "Write for example \"host\" or \"x86-64-linux-avx2-fma\"");
    }
    first = false;
  }
}

Target Target::with_feature(Feature feature) const {
  Target result = *this;
  result.set_feature(feature);
  return result;
}

Target Target::without_feature(Feature feature) const {
  Target result = *this;
  result.set_feature(feature, false);
  return result;
}

bool Target::features_any_of(const std::vector<Feature>& features) const {
  for (Feature feature : features) {
    if (has_feature(feature)) return true;
  }
  return false;
}

bool Target::features_all_of(const std::vector<Feature>& features) const {
  for (Feature feature : features) {
    if (!has_feature(feature)) return false;
  }
  return true;
}

int Target::natural_vector_size(Type type) const {
  const bool wide =
      features_any_of({AVX512, AVX512_Skylake, AVX512_Cannonlake, AVX512_SapphireRapids});
  const int vector_bytes = wide ? 64 : has_feature(AVX2) ? 32 : 16;
  return vector_bytes / std::max(type.bytes(), 1);
}

std::string Target::to_string() const {
  std::string result = name_of(arch_names, arch);
  result += bits ? "-" + std::to_string(bits) : "-bits_unknown";
  result += std::string("-") + name_of(os_names, os);
  for (const auto& entry : feature_names) {
    if (has_feature(entry.value)) result += std::string("-") + entry.name;
  }
  return result;
}

Target get_host_target() {
  Target target(Target::Linux, host_arch, 64);
  add_host_features(target);
  return target;
}

Target get_target_from_environment() { return from_environment("RG_TARGET", "HL_TARGET"); }

Target get_jit_target_from_environment() {
  return from_environment("RG_JIT_TARGET", "HL_JIT_TARGET").with_feature(Target::JIT);
}

}  // namespace retrograde
