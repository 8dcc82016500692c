// What a Func is made of: plain data that the front end fills in, and that analysis, autodiff,
// lowering and the interpreter read. The classes users meet (Func, Stage, RDom, Param, ImageParam)
// are handles onto these.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ir/expr.h"
#include "ir/scalar.h"

struct halide_buffer_t;

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

// How the symbol of an extern stage is named. Default: as the target says (C, unless it has
// c_plus_plus_name_mangling).
enum class NameMangling : uint8_t { Default, C, CPlusPlus };

namespace ir {

// Reduction variables innermost first, as listed in the RDom.
struct ReductionVariable {
  std::string var;  // unique in the process: "r$0.x"
  Expr min, extent;
};
// Symbol behind each RVar's Variable node.
struct ReductionDomainContents : Symbol {
  std::vector<ReductionVariable> vars;
  Expr predicate;       // RDom::where, undefined when none; may only grow until the domain is used
  bool frozen = false;  // used in a definition: where() is an error from now on
};

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
  ForType for_type = ForType::Serial;
  bool is_reduction =
      false;  // derives from a reduction variable: order matters unless proven otherwise
  Partition partition = Partition::Auto;
};

// Where a Func is computed or stored.
struct LoopLevel {
  enum class Kind : uint8_t { Inlined, Root, At };
  Kind kind = Kind::Inlined;
  std::string func;  // At: name of the consumer
  std::string var;   // At: its loop
  int stage = -1;    // At: which of its stages; -1: any
};
bool operator==(const LoopLevel& a, const LoopLevel& b);

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

struct StageSchedule {
  std::vector<Split> splits;  // in the order given
  std::vector<Dim> dims;      // loops innermost first
  bool touched = false;       // a directive was given for this stage
  bool atomic = false;        // updates of one element may come from several iterations at once
  bool override_associativity = false;  // atomic(true): the user vouches for it
  bool allow_races = false;
  std::vector<PrefetchDirective> prefetches;
  // compute_with: this stage runs inside the loops of another Func's stage, down to this loop.
  LoopLevel fuse_level;  // kind At, or Inlined when there is none
  std::map<std::string, LoopAlignStrategy> fuse_alignment;  // by loop
  // Func::specialize: the first whose condition holds replaces this schedule; tried in order. A
  // specialization starts as a copy of the schedule at that time and may be specialized itself.
  std::vector<StageSchedule> specializations;
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

struct FuncSchedule {
  LoopLevel compute_level, store_level;
  LoopLevel hoist_level;  // hoist_storage: where memory is allocated; Inlined: at the store level
  // The objects that said so; null where the level can't change any more.
  std::shared_ptr<LoopLevelContents> compute_from, store_from, hoist_from;
  std::vector<Bound> bounds, estimates;
  std::vector<std::string> storage_dims;   // innermost first; the pure args unless reordered
  std::vector<StorageRule> storage_rules;  // of dimensions that have any
  MemoryType memory = MemoryType::Auto;
  bool memoized = false;
  Expr eviction_key;  // memoize: undefined when none
  bool async = false;
  bool touched = false;  // compute_*/store_* was called
};

// Events that generated code reports.
struct TraceSchedule {
  bool loads = false, stores = false, realizations = false;
  std::vector<std::string> tags;
};

struct SourceLocation {
  std::string file;
  int line = 0;
};

// One definition: for all points of the pure args (and the reduction variables), args <- values,
// where predicate.
struct Definition {
  std::vector<Expr> args;  // pure definition: exactly the Func's args as Variables
  std::vector<Expr>
      values;      // one per Tuple element; all loads of one point happen before its stores
  Expr predicate;  // undefined: always
  std::vector<ReductionVariable> rvars;
  StageSchedule schedule;
};

// Parameter of the compiled function: scalar (Param), image (ImageParam), or an embedded Buffer.
struct BufferConstraint {
  Expr min, extent, stride;  // undefined: unconstrained, but see any_stride
  Expr min_estimate, extent_estimate;
  bool any_stride = false;  // set_stride(Expr()): lifts the promise that dimension 0 is dense
};
struct FuncContents;
struct ParameterContents : Symbol {
  std::string name;
  Type type;
  bool is_buffer = false;
  // scalar
  std::optional<Scalar> value;  // current value
  Expr min_value, max_value, estimate;
  // buffer
  int dimensions = 0;
  std::vector<BufferConstraint> constraints;
  std::shared_ptr<void> buffer_owner;  // keeps `buffer` alive
  halide_buffer_t* buffer = nullptr;   // currently bound; null when unset
  bool is_literal = false;             // a Buffer named in the program, not an ImageParam
  int host_alignment =
      0;                 // promise, in bytes, about the address of element min; 0: the type's size
  uint64_t version = 0;  // grows when anything but the value or the bound buffer changes
  TraceSchedule trace;
  // The Func that an ImageParam converts to: what reads the image reads it instead. Null when
  // nobody asked for it.
  std::shared_ptr<FuncContents> func;
};

// Func::define_extern: computed by a C function on buffers.
struct ExternArgument {
  enum class Kind : uint8_t { Func, Buffer, Expr };
  Kind kind = Kind::Expr;
  std::shared_ptr<FuncContents> func;
  std::shared_ptr<ParameterContents> buffer;
  Expr expr;
};
struct ExternDefinition {
  std::string function;  // the symbol
  std::vector<ExternArgument> args;
  NameMangling mangling = NameMangling::Default;
};

// What a user gave for autodiff to use instead of the definitions (autodiff/custom_derivative.h).
struct CustomDerivatives;

// Pipeline::add_requirement: calls fail with the message unless it holds.
struct Requirement {
  Expr condition;             // of parameters only
  std::vector<Expr> message;  // put together
};

// The contents of a Func. Symbol behind each Call to it.
struct FuncContents : Symbol, std::enable_shared_from_this<FuncContents> {
  std::string name;                // unique in the process
  SourceLocation declared_at;      // of the handle that made it
  std::vector<std::string> args;   // pure variables, dimension 0 first
  std::vector<Type> types;         // of the values
  std::optional<Definition> pure;  // empty until defined
  std::vector<Definition> updates;
  FuncSchedule schedule;
  std::vector<std::shared_ptr<ParameterContents>>
      outputs;                            // constraints on the buffers when it is an output
  std::vector<Requirement> requirements;  // of calls, when it is an output
  bool frozen = false;                    // used by another Func: no more updates
  uint64_t version =
      0;  // grows with every definition and directive: compiled code of an older one is stale
  TraceSchedule trace;
  std::string debug_file;  // debug_to_file: written after it is computed; empty: not
  // When set, `pure` has args but no values and no loops, and there are no updates.
  std::optional<ExternDefinition> extern_definition;
  std::shared_ptr<const CustomDerivatives> custom_derivatives;  // null: none; clones share it
  // Func::in and clone_in: consumers named here read the wrapper instead; "" stands for all others.
  std::map<std::string, std::shared_ptr<FuncContents>> wrappers;
  // Type the user asked for in the declaration (Func f(type, dims)), empty when none
  std::vector<Type> required_types;
  int required_dimensions = -1;

