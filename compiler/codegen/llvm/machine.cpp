// Maps targets to LLVM's machines: x86-64 from SSE2 to AVX-512, and AArch64 with NEON, on Linux.
#include "codegen/llvm/machine.h"

#include <llvm/ADT/StringMap.h>
#include <llvm/MC/MCSubtargetInfo.h>
#include <llvm/MC/TargetRegistry.h>
#include <llvm/Support/CommandLine.h>
#include <llvm/Support/TargetSelect.h>
#include <llvm/Target/TargetMachine.h>
#include <llvm/TargetParser/Host.h>

#include <algorithm>
#include <mutex>

#include "diagnostics/error.h"

namespace retrograde::codegen {
namespace {

using F = Target::Feature;

bool has_any(const Target& target, std::initializer_list<F> features) {
  return std::ranges::any_of(features, [&](F feature) { return target.has_feature(feature); });
}

bool has_skylake(const Target& t) {
  return has_any(t, {F::AVX512_Skylake, F::AVX512_Cannonlake, F::AVX512_SapphireRapids});
}

bool has_cannonlake(const Target& t) {
  return has_any(t, {F::AVX512_Cannonlake, F::AVX512_SapphireRapids});
}

std::string x86_features(const Target& t) {
  std::string text = "+sse2";
  const auto add = [&](bool has, const char* names) {
    if (has) text += std::string(",") + names;
  };
  const bool avx512 = has_any(t, {F::AVX512}) || has_skylake(t);
  const bool avx2 = avx512 || t.has_feature(F::AVX2);
  add(t.has_feature(F::SSE41), "+ssse3,+sse4.1,+sse4.2,+popcnt");
  add(t.has_feature(F::AVX), "+avx");
  add(avx512 || t.has_feature(F::F16C), "+f16c");
  add(avx512 || t.has_feature(F::FMA), "+fma");
  // Every processor with AVX2 has these scalar instructions.
  add(avx2, "+avx2,+popcnt,+lzcnt,+bmi,+bmi2");
  add(avx512, "+avx512f,+avx512cd");
  add(has_skylake(t), "+avx512vl,+avx512bw,+avx512dq");
  add(has_cannonlake(t), "+avx512ifma,+avx512vbmi");
  add(t.has_feature(F::AVX512_SapphireRapids),
      "+avx512vnni,+avx512vbmi2,+avx512bitalg,+avx512vpopcntdq");
  return text;
}

int x86_vector_bits(const Machine& machine) {
  if (machine.has_avx512()) return 512;
  return has_any(machine.target, {F::AVX, F::AVX2}) ? 256 : 128;
}

void initialize_llvm() {
  static std::once_flag once;
  std::call_once(once, [] {
    LLVMInitializeX86TargetInfo();
    LLVMInitializeX86Target();
    LLVMInitializeX86TargetMC();
    LLVMInitializeX86AsmPrinter();
    LLVMInitializeAArch64TargetInfo();
    LLVMInitializeAArch64Target();
    LLVMInitializeAArch64TargetMC();
    LLVMInitializeAArch64AsmPrinter();
    LLVMInitializeNVPTXTargetInfo();
    LLVMInitializeNVPTXTarget();
    LLVMInitializeNVPTXTargetMC();
    LLVMInitializeNVPTXAsmPrinter();
    // LLVM offers these only as command-line options.
    set_option("nvptx-short-ptr",
               true);  // 32-bit pointers to shared, constant and local memory
    // This pass moves integers to mask registers and gains nothing here. It takes time quadratic in the length of a
    // function, and took half of the time for the gradient of forty steps of a wave.
    set_option("disable-x86-domain-reassignment", true);
  });
}

// The suffix of SLEEF's functions for `vector_bits`, 0 for scalars.
std::string sleef_suffix(const Machine& machine, int vector_bits) {
  const Target& t = machine.target;
  if (vector_bits == 0) return machine.has_fma() ? "purecfma" : "purec";
  if (!machine.is_x86()) return "advsimd";
  if (machine.has_fma())
    return vector_bits == 128 ? "avx2128" : vector_bits == 256 ? "avx2" : "avx512f";
  if (vector_bits == 256) return "avx";
  return has_any(t, {F::SSE41, F::AVX, F::AVX2}) ? "sse4" : "sse2";
}

}  // namespace

void set_option(const char* name, bool value) {
  const auto& options = llvm::cl::getRegisteredOptions();
  if (const auto found = options.find(name); found != options.end())
    static_cast<llvm::cl::opt<bool>*>(found->second)->setValue(value);
}

bool Machine::has_avx512() const {
  return is_x86() && (has_any(target, {F::AVX512}) || has_skylake(target));
}
bool Machine::has_avx512_words() const { return is_x86() && has_skylake(target); }
bool Machine::has_avx512_bytes() const { return is_x86() && has_cannonlake(target); }
bool Machine::gathers(Type type) const {
  return has_avx2() && (type.bits() == 32 || type.bits() == 64);
}
bool Machine::has_avx2() const { return has_avx512() || (is_x86() && target.has_feature(F::AVX2)); }
bool Machine::has_fma() const {
  return !is_x86() || has_avx512() || (target.has_feature(F::FMA) && target.has_feature(F::AVX2));
}
bool Machine::has_rounding() const {
  return !is_x86() || has_avx2() || has_any(target, {F::SSE41, F::AVX});
}
bool Machine::has_f16c() const {
  const bool is_code_of_x86 = target.arch == Target::X86 && device != Device::Nvptx;
  return !is_code_of_x86 || has_avx512() || target.has_feature(F::F16C);
}

int Machine::max_math_lanes(int bits) const { return vector_bits / bits; }
int Machine::min_math_lanes(int bits) const { return 128 / bits; }

std::string Machine::math_symbol(const std::string& stem, const std::string& precision, int bits,
                                 int lanes) const {
  if (!has_sleef) return stem + (bits == 32 ? "f" : "");
  // finz, cinz: SLEEF's functions whose results do not depend on the vector width.
  const std::string family = has_fma() ? "finz_" : "cinz_";
  return "Sleef_" + family + stem + (bits == 32 ? "f" : "d") + std::to_string(lanes) + "_" +
         precision + sleef_suffix(*this, lanes == 1 ? 0 : lanes * bits);
}

namespace {

// ASAN is accepted: lowering itself emits a check for every access (check_accesses).
void refuse_sanitizers(const Target& target) {
  for (const F sanitizer : {F::MSAN, F::TSAN, F::SanitizerCoverage}) {
    if (!target.has_feature(sanitizer)) continue;
    const std::string name = quoted(Target::feature_to_name(sanitizer));
    unsupported("generate code for target \"" + target.to_string() + "\"",
                "generated code cannot contain this sanitizer's checks",
                "the target asks for " + name,
                "Leave out " + name +
                    ": code without it can be linked with sanitized programs, and bounds are "
                    "checked at every call");
  }
}

// Offsets into buffers are int32 throughout, from the linear forms of indices to the lanes of gathers.
void refuse_large_buffers(const Target& target) {
  if (!target.has_feature(F::LargeBuffers)) return;
  unsupported("generate code for target \"" + target.to_string() + "\"",
              "a buffer has at most 2147483647 elements",
              "the target has the feature \"large_buffers\", which allows more",
              "Leave out \"large_buffers\", and process an image of 2147483648 elements or more in "
              "tiles, each a cropped() part of it");
}

}  // namespace

// LLVM schedules instructions by a processor's latencies and ports. The generic tuning models the oldest processors and
// keeps more values alive than registers hold. So tune for the oldest processor that has the target's instructions.
static std::string tuning_for(const Machine& machine) {
  if (!machine.is_x86() || !machine.has_avx2()) return "";
  return machine.has_avx512_words() ? "x86-64-v4" : "x86-64-v3";
}

static const llvm::Target& llvm_target(const Machine& machine) {
  initialize_llvm();
  std::string problem;
  const llvm::Target* target = llvm::TargetRegistry::lookupTarget(machine.triple, problem);
  RETROGRADE_ASSERT(target != nullptr, "LLVM has no target ", machine.triple, ": ", problem);
  return *target;
}

// Whether a gather instruction is faster than one load per lane. LLVM's tuning decides this for some processors. On the
// AMD EPYC (Zen 5) on which it was measured, a gather of 16 floats takes twice as long as single loads.
static bool gathers_fast(const Machine& machine) {
  const bool is_for_any = machine.tune_cpu.empty() || machine.tune_cpu.starts_with("x86-64");
  if (!machine.has_avx2() || is_for_any) return false;
  const std::unique_ptr<llvm::MCSubtargetInfo> tuned(llvm_target(machine).createMCSubtargetInfo(
      machine.triple, machine.tune_cpu, machine.features));
  return tuned->checkFeatures("+fast-gather");
}

Machine machine_for(const Target& target, bool tune_for_host) {
  refuse_sanitizers(target);
  refuse_large_buffers(target);
  if (const std::string part = target.unsupported_part(); !part.empty()) {
    unsupported("generate code for target \"" + target.to_string() + "\"",
                "code is generated for 64-bit x86 and ARM under Linux",
                "no code can be generated for " + quoted(part),
                "Use \"host\", \"x86-64-linux\" or \"arm-64-linux\"");
  }
  Machine machine;
  machine.target = target;
  if (target.arch == Target::X86) {
    machine.triple = "x86_64-unknown-linux-gnu";
    machine.cpu = "x86-64";
    machine.features = x86_features(target);
    machine.vector_bits = x86_vector_bits(machine);
  } else {
    machine.triple = "aarch64-unknown-linux-gnu";
    machine.cpu = "generic";
    machine.features = "+neon";
    machine.has_sleef = tune_for_host;
  }
  machine.tune_cpu = tuning_for(machine);
  const bool is_host = target.arch == get_host_target().arch;
  if (tune_for_host && is_host) machine.tune_cpu = llvm::sys::getHostCPUName().str();
  if (const std::string name = target.processor_name(); !name.empty() && machine.is_x86())
    machine.tune_cpu = name == "k8_sse3" ? "k8-sse3" : name;
  machine.gathers_fast = gathers_fast(machine);
  return machine;
}

// PTX 7.8 is accepted by drivers from CUDA 11.8 on.
Machine device_machine(const Machine& host, Machine::Device device) {
  Machine machine = host;
  machine.device = device;
  machine.vector_bits = 128;  // the widest access of a thread
  machine.gathers_fast = false;
  machine.has_sleef = false;
  if (device != Machine::Device::Nvptx) return machine;
  machine.triple = "nvptx64-nvidia-cuda";
  machine.cpu = "sm_" + std::to_string(host.target.cuda_capability());
  machine.features = "+ptx78";
  machine.tune_cpu = "";
  return machine;
}

std::unique_ptr<llvm::TargetMachine> make_target_machine(const Machine& machine) {
  llvm::TargetOptions options;
  options.AllowFPOpFusion =
      llvm::FPOpFusion::Standard;  // fuses only operations with the contract flag
  options.TrapUnreachable = true;
  // Code with checked accesses serves to find errors. Without LLVM's optimal instruction selection it compiles more
  // than twice as fast, and runs slower.
  const bool is_quick = !machine.is_device() && machine.target.has_feature(Target::CheckedAccesses);
  const auto level = is_quick ? llvm::CodeGenOptLevel::None : llvm::CodeGenOptLevel::Default;
  return std::unique_ptr<llvm::TargetMachine>(llvm_target(machine).createTargetMachine(
      machine.triple, machine.cpu, machine.features, options, llvm::Reloc::PIC_,
      llvm::CodeModel::Small, level));
}

}  // namespace retrograde::codegen
