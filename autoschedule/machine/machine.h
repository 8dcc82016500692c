// machine.h -- the description of a processor: vectors, caches, threads, and the cost of operations, bytes and launches.
//
// Schedules are chosen for constants (`reference_machine`, changed by what a user says), so that a program has the same
// schedule on every processor. The cost model uses measured figures where there are any (kept_machine.h). They describe
// a kind of processor, never a program. `tune --machine` measures them; compiling a program never does.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "autoschedule/machine/reference.h"
#include "ir/target.h"

namespace retrograde::planning {

// The default is the reference machine: AVX-512 and two threads.
struct Machine {
  // A cache, or memory: its size and the bytes per nanosecond that stream from it, to one thread and to all together.
  struct Level {
    std::string name;
    double bytes = 0;
    double one_thread = 1, all_threads = 1;  // bytes per ns
    friend bool operator==(const Level&, const Level&) = default;
  };
  static constexpr size_t level_count = 4;
  static constexpr size_t near_cache = 1, last_cache = 2;  // of the levels

  std::string name = "constants";  // of the processor; "constants" if nothing was measured
  int threads = reference_threads;
  int vector_bytes = 64;
  int registers = 32;  // of vectors
  // "L1", "L2", "L3", "memory". The last is never full.
  std::array<Level, level_count> levels = {Level{"L1", first_cache_bytes, 256, 512},
                                           Level{"L2", second_cache_bytes, 1.6 * 64, 1.6 * 64 * 2},
                                           Level{"L3", third_cache_bytes, 60, 120},
                                           Level{"memory", 1e15, 25, 50}};

  // Nanoseconds of one thread per vector, for many independent operations. The constants are figures of `tune --machine`
  // on servers of 2023, rounded.
  double operation_ns = 0.25;  // sum, product, multiply-add, comparison, choice, conversion
  double divide_ns = 1.8, divide_double_ns = 3;
  double sqrt_ns = 2.5, sqrt_double_ns = 4.5;
  double exp_ns = 6, log_ns = 10, pow_ns = 25, sin_ns = 12;
  double load_ns = 0.35, store_ns = 0.7;
  double gather_lane_ns = 0.3;  // one lane of a gather
  double scatter_lane_ns = 0.4;
  double shuffle_ns = 0.45;
  double scalar_ns = 0.12;         // a scalar operation
  double scalar_divide_ns = 2;     // an integer division
  double latency_ns = 1.1;         // from one multiply-add to the next that depends on it
  double memory_latency_ns = 3.5;  // from a sum in memory to the next that adds to it
  double iteration_ns = 0.4;       // loop overhead
  double launch_ns = 4000;         // of a parallel loop
  double page_ns = 500;            // the first touch of a page of memory

  // Proportions from which the limits below follow. A search of schedules scales them.
  double accumulator_share = 0.75;  // of the registers: they hold sums, the others hold operands
  double parallel_tasks = tasks_per_thread;  // iterations of parallel loops per thread

  // ---- Limits ----

  // Iterations of parallel loops that keep all threads busy. Schedules for one thread have the tasks of the reference
  // threads.
  int64_t enough_tasks() const;
  // The same for the threads of large machines, where finer tasks cost nothing but their calls.
  int64_t many_tasks() const;
  // Bytes of the registers that hold sums.
  int64_t accumulator_bytes() const;
  // The second cache: data below this size stay near a core from one loop to the next.
  int64_t near_cache_bytes() const;
  // The last cache: larger data come from memory.
  int64_t last_cache_bytes() const;
  // The result of one parallel task: it stays in the second cache beside its operands.
  int64_t task_bytes() const;

  std::string to_string() const;  // a table
  std::string to_json() const;
  // Requires: a description of a machine is JSON with a number for each figure.
  static Machine from_json(const std::string& text, const std::string& where);
  friend bool operator==(const Machine&, const Machine&) = default;
};

// Constants that are right within a factor of two or three for the vectors of the target. `threads`: 0 means those of
// the processor that runs this code.
Machine constants_for(const Target& target, int threads = 0);
// The machine that schedules are chosen for: the same with the reference threads. It depends on the target alone.
Machine reference_machine(const Target& target);

}  // namespace retrograde::planning
