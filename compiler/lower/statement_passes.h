// The passes from statement to statement, each in the file of its name, whose first comment shows
// what it does; and all of them by name, for tools/opt and the golden tests. (pipeline.cpp is the
// order in which the compiler runs them.)
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

// ---- loops/: FlatStorage, before vectorization -> the same phase ----

// Keeps only what must be indivisible, and only where iterations may meet.
Stmt lower_atomics(const Stmt& s);
// Splits loops so that conditions marked likely() vanish from most of their iterations; afterwards
// there are no likely and likely_if_innermost markers. Loops, too.
Stmt partition_loops(const Stmt& s);
// What a condition says already is not said again where it holds. Loops, too.
Stmt drop_guarded_clamps(const Stmt& s);
// A tile without a point computes nothing of its producers, whose places need no clamp then. Before
// loops are partitioned. Loops, too.
Stmt skip_empty_tiles(const Stmt& s);
// A condition that holds in one stretch of a loop becomes the ends of the loop. Loops, too.
Stmt trim_loops(const Stmt& s);
// Copies the body of every Unrolled loop once per iteration. Any phase. UserError when the extent of
// such a loop is not a constant.
Stmt unroll_loops(const Stmt& s);
// A pure C function of what does not change in a loop is called once, before it.
Stmt hoist_calls(const Stmt& s);
// Storage that is small whatever its size is has a constant size. FlatStorage or Vector.
Stmt bound_allocations(const Stmt& s);
// A quotient and its remainder that make up an index together are one again.
Stmt join_indices(const Stmt& s);

// ---- vectors/ ----

// Turns the iterations of Vectorized loops into lanes of vectors: FlatStorage -> Vector. UserError
// when the extent of such a loop is not a constant.
Stmt vectorize_loops(const Stmt& s);
// Reductions of vectors combine lanes once after their loop, not in each iteration.
Stmt accumulate_vectors(const Stmt& s);
// Vectors whose lanes follow a pattern are computed part by part and interleaved.
Stmt interleave_vectors(const Stmt& s);
// Strided loads of neighbouring statements that together read a block are read by rows.
Stmt transpose_loads(const Stmt& s);
// Strided loads that lie beside each other share the vectors they are picked from.
Stmt deinterleave_loads(const Stmt& s);
// Loads of clamped places, in the arms of selects that hold where nothing is clamped, are dense.
Stmt mask_guarded_loads(const Stmt& s);
// Sums of strong products are of plain ones where these are no NaN.
Stmt try_plain_products(const Stmt& s);
// Stores under a mask into storage of one's own write whole vectors.
Stmt blend_masked_stores(const Stmt& s);

// ---- what targets do without, or ask for to find faults ----

// loops/drop_checks.cpp. Target::NoBoundsQuery: a buffer without memory is an error instead of a
// question.
Stmt drop_bounds_query(const Stmt& s);
// Target::NoAsserts: every check is left out.
Stmt drop_asserts(const Stmt& s);
// instrumentation/debug_features.cpp. Target::CheckUnsafePromises: a call fails where a value breaks
// its unsafe_promise_clamped().
Stmt check_promises(const Stmt& s);
// Target::FuzzFloatStores: the last bit of every stored float is 0.
Stmt fuzz_float_stores(const Stmt& s);

// Ends the life of an allocation right after its last use: FlatStorage or Vector -> the same phase,
// with a Free in every Allocate whose storage is used (loops/).
Stmt free_early(const Stmt& s);

// ---- by name ----

struct StatementPass {
  const char* name;
  Stmt (*run)(const Stmt&);
};
const std::vector<StatementPass>& statement_passes();
const StatementPass* find_statement_pass(const std::string& name);  // null when there is none

}  // namespace retrograde::lower
