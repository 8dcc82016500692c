// reference.h -- the reference machine: figures that are the same for every target and every processor.
//
// Some decisions of a schedule choose the order in which terms are added, and so the bits of a result: the lanes of a
// sum, its privatised copies, its blocks. They may depend on a program and its sizes, never on the machine that compiles
// or runs it. Such decisions use the figures below. Other figures are here because no target differs enough to matter.
#pragma once

#include <cstdint>

namespace retrograde::planning {

// ---- Vectors ----

// The elements of 32 bits in a vector of a schedule. They fill a register of 64 bytes; for targets with smaller
// registers, code generation uses several for each vector.
inline constexpr int schedule_lanes = 16;

// ---- Caches ----

inline constexpr int64_t line_bytes = 64;
inline constexpr int64_t line_elements = line_bytes / 4;  // of 32 bits
inline constexpr int64_t page_bytes = 4096;
// The caches of one core, which no other core shares, and the cache that all cores share.
inline constexpr int64_t first_cache_bytes = 32 << 10;
inline constexpr int64_t second_cache_bytes = 1 << 20;
inline constexpr int64_t third_cache_bytes = 16 << 20;
// The largest caches of a core that are common. Data that exceed them reach no core without the shared cache.
inline constexpr int64_t largest_second_cache_bytes = 2 << 20;
// The steps of a loop over time, all together, that no core's own caches hold.
inline constexpr int64_t many_step_bytes = third_cache_bytes / 2;
// Rows this many bytes apart, or a multiple of it, compete for a few sets of the second cache.
inline constexpr int64_t second_cache_set_stride = 32 << 10;
// The lines of one set of the first cache, rounded up.
inline constexpr int64_t first_cache_ways = 16;
// The streams of addresses that a core fetches ahead of their use, rounded up.
inline constexpr int64_t prefetched_streams = 32;
// The first lines of a stream: the second cache fetches ahead once it has noticed that it is one.
inline constexpr double unnoticed_lines = 2;
// The next line of a stream begins at most this far behind its last one.
inline constexpr double near_bytes = 512;
// Nanoseconds of waiting for a line that nothing fetched ahead, beside the time of moving it: if the first cache lacks it,
// and what is added if the second one lacks it, too. Others are on their way at the same time.
inline constexpr double far_line_ns[] = {0.7, 2.5, 0};
// The same for a page whose address the processor does not remember, and how many it does of one buffer.
inline constexpr double page_walk_ns = 8;
inline constexpr int64_t remembered_pages = 1024;
// A store to a line that others of its set evicted waits for it, and all later stores wait for that one.
inline constexpr double evicted_store_ns = 8;

// The cache of instructions, the mean bytes of an instruction of vectors, those of each lane of a gather, and nanoseconds
// until a line of them has come from the second cache: the body of a loop that exceeds the first one finds none of its own.
inline constexpr double code_cache_bytes = 32 << 10, instruction_bytes = 7, lane_instructions = 3;
inline constexpr double far_code_line_ns = 1;

// ---- Threads ----

// The threads that a schedule expects if nobody says how many there are.
inline constexpr int reference_threads = 2;
inline constexpr int threads_of_large_machines = 32;
// Accumulators have this many privatised copies on every machine.
inline constexpr int privatised_copies = threads_of_large_machines;
// The iterations of parallel loops for each thread: no thread waits long for the others.
inline constexpr int tasks_per_thread = 4;
// The iterations of parallel loops that suffice for the reference threads.
inline constexpr int64_t reference_tasks = int64_t{tasks_per_thread} * reference_threads;
// Work that takes as long as waking the threads for a parallel loop, about 10 microseconds: operations on elements of a
// vectorized loop, and cycles.
inline constexpr double launch_operations = 1 << 19;
inline constexpr double launch_cycles = 20000;

// Nanoseconds of a thread until the body of an iteration of a parallel loop runs: a call through a pointer, which keeps the
// errors of iterations apart, and the invariants of the loops around.
inline constexpr double task_ns = 8;

// Operations that one atomic addition takes. Threads seldom add to the same cache line of an accumulator that has at
// least this many.
inline constexpr double atomic_add_operations = 8;
inline constexpr int64_t uncontended_lines = 1 << 10;

// ---- Accuracy ----

// The longest chain of additions to one accumulator. Longer sums run in lanes or blocks, whose rounding errors are smaller.
inline constexpr double longest_chain = 512;
// The terms of a block of a long sum: about as many as there are blocks, between these.
inline constexpr int64_t least_block_terms = 64, most_block_terms = 256;
// A sum to few elements is split into lanes and rows if it has this many terms. The terms of a lane, if its rows are parts
// of a single loop.
inline constexpr int64_t many_terms = 4096;
inline constexpr int64_t lane_terms = 256;

// ---- Programs ----

// The extent of a dimension of which nothing is known.
inline constexpr int64_t unknown_extent = 1000;

// ---- Code ----

// Operations in the body of a loop, with its unrolled copies: the time that compiling takes grows with them.
inline constexpr int64_t most_body_operations = 2000;
// How often each value of a Func is computed at most, if loops that overlap compute it again.
inline constexpr double most_recomputation = 16;

// ---- The cost of memory, in operations on an element of a vectorized loop ----

// Storing a value to memory and loading it again: 12 bytes at the bandwidth of a core, against one operation a lane and
// cycle.
inline constexpr double memory_trip_operations = 24;
// The same through a cache near the core: a store and a load that wait for no memory.
inline constexpr double cache_trip_operations = 10;
// Loading or storing an element of a vector whose elements are a stride apart.
inline constexpr double strided_access_operations = 2;

// ---- The execution units of a core, per register of a vector ----

struct Core {
  double loads_per_cycle = 2, products_per_cycle = 2;
  // Cycles from operands to result.
  double load_latency = 6, float_latency = 4, divide_latency = 13, sqrt_latency = 19;
  // Cycles from one operation to the next that does not depend on it.
  double divide_cycles = 7, sqrt_cycles = 10;
  // Cycles for each addition in the approximation of a function.
  double function_latency = 2;
  // Instructions that execute ahead of the oldest unfinished one.
  double reorder_window = 256;
  // A vector at any address crosses cache lines and counts as this many loads, and as twice as many if every iteration
  // reads a row of its own.
  double unaligned_loads = 2, far_row_loads = 4;
  // Loads and insertions for each lane of a gather.
  double gather_lane_operations = 2;
};
inline constexpr Core core;

}  // namespace retrograde::planning
