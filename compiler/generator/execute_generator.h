// execute_generator.h -- a generator run from C++: what a build file says on its command line, as a
// struct.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "frontend/run/module.h"
#include "generator/abstract_generator.h"

namespace retrograde::internal {

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
  using CreateGeneratorFn =
      std::function<AbstractGeneratorPtr(const std::string& name, const GeneratorContext& context)>;
  CreateGeneratorFn create_generator = nullptr;  // null: by the registry
  std::map<std::string, std::string> generator_params;
  bool log_outputs = false;  // names its files on the standard output
};

// Requires: output_dir names the folder of the files; output_types names what to write; targets name
// what to compile for; there is one suffix for each target; generator_name names the generator, or
// runtime_name a runtime.
void execute_generator(const ExecuteGeneratorArgs& args);

// The program that build files call: the exit status. Errors go to the standard error stream.
int generate_filter_main(int argc, char** argv);

}  // namespace retrograde::internal
