// gpu_check -- checks an NVIDIA GPU against the simulated device.
//
//   gpu_check [--output FILE] [--seconds N]    checks the GPU of this machine
//   gpu_check --simulated                      runs the same checks on the simulated device, to test this program
//
//   --seconds N       approximate time limit (540; on the simulated device 10)
//   --random N        number of random pipelines under random schedules (2000; on the simulated device 5)
//   --first-seed N    seed of the first of them (1)
//   --only NAME       run only this program; may be repeated
//   --python PROGRAM  interpreter that may have PyTorch (python3)
//
// The checks are: the driver compiles kernels of every operator in every type. Results of the GPU and of the simulated
// device agree bit for bit, for pipelines of every operator (those of the differential tests), for the programs of
// test/support/gpu_programs, and for random ones. The programs run under compute-sanitizer, if it is installed. Their
// times are compared with the copy bandwidth and FMA rate measured in the same run, and with PyTorch, if it is
// installed. The results are written as JSON. It builds nothing and needs no network.
//
// Exit status: 0 all checks passed, 1 a check failed, 2 wrong arguments, 77 there is no GPU.
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <thread>

#include "child.h"
#include "device.h"
#include "records.h"
#include "worker.h"

namespace {

using namespace device_check;
using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr int problems_found = 1, wrong_arguments = 2, no_device = 77;

struct Arguments {
  std::string output, python = "python3";
  double seconds = -1;  // -1: the default, also for `random`
  int random = -1;
  uint64_t first_seed = 1;
  bool is_simulated = false;
  Names only;
  // Arguments for a worker, which this program starts itself.
  std::string worker, file;
  int capability = 75;
};

[[noreturn]] void usage(const std::string& problem) {
  std::cerr << "gpu_check: " << problem
            << "\nusage: gpu_check [--simulated] [--output FILE] [--seconds N] [--random N] "
               "[--first-seed N] [--only NAME]... [--python PROGRAM]\n";
  std::exit(wrong_arguments);
}

double number(const std::string& flag, const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end || !(value >= 0)) usage(flag + " needs a number, not \"" + text + "\"");
  return value;
}

Arguments arguments_of(int argc, char** argv) {
  Arguments result;
  for (int i = 1; i < argc; ++i) {
    const std::string flag = argv[i];
    if (flag == "--simulated") {
      result.is_simulated = true;
      continue;
    }
    if (i + 1 == argc) usage(flag + " is not a flag, or needs a value");
    const std::string value = argv[++i];
    if (flag == "--output")
      result.output = value;
    else if (flag == "--python")
      result.python = value;
    else if (flag == "--seconds")
      result.seconds = number(flag, value);
    else if (flag == "--random")
      result.random = static_cast<int>(number(flag, value));
    else if (flag == "--first-seed")
      result.first_seed = static_cast<uint64_t>(number(flag, value));
    else if (flag == "--only")
      result.only.push_back(value);
    else if (flag == "--worker")
      result.worker = value;
    else if (flag == "--file")
      result.file = value;
    else if (flag == "--capability")
      result.capability = static_cast<int>(number(flag, value));
    else
      usage("there is no flag " + flag);
  }
  if (result.random < 0) result.random = result.is_simulated ? 5 : 2000;
  if (result.seconds < 0) result.seconds = result.is_simulated ? 10 : 540;
  return result;
}

// ---- a worker: runs one part on the device that the environment selects ----

int work(const Arguments& arguments) {
  const retrograde::Target target = target_for(arguments.capability);
  try {
    if (arguments.worker == "times") {
      std::cout << time_programs(target,
                                 {arguments.is_simulated, arguments.seconds, arguments.only})
                << std::endl;
      return 0;
    }
    RecordWriter records(arguments.file);
    if (arguments.worker == "kernels")
      compile_kernels(arguments.capability, arguments.is_simulated, arguments.seconds, records);
    else if (arguments.worker == "programs")
      run_programs(target, arguments.only, records);
    else if (arguments.worker == "operators")
      run_operators(target, arguments.seconds, records);
    else if (arguments.worker == "random")
      run_random(target, arguments.first_seed, arguments.random, arguments.seconds, records);
    else
      usage("there is no worker " + arguments.worker);
    return records.is_good() ? 0 : problems_found;
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return problems_found;
  }
}

