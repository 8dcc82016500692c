// Describes a Target to LLVM, and names the vector math functions that SLEEF has for it.
#pragma once

#include <memory>
#include <string>

#include "ir/target.h"

namespace llvm {
class TargetMachine;
}

namespace retrograde::codegen {

struct Machine {
  Target target;
  std::string triple, cpu, tune_cpu, features;
  int vector_bits = 128;
  bool gathers_fast =
      false;  // whether the tuned processor's gathers are fast, i.e. not split into lanes
  // Whether vector math calls SLEEF. If not, it calls the C library lane by lane: code compiled ahead of time for
  // AArch64 must not need a library that its toolchains lack.
  bool has_sleef = true;

  // Set when generating kernels; `target` remains the host's.
  enum class Device : uint8_t { None, Nvptx, Simt };
  Device device = Device::None;
  bool is_device() const { return device != Device::None; }
  // Whether kernels are also compiled for the simulated device.
  bool wants_executor = false;

  bool is_x86() const { return target.arch == Target::X86 && !is_device(); }
  bool has_avx512() const;  // at least AVX-512F
  bool has_avx2() const;
  bool has_fma() const;           // for vector math: FMA with AVX2, or AArch64
  bool has_rounding() const;      // an instruction that rounds floats to whole numbers
  bool has_f16c() const;          // an instruction that converts half to float
  bool has_avx512_words() const;  // AVX-512 for 8- and 16-bit integers (BW)
  bool has_avx512_bytes() const;  // byte permutes with variable indices (VBMI)
  // Whether it has a gather instruction for the type.
  bool gathers(Type type) const;

  // Lanes of the widest vector math function for floats of `bits`.
  int max_math_lanes(int bits) const;
  int min_math_lanes(int bits) const;  // lanes of the narrowest one that is a vector
  // "Sleef_finz_expf8_u10avx2" for ("exp", "u10", 32, 8). `lanes` is 1 or a power of two between min_ and
  // max_math_lanes. All widths give the same bits on one machine, and on all machines with FMA.
  std::string math_symbol(const std::string& stem, const std::string& precision, int bits,
                          int lanes) const;
};

// Throws Unsupported for targets without a back end.
Machine machine_for(const Target& target, bool tune_for_host);
// The machine for kernels of functions that are compiled for `host`.
Machine device_machine(const Machine& host, Machine::Device device);
std::unique_ptr<llvm::TargetMachine> make_target_machine(const Machine& machine);

// Sets a process-wide option of LLVM; does nothing if this LLVM has no option of that name.
void set_option(const char* name, bool value);

}  // namespace retrograde::codegen
