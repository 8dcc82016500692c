// kernel.h -- a kernel on its way from loops over blocks and threads to what each thread does.
//
// The steps, in the order of make_kernels.cpp, each in the file of its name:
//
//   find_grid         the loops over blocks become the grid
//   choose_threads    how many threads a block has in each dimension; where storage lies
//   privatize         what threads keep to themselves moves into their registers
//   place_shared      where in the block's shared memory the rest lies
//   insert_barriers   between what one thread stores and another reads
//   place_heap        where a block's or a thread's part of device memory lies
//   map_threads       loops over threads become what a thread does
//
// Until the last, loops over threads are loops. One such loop is of the dimension that counts the
// loops over threads in it: the innermost is x.
#pragma once

#include <array>
#include <string>
#include <unordered_map>
#include <vector>

#include "ir/build.h"
#include "ir/expr.h"

namespace retrograde::lower {

constexpr int warp_threads = 32;  // x innermost

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

// Whether loops over threads are in the statement.
bool has_threads(const Stmt& s);
// The most loops over threads that lie in each other in it.
int thread_depth(const Stmt& s);

// In: loops over blocks, the outermost of which is `outermost`. UserError where one is not directly in
// the other, or depends on it; or for more than three.
Kernel find_grid(const std::string& name, const For& outermost);

// UserError for blocks of more than 1,024 threads, of sizes that depend on data, and for storage between
// loops over threads or of the wrong memory. Afterwards each allocation is of memory Stack (a thread's
// own), GPUShared, Register (a block's, to be privatized), Heap, or Auto (a block's).
void choose_threads(Kernel& kernel);

// UserError for storage in registers of which a thread reads what another one stores.
void privatize(Kernel& kernel);

// `limit_bytes`: what a block can have on the device. UserError beyond it. Auto is shared memory while there
// is some left, else Heap.
void place_shared(Kernel& kernel, int limit_bytes);

void insert_barriers(Kernel& kernel);

void place_heap(Kernel& kernel);

void map_threads(Kernel& kernel);

}  // namespace retrograde::lower