// ---- the checks ----

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "gpu_check.XXXXXX").string();
    if (!mkdtemp(name.data()))
      usage("no folder can be made in " + fs::temp_directory_path().string());
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code none;
    fs::remove_all(path_, none);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

// A range of seeds of random pipelines.
struct Seeds {
  uint64_t first = 1;
  int count = 0;
};

class Check {
 public:
  Check(const Arguments& arguments, const Device& device)
      : arguments_(arguments), device_(device), begin_(std::chrono::steady_clock::now()) {
    json_["device"] = {{"name", device.name},
                       {"compute_capability", device.capability / 10.0},
                       {"driver_version", device.driver_version},
                       {"simulated", arguments.is_simulated}};
  }

  // Returns the exit status.
  int run() {
    compile_kernels_there();
    compare_part("operators", 0.2);
    compare_part("programs", 1.0);
    compare_part("random", 0.35);
    sanitize();
    time();
    compare_with_torch();
    json_["problems"] = problems_;
    json_["passed"] = problems_.empty();
    json_["seconds"] = seconds_used();
    return problems_.empty() ? 0 : problems_found;
  }
  const Json& json() const { return json_; }

 private:
  const Arguments& arguments_;
  const Device& device_;
  const std::chrono::steady_clock::time_point begin_;
  const TemporaryFolder folder_;
  Json json_;
  std::vector<std::string> problems_;
  std::vector<Record> results_;  // of the programs, on the device

  double seconds_used() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  double seconds_left() const { return std::max(0.0, arguments_.seconds - seconds_used()); }
  void problem(const std::string& text) {
    std::cout << "  PROBLEM: " << text << std::endl;
    problems_.push_back(text);
  }

  // Splits the random pipelines among concurrent workers: half of the processors serve the device, half the simulated
  // device.
  std::vector<Seeds> shares() const {
    constexpr int most = 8;
    const int workers =
        std::clamp(static_cast<int>(std::thread::hardware_concurrency()) / 2, 1, most);
    std::vector<Seeds> all;
    uint64_t first = arguments_.first_seed;
    for (int i = 0, left = arguments_.random; i < workers && left > 0; ++i) {
      const int count = (left + workers - i - 1) / (workers - i);
      all.push_back({first, count});
      first += static_cast<uint64_t>(count);
      left -= count;
    }
    return all;
  }

  std::vector<std::string> worker(const std::string& part, const std::string& file, double seconds,
                                  const Seeds& seeds = {}) const {
    std::vector<std::string> words = {fs::read_symlink("/proc/self/exe").string(),
                                      "--worker",
                                      part,
                                      "--file",
                                      file,
                                      "--capability",
                                      std::to_string(device_.capability),
                                      "--seconds",
                                      std::to_string(seconds),
                                      "--random",
                                      std::to_string(seeds.count),
                                      "--first-seed",
                                      std::to_string(seeds.first)};
    for (const std::string& name : arguments_.only) words.insert(words.end(), {"--only", name});
    if (arguments_.is_simulated) words.push_back("--simulated");
    return words;
  }
  // The environment for the device under test: the GPU, or the simulated device with another thread order than in the
  // reference run.
  std::map<std::string, std::string> environment() const {
    if (!arguments_.is_simulated) return {{"RETROGRADE_GPU", "cuda"}};
    return {{"RETROGRADE_GPU", "simulated"},
            {"RETROGRADE_SIMT_ORDER", "random"},
            {"RETROGRADE_CACHE_DIR", folder_.file("code")}};
  }
  static std::map<std::string, std::string> executor() {
    return {{"RETROGRADE_GPU", "simulated"},
            {"RETROGRADE_SIMT_ORDER", "forward"},
            {"RETROGRADE_SIMT_FAIL", ""}};
  }

  void compile_kernels_there() {
    std::cout << "kernels: every operator in every type, by the driver" << std::endl;
    const double seconds = 0.2 * seconds_left();
    const std::string file = folder_.file("kernels");
    const Ended ended = run_child(worker("kernels", file, seconds), environment(), seconds + 60);
    if (!ended.succeeded())
      problem("the kernels of every operator end early, status " + std::to_string(ended.status) +
              ": " + ended.err);
    Json& told = json_["kernels"] = {{"modules", Json::array()}, {"compiled", 0}};
    for (const Record& record : read_records(file)) {
      if (record.state != Record::State::Done) {
        problem("every operator for " + record.name + ": " + record.bytes);
        continue;
      }
      told["modules"].push_back(record.name);
      told["compiled"] = told["compiled"].get<int64_t>() + std::ranges::count(record.bytes, '\n');
    }
    if (told["modules"].empty()) problem("no kernel of any operator was compiled");
    std::cout << "  " << told["compiled"] << " kernels in " << told["modules"].size() << " modules"
              << std::endl;
  }

