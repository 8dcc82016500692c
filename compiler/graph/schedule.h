// schedule.h -- the schedule of a Func and its stages, as plain data.
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
  RoundUp,      // runs past the end: extents (storage too) grow to a multiple
  GuardWithIf,  // an if (a predicate when vectorized) around the body
  Predicate,    // like GuardWithIf, with predicated loads and stores
  PredicateLoads,
  PredicateStores,
  // For splits that do not divide, these two write back the old values past the end: same as
  // PredicateStores.
  RoundUpAndBlend,
  ShiftInwardsAndBlend,
  ShiftInwards,  // the last block moves inwards and recomputes points (pure definitions only)
  // ShiftInwards for pure definitions, GuardWithIf for updates; RoundUp in storage that we size.
  Auto,
};

// How compute_with aligns two loops whose ranges differ.
enum class LoopAlignStrategy : uint8_t { AlignStart, AlignEnd, NoAlign, Auto };

// How prefetch treats the part of its region that lies outside of the data.
enum class PrefetchBoundStrategy : uint8_t { Clamp, GuardWithIf, NonFaulting };

namespace graph {

struct Split {
  enum class Kind : uint8_t { Split, Fuse, Rename };
  Kind kind = Kind::Split;
  // Split:  old -> outer * factor + inner.   Fuse: (outer, inner) -> old.   Rename: old -> outer.
  // `outer` or `inner` may reuse old_var's name (vectorize(x, 8) splits x into x and a fresh
  // inner). After that split the name means the new loop. Splits are therefore read in order, and a
  // name in an earlier entry is resolved through the later entries only.
  std::string old_var, outer, inner;
  Expr factor;  // Split only
  TailStrategy tail = TailStrategy::Auto;
  bool exact = false;  // on a reduction variable: no point may run twice or be added
};

struct Dim {
  std::string var;
  ForType runs = ForType::Serial;
  bool is_reduction =
      false;  // derives from a reduction variable: order matters unless proven otherwise
  Partition partition = Partition::Auto;
  // An extern stage computes this dimension in one call of its C function, without a loop, until a
  // directive splits it or sets how the loop runs.
  bool is_in_call = false;
  // Halide's queries: whether iterations are known to be independent, and whether it is an RVar's.
  bool is_pure() const { return !is_reduction; }
  bool is_rvar() const { return is_reduction; }
};

// Loops, innermost first. dims() exists for Halide programs that call get_schedule().
struct LoopList : std::vector<Dim> {
  using std::vector<Dim>::vector;
  LoopList(std::vector<Dim> loops) : std::vector<Dim>(std::move(loops)) {}
  const std::vector<Dim>& operator()() const { return *this; }
};

// The loop in which a Func is computed or stored.
struct LoopLevel {
  enum class Kind : uint8_t { Inlined, Root, At };
  Kind kind = Kind::Inlined;
  std::string func;  // At: name of the consumer
  std::string var;   // At: its loop
  int stage = -1;    // At: which of its stages; -1: any
  bool operator==(const LoopLevel& other) const = default;
};

// Shared state of a user's LoopLevel object, which may be set after it was passed to compute_at and
// the like. Setting it updates every schedule that uses it.
struct LoopLevelContents {
  LoopLevel level;
  bool defined = false;
  bool locked = false;
  std::vector<std::function<void(const LoopLevel&)>> followers;
};

// At each iteration of `at`, prefetches into the cache what iteration `from + offset` reads of
// `name`.
struct PrefetchDirective {
  std::string name;  // a Func or an image
  SymbolRef symbol;  // the contents of `name`
  std::string at, from;
  Expr offset;
  PrefetchBoundStrategy strategy = PrefetchBoundStrategy::GuardWithIf;
};

struct StageLoops {
  std::vector<Split> splits;  // in the order of the directives
  LoopList dims;
  bool is_given = false;                // the stage has a directive
  bool atomic = false;                  // concurrent iterations may update one element
  bool override_associativity = false;  // atomic(true): the user vouches for associativity
  bool allow_races = false;
  std::vector<PrefetchDirective> prefetches;
  // compute_with: this stage is fused with the loops of another stage, from the outermost to this
  // one.
  LoopLevel fuse_level;                                     // kind At, or Inlined when not fused
  std::map<std::string, LoopAlignStrategy> fuse_alignment;  // by loop
  // Func::specialize: the first specialization whose condition holds replaces this schedule. Each
  // starts as a copy of the schedule at that time and may be specialized itself.
  std::vector<StageLoops> specializations;
  Expr condition;       // on a specialization: over parameters only; undefined for specialize_fail
  std::string failure;  // specialize_fail: the error message of the call; empty otherwise
};

// Constraints on one pure dimension: the user's promise (bound), an estimate (set_estimate) or an
// alignment. One entry per variable.
struct Bound {
  std::string var;
  Expr min, extent;  // may be undefined
  // align_bounds: min % modulus == remainder, and the extent is a multiple of the modulus; both
  // undefined when unset. align_extent: the remainder is undefined, and the min stays as it is.
  Expr modulus, remainder;
};

// The storage layout of one dimension of a Func.
struct StorageRule {
  std::string var;
  Expr alignment;  // align_storage: pads the extent to a multiple; undefined when unset
  // bound_storage: an upper bound on the extent, checked at run time; undefined when unset.
  Expr bound;
  Expr fold;  // fold_storage: stores coordinates modulo this; undefined: the compiler chooses
  bool fold_forward = true;  // the coordinate increases from one iteration to the next
};

struct FuncPlacement {
  LoopLevel compute_level, store_level;
  LoopLevel hoist_level;  // hoist_storage: where memory is allocated; Inlined: at the storage level
  // The LoopLevel objects behind the levels; null for a level that cannot change any more.
  std::shared_ptr<LoopLevelContents> compute_from, store_from, hoist_from;
  std::vector<Bound> bounds, estimates;
  std::vector<std::string> storage_dims;   // innermost first; the pure args unless reordered
  std::vector<StorageRule> storage_rules;  // for dimensions with any rule
  MemoryType memory = MemoryType::Auto;
  Expr ring;  // ring_buffer: number of copies of hoisted storage; undefined: one
  bool memoized = false;
  Expr eviction_key;  // memoize; undefined when unset
  bool async = false;
  bool is_given = false;  // has a directive other than bounds and estimates
};

// Events that generated code reports.
struct TraceSchedule {
  bool loads = false, stores = false, realizations = false;
  std::vector<std::string> tags;
};

}  // namespace graph
}  // namespace retrograde
