// worker.h -- what runs on one device, which the process's RETROGRADE_GPU chooses.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ir/target.h"
#include "records.h"

namespace device_check {

retrograde::Target target_for(int capability);

// The programs of test/support/gpu_programs: these, or all where none is named.
using Names = std::vector<std::string>;
void run_programs(const retrograde::Target& target, const Names& only, RecordWriter& records);

// Every operator and kind of node in every type, as PTX for this chip and those before it, which the driver
// compiles; for the simulated device in one form alone. A record for each that the seconds suffice for: the
// names of its kernels.
void compile_kernels(int capability, bool is_simulated, double seconds, RecordWriter& records);

// The pipelines of test/differential/pipelines, which have every operator in every type, as far as the seconds
// suffice.
void run_operators(const retrograde::Target& target, double seconds, RecordWriter& records);

// Random pipelines under random schedules, of `count` seeds from `first` on, as far as the seconds suffice.
void run_random(const retrograde::Target& target, uint64_t first, int count, double seconds,
                RecordWriter& records);

struct Timings {
  bool is_small = false;  // as a test has them
  double seconds = 60;
  Names only = {};
  // Seconds of one of so many; a test takes the fewest runs.
  double share(int count) const { return is_small ? 0 : seconds / count; }
};
// JSON: bandwidth of copies, rate of FMA, the time of each program beside what these allow.
std::string time_programs(const retrograde::Target& target, const Timings& options);

}  // namespace device_check
