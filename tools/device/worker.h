// worker.h -- the checks that run on one device, which RETROGRADE_GPU selects for the process.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ir/target.h"
#include "records.h"

namespace device_check {

retrograde::Target target_for(int capability);

// The programs of test/support/gpu_programs: those that are named, or all if none are.
using Names = std::vector<std::string>;
void run_programs(const retrograde::Target& target, const Names& only, RecordWriter& records);

// Compiles every operator and node kind in every type to PTX for this chip and earlier ones, which the driver then
// compiles; for the simulated device, in one form only. Writes a record for each one that fits the time limit: the
// names of its kernels.
void compile_kernels(int capability, bool is_simulated, double seconds, RecordWriter& records);

// Runs the pipelines of test/differential/pipelines, which have every operator in every type, within the time limit.
void run_operators(const retrograde::Target& target, double seconds, RecordWriter& records);

// Runs random pipelines under random schedules, for `count` seeds beginning at `first`, within the time limit.
void run_random(const retrograde::Target& target, uint64_t first, int count, double seconds,
                RecordWriter& records);

struct Timings {
  bool is_small = false;  // small sizes, for tests
  double seconds = 60;
  Names only = {};
  // Time limit for one of `count` measurements; a test makes as few runs as possible.
  double share(int count) const { return is_small ? 0 : seconds / count; }
};
// Returns JSON: copy bandwidth, FMA rate, and each program's time relative to these limits.
std::string time_programs(const retrograde::Target& target, const Timings& options);

}  // namespace device_check
