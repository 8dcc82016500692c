// Targets as text, and the target of this machine.
#include "ir/target.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "diagnostics/error.h"
#include "ir/vector_bytes.h"

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
                                          {"android", Target::Android},
                                          {"ios", Target::IOS},
                                          {"qurt", Target::QuRT},
                                          {"noos", Target::NoOS},
                                          {"fuchsia", Target::Fuchsia},
                                          {"wasmrt", Target::WebAssemblyRuntime}};
constexpr Named<Target::Arch> arch_names[] = {{"arch_unknown", Target::ArchUnknown},
                                              {"x86", Target::X86},
                                              {"arm", Target::ARM},
                                              {"mips", Target::MIPS},
                                              {"hexagon", Target::Hexagon},
                                              {"powerpc", Target::POWERPC},
                                              {"wasm", Target::WebAssembly},
                                              {"riscv", Target::RISCV}};
// Processor names after "tune_": LLVM's names with underscores for dashes.
constexpr Named<Target::Processor> processor_names[] = {{"generic", Target::ProcessorGeneric},
                                                        {"k8", Target::K8},
                                                        {"k8_sse3", Target::K8_SSE3},
                                                        {"amdfam10", Target::AMDFam10},
                                                        {"btver1", Target::BtVer1},
                                                        {"bdver1", Target::BdVer1},
                                                        {"bdver2", Target::BdVer2},
                                                        {"bdver3", Target::BdVer3},
                                                        {"bdver4", Target::BdVer4},
                                                        {"btver2", Target::BtVer2},
                                                        {"znver1", Target::ZnVer1},
                                                        {"znver2", Target::ZnVer2},
                                                        {"znver3", Target::ZnVer3},
                                                        {"znver4", Target::ZnVer4}};
constexpr Named<Target::Feature> feature_names[] = {
#define RETROGRADE_FEATURE(enumerator, name, generated) {name, Target::enumerator},
#include "ir/target_features.def"
#undef RETROGRADE_FEATURE
};
constexpr bool is_generated[] = {
#define RETROGRADE_FEATURE(enumerator, name, generated) generated,
#include "ir/target_features.def"
#undef RETROGRADE_FEATURE
};

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

// Which of the three required parts of a target have been read.
struct Parts {
  bool arch = false, bits = false, os = false;
  bool all() const { return arch && bits && os; }
};

bool read_bits(const std::string& word, int& bits) {
  if (word != "32" && word != "64" && word != "bits_unknown" && word != "0") return false;
  bits = word == "32" ? 32 : word == "64" ? 64 : 0;
  return true;
}

bool has_prefix(const std::string& word, const std::string& prefix) {
  return word.rfind(prefix, 0) == 0;
}

// "tune_znver3", "vector_bits_256"
bool read_option(const std::string& word, Target& target) {
  const std::string tune = "tune_", bits = "vector_bits_";
  if (has_prefix(word, tune))
    return find_name(processor_names, word.substr(tune.size()), target.processor_tune);
  if (!has_prefix(word, bits) || word.size() == bits.size() || word.size() > bits.size() + 5)
    return false;
  const std::string digits = word.substr(bits.size());
  if (digits.find_first_not_of("0123456789") != std::string::npos) return false;
  target.vector_bits = std::stoi(digits);
  return target.vector_bits > 0;
}

bool read_feature(const std::string& word, Target& target) {
  if (word == "trace_all") {
    target.set_features({Target::TraceLoads, Target::TraceStores, Target::TraceRealizations});
    return true;
  }
  const Target::Feature feature = Target::feature_from_name(word);
  target.set_feature(feature);
  return feature != Target::FeatureEnd;
}

bool read_word(const std::string& word, Target& target, Parts& parts) {
  if (read_bits(word, target.bits)) return !std::exchange(parts.bits, true);
  if (find_name(arch_names, word, target.arch)) return !std::exchange(parts.arch, true);
  if (find_name(os_names, word, target.os)) return !std::exchange(parts.os, true);
  return read_option(word, target) || read_feature(word, target);
}

