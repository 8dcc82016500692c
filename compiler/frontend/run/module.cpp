#include "frontend/run/module.h"

#include <algorithm>
#include <ostream>

#include "diagnostics/error.h"
#include "frontend/run/compiler_interface.h"
#include "graph/definitions/random_sequence.h"

namespace retrograde {

struct Module::Contents {
  std::string name;
  Target target;
  std::vector<internal::LoweredFunc> functions;
  std::vector<Module> submodules;
  std::map<std::string, std::string> metadata_names;
};

std::ostream& operator<<(std::ostream& out, const LinkageType& linkage) {
  const char* const names[] = {"external", "external_plus_metadata", "external_plus_argv",
                               "internal"};
  return out << names[static_cast<int>(linkage)];
}

namespace internal {

std::map<OutputFileType, const OutputInfo> get_output_info(const Target& target) {
  const bool is_windows = target.os == Target::Windows;
  return {
      {OutputFileType::assembly, {"assembly", ".s", true}},
      {OutputFileType::bitcode, {"bitcode", ".bc", true}},
      {OutputFileType::c_header, {"c_header", ".h", false}},
      {OutputFileType::c_source, {"c_source", ".halide_generated.cpp", true}},
      {OutputFileType::compiler_log, {"compiler_log", ".halide_compiler_log", true}},
      {OutputFileType::cpp_stub, {"cpp_stub", ".stub.h", false}},
      {OutputFileType::featurization, {"featurization", ".featurization", true}},
      {OutputFileType::function_info_header, {"function_info_header", ".function_info.h", false}},
      {OutputFileType::llvm_assembly, {"llvm_assembly", ".ll", true}},
      {OutputFileType::object, {"object", is_windows ? ".obj" : ".o", true}},
      {OutputFileType::python_extension, {"python_extension", ".py.cpp", false}},
      {OutputFileType::pytorch_wrapper, {"pytorch_wrapper", ".pytorch.h", false}},
      {OutputFileType::registration, {"registration", ".registration.cpp", false}},
      {OutputFileType::schedule, {"schedule", ".schedule.h", true}},
      {OutputFileType::static_library, {"static_library", is_windows ? ".lib" : ".a", false}},
      {OutputFileType::stmt, {"stmt", ".stmt", true}},
      {OutputFileType::stmt_html, {"stmt_html", ".stmt.html", true}},
  };
}

}  // namespace internal

// ---- Module ----

Module::Module(const std::string& name, const Target& target)
    : contents_(std::make_shared<Contents>()) {
  contents_->name = name;
  contents_->target = target;
}

const Target& Module::target() const { return contents_->target; }
const std::string& Module::name() const { return contents_->name; }
const std::vector<internal::LoweredFunc>& Module::functions() const { return contents_->functions; }
std::vector<internal::LoweredFunc>& Module::functions() { return contents_->functions; }
const std::vector<Module>& Module::submodules() const { return contents_->submodules; }
bool Module::any_strict_float() const { return target().has_feature(Target::StrictFloat); }

internal::LoweredFunc Module::get_function_by_name(const std::string& name) const {
  std::string names;
  for (const internal::LoweredFunc& function : functions()) {
    if (function.name == name) return function;
    names += (names.empty() ? "" : ", ") + quoted(function.name);
  }
  user_error("find the function " + quoted(name) + " in the module " + quoted(this->name()),
             "a module has the functions that were appended to it",
             names.empty() ? "it has none" : "it has " + names, "Name one of them");
}

void Module::append(const internal::LoweredFunc& function) {
  for (const internal::LoweredFunc& other : functions()) {
    if (other.name != function.name) continue;
    user_error("append the function " + quoted(function.name) + " to the module " + quoted(name()),
               "functions of a module have different names", "it has one of that name",
               "Give the second one another function name");
  }
  contents_->functions.push_back(function);
}

void Module::append(const Module& module) {
  if (module.contents_ == contents_) {
    user_error("append the module " + quoted(name()) + " to itself",
               "a module contains other modules", "it was appended to itself",
               "Append it to another Module");
  }
  contents_->submodules.push_back(module);
}

void Module::compile(const std::map<OutputFileType, std::string>& output_files) const {
  default_compiler().write(*this, output_files);
}

Buffer<uint8_t> Module::compile_to_buffer() const {
  const std::vector<uint8_t> object = default_compiler().object(*this);
  Buffer<uint8_t> buffer({static_cast<int>(object.size())}, name());
  std::copy(object.begin(), object.end(), buffer.data());
  return buffer;
}

void Module::remap_metadata_name(const std::string& from, const std::string& to) const {
  contents_->metadata_names[from] = to;
}
std::map<std::string, std::string> Module::get_metadata_name_map() const {
  return contents_->metadata_names;
}

Module link_modules(const std::string& name, const std::vector<Module>& modules) {
  if (modules.empty())
    user_error("link modules into " + quoted(name), "there must be at least one", "none was given",
               "Give a Module");
  Module result(name, modules[0].target());
  for (const Module& module : modules) {
    if (!(module.target() == result.target())) {
      user_error("link modules into " + quoted(name), "all must be made for one target",
                 quoted(modules[0].name()) + " is for " + quoted(result.target().to_string()) +
                     ", " + quoted(module.name()) + " for " + quoted(module.target().to_string()),
                 "Compile them for one target");
    }
    for (const internal::LoweredFunc& function : module.functions()) result.append(function);
    for (const Module& submodule : module.submodules()) result.append(submodule);
    for (const auto& [from, to] : module.get_metadata_name_map())
      result.remap_metadata_name(from, to);
  }
  return result;
}

// ---- the runtime ----

std::map<OutputFileType, std::string> compile_standalone_runtime(
    const std::map<OutputFileType, std::string>& output_files, const Target& target) {
  std::map<OutputFileType, std::string> written;
  for (OutputFileType type :
       {OutputFileType::object, OutputFileType::static_library, OutputFileType::python_extension}) {
    const auto found = output_files.find(type);
    if (found != output_files.end()) written.insert(*found);
  }
  default_compiler().write_runtime(written, target);
  return written;
}

void compile_standalone_runtime(const std::string& object_filename, const Target& target) {
  compile_standalone_runtime({{OutputFileType::object, object_filename}}, target);
}

// ---- several targets ----

namespace {

std::string identifier(std::string text) {
  for (char& c : text) {
    if (c == '-') c = '_';
  }
  return text;
}

void check_targets(const std::string& asked, const std::vector<Target>& targets,
                   const std::vector<std::string>& suffixes) {
  if (targets.empty())
    user_error(asked, "there must be at least one target", "none was given", "Name a target");
  if (!suffixes.empty() && suffixes.size() != targets.size()) {
    user_error(asked, "there is one suffix for each target",
               text(targets.size(), " targets and ", suffixes.size(), " suffixes were given"),
               "Give that many suffixes");
  }
  const Target& base = targets.back();
  for (const Target& target : targets) {
    if (target.arch == base.arch && target.bits == base.bits && target.os == base.os) continue;
    user_error(asked, "all targets have the same architecture, width and operating system",
               quoted(target.to_string()) + " and " + quoted(base.to_string()) + " do not",
               "Compile for each platform by itself");
  }
}

// All targets must agree on the features that change the function's signature or symbol.
void check_interface(const std::string& asked, const std::vector<Target>& targets) {
  for (Target::Feature feature : {Target::UserContext, Target::CPlusPlusMangling}) {
    for (const Target& target : targets) {
      if (target.has_feature(feature) == targets.back().has_feature(feature)) continue;
      user_error(asked, "the function is called in the same way for all targets",
                 quoted(Target::feature_to_name(feature)) + " is in some of them",
                 "Give it to all or to none");
    }
  }
}

}  // namespace

void compile_multitarget(const std::string& function_name,
                         const std::map<OutputFileType, std::string>& output_files,
                         const std::vector<Target>& targets,
                         const std::vector<std::string>& suffixes,
                         const ModuleFactory& module_factory) {
  const std::string asked = "compile " + quoted(function_name) + " for several targets";
  check_targets(asked, targets, suffixes);
  check_interface(asked, targets);
  if (targets.size() == 1) return module_factory(function_name, targets[0]).compile(output_files);
  std::vector<Module> modules;
  std::vector<std::string> endings;
  for (size_t i = 0; i < targets.size(); i++) {
    endings.push_back("-" + (suffixes.empty() ? targets[i].to_string() : suffixes[i]));
    const std::string name = function_name + identifier(endings.back());
    const graph::RandomSequence same_numbers;
    modules.push_back(module_factory(name, targets[i]));
  }
  default_compiler().write_multitarget(function_name, modules, endings, output_files);
}

}  // namespace retrograde
