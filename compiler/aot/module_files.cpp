#include "aot/module_files.h"

#include <algorithm>
#include <chrono>
#include <sstream>

#include "aot/files.h"
#include "aot/function_info.h"
#include "aot/header.h"
#include "aot/html.h"
#include "aot/mangle.h"
#include "aot/merge_objects.h"
#include "aot/program.h"
#include "aot/python_extension.h"
#include "aot/pytorch_wrapper.h"
#include "aot/runtime_object.h"
#include "codegen/device/kernel_code.h"
#include "codegen/llvm/archive.h"
#include "codegen/llvm/machine.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "diagnostics/pass_observer.h"
#include "frontend/run/warnings.h"
#include "ir/print.h"

namespace retrograde::aot {
namespace {

using codegen::Format;

codegen::Options options_for(const Target& target) {
  codegen::Options options;
  options.target = target;
  options.tune_for_host = false;  // the code runs on another machine
  return options;
}

void check_type(OutputFileType type, const std::string& module) {
  const std::string asked = "write " + quoted(internal::get_output_info({}).at(type).name) +
                            " of the module " + quoted(module);
  switch (type) {
    case OutputFileType::c_source:
    case OutputFileType::featurization:
    case OutputFileType::compiler_log:
      unsupported(asked,
                  "a module is compiled to machine code, LLVM's formats, statements and "
                  "headers",
                  "there is no writer for this kind of output",
                  "Write an object or a static library, and a header");
    case OutputFileType::cpp_stub:
    case OutputFileType::schedule:
      unsupported(asked, "only generators have stubs and schedules",
                  "a module does not know where it came from", "Ask the generator for it");
    default:
      return;
  }
}

std::string statement_text(const Module& module) {
  std::ostringstream out;
  run_on_large_stack([&] {
    for (const internal::LoweredFunc& function : exported_functions(module)) {
      out << "// " << function.name << " for " << module.target().to_string() << "\n"
          << function.lowered.body << "\n";
    }
  });
  return out.str();
}

std::vector<DeclaredFunction> declared_functions(const Module& module) {
  return ir::mapped(exported_functions(module), [&](const internal::LoweredFunc& function) {
    return DeclaredFunction{function.name, signature_of(function, module)};
  });
}

std::string page_text(const Module& module, const std::string& assembly) {
  std::vector<PageFunction> functions;
  run_on_large_stack([&] {
    for (const internal::LoweredFunc& function : exported_functions(module)) {
      std::ostringstream statement;
      statement << function.lowered.body;
      functions.push_back({function.name, function.lowered.loop_nest(), statement.str()});
    }
  });
  return html_page(module.name() + " for " + module.target().to_string(), functions, assembly);
}

bool has_runtime(const Target& target) { return !target.has_feature(Target::NoRuntime); }

// An archive of these objects, and of the runtime unless the target has no_runtime.
std::string library_of(std::vector<codegen::Member> members, const Target& target) {
  if (has_runtime(target)) members.push_back({"retrograde_runtime.o", runtime_object(target)});
  return codegen::archive(members);
}

// The outputs of one module. Machine code is only generated if a requested output needs it.
class Outputs {
 public:
  Outputs(const Module& module, const Files& wanted) : module_(module) {
    std::vector<Format> formats;
    const auto need = [&](OutputFileType type, Format format) {
      const bool is_new = std::find(formats.begin(), formats.end(), format) == formats.end();
      if (wanted.count(type) && is_new) formats.push_back(format);
    };
    need(OutputFileType::assembly, Format::Assembly);
    need(OutputFileType::stmt_html, Format::Assembly);
    need(OutputFileType::llvm_assembly, Format::LlvmIr);
    need(OutputFileType::bitcode, Format::Bitcode);
    const bool needs_object =
        wanted.count(OutputFileType::object) || wanted.count(OutputFileType::static_library);
    if (formats.empty() && !needs_object) return;
    const auto start = std::chrono::steady_clock::now();
    const codegen::Program program = program_of(module);
    const codegen::Options options = options_for(module.target());
    if (needs_object) object_ = join_parts(codegen::compile_parts(program, options));
    if (!formats.empty()) texts_ = codegen::compile_texts(program, options, formats);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    tell_pass_observers({module.name(), "llvm", seconds.count(), {}});
  }

