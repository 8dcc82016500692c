// module.h -- lowered functions on their way to files: what compile_to_module gives, and what
// generators and build rules compile.
//
// A Module is a handle: copies are the same module. Files are written whole or not at all: under a
// temporary name first, which then takes the place of the old file.
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "frontend/data/argument.h"
#include "frontend/data/buffer.h"
#include "ir/lowered_function.h"
#include "ir/target.h"

namespace retrograde {

enum class OutputFileType {
  assembly,
  bitcode,
  c_header,
  c_source,              // Unsupported
  compiler_log,          // Unsupported
  cpp_stub,              // Unsupported in Module::compile: generators write it
  featurization,         // Unsupported
  function_info_header,  // name_argument_info(), the arguments as constants of C++17
  llvm_assembly,
  object,
  python_extension,  // C++ that makes a Python module of the functions; see aot/python_extension.h
  pytorch_wrapper,   // C++ that calls the functions on tensors; see aot/pytorch_wrapper.h
  registration,      // C++ that hands name_argv and name_metadata to the program
  schedule,          // Unsupported in Module::compile: generators write it
  static_library,
  stmt,
  stmt_html,
};

// What the outside sees of a function.
enum class LinkageType {
  External,              // name
  ExternalPlusMetadata,  // name, name_argv and name_metadata
  ExternalPlusArgv,      // name and name_argv
  Internal,              // nothing
};
std::ostream& operator<<(std::ostream& out, const LinkageType& linkage);

// Of compile_to_lowered_stmt.
enum StmtOutputFormat { Text, HTML };

namespace internal {

struct OutputInfo {
  std::string name, extension;  // "object", ".o"
  bool is_multi = false;        // one file for each target of several
};
std::map<OutputFileType, const OutputInfo> get_output_info(const Target& target);

// One function of a module. `args` is what its callers pass, the outputs last; under
// Target::UserContext a handle "__user_context" stands first.
struct LoweredFunc {
  std::string name;
  std::vector<Argument> args;
  LinkageType linkage = LinkageType::ExternalPlusMetadata;
  // Buffers among its arguments that `args` does not name are embedded in the code.
  ir::LoweredFunction lowered;
};

}  // namespace internal

class Module {
 public:
  Module(const std::string& name, const Target& target);

  const Target& target() const;     // what its functions are made for
  const std::string& name() const;  // the name given
  const std::vector<internal::LoweredFunc>& functions() const;
  std::vector<internal::LoweredFunc>& functions();
  const std::vector<Module>& submodules() const;  // modules that were appended to it
  bool any_strict_float() const;                  // its target is strict about all floats
  // Requires: a module gives functions that were appended to it.
  internal::LoweredFunc get_function_by_name(const std::string& name) const;

  // Requires: functions of a module have different names; a module contains other modules.
  void append(const internal::LoweredFunc& function);
  void append(const Module& module);

  // Writes the files; where one cannot be written, none is left half-written.
  // Requires: an output file's folder must exist and be writable; a module is compiled to machine
  // code, LLVM's formats, statements and headers (Unsupported); only generators have stubs and
  // schedules (Unsupported); functions of a module and its submodules have different names; a
  // module and its submodules are made for one target (Unsupported); what PyTorch calls has tensors
  // and numbers that PyTorch has (Unsupported); what PyTorch calls has a name of C
  // (Unsupported); Python has numbers for the scalars (Unsupported).
  void compile(const std::map<OutputFileType, std::string>& output_files) const;
  // The object file.
  Buffer<uint8_t> compile_to_buffer() const;

  // In metadata, `to` is shown where an argument is called `from`.
  void remap_metadata_name(const std::string& from, const std::string& to) const;
  std::map<std::string, std::string> get_metadata_name_map() const;

 private:
  struct Contents;
  std::shared_ptr<Contents> contents_;
};

// One module with the functions of all.
// Requires: there must be at least one; all must be made for one target.
Module link_modules(const std::string& name, const std::vector<Module>& modules);

// The runtime as an object file, a static library, or both; returns what was written. As a
// python_extension: the definition of a Python module that has the functions of other files.
// Requires: a runtime is there for this machine and for those that a cross compiler was found for
// when the compiler was built (Unsupported).
void compile_standalone_runtime(const std::string& object_filename, const Target& target);
std::map<OutputFileType, std::string> compile_standalone_runtime(
    const std::map<OutputFileType, std::string>& output_files, const Target& target);

using ModuleFactory = std::function<Module(const std::string& function_name, const Target& target)>;

// One function compiled for several targets of one arch-bits-os, the best first and the baseline
// last; `function_name` picks the first that the machine can run. Files of types that are
// OutputInfo::is_multi are written once for each target, with a suffix ("-" and the target, or what
// `suffixes` says) before their extension; static libraries hold all of it.
// Requires: there must be at least one target; there is one suffix for each target; all targets
// have the same architecture, width and operating system; the function is called in the same way
// for all targets.
void compile_multitarget(const std::string& function_name,
                         const std::map<OutputFileType, std::string>& output_files,
                         const std::vector<Target>& targets,
                         const std::vector<std::string>& suffixes,
                         const ModuleFactory& module_factory);

}  // namespace retrograde
