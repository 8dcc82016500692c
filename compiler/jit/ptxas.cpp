#include "jit/ptxas.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <vector>

extern "C" char** environ;

namespace retrograde::jit {
namespace {

namespace fs = std::filesystem;

bool is_program(const fs::path& path) {
  return access(path.c_str(), X_OK) == 0 && !fs::is_directory(path);
}

// A folder that is deleted with its contents on destruction. Its path is empty if it could not be made.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::error_code none;
    std::string name = (fs::temp_directory_path(none) / "retrograde-ptxas.XXXXXX").string();
    if (mkdtemp(name.data())) path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code none;
    if (!path_.empty()) fs::remove_all(path_, none);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  bool exists() const { return !path_.empty(); }
  std::string file(const char* name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

std::string read_to_end(int fd) {
  std::string text;
  std::array<char, 4096> part;
  while (true) {
    const ssize_t got = read(fd, part.data(), part.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return text;
    text.append(part.data(), static_cast<size_t>(got));
  }
}

struct Run {
  bool succeeded = false;
  std::string told;  // output on both streams
};

// Runs without a shell, because names may contain any character.
Run run(std::vector<std::string> words) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return {false, "no pipe could be made"};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
  posix_spawn_file_actions_adddup2(&actions, ends[1], 2);
  pid_t child = 0;
  const int error = posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  Run result;
  result.told = read_to_end(ends[0]);
  close(ends[0]);
  if (error != 0) return {false, words[0] + " cannot be started"};
  int status = 0;
  while (waitpid(child, &status, 0) < 0) {
    if (errno != EINTR) return result;
  }
  result.succeeded = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  return result;
}

std::string contents_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  return bytes.str();
}

}  // namespace

std::string find_ptxas() {
  if (const char* named = std::getenv("RETROGRADE_PTXAS")) return is_program(named) ? named : "";
  std::vector<fs::path> folders;
  if (const char* path = std::getenv("PATH")) {
    std::istringstream list(path);
    for (std::string folder; std::getline(list, folder, ':');) {
      if (!folder.empty()) folders.emplace_back(folder);
    }
  }
  if (const char* home = std::getenv("CUDA_HOME")) folders.push_back(fs::path(home) / "bin");
  folders.emplace_back("/usr/local/cuda/bin");
  for (const fs::path& folder : folders) {
    if (is_program(folder / "ptxas")) return (folder / "ptxas").string();
  }
  return "";
}

std::string ptxas_version(const std::string& program) {
  if (program.empty()) return "";
  const Run said = run({program, "--version"});
  static const std::regex version(R"(V(\d+\.\d+\.\d+))");
  std::smatch found;
  return said.succeeded && std::regex_search(said.told, found, version) ? found[1].str() : "";
}

// ptxas info    : Function properties for kernel_f_0
//     64 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads
// ptxas info    : Used 12 registers, used 0 barriers, 64 bytes cumulative stack size, 380 bytes cmem[0]
std::map<std::string, KernelFigures> figures_in(const std::string& told) {
  static const std::regex name(R"(Function properties for (\S+))"),
      stack(R"((\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads)"),
      registers(R"(Used (\d+) registers)"), cumulative(R"((\d+) bytes cumulative stack size)");
  std::map<std::string, KernelFigures> kernels;
  KernelFigures* own = nullptr;
  std::istringstream lines(told);
  std::smatch found;
  for (std::string line; std::getline(lines, line);) {
    if (std::regex_search(line, found, name)) own = &kernels[found[1].str()];
    if (!own) continue;
    if (std::regex_search(line, found, stack)) {
      own->stack_bytes = std::stoll(found[1].str());
      own->spill_store_bytes = std::stoll(found[2].str());
      own->spill_load_bytes = std::stoll(found[3].str());
    }
    if (std::regex_search(line, found, registers)) own->registers = std::stoi(found[1].str());
    if (std::regex_search(line, found, cumulative))
      own->stack_bytes = std::max<int64_t>(own->stack_bytes, std::stoll(found[1].str()));
  }
  return kernels;
}

int assembled_capability(int capability) { return std::max(capability, 75); }

Assembly assemble(const std::string& program, const std::string& ptx, int capability) {
  const TemporaryFolder folder;
  Assembly result;
  if (!folder.exists()) {
    result.problem = "no folder for temporary files could be made";
    return result;
  }
  const std::string source = folder.file("kernels.ptx"), image = folder.file("kernels.cubin");
  std::ofstream(source, std::ios::binary) << ptx;
  const Run assembled = run({program, "--verbose", "--gpu-name",
                             "sm_" + std::to_string(assembled_capability(capability)),
                             "--output-file", image, source});
  if (assembled.succeeded) result.image = contents_of(image);
  if (result.image.empty()) {
    result.problem = assembled.told.empty() ? "it wrote no machine code" : assembled.told;
    return result;
  }
  result.kernels = figures_in(assembled.told);
  return result;
}

}  // namespace retrograde::jit
