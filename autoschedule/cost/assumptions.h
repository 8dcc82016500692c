// assumptions.h -- the numbers of the cost model that describe neither a machine nor a program: what nobody knows before a
// program runs, and how the terms of the model combine.
#pragma once

#include <cstddef>

namespace retrograde::planning {

// The units of a core work at the same time, and so do computing and moving data. Of all that the slower side hides, this
// part shows.
inline constexpr double not_overlapped = 0.25;
// The same of computing beside data that come from memory, for which a core waits longer than it looks ahead.
inline constexpr double not_overlapped_with_memory = 0.75;
// The part of a cache that a loop may fill: other data take the rest, or share sets with it.
inline constexpr double usable_share = 0.8;
// Data that exceed a cache by this factor find nothing of the last pass in it.
inline constexpr double most_excess = 4;
// How often a condition on data holds.
inline constexpr double taken_branches = 0.5;
// A coordinate that is a sum of an iterator and values from memory moves with the iterator; the values displace it by so
// many elements at most while a row or a column runs.
inline constexpr double displacement = 2;
// How far a coordinate of floating-point origin moves with an iterator when neither says: along the diagonal.
inline constexpr double unknown_slope = 0.7;
// Neighbouring points of data fall into the same bin this often, so that one addition waits for the last.
inline constexpr double equal_neighbours = 0.05;
// A C function takes as long as so many scalar operations.
inline constexpr double function_call_operations = 50;
// The wait of a consumer for a Func that is computed in one of its loops, in iterations of an empty loop.
inline constexpr double slice_iterations = 25;
// A block of memory whose size is unknown takes as long as so many scalar operations, each time: the heap gives it and
// takes it back.
inline constexpr double heap_block_operations = 400;
// Threads begin and end at different times: a parallel loop takes longer by this part of a chunk.
inline constexpr double late_chunk = 0.1;
// A tile that a border cuts has a condition for each unrolled copy and takes longer by as much again.
inline constexpr double guarded_copies = 1;
// Operands of a loop that need a register for a while.
inline constexpr double passing_operands = 2;
// An array of constant indices is kept in registers if it is no larger than so many times all of them. They hold this share
// of it at most; operands take the rest.
inline constexpr double largest_register_array = 4, operand_share = 0.8;
// A lane of which no vector holds the place, as lanes are a stride apart, takes this part of the time of another one.
inline constexpr double known_places = 0.7;
// Loops that become vectors although no plan says so take longer than others: their remainders run element by element.
inline constexpr double remainder_overhead = 1.1;
// Lowering gives lanes to bodies of so many nodes of expressions at most: an operation and an operand, an access and its
// index.
inline constexpr double largest_vector_body = 600, nodes_of_operation = 2, nodes_of_access = 3;
// The reads that inlining may give a stage; beyond them its cost is a lower bound.
inline constexpr size_t most_composed_reads = 2000;
// Instructions of a loop beside its body: its bounds, and its share of those of buffers.
inline constexpr double code_of_loop = 20;
// Two half vectors are widened, and their lanes put in turn.
inline constexpr double interleave_shuffles = 3;
// An access beyond this stride is an element at a time.
inline constexpr double longest_vector_stride = 4;

}  // namespace retrograde::planning
