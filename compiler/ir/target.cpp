// The features of a target and those that they imply; its vectors and devices.
#include "ir/target.h"

#include <algorithm>
#include <utility>

#include "diagnostics/error.h"
#include "ir/vector_bytes.h"

namespace retrograde {

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

Target::Feature Target::checked(Feature feature) {
  if (feature >= 0 && feature < FeatureEnd) return feature;
  user_error(text("use feature ", static_cast<int>(feature), " of a target"),
             "a feature is one of Target::Feature",
             text("they end with ", static_cast<int>(FeatureEnd)), "Name one, as in Target::AVX2");
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

}  // namespace retrograde