  // A worker's records, and how it ended.
  struct Told {
    Ended ended;
    std::vector<Record> records;
  };
  std::future<Told> start(const std::vector<std::string>& words, const std::string& file,
                          const std::map<std::string, std::string>& variables, double seconds) {
    return std::async(std::launch::async, [=] {
      Ended ended = run_child(words, variables, seconds);
      return Told{std::move(ended), read_records(file)};
    });
  }
  // Collects all records; a worker that ended early is reported as a problem.
  std::vector<Record> records_of(const std::string& part, const std::string& where,
                                 std::vector<std::future<Told>>& workers) {
    std::vector<Record> all;
    for (std::future<Told>& worker : workers) {
      Told told = worker.get();
      std::ranges::move(told.records, std::back_inserter(all));
      if (told.ended.succeeded()) continue;
      problem(part + " end early on " + where +
              (told.ended.timed_out ? ", its time limit was reached" : "") + ", status " +
              std::to_string(told.ended.status) + ": " + told.ended.err);
    }
    return all;
  }

  void compare_part(const std::string& part, double share) {
    std::cout << part << ": on " << device_.name << " and on the executor" << std::endl;
    const double seconds = share * seconds_left(), grace = seconds + 20;
    std::vector<std::future<Told>> there, here;
    for (const Seeds& seeds : part == "random" ? shares() : std::vector<Seeds>{{}}) {
      const std::string number = std::to_string(seeds.first),
                        own = folder_.file(part + ".device" + number),
                        other = folder_.file(part + ".executor" + number);
      here.push_back(start(worker(part, other, seconds, seeds), other, executor(), grace));
      there.push_back(start(worker(part, own, seconds, seeds), own, environment(), grace));
    }
    std::vector<Record> own = records_of(part, "the device", there);
    const std::vector<Record> other = records_of(part, "the executor", here);
    const Agreement agreement = compare(own, other);
    for (const std::string& text : agreement.problems) problem(text);
    if (agreement.compared == 0) problem("nothing was compared in the part " + part);
    std::cout << "  " << agreement.compared << " compared bit for bit, " << agreement.refused
              << " refused by the compiler, " << agreement.problems.size() << " problems"
              << std::endl;
    json_[part] = {{"compared", agreement.compared},
                   {"refused", agreement.refused},
                   {"bytes", agreement.bytes},
                   {"problems", agreement.problems}};
    if (part == "random") json_[part]["first_seed"] = arguments_.first_seed;
    if (part == "programs") results_ = std::move(own);
  }

  void sanitize() {
    const std::string program =
        arguments_.is_simulated ? "" : find_program("compute-sanitizer", {"/usr/local/cuda/bin"});
    if (program.empty()) {
      json_["compute_sanitizer"] = "not installed";
      return;
    }
    for (const char* tool : {"memcheck", "racecheck", "synccheck", "initcheck"}) {
      std::cout << "programs: under compute-sanitizer's " << tool << std::endl;
      constexpr int found = 99;
      std::vector<std::string> words = {program, "--tool", tool, "--error-exitcode",
                                        std::to_string(found)};
      const std::vector<std::string> own = worker("programs", folder_.file(tool), seconds_left());
      words.insert(words.end(), own.begin(), own.end());
      const Ended ended = run_child(words, environment(), std::min(60.0, seconds_left() / 4));
      std::string verdict = ended.succeeded() ? "clean"
                            : ended.timed_out ? "time limit reached"
                                              : "findings";
      if (verdict == "findings")
        problem(std::string(tool) + ": " + ended.out.substr(0, 2000) + ended.err);
      json_["compute_sanitizer"][tool] = verdict;
    }
  }

