// check.h -- all checks of one device, each of which adds to the report.
#pragma once

#include <chrono>
#include <filesystem>
#include <future>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "arguments.h"
#include "device.h"
#include "records.h"
#include "workers.h"

namespace device_check {

using Json = nlohmann::json;

class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

class Check {
 public:
  Check(const Arguments& arguments, const Device& device);
  // Returns the exit status.
  int run();
  const Json& json() const { return json_; }

 private:
  double seconds_used() const;
  double seconds_left() const;
  void problem(const std::string& text);
  // Collects all records; a worker that ended early is reported as a problem.
  std::vector<Record> records_of(const std::string& part, const std::string& where,
                                 std::vector<std::future<Told>>& workers);

  void compile_kernels_there();
  void compare_part(const std::string& part, double share);
  void sanitize();
  void time();
  // Passes timings and results to the Python script, which returns its own times and the differences.
  void compare_with_torch();

  const Arguments& arguments_;
  const Device& device_;
  const std::chrono::steady_clock::time_point begin_;
  const TemporaryFolder folder_;
  const Workers workers_;
  Json json_;
  std::vector<std::string> problems_;
  std::vector<Record> results_;  // of the programs, on the device
};

}  // namespace device_check
