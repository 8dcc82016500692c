// Targets as text: the names of systems, architectures, processors and features, reading and writing.
#include <algorithm>
#include <utility>

#include "diagnostics/error.h"
#include "ir/target.h"

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

}  // namespace

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

bool Target::validate_target_string(const std::string& text) {
  Target target;
  Parts parts;
  return read_words(text, target, parts).empty() && parts.all() && !target.has_unknowns();
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

}  // namespace retrograde
