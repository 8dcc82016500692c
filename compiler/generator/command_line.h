// command_line.h -- the program that build files call to run a generator, with the command line of
// Halide's:
//
//   -g NAME  -f FUNCTION  -o FOLDER  -n FILE_BASE  -e object,c_header,...  -d 1 (the gradient)|separate
//   -p PLUGINS  -s SCHEDULER  -r RUNTIME  -t SECONDS  target=TARGET,...  param=value ...
#pragma once

#include <functional>
#include <iosfwd>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "frontend/run/module.h"
#include "generator/abstract_generator.h"

namespace retrograde::internal {

using CreateGenerator =
    std::function<AbstractGeneratorPtr(const std::string& name, const GeneratorContext& context)>;

struct CommandLine {
  std::string generator, function, folder, file_base, runtime, scheduler;
  std::vector<std::string> plugins;
  std::vector<OutputFileType> emit;  // empty: c_header, static_library, registration
  std::vector<Target> targets;
  std::vector<std::string> suffixes;  // of the targets: their text
  std::map<std::string, std::string> params;
  enum class Gradient { None, Whole, Separate } gradient = Gradient::None;
  int timeout_seconds = 900;    // 0: none
  CreateGenerator create;       // null: by the registry
  std::ostream* log = nullptr;  // gets the paths of the files
};

// Reads it all before anything is generated.
// Requires: its arguments are flags of one letter and param=value; every flag has a value; -g names
// the generator, or -r a runtime; -o names the folder of its files; target= names what to compile
// for; the types of -e are names of OutputFileType; -d takes 1, the gradient, 0, or
// separate; -t takes a number of seconds, 0 for no limit.
CommandLine read_command_line(int argc, const char* const* argv);
// Writes the files.
// Requires: one runtime serves all targets; separate gradients are compiled for one target.
void run(const CommandLine& command);
std::string usage();

// The same from C++.
struct ExecuteGeneratorArgs {
  std::string output_dir;
  std::set<OutputFileType> output_types;
  std::vector<Target> targets;        // several: the machine decides at run time
  std::vector<std::string> suffixes;  // one for each target; none: their text
  std::string generator_name;
  std::string function_name;   // none: that of the generator
  std::string file_base_name;  // none: that of the function
  std::string runtime_name;    // a runtime to write
  enum BuildMode { Default, Gradient } build_mode = Default;
  using CreateGeneratorFn = CreateGenerator;
  CreateGeneratorFn create_generator = nullptr;  // null: by the registry
  std::map<std::string, std::string> generator_params;
  bool log_outputs = false;  // names its files on the standard output
};

// Requires: output_dir names the folder of the files; output_types names what to write; targets name
// what to compile for; there is one suffix for each target; generator_name names the generator, or
// runtime_name a runtime.
void execute_generator(const ExecuteGeneratorArgs& args);

// All of it: what goes wrong is written to `errors`, and nothing else; with --help, or without any
// argument, the usage. The program's exit status: 0, or 1.
int generate_filter_main(int argc, char** argv, std::ostream& errors);
int generate_filter_main(int argc, char** argv);  // errors to the standard error stream

}  // namespace retrograde::internal
