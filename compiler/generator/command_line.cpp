// command_line.cpp -- parses the command line of a generator program, runs the generator and writes the files.
#include "generator/command_line.h"

#include <malloc.h>

#include <iostream>

#include "diagnostics/error.h"
#include "frontend/schedule/autoscheduler.h"
#include "generator/generator_base.h"
#include "generator/registry.h"

namespace retrograde::internal {

namespace {

constexpr char asked[] = "run a generator";

std::vector<std::string> words_between_commas(const std::string& text) {
  std::vector<std::string> words;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    if (end > begin) words.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return words;
}

std::string names_of(const std::vector<std::string>& names) { return listed(names, quoted); }

std::vector<std::string> emit_names() {
  return ir::mapped(get_output_info(get_host_target()),
                    [](const auto& output) { return output.second.name; });
}

OutputFileType read_emit_type(const std::string& word) {
  for (const auto& [type, info] : get_output_info(get_host_target())) {
    if (info.name == word) return type;
  }
  user_error("emit a file of type " + quoted(word), "the types of -e are " + names_of(emit_names()),
             quoted(word) + " is not one of them",
             "Name one or more of these, with commas between");
}

CommandLine::Gradient read_gradient(const std::string& text) {
  using Gradient = CommandLine::Gradient;
  const std::map<std::string, Gradient> known = {
      {"0", Gradient::None}, {"1", Gradient::Whole}, {"separate", Gradient::Separate}};
  const auto found = known.find(text);
  if (found == known.end()) {
    user_error(std::string(asked) + " with -d " + text, "-d takes 1, the gradient, 0, or separate",
               quoted(text) + " is not one of them", "Write -d 1 or leave it out");
  }
  return found->second;
}

int read_seconds(const std::string& text) {
  const std::optional<int> seconds = read_number<int>(text);
  if (!seconds || *seconds < 0) {
    user_error(std::string(asked) + " with -t " + text,
               "-t takes a number of seconds, 0 for no limit", quoted(text) + " is not a number",
               "Write for example -t 60");
  }
  return *seconds;
}

void read_targets(const std::string& text, CommandLine& command) {
  command.suffixes = words_between_commas(text);
  command.targets.clear();
  for (const std::string& word : command.suffixes) command.targets.push_back(Target(word));
}

void set_flag(char flag, const std::string& value, CommandLine& command) {
  switch (flag) {
    case 'g':
      command.generator = value;
      return;
    case 'f':
      command.function = value;
      return;
    case 'o':
      command.folder = value;
      return;
    case 'n':
      command.file_base = value;
      return;
    case 'r':
      command.runtime = value;
      return;
    case 's':
      command.scheduler = value;
      return;
    case 'd':
      command.gradient = read_gradient(value);
      return;
    case 't':
      command.timeout_seconds = read_seconds(value);
      return;
    case 'p':
      command.plugins = words_between_commas(value);
      return;
    case 'e':
      for (const std::string& word : words_between_commas(value))
        command.emit.push_back(read_emit_type(word));
      return;
  }
}

// Checks that all required flags are present.
void check_complete(const CommandLine& command) {
  if (command.generator.empty() && command.runtime.empty()) {
    const std::vector<std::string> names = GeneratorRegistry::enumerate();
    user_error(asked, "-g names the generator, or -r a runtime", "neither is given",
               names.empty() ? "No generator is linked into this program"
                             : "Name one of " + names_of(names));
  }
  if (command.folder.empty()) {
    user_error(asked, "-o names the folder of its files", "it is missing", "Add -o .");
  }
  const bool needs_target = command.emit.empty() || !command.runtime.empty() ||
                            std::ranges::any_of(command.emit, [](OutputFileType type) {
                              return type != OutputFileType::cpp_stub;
                            });
  if (command.targets.empty() && needs_target) {
    user_error(asked, "target= names what to compile for", "it is missing",
               "Add target=host, or for example target=x86-64-linux-avx2");
  }
}

// "ns::blur" => "blur"
std::string base_name(const std::string& function) {
  const size_t colons = function.rfind("::");
  return colons == std::string::npos ? function : function.substr(colons + 2);
}

// Creates the generator in a context for the target, with the autoscheduler of -s.
std::unique_ptr<GeneratorBase> make_generator(const CommandLine& command, const Target& target) {
  AutoschedulerParams scheduler;
  GeneratorParamsMap params;
  for (const auto& [key, value] : command.params) {
    if (key == "autoscheduler")
      scheduler.name = value;
    else if (key.starts_with("autoscheduler."))
      scheduler.extra[key.substr(key.find('.') + 1)] = value;
    else
      params.insert_or_assign(key, value);
  }
  const GeneratorContext context(target, scheduler);
  auto generator = command.create ? as_generator_base(command.create(command.generator, context))
                                  : GeneratorRegistry::create(command.generator, context);
  generator->set_generator_param_values(params);
  return generator;
}

std::map<OutputFileType, std::string> files_of(const CommandLine& command,
                                               const std::string& base) {
  std::vector<OutputFileType> emit = command.emit;
  if (emit.empty()) {
    emit = {OutputFileType::static_library};
    if (command.runtime.empty()) {
      emit.push_back(OutputFileType::c_header);
      emit.push_back(OutputFileType::registration);
    }
  }
  const auto info = get_output_info(command.targets[0]);
  std::map<OutputFileType, std::string> files;
  for (OutputFileType type : emit)
    files[type] = command.folder + "/" + base + info.at(type).extension;
  return files;
}

void log(const CommandLine& command, const std::map<OutputFileType, std::string>& files) {
  if (!command.log) return;
  for (const auto& [type, path] : files) *command.log << path << "\n";
}

void run_runtime(const CommandLine& command) {
  Target common = command.targets[0];
  for (const Target& target : command.targets) {
    if (target.get_runtime_compatible_target(common, common)) continue;
    user_error("make the runtime " + quoted(command.runtime), "one runtime serves all targets",
               quoted(target.to_string()) + " and " + quoted(command.targets[0].to_string()) +
                   " need different ones",
               "Make one for each");
  }
  log(command, compile_standalone_runtime(files_of(command, command.runtime), common));
}

// Writes one schedule for each target, since a schedule may depend on the target.
void emit_schedules(const CommandLine& command, const std::string& function,
                    const std::string& base) {
  const std::string extension =
      get_output_info(command.targets[0]).at(OutputFileType::schedule).extension;
  for (size_t i = 0; i < command.targets.size(); i++) {
    const std::string suffix = command.targets.size() > 1 ? "-" + command.suffixes[i] : "";
    make_generator(command, command.targets[i])
        ->emit_schedule(command.folder + "/" + base + suffix + extension, function);
  }
}

void run_generator(const CommandLine& command) {
  const std::string function = command.function.empty() ? command.generator : command.function;
  const std::string base = command.file_base.empty() ? base_name(function) : command.file_base;
  const auto build = [&](const std::string& name, const Target& target) {
    const auto generator = make_generator(command, target);
    switch (command.gradient) {
      case CommandLine::Gradient::Whole:
        return generator->build_gradient_module(name);
      case CommandLine::Gradient::Separate:
        return generator->build_separate_gradients(name);
      default:
        return generator->build_module(name);
    }
  };
  if (command.gradient == CommandLine::Gradient::Separate && command.targets.size() > 1) {
    user_error(std::string(asked) + " with -d separate",
               "separate gradients are compiled for one target",
               text(command.targets.size(), " targets are given"), "Name one, or ask for -d 1");
  }
  auto files = files_of(command, base);
  log(command, files);
  if (const auto stub = files.find(OutputFileType::cpp_stub); stub != files.end()) {
    make_generator(command, command.targets[0])->emit_cpp_stub(stub->second);
    files.erase(stub);
  }
  if (files.erase(OutputFileType::schedule)) emit_schedules(command, function, base);
  if (files.empty()) return;
  if (command.targets.size() == 1)
    build(function, command.targets[0]).compile(files);
  else
    compile_multitarget(function, files, command.targets, command.suffixes, build);
}

// Parses the command line, loads plugins, and creates the generator once, so that errors come before any file.
CommandLine prepare(int argc, const char* const* argv) {
  CommandLine command = read_command_line(argc, argv);
  for (const std::string& plugin : command.plugins) load_plugin(plugin);
  if (!command.scheduler.empty()) set_default_autoscheduler_name(command.scheduler);
  if (!command.generator.empty()) make_generator(command, command.targets[0]);
  return command;
}

}  // namespace

CommandLine read_command_line(int argc, const char* const* argv) {
  CommandLine command;
  const std::string flags = "gfonrsdtpe";
  for (int i = 1; i < argc; i++) {
    const std::string word = argv[i];
    const size_t equals = word.find('=');
    if (word[0] != '-' && equals != std::string::npos) {
      const std::string key = word.substr(0, equals), value = word.substr(equals + 1);
      if (key == "target")
        read_targets(value, command);
      else
        command.params[key] = value;
      continue;
    }
    if (word.size() != 2 || word[0] != '-' || flags.find(word[1]) == std::string::npos) {
      user_error(asked, "its arguments are flags of one letter and param=value",
                 quoted(word) + " is neither", "See --help");
    }
    if (i + 1 == argc)
      user_error(asked, "every flag has a value", word + " has none", "Put it after the flag");
    set_flag(word[1], argv[++i], command);
  }
  check_complete(command);
  if (command.targets.empty()) read_targets("host", command);  // for a stub, which needs no target
  return command;
}

void run(const CommandLine& command) {
  if (!command.runtime.empty()) run_runtime(command);
  if (!command.generator.empty()) run_generator(command);
}

namespace {

void check(const ExecuteGeneratorArgs& args) {
  if (args.output_dir.empty())
    user_error(asked, "output_dir names the folder of the files", "it is empty",
               "Set it, as to \".\"");
  if (args.output_types.empty())
    user_error(asked, "output_types names what to write", "it is empty", "Name one or more types");
  if (args.targets.empty())
    user_error(asked, "targets name what to compile for", "there is none",
               "Name one or more targets");
  if (!args.suffixes.empty() && args.suffixes.size() != args.targets.size()) {
    user_error(asked, "there is one suffix for each target",
               text("there are ", args.suffixes.size(), " for ", args.targets.size()),
               "Name as many, or none");
  }
  if (args.generator_name.empty() && args.runtime_name.empty()) {
    user_error(asked, "generator_name names the generator, or runtime_name a runtime",
               "both are empty", "Set one of them");
  }
}

}  // namespace

void execute_generator(const ExecuteGeneratorArgs& args) {
  check(args);
  CommandLine command;
  command.generator = args.generator_name;
  command.function = args.function_name;
  command.folder = args.output_dir;
  command.file_base = args.file_base_name;
  command.runtime = args.runtime_name;
  command.emit.assign(args.output_types.begin(), args.output_types.end());
  command.targets = args.targets;
  command.suffixes = args.suffixes;
  if (command.suffixes.empty()) {
    command.suffixes =
        ir::mapped(args.targets, [](const Target& target) { return target.to_string(); });
  }
  command.params = args.generator_params;
  if (args.build_mode == ExecuteGeneratorArgs::Gradient)
    command.gradient = CommandLine::Gradient::Whole;
  command.create = args.create_generator;
  if (args.log_outputs) command.log = &std::cout;
  run(command);
}

std::string usage() {
  return "usage: [-g GENERATOR] [-f FUNCTION] -o FOLDER [-n FILE_BASE] [-e TYPE,...] [-d "
         "0|1|separate]\n"
         "       [-p PLUGIN,...] [-s SCHEDULER] [-r RUNTIME] [-t SECONDS]\n"
         "       target=TARGET[,TARGET...] [param=value ...]\n"
         "  -g  the generator to run: " +
         names_of(GeneratorRegistry::enumerate()) +
         "\n"
         "  -f  name of the function; by default that of the generator\n"
         "  -n  name of its files without extension; by default that of the function\n"
         "  -e  files to write: " +
         names_of(emit_names()) +
         "\n"
         "      by default c_header, static_library and registration\n"
         "  -d  1: the gradient of the generator's outputs with respect to its images; separate: "
         "functions\n"
         "      that give it by all images and numbers, and by each of them alone\n"
         "  -p  shared libraries to load, with autoschedulers\n"
         "  -s  the scheduler that auto_schedule=true means\n"
         "  -r  write a runtime of this name\n"
         "  -t  give up after so many seconds; 0: never; by default 900\n";
}

static bool asks_for_help(int argc, const char* const* argv) {
  for (int i = 1; i < argc; i++) {
    if (std::string(argv[i]) == "--help" || std::string(argv[i]) == "-h") return true;
  }
  return argc <= 1;
}

// Makes glibc request memory in large pieces and keep it, since the process only compiles and exits. By default a
// thread's arena grows a page at a time, and glibc returns memory that is needed again soon.
static void expect_much_memory() {
#ifdef __GLIBC__
  constexpr int at_once_bytes = 8 << 20;
  mallopt(M_TOP_PAD, at_once_bytes);
#endif
}

int generate_filter_main(int argc, char** argv, std::ostream& errors) {
  expect_much_memory();
  try {
    if (asks_for_help(argc, argv)) {
      errors << usage();
      return argc <= 1 ? 1 : 0;
    }
    CommandLine command;
    try {
      command = prepare(argc, argv);
    } catch (const Error& error) {
      errors << "Error: " << error.what() << "\nRun it with --help for its usage.\n";
      return 1;
    }
    run(command);
    return 0;
  } catch (const std::exception& error) {
    errors << "Error: " << error.what() << "\n";
    return 1;
  }
}

int generate_filter_main(int argc, char** argv) {
  return generate_filter_main(argc, argv, std::cerr);
}

}  // namespace retrograde::internal
