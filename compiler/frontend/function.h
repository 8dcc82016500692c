// What a Func is made of: plain data that the front end fills in, and that analysis, autodiff,
// lowering and the interpreter read. The classes users meet (Func, Stage, RDom, Param, ImageParam)
// are handles onto these.
#pragma once

#include <functional>
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
  ShiftInwards,  // the last block moves inwards and recomputes (pure definitions only)
  Auto,  // ShiftInwards for pure definitions, GuardWithIf for updates; RoundUp inside storage we
         // size ourselves
};

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
};

struct StageSchedule {
  std::vector<Split> splits;  // in the order given
  std::vector<Dim> dims;      // loops innermost first
  bool touched = false;       // a directive was given for this stage
};

// Where a Func is computed or stored.
struct LoopLevel {
  enum class Kind : uint8_t { Inlined, Root, At };
  Kind kind = Kind::Inlined;
  std::string func;  // At: name of the consumer
  std::string var;   // At: its loop
  int stage = -1;    // At: which of its stages; -1: any
};

struct Bound {  // a user's promise (bound) or guess (set_estimate) about one pure dimension
  std::string var;
  Expr min, extent;  // min may be undefined
};

struct FuncSchedule {
  LoopLevel compute_level, store_level;
  std::vector<Bound> bounds, estimates;
  std::vector<std::string> storage_dims;  // innermost first; the pure args unless reordered
  MemoryType memory = MemoryType::Auto;
  bool touched = false;  // compute_*/store_* was called
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
  uint64_t version = 0;  // grows when anything but the value or the bound buffer changes
};

// The contents of a Func. Symbol behind each Call to it.
struct FuncContents : Symbol, std::enable_shared_from_this<FuncContents> {
  std::string name;                // unique in the process
  std::vector<std::string> args;   // pure variables, dimension 0 first
  std::vector<Type> types;         // of the values
  std::optional<Definition> pure;  // empty until defined
  std::vector<Definition> updates;
  FuncSchedule schedule;
  std::vector<std::shared_ptr<ParameterContents>>
      outputs;          // constraints on the buffers when it is an output
  bool frozen = false;  // used by another Func: no more updates
  uint64_t version =
      0;  // grows with every definition and directive: compiled code of an older one is stale
  bool debug_trace = false;
  // Type the user asked for in the declaration (Func f(type, dims)), empty when none
  std::vector<Type> required_types;
  int required_dimensions = -1;

  bool is_defined() const { return pure.has_value(); }
  int dimensions() const { return static_cast<int>(args.size()); }
  int stage_count() const { return pure ? 1 + static_cast<int>(updates.size()) : 0; }
  const Definition& stage(int index) const { return index == 0 ? *pure : updates[index - 1]; }
  Definition& stage(int index) { return index == 0 ? *pure : updates[index - 1]; }
  bool is_pure() const { return updates.empty(); }
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
