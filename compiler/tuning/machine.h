// machine.h -- the machine as the cost model sees it: what an operation, a byte and a launch cost.
//
// The figures are of one kind of machine, never of a program. They are measured when somebody asks for
// it (calibrate.h, `tune --machine`), which takes a few seconds, and kept in the user's cache
// folder. Where nothing was measured, constants stand for the target's vector width: compiling a
// program never starts to measure.
#pragma once

#include <array>
#include <string>

#include "ir/target.h"

namespace retrograde::tuning {

struct Machine {
  // A cache, or memory: what it holds, and how many bytes a nanosecond come from it when all that is
  // read or written streams through it; of one thread, and of all together.
  struct Level {
    std::string name;
    double bytes = 0;
    double one_thread = 1, all_threads = 1;  // bytes per ns
    friend bool operator==(const Level&, const Level&) = default;
  };
  static constexpr size_t level_count = 4;

  std::string name = "constants";  // of the processor, or that nobody measured
  int threads = 1;
  int vector_bytes = 16;
  int registers = 16;  // of vectors
  // "L1", "L2", "L3", "memory". The last holds everything.
  std::array<Level, level_count> levels;

  // Nanoseconds of one thread for a vector, of many that do not wait for each other.
  double operation_ns = 0.2;  // sum, product, multiply-add, comparison, choice, conversion
  double divide_ns = 2, divide_double_ns = 4;
  double sqrt_ns = 2, sqrt_double_ns = 4;
  double exp_ns = 4, log_ns = 5, pow_ns = 20, sin_ns = 6;
  double load_ns = 0.2, store_ns = 0.35;
  double gather_lane_ns = 0.35;  // of an element that a vector takes from anywhere
  double scatter_lane_ns = 0.5;
  double shuffle_ns = 0.3;
  double scalar_ns = 0.1;          // of a scalar operation
  double scalar_divide_ns = 4;     // of integers
  double latency_ns = 1.3;         // from one multiply-add to the next that needs it
  double memory_latency_ns = 2.5;  // from a sum in memory to the next that adds to it
  double iteration_ns = 0.3;       // of a loop, beside what it does
  double launch_ns = 5000;         // of a parallel loop
  double page_ns = 250;            // the first touch of a page of memory

  std::string to_string() const;  // a table
  std::string to_json() const;
  // Requires: a description of a machine is JSON with a number for each figure.
  static Machine from_json(const std::string& text, const std::string& where);
  friend bool operator==(const Machine&, const Machine&) = default;
};

// Constants that are right within a factor of two or three, for the vectors of the target.
Machine constants_for(const Target& target);

// What describes the machine: the file that RETROGRADE_MACHINE names, else what was measured for this
// processor, else the constants. What is kept in the cache folder and cannot be read counts as not
// there.
// Requires: RETROGRADE_MACHINE names a file with the description of a machine.
Machine machine_for(const Target& target);

// Keeps it for this processor, whole or not at all; gives the file's path.
// Requires: the cache folder can be written.
std::string keep_machine(const Machine& machine);
// Where: $XDG_CACHE_HOME/retrograde, else ~/.cache/retrograde; empty
// where there is none.
std::string cache_folder();
std::string processor_name();

}  // namespace retrograde::tuning