// Returns the first unexpected word. "" may also mean that a part is missing; see `parts`.
std::string read_words(const std::string& text, Target& target, Parts& parts) {
  bool first = true;
  for (const std::string& word : split_at_dashes(text)) {
    if (first && word == "host") {
      target = get_host_target();
      parts = {};
    } else if (!read_word(word, target, parts)) {
      return word.empty() ? "-" : word;
    }
    first = false;
  }
  if (text.rfind("host", 0) == 0) parts = {true, true, true};
  return "";
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

Target::Target(OS os, Arch arch, int bits, Processor processor,
               const std::vector<Feature>& features, int vector_bits)
    : Target(os, arch, bits, features) {
  processor_tune = processor;
  this->vector_bits = vector_bits;
}

Target::Target(const std::string& text) {
  if (text.empty()) {
    *this = get_host_target();
    return;
  }
  Parts parts;
  const std::string wrong = read_words(text, *this, parts);
  if (wrong.empty() && parts.all()) return;
  std::string evidence = quoted(wrong) + " is none of them, or comes twice";
  if (wrong.empty()) {
    evidence = std::string(!parts.arch   ? "an architecture"
                           : !parts.bits ? "32 or 64"
                                         : "a system") +
               " is missing";
  }
  user_error("read the target " + quoted(text),
             "a target is arch-bits-os or host, then features, joined by dashes", evidence,
             "Write for example \"host\" or \"x86-64-linux-avx2-fma\"");
}

Target::Target(const char* text) {
  if (!text) {
    user_error("read a target", "a target is a text such as \"host\"", "the pointer to it is null",
               "Look whether the environment has the variable that it is taken from");
  }
  *this = Target(std::string(text));
}

Target::Feature Target::checked(Feature feature) {
  if (feature >= 0 && feature < FeatureEnd) return feature;
  user_error(text("use feature ", static_cast<int>(feature), " of a target"),
             "a feature is one of Target::Feature",
             text("they end with ", static_cast<int>(FeatureEnd)), "Name one, as in Target::AVX2");
}

bool Target::validate_target_string(const std::string& text) {
  Target target;
  Parts parts;
  return read_words(text, target, parts).empty() && parts.all() && !target.has_unknowns();
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
  return std::ranges::any_of(features, [&](Feature feature) { return has_feature(feature); });
}

bool Target::features_all_of(const std::vector<Feature>& features) const {
  return std::ranges::all_of(features, [&](Feature feature) { return has_feature(feature); });
}

namespace {

// A feature and those that it implies. Each row comes before the rows of the features that it
// implies.
struct Implication {
  Target::Feature feature;
  std::vector<Target::Feature> implied;
};
const std::vector<Implication>& implications() {
  static const std::vector<Implication> all = {
      {Target::AVX512_Zen4, {Target::AVX512_Cannonlake}},
      {Target::AVX512_SapphireRapids, {Target::AVX512_Cannonlake}},
      {Target::AVX512_Cannonlake, {Target::AVX512_Skylake}},
      {Target::AVX512_Skylake, {Target::AVX512}},
      {Target::AVX512_KNL, {Target::AVX512}},
      {Target::AVX512, {Target::AVX2}},
      {Target::AVX2, {Target::AVX, Target::FMA, Target::F16C}},
      {Target::FMA, {Target::AVX}},
      {Target::F16C, {Target::AVX}},
      {Target::AVX, {Target::SSE41}},
      {Target::CUDACapability86, {Target::CUDACapability80}},
      {Target::CUDACapability80, {Target::CUDACapability75}},
      {Target::CUDACapability75, {Target::CUDACapability70}},
      {Target::CUDACapability70, {Target::CUDACapability61}},
      {Target::CUDACapability61, {Target::CUDACapability50}},
      {Target::CUDACapability50, {Target::CUDACapability35}},
      {Target::CUDACapability35, {Target::CUDACapability32}},
      {Target::CUDACapability32, {Target::CUDACapability30}},
      {Target::CUDACapability30, {Target::CUDA}},
      {Target::HVX_v68, {Target::HVX_v66}},
      {Target::HVX_v66, {Target::HVX_v65}},
      {Target::HVX_v65, {Target::HVX_v62}},
      {Target::HVX_v62, {Target::HVX_128}},
      {Target::SVE2, {Target::SVE}},
      {Target::ARMv89a, {Target::ARMv88a}},
      {Target::ARMv88a, {Target::ARMv87a}},
      {Target::ARMv87a, {Target::ARMv86a}},
      {Target::ARMv86a, {Target::ARMv85a}},
      {Target::ARMv85a, {Target::ARMv84a}},
      {Target::ARMv84a, {Target::ARMv83a}},
      {Target::ARMv83a, {Target::ARMv82a}},
      {Target::ARMv82a, {Target::ARMv81a}},
      {Target::ARMv81a, {Target::ARMv8a}}};
  return all;
}

constexpr std::pair<Target::Feature, int> sme_lengths[] = {{Target::SME_SVL128, 128},
                                                           {Target::SME_SVL256, 256},
                                                           {Target::SME_SVL512, 512},
                                                           {Target::SME_SVL1024, 1024},
                                                           {Target::SME_SVL2048, 2048}};

}  // namespace

void Target::set_implied_features() {
  for (const Implication& line : implications()) {
    if (has_feature(line.feature)) set_features(line.implied);
  }
}

void Target::unset_implied_features() {
  Target implied(os, arch, bits);
  for (const Implication& line : implications()) {
    if (has_feature(line.feature) || implied.has_feature(line.feature))
      implied.set_features(line.implied);
  }
  features_ &= ~implied.features_;
}

int Target::sme_streaming_vector_bits() const {
  for (const auto& [feature, length] : sme_lengths) {
    if (has_feature(feature)) return length;
  }
  return 0;
}

Target::Feature Target::sme_svl_feature_from_bits(int bits) {
  for (const auto& [feature, length] : sme_lengths) {
    if (length == bits) return feature;
  }
  return FeatureEnd;
}

int ir::vector_bytes(const Target& target) {
  const bool wide =
      target.features_any_of({Target::AVX512, Target::AVX512_Skylake, Target::AVX512_Cannonlake,
                              Target::AVX512_SapphireRapids});
  return wide ? 64 : target.has_feature(Target::AVX2) ? 32 : 16;
}

int Target::natural_vector_size(Type type) const {
  if (has_unknowns())
    user_error("ask a target for the length of its vectors", "the target is known",
               text("it is ", quoted(to_string())),
               "Take get_host_target(), or name one: Target(\"x86-64-linux-avx2\")");
  // AVX alone has 32-byte instructions for floats but only 16-byte ones for integers.
  const int bytes = type.is_float() && has_feature(AVX) ? std::max(ir::vector_bytes(*this), 32)
                                                        : ir::vector_bytes(*this);
  return bytes / std::max(type.bytes(), 1);
}

std::string Target::to_string() const {
  std::string result = name_of(arch_names, arch);
  result += "-" + std::to_string(bits) + "-" + name_of(os_names, os);
  std::vector<std::string> features;
  Target named = *this;
  if (features_all_of({TraceLoads, TraceStores, TraceRealizations})) {
    features.push_back("trace_all");
    for (Feature part : {TraceLoads, TraceStores, TraceRealizations})
      named.set_feature(part, false);
  }
  for (const auto& entry : feature_names) {
    if (named.has_feature(entry.value)) features.push_back(entry.name);
  }
  std::ranges::sort(features);
  for (const std::string& feature : features) result += "-" + feature;
  if (processor_tune != ProcessorGeneric)
    result += "-tune_" + std::string(name_of(processor_names, processor_tune));
  if (vector_bits != 0) result += "-vector_bits_" + std::to_string(vector_bits);
  return result;
}

std::string Target::processor_name() const {
  return processor_tune == ProcessorGeneric ? "" : name_of(processor_names, processor_tune);
}

std::string Target::feature_to_name(Feature feature) { return name_of(feature_names, feature); }

Target::Feature Target::feature_from_name(const std::string& name) {
  Feature feature = FeatureEnd;
  if (name == "hvx_128") return HVX_128;
  find_name(feature_names, name, feature);
  return feature;
}

std::string Target::unsupported_part() const {
  if (os != Linux) return name_of(os_names, os);
  if (arch != X86 && arch != ARM) return name_of(arch_names, arch);
  if (bits != 64) return std::to_string(bits);
  for (int i = 0; i < FeatureEnd; i++) {
    if (features_.test(i) && !is_generated[i]) return feature_names[i].name;
  }
  return "";
}

bool Target::supports_device_api(DeviceAPI device) const {
  if (device == DeviceAPI::None || device == DeviceAPI::Host) return true;
  if (device == DeviceAPI::Default_GPU) return has_gpu_feature();
  return has_feature(target_feature_for_device_api(device));
}

namespace {
constexpr DeviceAPI gpus[] = {DeviceAPI::Metal,         DeviceAPI::OpenCL,       DeviceAPI::CUDA,
                              DeviceAPI::OpenGLCompute, DeviceAPI::D3D12Compute, DeviceAPI::Vulkan,
                              DeviceAPI::WebGPU};

// The first of the devices that the target has, else `otherwise`.
template <size_t N>
DeviceAPI first_of(const DeviceAPI (&devices)[N], const Target& target, DeviceAPI otherwise) {
  for (DeviceAPI device : devices) {
    if (target.supports_device_api(device)) return device;
  }
  return otherwise;
}
}  // namespace

DeviceAPI Target::get_required_device_api() const {
  constexpr DeviceAPI others[] = {DeviceAPI::Hexagon, DeviceAPI::HexagonDma};
  return first_of(gpus, *this, first_of(others, *this, DeviceAPI::None));
}

DeviceAPI get_default_device_api_for_target(const Target& target) {
  return first_of(gpus, target, DeviceAPI::Host);
}

int Target::get_cuda_capability_lower_bound() const {
  constexpr std::pair<Feature, int> capabilities[] = {
      {CUDACapability30, 30}, {CUDACapability32, 32}, {CUDACapability35, 35},
      {CUDACapability50, 50}, {CUDACapability61, 61}, {CUDACapability70, 70},
      {CUDACapability75, 75}, {CUDACapability80, 80}, {CUDACapability86, 86}};
  for (const auto& [feature, capability] : capabilities) {
    if (has_feature(feature)) return capability;
  }
  return 20;
}

int Target::cuda_capability() const {
  constexpr std::pair<Feature, int> capabilities[] = {
      {CUDACapability90, 90}, {CUDACapability86, 86}, {CUDACapability80, 80},
      {CUDACapability75, 75}, {CUDACapability70, 70}, {CUDACapability61, 61},
      {CUDACapability50, 50}};
  for (const auto& [feature, capability] : capabilities) {
    if (has_feature(feature)) return capability;
  }
  return 75;
}

bool Target::get_runtime_compatible_target(const Target& other, Target& result) const {
  if (arch != other.arch || os != other.os || bits != other.bits) return false;
  // Features that change the functions a runtime offers. The others only affect code that the
  // runtime never sees.
  const std::vector<Feature> either = {CUDA, OpenCL, Metal, D3D12Compute, OpenGLCompute, HVX_128};
  const std::vector<Feature> same = {Debug, SoftFloatABI, MSAN, TSAN, ASAN};
  Target common(os, arch, bits);
  const auto has_v8 = [](Target target) {
    target.set_implied_features();
    return target.has_feature(ARMv8a);
  };
  common.set_feature(ARMv8a, has_v8(*this) && has_v8(other));
  for (Feature feature : either) {
    common.set_feature(feature, has_feature(feature) || other.has_feature(feature));
  }
  for (Feature feature : same) {
    if (has_feature(feature) != other.has_feature(feature)) return false;
    common.set_feature(feature, has_feature(feature));
  }
  result = common;
  return true;
}

Target::Feature target_feature_for_device_api(DeviceAPI device) {
  static constexpr std::pair<DeviceAPI, Target::Feature> features[] = {
      {DeviceAPI::CUDA, Target::CUDA},
      {DeviceAPI::OpenCL, Target::OpenCL},
      {DeviceAPI::OpenGLCompute, Target::OpenGLCompute},
      {DeviceAPI::Metal, Target::Metal},
      {DeviceAPI::Hexagon, Target::HVX_128},
      {DeviceAPI::HexagonDma, Target::HexagonDma},
      {DeviceAPI::D3D12Compute, Target::D3D12Compute},
      {DeviceAPI::Vulkan, Target::Vulkan},
      {DeviceAPI::WebGPU, Target::WebGPU}};
  for (const auto& [api, feature] : features) {
    if (api == device) return feature;
  }
  return Target::FeatureEnd;
}

bool host_supports_target_device(const Target& target) { return !target.has_gpu_feature(); }

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
