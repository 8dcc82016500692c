// Target: the operating system, architecture, vector width and features to generate code for, under
// Halide's names.
#pragma once

#include <bitset>
#include <cstddef>
#include <string>
#include <vector>

#include "ir/type.h"

namespace retrograde {

enum class DeviceAPI {
  None,
  Host,
  Default_GPU,
  CUDA,
  OpenCL,
  OpenGLCompute,
  Metal,
  Hexagon,
  HexagonDma,
  D3D12Compute,
  Vulkan,
  WebGPU,
};

// Features, architectures and systems without code generation are named too. Programs may mention
// them; compiling for them is an error that names the part.
struct Target {
  enum OS {
    OSUnknown = 0,
    Linux,
    Windows,
    OSX,
    Android,
    IOS,
    QuRT,
    NoOS,
    Fuchsia,
    WebAssemblyRuntime
  } os = OSUnknown;
  enum Arch {
    ArchUnknown = 0,
    X86,
    ARM,
    MIPS,
    Hexagon,
    POWERPC,
    WebAssembly,
    RISCV
  } arch = ArchUnknown;
  int bits = 0;
  // Vector length in bits where the instruction set leaves it open: "vector_bits_256"; 0:
  // unspecified.
  int vector_bits = 0;
  // The processor whose pipeline model schedules instructions: "tune_znver3". It never changes
  // which instructions are used.
  enum Processor {
    ProcessorGeneric,
    K8,
    K8_SSE3,
    AMDFam10,
    BtVer1,
    BdVer1,
    BdVer2,
    BdVer3,
    BdVer4,
    BtVer2,
    ZnVer1,
    ZnVer2,
    ZnVer3,
    ZnVer4
  } processor_tune = ProcessorGeneric;
  // The first enumerators have the positions of halide_target_feature_t. AVX512 means F and CD;
  // AVX512_Skylake adds VL, BW and DQ.
  enum Feature {
#define RETROGRADE_FEATURE(enumerator, name, generated) enumerator,
#include "ir/target_features.def"
#undef RETROGRADE_FEATURE
    FeatureEnd,
    HVX = HVX_128
  };

  Target() = default;
  Target(OS os, Arch arch, int bits, const std::vector<Feature>& features = {});
  Target(OS os, Arch arch, int bits, Processor processor, const std::vector<Feature>& features = {},
         int vector_bits = 0);
  // "host", "x86-64-linux-avx2-fma", "arm-64-linux", "host-no_asserts"; "" is the host.
  // Requires: a target is arch-bits-os or host, then features, joined by dashes; a target is a text
  // such as "host".
  explicit Target(const std::string& text);
  explicit Target(const char* text);  // UserError when it is null
  explicit Target(std::nullptr_t) = delete;
  // Whether the text is a target whose parts are all known.
  static bool validate_target_string(const std::string& text);

  // Every target has FeatureEnd.
  // Requires: a feature is one of Target::Feature.
  bool has_feature(Feature feature) const {
    return feature == FeatureEnd || features_.test(checked(feature));
  }
  Target with_feature(Feature feature) const;
  Target without_feature(Feature feature) const;
  void set_feature(Feature feature, bool value = true) {
    if (feature != FeatureEnd) features_.set(checked(feature), value);
  }
  void set_features(const std::vector<Feature>& features, bool value = true) {
    for (Feature feature : features) set_feature(feature, value);
  }
  bool features_any_of(const std::vector<Feature>& features) const;
  bool features_all_of(const std::vector<Feature>& features) const;
  // Adds the features that the present ones imply (AVX2 implies AVX, FMA, F16C and SSE4.1). The
  // other function removes every feature that the remaining ones imply.
  void set_implied_features();
  void unset_implied_features();
  // The vector length of SME, from sme_svl128 to sme_svl2048; 0 without one.
  int sme_streaming_vector_bits() const;
  static Feature sme_svl_feature_from_bits(int bits);  // FeatureEnd when there is none

  // Lanes in 64 bytes with AVX-512, 32 with AVX2, else 16. Requires: the target is known.
  int natural_vector_size(Type type) const;
  template <class T>
  int natural_vector_size() const {
    return natural_vector_size(type_of<T>());
  }
  bool has_unknowns() const { return os == OSUnknown || arch == ArchUnknown || bits == 0; }
  bool has_gpu_feature() const {
    return features_any_of({CUDA, OpenCL, Metal, D3D12Compute, Vulkan, WebGPU});
  }
  bool has_large_buffers() const { return bits == 64 && has_feature(LargeBuffers); }
  int64_t maximum_buffer_size() const {
    return has_large_buffers() ? INT64_MAX : static_cast<int64_t>(INT32_MAX);
  }
  bool supports_type(const Type& type) const { return type.bits() > 0; }
  bool supports_type(const Type& type, DeviceAPI device) const {
    return supports_type(type) && supports_device_api(device);
  }
  bool supports_device_api(DeviceAPI device) const;
  // A GPU API that the features select (any one, if several); None without.
  DeviceAPI get_required_device_api() const;
  // The compute capability that kernels are compiled for: 75 for cuda_capability_75. The highest
  // one if the target has several, 75 if it has none.
  int cuda_capability() const;
  // 75 for cuda_capability_75; 20 when the target has none.
  int get_cuda_capability_lower_bound() const;
  // The first part without code generation, such as "cuda"; empty when there is none.
  std::string unsupported_part() const;
  bool supported() const { return unsupported_part().empty(); }
  // Whether one runtime serves code for both targets; if so, `result` is that runtime's target.
  bool get_runtime_compatible_target(const Target& other, Target& result) const;
  std::string processor_name() const;  // "znver3"; empty for ProcessorGeneric
  // arch-bits-os, then features by name; round-trips through the constructor.
  std::string to_string() const;
  const std::bitset<FeatureEnd>& get_features_bitset() const { return features_; }
  static std::string feature_to_name(Feature feature);
  static Feature feature_from_name(const std::string& name);  // FeatureEnd when there is none
  friend bool operator==(const Target& a, const Target& b) {
    return a.os == b.os && a.arch == b.arch && a.bits == b.bits && a.vector_bits == b.vector_bits &&
           a.processor_tune == b.processor_tune && a.features_ == b.features_;
  }

 private:
  static Feature checked(Feature feature);  // UserError when the feature does not exist
  std::bitset<FeatureEnd> features_;
};

Target get_host_target();              // this machine, detected by cpuid
Target get_target_from_environment();  // RG_TARGET or HL_TARGET, else host
// RG_JIT_TARGET or HL_JIT_TARGET, else host, plus JIT.
// Requires: the target of HL_JIT_TARGET is one that this machine can run.
Target get_jit_target_from_environment();
// FeatureEnd when there is no single feature.
Target::Feature target_feature_for_device_api(DeviceAPI device);
// The meaning of DeviceAPI::Default_GPU for the target; Host when it has no GPU.
DeviceAPI get_default_device_api_for_target(const Target& target);
bool host_supports_target_device(const Target& target);

}  // namespace retrograde