  const std::string& object() const { return object_; }

  std::string contents(OutputFileType type) const {
    switch (type) {
      case OutputFileType::object:
        return object_with_runtime();
      case OutputFileType::static_library:
        return library_of({{name_parts(module_.name()).back() + ".o", object()}}, module_.target());
      case OutputFileType::assembly:
        return texts_.at(Format::Assembly);
      case OutputFileType::llvm_assembly:
        return texts_.at(Format::LlvmIr);
      case OutputFileType::bitcode:
        return texts_.at(Format::Bitcode);
      case OutputFileType::stmt:
        return statement_text(module_);
      case OutputFileType::stmt_html:
        return page_text(module_, texts_.at(Format::Assembly));
      case OutputFileType::c_header:
        return header_text(module_.name(), module_.target(), declared_functions(module_));
      case OutputFileType::function_info_header:
        return function_info_text(module_.name(), module_.target(), declared_functions(module_));
      case OutputFileType::registration:
        return registration_text(declared_functions(module_), module_.target());
      case OutputFileType::python_extension:
        return python_extension_text(module_.name(), module_.target(), declared_functions(module_));
      case OutputFileType::pytorch_wrapper:
        return pytorch_wrapper_text(module_.name(), module_.target(), declared_functions(module_));
      default:
        internal_error("no writer for an output that was checked");
    }
  }

 private:
  const Module module_;
  std::string object_;
  std::map<Format, std::string> texts_;

  // If this build has no runtime for the target, the object's user has to link one.
  std::string object_with_runtime() const {
    if (!has_runtime(module_.target()) || !has_runtime_object(module_.target())) return object();
    return merge_objects(object(), runtime_object(module_.target()));
  }
};

// dir/name.ext => dir/name<suffix>.ext
std::string with_suffix(const std::string& path, const std::string& suffix,
                        const std::string& extension) {
  const bool ends = path.size() > extension.size() &&
                    path.compare(path.size() - extension.size(), extension.size(), extension) == 0;
  const std::string stem = ends ? path.substr(0, path.size() - extension.size()) : path;
  return stem + suffix + (ends ? extension : "");
}

// Outputs for several targets: the variants, the function that dispatches among them, and the runtime.
class MultitargetOutputs {
 public:
  MultitargetOutputs(const std::string& function_name, const std::vector<Module>& modules,
                     const std::vector<std::string>& suffixes)
      : name_(function_name), modules_(modules), suffixes_(suffixes) {}

  std::vector<File> files(const Files& wanted) {
    std::vector<File> result;
    const auto info = internal::get_output_info(baseline().target());
    Files multi;
    for (const auto& [type, path] : wanted) {
      if (info.at(type).is_multi) multi[type] = path;
    }
    add_variants(multi, info, wanted.count(OutputFileType::static_library) != 0, result);
    for (const auto& [type, path] : wanted) {
      if (!info.at(type).is_multi) result.push_back({path, shared(type)});
    }
    if (const auto object = wanted.find(OutputFileType::object); object != wanted.end())
      add_objects(object->second, info.at(OutputFileType::object).extension, result);
    return result;
  }

 private:
  const std::string& name_;
  const std::vector<Module>& modules_;
  const std::vector<std::string>& suffixes_;
  std::vector<codegen::Member> members_;

  const Module& baseline() const { return modules_.back(); }

