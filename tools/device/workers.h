// workers.h -- the workers of gpu_check: this program, started once more for one part of the checks on one device.
#pragma once

#include <cstdint>
#include <future>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "arguments.h"
#include "child.h"
#include "records.h"

namespace device_check {

// A range of seeds of random pipelines.
struct Seeds {
  uint64_t first = 1;
  int count = 0;
};

// A worker's records, and how it ended.
struct Told {
  Ended ended;
  std::vector<Record> records;
};

class Workers {
 public:
  // `code_folder`: keeps the simulated device's machine code.
  Workers(const Arguments& arguments, int capability, std::string code_folder)
      : arguments_(arguments), capability_(capability), code_folder_(std::move(code_folder)) {}

  // The command that starts a worker, which writes its records to the file.
  std::vector<std::string> command(const std::string& part, const std::string& file, double seconds,
                                   const Seeds& seeds = {}) const;
  // The environment for the device under test: the GPU, or the simulated device with another thread order than in the
  // reference run.
  std::map<std::string, std::string> environment() const;
  // The environment for the reference run on the simulated device.
  static std::map<std::string, std::string> executor();
  // Splits the random pipelines among concurrent workers: half of the processors serve the device, half the simulated
  // device.
  std::vector<Seeds> shares() const;

  static std::future<Told> start(const std::vector<std::string>& command, const std::string& file,
                                 const std::map<std::string, std::string>& variables,
                                 double seconds);

 private:
  const Arguments& arguments_;
  const int capability_;
  const std::string code_folder_;
};

}  // namespace device_check
