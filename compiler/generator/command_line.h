// command_line.h -- the command line by which build files run a generator; flags are those of Halide:
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

// The parsed command line of a generator program.
struct CommandLine {
  std::string generator, function, folder, file_base, runtime, scheduler;
  std::vector<std::string> plugins;
  std::vector<OutputFileType> emit;  // empty: c_header, static_library, registration
  std::vector<Target> targets;
  std::vector<std::string> suffixes;  // of the targets; empty: the targets as text
  std::map<std::string, std::string> params;
  enum class Gradient { None, Whole, Separate } gradient = Gradient::None;
  int timeout_seconds = 900;                       // 0: no limit
  ExecuteGeneratorArgs::CreateGeneratorFn create;  // null: the registry
  std::ostream* log = nullptr;                     // receives the paths of the files
};

// Parses and checks the whole command line before anything is generated.
// Requires: its arguments are flags of one letter and param=value; every flag has a value; -g names
// the generator, or -r a runtime; -o names the folder of its files; target= names what to compile
// for; the types of -e are names of OutputFileType; -d takes 1, the gradient, 0, or
// separate; -t takes a number of seconds, 0 for no limit.
CommandLine read_command_line(int argc, const char* const* argv);
// Runs the generator and writes the files.
// Requires: one runtime serves all targets; separate gradients are compiled for one target.
void run(const CommandLine& command);
// The text of --help.
std::string usage();

// Parses, runs and reports: an error goes to `errors`, and so does the usage, for --help or without
// arguments. Returns the exit status, 0 or 1.
int generate_filter_main(int argc, char** argv, std::ostream& errors);

}  // namespace retrograde::internal
