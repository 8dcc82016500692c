// kernel.h -- the data structure and the steps that turn loops over blocks and threads into a kernel.
//
// The steps, in the order in which make_kernels.cpp runs them, each in the file of its name:
//
//   find_grid         the loops over blocks become the grid
//   choose_threads    chooses the number of threads of a block per dimension, and the memory of each allocation
//   privatize         moves storage of which each thread uses its own elements into that thread's registers
//   place_shared      assigns offsets in the block's shared memory to the other storage
//   insert_barriers   inserts barriers between stores of one thread and accesses of another
//   place_heap        assigns each block or thread its part of device memory
//   map_threads       replaces the loops over threads by the work of one thread
//
// Loops over threads stay loops until the last step. A loop's dimension is the number of loops over threads nested in
// it: the innermost one is x.
#pragma once

#include <array>
#include <string>
#include <unordered_map>
#include <vector>

#include "ir/build.h"
#include "ir/expr.h"

namespace retrograde::lower {

constexpr int warp_threads = 32;  // consecutive threads; x varies fastest

struct Kernel {
  std::string name;
  std::vector<Expr> blocks;              // x, y, z
  std::vector<int> threads = {1, 1, 1};  // x, y, z; see choose_threads
  Expr shared_bytes = 0;
  struct Heap {  // device memory for all blocks together
    std::string name;
    Type type;
    Expr elements;
  };
  std::vector<Heap> heap;
  Stmt body;
};

// Whether the statement contains loops over threads.
bool has_threads(const Stmt& s);
// The maximum nesting depth of loops over threads in the statement.
int thread_depth(const Stmt& s);

// In: a nest of loops over blocks, the outermost of which is `outermost`. UserError if a loop is not directly inside
// the next outer one or depends on it, or if there are more than three.
Kernel find_grid(const std::string& name, const For& outermost);

// UserError for blocks of more than 1,024 threads, for sizes that depend on data, and for storage between loops over
// threads or in an unsuitable memory. Afterwards the memory of each allocation is Stack (private to a thread),
// GPUShared, Register (of a block, to be privatised), Heap, or Auto (of a block).
void choose_threads(Kernel& kernel);

// UserError for storage in registers if a thread reads elements that another thread stored.
void privatize(Kernel& kernel);

// `limit_bytes`: the shared memory that a block can have on the device; UserError beyond it. Auto storage becomes
// shared memory while some is left, then Heap.
void place_shared(Kernel& kernel, int limit_bytes);

void insert_barriers(Kernel& kernel);

void place_heap(Kernel& kernel);

void map_threads(Kernel& kernel);

}  // namespace retrograde::lower
