#include <algorithm>
#include <cmath>
#include <thread>

#include "autoschedule/machine/machine.h"
#include "ir/vector_bytes.h"

namespace retrograde::planning {

namespace {

int64_t whole_bytes(double bytes) {
  return bytes >= static_cast<double>(INT64_MAX) ? INT64_MAX : static_cast<int64_t>(bytes);
}

}  // namespace

Machine constants_for(const Target& target, int threads) {
  Machine machine;
  machine.threads =
      threads > 0 ? threads : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  machine.vector_bytes = ir::vector_bytes(target);
  machine.registers = machine.vector_bytes >= 64 || target.arch == Target::ARM ? 32 : 16;
  const double count = machine.threads, width = machine.vector_bytes;
  machine.levels = {Machine::Level{"L1", first_cache_bytes, 4 * width, 4 * width * count},
                    Machine::Level{"L2", second_cache_bytes, 1.6 * width, 1.6 * width * count},
                    Machine::Level{"L3", third_cache_bytes, 60, 60 * count},
                    Machine::Level{"memory", 1e15, 25, std::min(25 * count, 80.0)}};
  return machine;
}

Machine reference_machine(const Target& target) {
  Machine machine = constants_for(target, reference_threads);
  // Schedules use 32 registers only if the target names AVX512 itself. The newer features imply it, but a target that
  // names only these, as "avx512_skylake", keeps the schedules for 16.
  const bool has_many = target.arch == Target::ARM || target.has_feature(Target::AVX512);
  machine.registers = has_many ? 32 : 16;
  return machine;
}

int64_t Machine::enough_tasks() const {
  const int count = std::max(threads, reference_threads);
  return std::max<int64_t>(static_cast<int64_t>(parallel_tasks * count), 1);
}

int64_t Machine::many_tasks() const {
  return std::max(enough_tasks(), int64_t{threads_of_large_machines});
}

int64_t Machine::accumulator_bytes() const {
  return static_cast<int64_t>(accumulator_share * registers * vector_bytes);
}

int64_t Machine::near_cache_bytes() const { return whole_bytes(levels[near_cache].bytes); }
int64_t Machine::last_cache_bytes() const { return whole_bytes(levels[last_cache].bytes); }
int64_t Machine::task_bytes() const { return near_cache_bytes() / 8 * 3; }

}  // namespace retrograde::planning
