// work_tree.h -- a lowered function as the work it does: its loops, and in each what it computes, loads and
// stores once an iteration.
//
// What does not change in a loop stands outside of it, and equal operations of one iteration once, as
// LLVM will have them. Products that are added count with the sum, as multiply-adds. Values that
// allocations of constant places hold are registers.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <unordered_set>
#include <vector>

#include "tuning/known_value.h"

namespace retrograde::tuning {

// Of vectors, each of the machine's width, but lanes and scalars.
struct Work {
  double operations = 0;  // sums, products, multiply-adds, comparisons, choices, conversions
  double divisions = 0, double_divisions = 0, roots = 0, double_roots = 0;
  double exps = 0, logs = 0, pows = 0, sines = 0;
  double loads = 0, stores = 0;
  double gather_lanes = 0, scatter_lanes = 0, shuffles = 0;
  double scalars = 0, scalar_divisions = 0;
  double chain = 0;         // multiply-adds of which each needs the one before
  double memory_chain = 0;  // and through memory

  // Everything but chains, which are taken as the longest.
  void add(const Work& other, double times = 1);
};

// What one load or store touches.
struct MemoryAccess {
  int buffer = 0;
  int stage = 0;
  bool is_store = false;
  bool in_parallel = false;
  double at = 0;               // bytes from the buffer's begin, in the middle of all loops
  double lane_bytes = 0;       // from its first byte to its last, where they lie together
  double lane_blocks = 1;      // else so many such pieces
  double data_range = 0;       // bytes that data choose from; 0: places do not depend on data
  uint64_t data_loops = 0;     // places of loops whose data do
  std::vector<double> slopes;  // bytes, by the place of the loop
};

struct WorkNode {
  enum class Kind : uint8_t { Root, Loop, Parallel, Branch };
  Kind kind = Kind::Root;
  std::string name;
  int parent = -1;
  size_t place = 0;    // in the nest
  double trips = 1;    // of a branch: how often it is taken
  double speedup = 1;  // by threads, with all parallel loops around it
  int stage = 0;
  std::map<int, Work> work;  // by stage, once an iteration
  std::vector<MemoryAccess> accesses;
  std::vector<int> children;
  bool is_loop() const { return kind == Kind::Loop || kind == Kind::Parallel; }
};

struct WorkTree {
  std::vector<WorkNode> nodes;  // the first is the root; parents before children
  std::vector<std::string>
      stages;  // Funcs as their produce nodes name them; the first is none of them
  struct Memory {
    std::string name;
    double bytes = 0;  // 0: not known
    bool is_allocated = false;
    double times = 1;  // allocated so often
  };
  std::vector<Memory> buffers;

  Work total() const;            // of the whole call
  double times(int node) const;  // iterations of all loops around it and of itself
};

struct TreeOptions {
  int vector_bytes = 16;
  int registers = 16;
  int threads = 1;
};

WorkTree work_tree(const LoweredFunction& function, const ProgramSizes& sizes,
                   const TreeOptions& options);

}  // namespace retrograde::tuning
