// Passes from statement to statement. Each is in the file of its name, whose file comment describes it.
// statement_passes() lists them by name for tools/opt and the golden tests; pipeline.cpp runs them in the compiler's
// order.
#pragma once

#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::lower {

// ---- loops/: FlatStorage, before vectorization -> the same phase ----

// Reduces Atomic statements to the part that must be atomic, and drops those whose storage is not shared.
Stmt lower_atomics(const Stmt& s);
// Splits loops so that likely() conditions vanish from most of their iterations. Removes likely and
// likely_if_innermost markers. Also for Loops.
Stmt partition_loops(const Stmt& s);
// Removes a min or max that a surrounding condition decides. Also for Loops.
Stmt drop_guarded_clamps(const Stmt& s);
// Skips the producers of tiles that contain no points, whose regions then need no clamp. Runs before partition_loops.
// Also for Loops.
Stmt skip_empty_tiles(const Stmt& s);
// Turns conditions on a loop's variable into bounds of the loop. Also for Loops.
Stmt trim_loops(const Stmt& s);
// Turns a condition between loops that only differ in their extents into a part of the extent.
Stmt merge_equal_loops(const Stmt& s);
// Copies the body of every Unrolled loop once per iteration. For any phase. UserError if the extent of such a loop has
// no constant upper bound.
Stmt unroll_loops(const Stmt& s);
// Moves calls of pure C functions with loop-invariant arguments out of their loops.
Stmt hoist_calls(const Stmt& s);
// Gives small storage of varying size a constant size. For FlatStorage or Vector.
Stmt bound_allocations(const Stmt& s);
// Simplifies indices in which a quotient and its remainder recombine.
Stmt join_indices(const Stmt& s);
// Binds equal indices of statements that run one after another once. For any phase.
Stmt share_lets(const Stmt& s);

// ---- vectors/ ----

// Turns the iterations of Vectorized loops into lanes of vectors: FlatStorage -> Vector. UserError if the extent of
// such a loop has no constant upper bound.
Stmt vectorize_loops(const Stmt& s);
// Combines the lanes of a vector reduction once after its loop instead of in each iteration.
Stmt accumulate_vectors(const Stmt& s);
// Splits expressions that alternate between lanes into parts, and interleaves their results.
Stmt interleave_vectors(const Stmt& s);
// Reads the columns of a block by rows, and transposes them in registers.
Stmt transpose_loads(const Stmt& s);
// Reads neighbouring strided vectors through dense loads that they share.
Stmt deinterleave_loads(const Stmt& s);
// Replaces clamped gathers under a select by dense loads under the select's mask.
Stmt mask_guarded_loads(const Stmt& s);
// Sums strong products with plain multiplications first, and repeats the sum if it gives NaN.
Stmt try_plain_products(const Stmt& s);
// Replaces masked accesses of local allocations by accesses of whole vectors.
Stmt blend_masked_stores(const Stmt& s);

// ---- checks that a target disables or requests ----

// Target::NoBoundsQuery (loops/drop_checks.cpp): a buffer without memory is an error instead of a bounds query.
Stmt drop_bounds_query(const Stmt& s);
// Target::NoAsserts: removes every check.
Stmt drop_asserts(const Stmt& s);
// Target::CheckUnsafePromises (instrumentation/debug_features.cpp): a call fails if a value breaks its
// unsafe_promise_clamped().
Stmt check_promises(const Stmt& s);
// Target::FuzzFloatStores: clears the last bit of every stored float.
Stmt fuzz_float_stores(const Stmt& s);

// Frees each allocation right after its last use (loops/): FlatStorage or Vector -> the same phase, with a Free in
// every Allocate whose storage is used.
Stmt free_early(const Stmt& s);

// ---- by name ----

struct StatementPass {
  const char* name;
  Stmt (*run)(const Stmt&);
};
const std::vector<StatementPass>& statement_passes();
const StatementPass* find_statement_pass(const std::string& name);  // null if there is none

}  // namespace retrograde::lower
