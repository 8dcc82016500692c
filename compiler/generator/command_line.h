// command_line.h -- the program that build files call to run a generator, with the command line of
// Halide's:
//
//   -g NAME  -f FUNCTION  -o FOLDER  -n FILE_BASE  -e object,c_header,...  -d 1 (the gradient)|separate
//   -p PLUGINS  -s SCHEDULER  -r RUNTIME  -t SECONDS  target=TARGET,...  param=value ...
#pragma once

#include <iosfwd>
#include <map>
#include <string>
#include <vector>

#include "frontend/run/module.h"
#include "generator/execute_generator.h"

namespace retrograde::internal {

struct CommandLine {
  std::string generator, function, folder, file_base, runtime, scheduler;
  std::vector<std::string> plugins;
  std::vector<OutputFileType> emit;  // empty: c_header, static_library, registration
  std::vector<Target> targets;
  std::vector<std::string> suffixes;  // of the targets: their text
  std::map<std::string, std::string> params;
  enum class Gradient { None, Whole, Separate } gradient = Gradient::None;
  int timeout_seconds = 900;                       // 0: none
  ExecuteGeneratorArgs::CreateGeneratorFn create;  // null: by the registry
  std::ostream* log = nullptr;                     // gets the paths of the files
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

// All of it: what goes wrong is written to `errors`, and nothing else; with --help, or without any
// argument, the usage. The program's exit status: 0, or 1.
int generate_filter_main(int argc, char** argv, std::ostream& errors);

}  // namespace retrograde::internal
