#include "lower/statement_passes.h"

#include "lower/instrumentation/check_accesses.h"
#include "lower/loops/carry_elements.h"
#include "lower/loops/equal_nests.h"
#include "lower/loops/flatten_storage.h"
#include "lower/loops/fold_steps.h"
#include "lower/loops/keep_accumulators.h"
#include "lower/loops/skip_stages.h"
#include "lower/vectors/vectorize_inner_loops.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

const std::vector<StatementPass>& statement_passes() {
  static const std::vector<StatementPass> passes = {
      {"accumulate_vectors", accumulate_vectors},
      {"blend_masked_stores", blend_masked_stores},
      {"bound_allocations", bound_allocations},
      {"carry_elements",  // loops whose names lack "r$" count as loops over pure variables
       [](const Stmt& s) {
         return carry_elements(
             s, [](const For& loop) { return loop.name.find(".r$") == std::string::npos; });
       }},
      {"check_accesses",  // only for allocations: a statement does not list its buffers
       [](const Stmt& s) { return check_accesses(s, {}); }},
      {"check_promises", check_promises},
      {"deinterleave_loads", deinterleave_loads},
      {"drop_asserts", drop_asserts},
      {"drop_bounds_query", drop_bounds_query},
      {"keep_accumulators",  // loops whose names lack "r$" count as loops over pure variables
       [](const Stmt& s) {
         return keep_accumulators(
             s, [](const For& loop) { return loop.name.find(".r$") == std::string::npos; });
       }},
      {"expand_equal_nests", expand_equal_nests},
      {"flatten_storage", [](const Stmt& s) { return flatten_storage(s); }},
      {"fold_steps",  // every Func may be folded; loops whose names lack "r$" count as loops over pure variables
       [](const Stmt& s) {
         return fold_steps(
             s, {[](const std::string&) { return true; },
                 [](const For& loop) { return loop.name.find(".r$") == std::string::npos; }});
       }},
      {"free_early", free_early},
      {"fuzz_float_stores", fuzz_float_stores},
      {"hoist_calls", hoist_calls},
      {"join_indices", join_indices},
      {"lower_atomics", lower_atomics},
      {"partition_loops", partition_loops},
      {"simplify", [](const Stmt& s) { return simplify(s); }},
      {"mask_guarded_loads", mask_guarded_loads},
      {"share_equal_nests", share_equal_nests},
      {"skip_stages",  // every Func that is stored may be skipped
       [](const Stmt& s) { return skip_stages(s, [](const std::string&) { return true; }); }},
      {"transpose_loads", transpose_loads},
      {"skip_empty_tiles", skip_empty_tiles},
      {"drop_guarded_clamps", drop_guarded_clamps},
      {"trim_loops", trim_loops},
      {"merge_equal_loops", merge_equal_loops},
      {"share_lets", share_lets},
      {"try_plain_products", try_plain_products},
      {"unroll_loops", unroll_loops},
      {"vectorize_inner_loops",  // every loop counts as a loop over a pure variable
       [](const Stmt& s) {
         return vectorize_inner_loops(s, {32, [](const For&) { return true; }});
       }},
      {"vectorize_loops", vectorize_loops},
      {"interleave_vectors", interleave_vectors},
  };
  return passes;
}

const StatementPass* find_statement_pass(const std::string& name) {
  return first_where(statement_passes(),
                     [&](const StatementPass& pass) { return name == pass.name; });
}

}  // namespace retrograde::lower
