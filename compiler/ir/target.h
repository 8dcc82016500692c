// What machine code is generated for: operating system, architecture, width, and features by
// Halide's names.
#pragma once

#include <bitset>
#include <string>
#include <vector>

#include "ir/type.h"

namespace retrograde {

struct Target {
  enum OS { OSUnknown = 0, Linux, Windows, OSX, NoOS } os = OSUnknown;
  enum Arch { ArchUnknown = 0, X86, ARM } arch = ArchUnknown;
  int bits = 0;
  enum Feature {
    JIT,
    Debug,
    NoAsserts,
    NoBoundsQuery,
    SSE41,
    AVX,
    F16C,
    FMA,
    AVX2,
    AVX512,          // F and CD
    AVX512_Skylake,  // + VL, BW, DQ
    AVX512_Cannonlake,
    AVX512_SapphireRapids,
    UserContext,
    NoRuntime,
    Profile,
    TraceLoads,
    TraceStores,
    TraceRealizations,
    StrictFloat,
    LargeBuffers,
    FeatureEnd
  };

  Target() = default;
  Target(OS os, Arch arch, int bits, const std::vector<Feature>& features = {});
  // "host", "x86-64-linux-avx2-fma", "arm-64-linux", "host-no_asserts". UserError on anything else.
  explicit Target(const std::string& text);
  explicit Target(const char* text) : Target(std::string(text)) {}

  bool has_feature(Feature feature) const { return features_.test(feature); }
  Target with_feature(Feature feature) const;
  Target without_feature(Feature feature) const;
  void set_feature(Feature feature, bool value = true) { features_.set(feature, value); }
  bool features_any_of(const std::vector<Feature>& features) const;
  bool features_all_of(const std::vector<Feature>& features) const;

  // Natural lanes of a vector of the type: 64-byte vectors with AVX-512, 32 with AVX2, else 16.
  int natural_vector_size(Type type) const;
  template <class T>
  int natural_vector_size() const {
    return natural_vector_size(type_of<T>());
  }
  bool has_unknowns() const { return os == OSUnknown || arch == ArchUnknown || bits == 0; }
  bool has_gpu_feature() const { return false; }
  std::string to_string() const;  // round-trips through the constructor
  friend bool operator==(const Target& a, const Target& b) {
    return a.os == b.os && a.arch == b.arch && a.bits == b.bits && a.features_ == b.features_;
  }

 private:
  std::bitset<FeatureEnd> features_;
};

Target get_host_target();                  // this machine, by cpuid
Target get_target_from_environment();      // RG_TARGET or HL_TARGET, else host
Target get_jit_target_from_environment();  // RG_JIT_TARGET or HL_JIT_TARGET, else host, plus JIT

}  // namespace retrograde
