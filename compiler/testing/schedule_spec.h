// A schedule as plain data: loops by name, Funcs by number. random_schedule.h draws it,
// apply_schedule.h gives it to Funcs, print_program.h prints it, reducer.h cuts it down.
//
// Loops: "x", "y", "z" are a definition's pure variables, "r0", "r1" its reduction variables, any
// other name was made by a directive; names of reduction loops begin with r. A loop without a name
// is the inner one of vectorize(x, 8) and its like.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::fuzz {

struct Directive {
  enum class Kind : uint8_t {
    Split,
    Fuse,
    Rename,
    Reorder,
    Serial,
    Vectorize,
    Unroll,
    Parallel,
    NeverPartition,
    AlwaysPartition,
    Atomic,
    AllowRaces,
    Prefetch,
    Specialize,
    SpecializeFail,
  };
  static constexpr int kinds = static_cast<int>(Kind::SpecializeFail) + 1;
  Kind kind = Kind::Split;
  // Split: old, outer, inner. Fuse: inner, outer, fused. Rename: old, new. Reorder: innermost
  // first. Prefetch: at, from. Specialize, Atomic, AllowRaces: none. Else: one loop.
  std::vector<std::string> loops = {};
  int factor = 0;  // Split; Vectorize, Unroll, Parallel: 0 without a split. Prefetch: the offset
  TailStrategy tail = TailStrategy::Auto;
  int source = 0;                      // Prefetch: of this Func, or of image -1 - source
  int condition = 0;                   // Specialize: when the selector has this value
  std::vector<Directive> nested = {};  // Specialize: given to the specialization
};

struct StageSpec {
  std::vector<Directive> directives;
};

struct Placement {
  enum class Where : uint8_t { Default, Inline, Root, At };
  Where where = Where::Default;
  int consumer = -1, stage = 0;  // At: whose loops
  std::string compute_loop;      // At
  // "root", or a loop of store_consumer; empty: not said.
  std::string store_loop, hoist_loop;
  int store_consumer = -1, store_stage = 0, hoist_consumer = -1, hoist_stage = 0;
};

Placement at_root();

// What is said about one dimension of a Func.
struct DimensionRule {
  enum class Kind : uint8_t {
    Bound,        // a: min, b: extent
    BoundExtent,  // a
    AlignBounds,  // a: modulus, b: remainder
    AlignExtent,  // a: modulus
    AlignStorage,
    BoundStorage,
    FoldStorage,  // a: factor, b: forward
  };
  static constexpr int kinds = static_cast<int>(Kind::FoldStorage) + 1;
  Kind kind = Kind::AlignBounds;
  int dimension = 0, a = 0, b = 0;
};

struct FuncScheduleSpec {
  Placement placement;
  std::vector<StageSpec> stages;  // the pure definition, then the updates
  std::vector<DimensionRule> rules;
  std::vector<int> storage_order;  // reorder_storage; empty: not said
  MemoryType memory = MemoryType::Auto;
  bool memoized = false, async = false, traced = false;
};

// A Func that a directive makes.
struct DerivedFunc {
  enum class Kind : uint8_t { None, Wrapper, Clone, Factored };
  Kind kind = Kind::None;  // None: the reducer took it away; its number stays
  int source = 0;
  int consumer = -1;  // Wrapper: of this Func, or of all that use it. Clone: of this Func
  int stage = 0;      // Factored: of this stage, an update
  // Factored: first split this loop, when there is a factor; then keep these as new variables.
  std::string split_loop, outer, inner;
  int factor = 0;
  std::vector<std::string> preserved, variables;
};

// Stage 0 of `func` runs inside the loops of stage 0 of `with`, down to `loop`.
struct Companion {
  int func = 0, with = 0;
  std::string loop = {};
  LoopAlignStrategy align = LoopAlignStrategy::Auto;
};

struct ScheduleSpec {
  std::vector<FuncScheduleSpec> funcs;  // of the pipeline, then the derived ones
  std::vector<DerivedFunc> derived;
  std::vector<Companion> companions;
  int selector = 0;  // what the conditions of specializations compare with
};

// Reduction variable k of a stage by the name that schedules use: "r0", "r1".
std::string reduction_loop(int k);
bool is_reduction_loop(const std::string& name);
bool is_reduction_variable(const std::string& name);  // one of the definition's own

// Takes a derived Func away; what is computed in its loops goes to root.
void drop_derived(ScheduleSpec& schedule, int index);

// Takes every use of a directive out of a schedule, which stays legal: specialize, prefetch, async,
// memoize, trace, hoist_storage, fold_storage, compute_with, rfactor, wrappers. Others: UserError,
// as the check alone.
void check_can_be_left_out(const std::string& directive);
void leave_out(ScheduleSpec& schedule, const std::string& directive);

const char* tail_name(TailStrategy tail);

}  // namespace retrograde::fuzz
