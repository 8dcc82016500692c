// tune -- measures this machine for the cost model, and measures schedules.
//
//   tune --machine                   measures the machine's figures, prints them, keeps them in the user's cache
//   tune --show                      prints the figures in use: measured ones, or constants
//   tune PROGRAM.graph...            measures the schedules that a search finds for programs in text form
//                                    (graph/graph.h), on inputs of estimated sizes
//   tune ... -- COMMAND ARGS...      for everything that a command compiles or schedules while it runs
//   tune --fit                       fits the figures to the measurements, keeps them
//
//   --seconds N        for each program (60)        --each N      seconds that each schedule runs (0.5)
//   --limit N          schedules of each program    --threads N
//   --output PATH      with --machine or --fit a file for RETROGRADE_MACHINE to name; else a folder
//                      for the best schedules: NAME.schedule as a log, NAME.cpp as C++
//   --database FILE    default: measured.sqlite in the user's cache folder
//
// An interrupted run can be continued: schedules that are in the database are not measured again.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "autoschedule/machine/kept_machine.h"
#include "database.h"
#include "diagnostics/error.h"
#include "fit_database.h"
#include "tune_program.h"
#include "tuning/calibrate.h"
#include "tuning/keep_machine.h"

namespace {

using namespace retrograde;

struct CommandLine {
  bool calibrates = false, shows = false, fits = false;
  std::string database;
  tune::Options options;
  std::vector<std::string> files;
  std::vector<char*> command;  // the words after "--", null-terminated

  bool is_valid() const {
    const bool tunes = !files.empty() || !command.empty();
    return calibrates + shows + fits + tunes == 1;
  }
};

int usage() {
  std::cerr << "usage: tune --machine [--output FILE] | --show\n"
               "       tune [--seconds N] [--each N] [--limit N] [--threads N] [--output FOLDER] "
               "[--database FILE] PROGRAM.graph... | -- COMMAND ARGS...\n"
               "       tune --fit [--threads N] [--output FILE] [--database FILE]\n";
  return 2;
}

std::optional<double> number(const char* text) {
  char* end = nullptr;
  const double value = std::strtod(text, &end);
  if (end == text || *end != '\0' || value < 0) return std::nullopt;
  return value;
}

// Reads an option and its value; false if there is no such option.
bool read_value(const std::string& name, const char* value, CommandLine& line) {
  if (name == "--output") return line.options.output = value, true;
  if (name == "--database") return line.database = value, true;
  const auto found = number(value);
  if (!found) return false;
  if (name == "--seconds") return line.options.seconds = *found, true;
  if (name == "--each") return line.options.run_seconds = *found, true;
  if (name == "--limit") return line.options.limit = static_cast<int>(*found), true;
  if (name == "--threads") return line.options.threads = static_cast<int>(*found), true;
  return false;
}

std::optional<CommandLine> parse(int argc, char** argv) {
  CommandLine line;
  for (int i = 1; i < argc; i++) {
    const std::string arg = argv[i];
    if (arg == "--") {
      line.command.assign(argv + i + 1, argv + argc);
      if (!line.command.empty()) line.command.push_back(nullptr);
      break;
    }
    if (arg == "--machine") {
      line.calibrates = true;
    } else if (arg == "--show") {
      line.shows = true;
    } else if (arg == "--fit") {
      line.fits = true;
    } else if (!arg.starts_with("--")) {
      line.files.push_back(arg);
    } else if (i + 1 == argc || !read_value(arg, argv[i + 1], line)) {
      return std::nullopt;
    } else {
      i++;
    }
  }
  return line.is_valid() ? std::optional(line) : std::nullopt;
}

void keep(const planning::Machine& machine, const std::string& output) {
  if (output.empty()) {
    std::cout << "kept in " << tuning::keep_machine(machine) << "\n";
    return;
  }
  std::ofstream out(output);
  out << machine.to_json();
  if (!out.flush())
    user_error("write " + retrograde::quoted(output), "the file must be writable",
               "writing it failed", "Name another one");
  std::cout << "written to " << output << "\n";
}

std::string database_of(const CommandLine& line) {
  if (!line.database.empty()) return line.database;
  const std::string folder = planning::cache_folder();
  if (folder.empty())
    user_error("keep measurements", "there is a cache folder, or a file is named",
               "neither XDG_CACHE_HOME nor HOME is set", "Name one: --database FILE");
  std::filesystem::create_directories(folder);
  return folder + "/measured.sqlite";
}

std::string contents_of(const std::string& path) {
  std::ifstream in(path);
  if (!in) user_error("read " + retrograde::quoted(path), "the file must exist and be readable");
  return {std::istreambuf_iterator<char>(in), {}};
}

// A temporary folder that is deleted on destruction.
class Folder {
 public:
  Folder() {
    if (!mkdtemp(path_)) user_error("make a folder in /tmp", "tune keeps the programs there");
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  const char* path() const { return path_; }

 private:
  char path_[32] = "/tmp/retrograde_tune_XXXXXX";
};

// Writes everything that the command compiles or schedules to files in the folder.
void run_command(const std::vector<char*>& command, const char* folder) {
  const pid_t child = fork();
  if (child == 0) {
    setenv("RETROGRADE_GRAPHS", folder, 1);
    execvp(command[0], command.data());
    std::perror(command[0]);
    _exit(127);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child)
    user_error("run " + retrograde::quoted(command[0]), "the system must start it");
}

void tune_files(const CommandLine& line, std::vector<std::string> files) {
  tune::Database database(database_of(line));
  std::sort(files.begin(), files.end());
  for (const std::string& file : files)
    tune::tune_program(std::filesystem::path(file).stem(), contents_of(file), line.options,
                       database, std::cout);
}

void tune_command(const CommandLine& line) {
  const Folder folder;
  run_command(line.command, folder.path());
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    if (entry.path().extension() == ".graph") files.push_back(entry.path());
  }
  if (files.empty())
    user_error("tune what " + retrograde::quoted(line.command[0]) + " compiles",
               "it compiles a gradient, or calls auto_schedule()", "it did neither",
               "Call auto_schedule() in it");
  tune_files(line, files);
}

void run(const CommandLine& line) {
  if (line.shows) {
    std::cout << planning::machine_for(get_jit_target_from_environment()).to_string();
  } else if (line.calibrates) {
    const planning::Machine machine = tuning::calibrate(get_jit_target_from_environment());
    std::cout << machine.to_string();
    keep(machine, line.options.output);
  } else if (line.fits) {
    tune::Database database(database_of(line));
    keep(tune::fit_database(database, tune::threads_of(line.options), std::cout),
         line.options.output);
  } else if (!line.command.empty()) {
    tune_command(line);
  } else {
    tune_files(line, line.files);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto line = parse(argc, argv);
  if (!line) return usage();
  try {
    run(*line);
    return 0;
  } catch (const std::exception& error) {
    std::cerr << "tune: " << error.what() << "\n";
    return 1;
  }
}
