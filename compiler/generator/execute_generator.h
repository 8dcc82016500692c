// execute_generator.h -- runs a generator from C++. A struct holds what a build file passes on the command line.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "frontend/run/module.h"
#include "generator/abstract_generator.h"

namespace retrograde::internal {

// Arguments of a run of a generator, as on its command line.
struct ExecuteGeneratorArgs {
  std::string output_dir;                 // folder of the files
  std::set<OutputFileType> output_types;  // files to write
  std::vector<Target> targets;            // several: selected at run time
  std::vector<std::string> suffixes;      // one for each target; empty: the targets as text
  std::string generator_name;             // name in the registry
  std::string function_name;              // empty: the generator's name
  std::string file_base_name;             // empty: the function's name
  std::string runtime_name;               // file base of a runtime to write
  // Whether to compile the pipeline or its gradient.
  enum BuildMode { Default, Gradient } build_mode = Default;
  // Creates a generator by name.
  using CreateGeneratorFn =
      std::function<AbstractGeneratorPtr(const std::string& name, const GeneratorContext& context)>;
  CreateGeneratorFn create_generator = nullptr;         // null: the registry
  std::map<std::string, std::string> generator_params;  // values of generator parameters
  bool log_outputs = false;  // prints the names of the files to standard output
};

// Runs a generator and writes the files.
// Requires: output_dir names the folder of the files; output_types names what to write; targets name
// what to compile for; there is one suffix for each target; generator_name names the generator, or
// runtime_name a runtime.
void execute_generator(const ExecuteGeneratorArgs& args);

// The main() of programs that build files call. Returns the exit status and prints errors to standard error.
int generate_filter_main(int argc, char** argv);

}  // namespace retrograde::internal
