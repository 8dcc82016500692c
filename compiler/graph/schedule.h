// schedule.h -- how a Func and its stages are computed: plain data.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde {

// How a split treats an extent that its factor does not divide.
enum class TailStrategy : uint8_t {
  RoundUp,      // runs past the end: extents grow to a multiple (storage too)
  GuardWithIf,  // an if (a predicate when vectorized) around the body
  Predicate,    // as GuardWithIf, by predicated loads and stores
  PredicateLoads,
  PredicateStores,
  // For splits that do not divide, with stores that write back what was there: PredicateStores.
  RoundUpAndBlend,
  ShiftInwardsAndBlend,
  ShiftInwards,  // the last block moves inwards and recomputes (pure definitions only)
  Auto,  // ShiftInwards for pure definitions, GuardWithIf for updates; RoundUp inside storage we
         // size ourselves
};

// How two loops line up that compute_with runs as one, when their ranges differ.
enum class LoopAlignStrategy : uint8_t { AlignStart, AlignEnd, NoAlign, Auto };

// What prefetch does with the part of its region that lies outside of the data.
enum class PrefetchBoundStrategy : uint8_t { Clamp, GuardWithIf, NonFaulting };

namespace graph {

struct Split {
  enum class Kind : uint8_t { Split, Fuse, Rename };
  Kind kind = Kind::Split;
  // Split:  old -> outer * factor + inner.   Fuse: (outer, inner) -> old.   Rename: old -> outer.
  // `outer` or `inner` may be old_var's own name (vectorize(x, 8) splits x into x and a fresh
  // inner): from this split on the name means the new loop, so a list of splits is read in order,
  // and what an earlier entry says about the name is to be resolved with the later entries only.
  std::string old_var, outer, inner;
  Expr factor;  // Split only
  TailStrategy tail = TailStrategy::Auto;
  bool exact = false;  // of a reduction variable: no point may run twice or be added
};

struct Dim {
  std::string var;
  ForType runs = ForType::Serial;
  bool is_reduction =
      false;  // derives from a reduction variable: order matters unless proven otherwise
  Partition partition = Partition::Auto;
  // An extern stage computes this dimension in one call of its C function, without a loop, until a
  // directive splits it or says how the loop runs.
  bool is_in_call = false;
  // As Halide asks: whether iterations are known to be independent, and whether it is an RVar's.
  bool is_pure() const { return !is_reduction; }
  bool is_rvar() const { return is_reduction; }
};

// Loops, innermost first. dims() is what Halide's programs call, of get_schedule().
struct LoopList : std::vector<Dim> {
  using std::vector<Dim>::vector;
  LoopList(std::vector<Dim> loops) : std::vector<Dim>(std::move(loops)) {}
  const std::vector<Dim>& operator()() const { return *this; }
};

// Where a Func is computed or stored.
struct LoopLevel {
  enum class Kind : uint8_t { Inlined, Root, At };
  Kind kind = Kind::Inlined;
  std::string func;  // At: name of the consumer
  std::string var;   // At: its loop
  int stage = -1;    // At: which of its stages; -1: any
  bool operator==(const LoopLevel& other) const = default;
};

// Behind a user's LoopLevel object, which may be set after it was given to compute_at and its like:
// what it says then goes to every schedule that uses it.
struct LoopLevelContents {
  LoopLevel level;
  bool defined = false;
  bool locked = false;
  std::vector<std::function<void(const LoopLevel&)>> followers;
};

// Fetch into the cache what iteration `from + offset` will read of `name`, at each iteration of
// `at`.
struct PrefetchDirective {
  std::string name;  // of a Func or an image
  SymbolRef symbol;  // its contents
  std::string at, from;
  Expr offset;
  PrefetchBoundStrategy strategy = PrefetchBoundStrategy::GuardWithIf;
};

struct StageLoops {
  std::vector<Split> splits;  // in the order given
  LoopList dims;
  bool is_given = false;  // a directive was given for this stage
  bool atomic = false;    // updates of one element may come from several iterations at once
  bool override_associativity = false;  // atomic(true): the user vouches for it
  bool allow_races = false;
  std::vector<PrefetchDirective> prefetches;
  // compute_with: this stage runs inside the loops of another Func's stage, down to this loop.
  LoopLevel fuse_level;  // kind At, or Inlined when there is none
  std::map<std::string, LoopAlignStrategy> fuse_alignment;  // by loop
  // Func::specialize: the first whose condition holds replaces this schedule; tried in order. A
  // specialization starts as a copy of the schedule at that time and may be specialized itself.
  std::vector<StageLoops> specializations;
  Expr condition;       // of a specialization: over parameters only; undefined in specialize_fail
  std::string failure;  // specialize_fail: what the call reports when it gets here; empty otherwise
};

// What is known or wanted of one pure dimension: a user's promise (bound), guess (set_estimate),
// or an alignment. One entry for a variable.
struct Bound {
  std::string var;
  Expr min, extent;  // may be undefined
  // align_bounds: min % modulus == remainder, and the extent is a multiple of the modulus; both
  // undefined without. align_extent: the remainder is undefined, and the min stays.
  Expr modulus, remainder;
};

// Layout of one dimension of a Func's storage.
struct StorageRule {
  std::string var;
  Expr alignment;  // align_storage: the extent grows to a multiple; undefined: none
  Expr bound;      // bound_storage: at least what is needed at run time, checked; undefined: none
  Expr fold;       // fold_storage: coordinates modulo this; undefined: the compiler's choice
  bool fold_forward = true;  // the coordinate grows from one iteration to the next
};

struct FuncPlacement {
  LoopLevel compute_level, store_level;
  LoopLevel hoist_level;  // hoist_storage: where memory is allocated; Inlined: at the store level
  // The objects that said so; null where the level can't change any more.
  std::shared_ptr<LoopLevelContents> compute_from, store_from, hoist_from;
  std::vector<Bound> bounds, estimates;
  std::vector<std::string> storage_dims;   // innermost first; the pure args unless reordered
  std::vector<StorageRule> storage_rules;  // of dimensions that have any
  MemoryType memory = MemoryType::Auto;
  Expr ring;  // ring_buffer: copies of hoisted storage, used in turn; undefined: one
  bool memoized = false;
  Expr eviction_key;  // memoize: undefined when none
  bool async = false;
  bool is_given = false;  // a directive was given that is not of sizes (bound, set_estimate ...)
};

// Events that generated code reports.
struct TraceSchedule {
  bool loads = false, stores = false, realizations = false;
  std::vector<std::string> tags;
};

}  // namespace graph
}  // namespace retrograde
