#include "check.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>

namespace device_check {

namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "gpu_check.XXXXXX").string();
  if (!mkdtemp(name.data()))
    usage("no folder can be made in " + fs::temp_directory_path().string());
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code none;
  fs::remove_all(path_, none);
}

Check::Check(const Arguments& arguments, const Device& device)
    : arguments_(arguments),
      device_(device),
      begin_(std::chrono::steady_clock::now()),
      workers_(arguments, device.capability, folder_.file("code")) {
  json_["device"] = {{"name", device.name},
                     {"compute_capability", device.capability / 10.0},
                     {"driver_version", device.driver_version},
                     {"simulated", arguments.is_simulated}};
}

int Check::run() {
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

double Check::seconds_used() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

double Check::seconds_left() const { return std::max(0.0, arguments_.seconds - seconds_used()); }

void Check::problem(const std::string& text) {
  std::cout << "  PROBLEM: " << text << std::endl;
  problems_.push_back(text);
}

void Check::compile_kernels_there() {
  std::cout << "kernels: every operator in every type, by the driver" << std::endl;
  const double seconds = 0.2 * seconds_left();
  const std::string file = folder_.file("kernels");
  const Ended ended =
      run_child(workers_.command("kernels", file, seconds), workers_.environment(), seconds + 60);
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

std::vector<Record> Check::records_of(const std::string& part, const std::string& where,
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

void Check::compare_part(const std::string& part, double share) {
  std::cout << part << ": on " << device_.name << " and on the executor" << std::endl;
  const double seconds = share * seconds_left(), grace = seconds + 20;
  std::vector<std::future<Told>> there, here;
  for (const Seeds& seeds : part == "random" ? workers_.shares() : std::vector<Seeds>{{}}) {
    const std::string number = std::to_string(seeds.first),
                      own = folder_.file(part + ".device" + number),
                      other = folder_.file(part + ".executor" + number);
    here.push_back(Workers::start(workers_.command(part, other, seconds, seeds), other,
                                  Workers::executor(), grace));
    there.push_back(Workers::start(workers_.command(part, own, seconds, seeds), own,
                                   workers_.environment(), grace));
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

void Check::sanitize() {
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
    const std::vector<std::string> own =
        workers_.command("programs", folder_.file(tool), seconds_left());
    words.insert(words.end(), own.begin(), own.end());
    const Ended ended =
        run_child(words, workers_.environment(), std::min(60.0, seconds_left() / 4));
    std::string verdict = ended.succeeded() ? "clean"
                          : ended.timed_out ? "time limit reached"
                                            : "findings";
    if (verdict == "findings")
      problem(std::string(tool) + ": " + ended.out.substr(0, 2000) + ended.err);
    json_["compute_sanitizer"][tool] = verdict;
  }
}

void Check::time() {
  std::cout << "times" << std::endl;
  const double seconds = std::min(150.0, 0.6 * seconds_left());
  const Ended ended =
      run_child(workers_.command("times", "", seconds), workers_.environment(), seconds + 60);
  json_["times"] = Json::parse(ended.out, nullptr, /*allow_exceptions=*/false);
  if (!ended.succeeded() || json_["times"].is_discarded()) {
    json_["times"] = nullptr;
    problem("the times were not taken, status " + std::to_string(ended.status) + ": " + ended.err);
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

void Check::compare_with_torch() {
  constexpr double to_import_it = 3;
  if (arguments_.is_simulated && seconds_left() < to_import_it) {
    json_["pytorch"] = {{"not_run", "no time was left"}};
    return;
  }
  const fs::path script = fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "share" /
                          "retrograde" / "gpu_check_torch.py";
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

}  // namespace device_check