  void add_variants(const Files& multi,
                    const std::map<OutputFileType, const internal::OutputInfo>& info,
                    bool wants_library, std::vector<File>& result) {
    for (size_t i = 0; i < modules_.size(); i++) {
      Files wanted = multi;
      if (wants_library) wanted[OutputFileType::object];
      const Outputs outputs(modules_[i], wanted);
      for (const auto& [type, path] : multi) {
        const std::string place = with_suffix(path, suffixes_[i], info.at(type).extension);
        // All variants share one runtime, in an object of its own.
        result.push_back(
            {place, type == OutputFileType::object ? outputs.object() : outputs.contents(type)});
      }
      if (wants_library)
        members_.push_back({modules_[i].functions()[0].name + ".o", outputs.object()});
    }
  }

  std::string wrapper_object() const {
    return join_parts(
        codegen::compile_parts(dispatcher(name_, modules_), options_for(baseline().target())));
  }

  void add_objects(const std::string& path, const std::string& extension,
                   std::vector<File>& result) {
    result.push_back({with_suffix(path, "_wrapper", extension), wrapper_object()});
    if (has_runtime(baseline().target())) {
      result.push_back(
          {with_suffix(path, "_runtime", extension), runtime_object(baseline().target())});
    }
  }

  std::string shared(OutputFileType type) {
    const std::vector<DeclaredFunction> functions = {
        {name_, dispatcher_signature(name_, baseline())}};
    if (type == OutputFileType::c_header) return header_text(name_, baseline().target(), functions);
    if (type == OutputFileType::function_info_header)
      return function_info_text(name_, baseline().target(), functions);
    if (type == OutputFileType::registration)
      return registration_text(functions, baseline().target());
    if (type == OutputFileType::python_extension)
      return python_extension_text(name_, baseline().target(), functions);
    if (type == OutputFileType::pytorch_wrapper)
      return pytorch_wrapper_text(name_, baseline().target(), functions);
    RETROGRADE_ASSERT(type == OutputFileType::static_library, "an output without a writer");
    std::vector<codegen::Member> members = members_;
    members.push_back({name_parts(name_).back() + "_wrapper.o", wrapper_object()});
    return library_of(std::move(members), baseline().target());
  }
};

}  // namespace

void check_target(const Target& target) { codegen::machine_for(target, false); }

void tell_kernel_notes(const ir::LoweredFunction& function, const Target& target) {
  if (!frontend::has_warning_scope()) return;
  for (const auto& kernel : codegen::compile_kernels(function, options_for(target)).kernels) {
    if (kernel.local_bytes > 0)
      frontend::tell_warning(codegen::local_memory_note(kernel.name, kernel.local_bytes));
  }
}

std::vector<uint8_t> object_of(const Module& module) {
  const std::string bytes = Outputs(module, {{OutputFileType::object, ""}}).object();
  return {bytes.begin(), bytes.end()};
}

void write_module(const Module& module, const Files& output_files) {
  for (const auto& [type, path] : output_files) check_type(type, module.name());
  const Outputs outputs(module, output_files);
  std::vector<File> files;
  for (const auto& [type, path] : output_files) files.push_back({path, outputs.contents(type)});
  write_files(files);
}

void write_multitarget(const std::string& function_name, const std::vector<Module>& modules,
                       const std::vector<std::string>& suffixes, const Files& output_files) {
  for (const auto& [type, path] : output_files) check_type(type, function_name);
  write_files(MultitargetOutputs(function_name, modules, suffixes).files(output_files));
}

void write_runtime(const Files& output_files, const Target& target) {
  const std::string object = runtime_object(target);
  std::vector<File> files;
  for (const auto& [type, path] : output_files) {
    const bool is_library = type == OutputFileType::static_library;
    if (type == OutputFileType::python_extension) {
      const std::string file = path.substr(path.rfind('/') + 1);
      files.push_back({path, python_extension_text(file.substr(0, file.find('.')), target, {})});
      continue;
    }
    files.push_back(
        {path, is_library ? codegen::archive({{"retrograde_runtime.o", object}}) : object});
  }
  write_files(files);
}

}  // namespace retrograde::aot