  void time() {
    std::cout << "times" << std::endl;
    const double seconds = std::min(150.0, 0.6 * seconds_left());
    const Ended ended = run_child(worker("times", "", seconds), environment(), seconds + 60);
    json_["times"] = Json::parse(ended.out, nullptr, /*allow_exceptions=*/false);
    if (!ended.succeeded() || json_["times"].is_discarded()) {
      json_["times"] = nullptr;
      problem("the times were not taken, status " + std::to_string(ended.status) + ": " +
              ended.err);
      return;
    }
    std::printf("  copies %.4g GB/s, FMA %.4g GFLOP/s\n",
                json_["times"]["copy_gigabytes_per_second"].get<double>(),
                json_["times"]["fma_gigaflops"].get<double>());
    for (const Json& one : json_["times"]["programs"]) {
      if (one.contains("milliseconds"))
        std::printf("  %-18s %10.4g ms, %5.1f %% of what %s allows\n",
                    one["name"].get<std::string>().c_str(), one["milliseconds"].get<double>(),
                    100 * one["share_of_bound"].get<double>(),
                    one["bound_by"].get<std::string>().c_str());
    }
    std::fflush(stdout);
  }

  // Passes timings and results to the Python script, which returns its own times and the differences.
  void compare_with_torch() {
    constexpr double to_import_it = 3;
    if (arguments_.is_simulated && seconds_left() < to_import_it) {
      json_["pytorch"] = {{"not_run", "no time was left"}};
      return;
    }
    const fs::path script = fs::read_symlink("/proc/self/exe").parent_path().parent_path() /
                            "share" / "retrograde" / "gpu_check_torch.py";
    const std::string tasks = folder_.file("tasks.json");
    Json task = {
        {"device", arguments_.is_simulated ? "cpu" : "cuda"},
        {"seconds", arguments_.is_simulated ? 1.0 : std::min(60.0, seconds_left())},
        {"programs", json_["times"].is_object() ? json_["times"]["programs"] : Json::array()}};
    for (const Record& record : results_) {
      if (record.state != Record::State::Done) continue;
      const std::string file = folder_.file(record.name + ".raw");
      std::ofstream(file, std::ios::binary) << record.bytes;
      task["results"][record.name] = file;
    }
    std::ofstream(tasks) << task;
    std::cout << "PyTorch" << std::endl;
    const Ended ended =
        run_child({arguments_.python, script.string(), tasks}, {}, seconds_left() + 20);
    Json told = Json::parse(ended.out, nullptr, /*allow_exceptions=*/false);
    if (!ended.succeeded() || !told.is_object()) {
      json_["pytorch"] = nullptr;
      return problem("PyTorch's script ended with status " + std::to_string(ended.status) + ": " +
                     ended.err);
    }
    if (told.contains("not_installed")) std::cout << "  not installed" << std::endl;
    const Json programs = told.value("programs", Json::object());
    for (const auto& [name, one] : programs.items()) {
      // PyTorch sums in another order.
      constexpr double allowed = 1e-4;
      const double difference = one.value("largest_difference", 0.0);
      if (!(difference <= allowed))
        problem(name + " differs from PyTorch's by " + std::to_string(difference));
      if (one.contains("milliseconds"))
        std::printf("  %-18s %10.4g ms\n", name.c_str(), one["milliseconds"].get<double>());
    }
    std::fflush(stdout);
    json_["pytorch"] = told;
  }
};

// Checked first, because the run takes minutes.
void check_writable(const std::string& path) {
  if (path.empty()) return;
  const fs::path folder = fs::absolute(path).parent_path();
  if (fs::is_directory(path) || access(folder.c_str(), W_OK) != 0)
    usage("\"" + path + "\" cannot be written");
}

int check(const Arguments& arguments) {
  Device device = {"the simulated device", 90, 0, ""};
  if (!arguments.is_simulated) device = find_device();
  if (!device.why_none.empty()) {
    std::cerr << "gpu_check: there is no NVIDIA GPU to check: " << device.why_none
              << ". --simulated checks the simulated device.\n";
    return no_device;
  }
  check_writable(arguments.output);
  std::cout << "gpu_check on " << device.name << std::endl;
  Check all(arguments, device);
  const int status = all.run();
  if (!arguments.output.empty()) {
    std::ofstream file(arguments.output);
    file << all.json().dump(2) << "\n";
    if (!file.good()) usage("\"" + arguments.output + "\" cannot be written");
    std::cout << "written to " << arguments.output << std::endl;
  }
  std::cout << (status == 0 ? "all is well" : "there are problems") << std::endl;
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = arguments_of(argc, argv);
  return arguments.worker.empty() ? check(arguments) : work(arguments);
}
