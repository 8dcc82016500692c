// What a Target means to LLVM, and which vector math it finds in SLEEF.
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
  bool gathers_fast = false;  // what the code is tuned for: not lane by lane inside
  // Whether vector math is SLEEF's; else the C library's, lane by lane: what is compiled ahead of
  // time for AArch64 needs no library that its toolchains lack.
  bool has_sleef = true;

  // Of code for kernels; the target is the host's.
  enum class Device : uint8_t { None, Nvptx, Simt };
  Device device = Device::None;
  bool is_device() const { return device != Device::None; }
  // Whether kernels are compiled for the executor, too.
  bool wants_executor = false;

  bool is_x86() const { return target.arch == Target::X86 && !is_device(); }
  bool has_avx512() const;  // F at least
  bool has_avx2() const;
  bool has_fma() const;           // as the vector math sees it: FMA with AVX2, or AArch64
  bool has_rounding() const;      // of floats to whole numbers, as an instruction
  bool has_f16c() const;          // half to float conversion as an instruction
  bool has_avx512_words() const;  // AVX-512 of integers of 8 and 16 bits (BW)
  bool has_avx512_bytes() const;  // shuffles of bytes by numbers (VBMI)
  // Whether it has an instruction for loads from anywhere.
  bool gathers(Type type) const;

  // Lanes of the widest vector math function for floats of `bits`.
  int max_math_lanes(int bits) const;
  int min_math_lanes(int bits) const;  // of the narrowest one that is a vector
  // "Sleef_finz_expf8_u10avx2" for ("exp", "u10", 32, 8). `lanes` is 1 or a power of two between
  // min_ and max_math_lanes. All widths on one machine, and all machines with FMA, give the same
  // bits.
  std::string math_symbol(const std::string& stem, const std::string& precision, int bits,
                          int lanes) const;
};

// Unsupported for targets that no back end exists for.
Machine machine_for(const Target& target, bool tune_for_host);
// For the kernels of functions that are made for `host`.
Machine device_machine(const Machine& host, Machine::Device device);
std::unique_ptr<llvm::TargetMachine> make_target_machine(const Machine& machine);

// One of LLVM's options of the whole process; nothing where this LLVM has none of the name.
void set_option(const char* name, bool value);

}  // namespace retrograde::codegen
