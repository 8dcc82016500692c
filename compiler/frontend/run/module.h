// module.h -- Module, a set of lowered functions that are written to files. compile_to_module returns one; generators
// and build rules compile it.
//
// A file is written under a temporary name, which then replaces the old file, so it is never incomplete.
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

// Kinds of files that the compiler writes.
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
  python_extension,  // C++ source of a Python module with the functions; see aot/python_extension.h
  pytorch_wrapper,   // C++ that calls the functions on tensors; see aot/pytorch_wrapper.h
  registration,      // C++ that registers name_argv and name_metadata with the program
  schedule,          // Unsupported in Module::compile: generators write it
  static_library,
  stmt,
  stmt_html,
};

// Which symbols of a function are visible outside its object file.
enum class LinkageType {
  External,              // name
  ExternalPlusMetadata,  // name, name_argv and name_metadata
  ExternalPlusArgv,      // name and name_argv
  Internal,              // nothing
};
// Prints the enumerator's name.
std::ostream& operator<<(std::ostream& out, const LinkageType& linkage);

// Format of compile_to_lowered_stmt().
enum StmtOutputFormat { Text, HTML };

namespace internal {

// Properties of a kind of file.
struct OutputInfo {
  std::string name, extension;  // "object", ".o"
  bool is_multi = false;        // one file for each target of several
};
// The properties of every kind of file for a target.
std::map<OutputFileType, const OutputInfo> get_output_info(const Target& target);

// One function of a module.
struct LoweredFunc {
  std::string name;  // name of the C symbol
  // Arguments that callers pass, outputs last. With Target::UserContext the first is a handle
  // "__user_context".
  std::vector<Argument> args;
  // Which of its symbols are visible.
  LinkageType linkage = LinkageType::ExternalPlusMetadata;
  // The lowered code. Buffers among its arguments that `args` does not name are embedded in the code.
  ir::LoweredFunction lowered;
};

}  // namespace internal

// A set of lowered functions for one target, to be written to files. Module is a handle: copies refer to the
// same module.
class Module {
 public:
  // An empty module for `target`.
  Module(const std::string& name, const Target& target);

  const Target& target() const;     // target of all functions
  const std::string& name() const;  // name of the module
  const std::vector<internal::LoweredFunc>& functions()
      const;  // functions in the order of append()
  std::vector<internal::LoweredFunc>& functions();
  const std::vector<Module>& submodules() const;  // modules that were appended
  bool any_strict_float() const;                  // whether the target has strict_float
  // The function that was appended under `name`.
  // Requires: a module has the functions that were appended to it.
  internal::LoweredFunc get_function_by_name(const std::string& name) const;

  // Adds a function, or the functions of another module.
  // Requires: functions of a module have different names; a module contains other modules.
  void append(const internal::LoweredFunc& function);
  void append(const Module& module);

  // Compiles the module and writes the given files. If a file cannot be written, no file is left incomplete.
  // Requires: an output file's folder must exist and be writable; a module is compiled to machine
  // code, LLVM's formats, statements and headers (Unsupported); only generators have stubs and
  // schedules (Unsupported); functions of a module and its submodules have different names; a
  // module and its submodules are made for one target (Unsupported); PyTorch supports the types of all arguments
  // (Unsupported); the function's name is a C name
  // (Unsupported); Python supports the scalars' types (Unsupported).
  void compile(const std::map<OutputFileType, std::string>& output_files) const;
  // The object file as bytes.
  Buffer<uint8_t> compile_to_buffer() const;

  // Shows argument `from` under the name `to` in the metadata.
  void remap_metadata_name(const std::string& from, const std::string& to) const;
  // All renamings of remap_metadata_name().
  std::map<std::string, std::string> get_metadata_name_map() const;

 private:
  struct Contents;
  std::shared_ptr<Contents> contents_;
};

// A module with the functions of several modules.
// Requires: there must be at least one; all must be made for one target.
Module link_modules(const std::string& name, const std::vector<Module>& modules);

// Writes the runtime as an object file, a static library, or both, and returns the files. A python_extension
// file holds the definition of a Python module whose functions are in other files.
// Requires: the compiler was built with a runtime for the target (Unsupported).
void compile_standalone_runtime(const std::string& object_filename, const Target& target);
std::map<OutputFileType, std::string> compile_standalone_runtime(
    const std::map<OutputFileType, std::string>& output_files, const Target& target);

// Builds the module of a function for one of several targets.
using ModuleFactory = std::function<Module(const std::string& function_name, const Target& target)>;

// Compiles one function for several targets with the same architecture, width and operating system, best
// target first and baseline last. At run time `function_name` selects the first target that the machine
// supports. Kinds of files with OutputInfo::is_multi are written once per target; their names get a suffix
// before the extension: "-" and the target, or an element of `suffixes`. A static library holds all of them.
// Requires: there must be at least one target; there is one suffix for each target; all targets
// have the same architecture, width and operating system; the function is called in the same way
// for all targets.
void compile_multitarget(const std::string& function_name,
                         const std::map<OutputFileType, std::string>& output_files,
                         const std::vector<Target>& targets,
                         const std::vector<std::string>& suffixes,
                         const ModuleFactory& module_factory);

}  // namespace retrograde