  bool is_defined() const { return pure.has_value(); }
  int dimensions() const { return static_cast<int>(args.size()); }
  int stage_count() const { return pure ? 1 + static_cast<int>(updates.size()) : 0; }
  const Definition& stage(int index) const { return index == 0 ? *pure : updates[index - 1]; }
  Definition& stage(int index) { return index == 0 ? *pure : updates[index - 1]; }
  bool is_extern() const { return extern_definition.has_value(); }
  bool is_pure() const { return updates.empty() && !is_extern(); }
  // The same Func in another place, for graphs that are rewritten whole.
  virtual std::shared_ptr<FuncContents> copy() const {
    return std::make_shared<FuncContents>(*this);
  }
};
using FuncPtr = std::shared_ptr<FuncContents>;

// The Func behind a Call (CallType::Func); throws InternalError when it is gone.
FuncPtr func_of(const Call& call);

// Every Func that the outputs depend on (themselves too), producers before consumers; an order that
// depends only on the program. UserError on recursion among Funcs and on undefined Funcs, naming
// the path.
std::vector<FuncPtr> topological_order(const std::vector<FuncPtr>& outputs);
// Funcs called directly by any stage of f (f itself excluded), in first-use order.
std::vector<FuncPtr> direct_callees(const FuncContents& f);
// Visits every expression of a definition: args, values, predicate, rvar bounds.
void for_each_expr(const Definition& definition, const std::function<void(const Expr&)>& visit);
Definition map_exprs(const Definition& definition, const std::function<Expr(const Expr&)>& map);

// Scalar and buffer parameters reached from the outputs, in first-use order.
std::vector<std::shared_ptr<ParameterContents>> parameters_of(const std::vector<FuncPtr>& outputs);

}  // namespace ir
}  // namespace retrograde
