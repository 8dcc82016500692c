// function.h -- what a Func is made of: plain data that the front end fills in, and that analysis,
// autodiff, lowering and the interpreter read. The classes users meet (Func, Stage, RDom, Param,
// ImageParam) are handles onto these.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "graph/directive.h"
#include "graph/parameter_contents.h"
#include "graph/provenance.h"
#include "graph/reduction_domain.h"
#include "graph/schedule.h"
#include "ir/visit.h"

namespace retrograde {

// What a user gave for autodiff to use instead of the definitions (autodiff/custom_derivative.h).
namespace autodiff {
struct CustomDerivatives;
}

// How the symbol of an extern stage is named. Default: as the target says (C, unless it has
// c_plus_plus_name_mangling).
enum class NameMangling : uint8_t { Default, C, CPlusPlus };

namespace graph {

// Of one value of each type.
int total_bytes(const std::vector<Type>& types);

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
  StageLoops schedule;
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
  FuncPlacement schedule;
  std::vector<LoggedDirective> log;  // all that were given to it and its stages, in their order
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
  // Null: none; clones share it.
  std::shared_ptr<const autodiff::CustomDerivatives> custom_derivatives;
  // Func::in and clone_in: consumers named here read the wrapper instead; "" stands for all others.
  std::map<std::string, std::shared_ptr<FuncContents>> wrappers;
  // Func::copy_input: images named here are read through these Funcs.
  std::map<std::string, std::shared_ptr<FuncContents>> copied_inputs;
  // Type the user asked for in the declaration (Func f(type, dims)), empty when none
  std::vector<Type> required_types;
  int required_dimensions = -1;
  std::optional<Provenance> made;  // empty: its user wrote it

  bool is_defined() const { return pure.has_value(); }
  int dimensions() const { return static_cast<int>(args.size()); }
  int stage_count() const { return pure ? 1 + static_cast<int>(updates.size()) : 0; }
  const Definition& stage(int index) const { return index == 0 ? *pure : updates[index - 1]; }
  Definition& stage(int index) { return index == 0 ? *pure : updates[index - 1]; }
  bool is_extern() const { return extern_definition.has_value(); }
  bool is_pure() const { return updates.empty() && !is_extern(); }
};
using FuncPtr = std::shared_ptr<FuncContents>;

// A Func that the compiler makes; its name and definitions are to come.
FuncPtr make_func(Role role);
// The same with a name like `name` that no other Func has, made for the Func `of`.
FuncPtr make_func(Role role, const std::string& name, const std::string& of = "");

// Where the Func that is called comes from; null when its user wrote it, or no Func is called.
const Provenance* provenance_of(const Call& call);
// The Func behind a Call (CallType::Func); throws InternalError when it is gone.
FuncPtr func_of(const Call& call);

// Every Func that the outputs depend on (themselves too), producers before consumers; an order that
// depends only on the program. UserError on recursion among Funcs and on undefined Funcs, naming
// the path.
std::vector<FuncPtr> topological_order(const std::vector<FuncPtr>& outputs);
// Funcs called directly by any stage of f (f itself excluded), in first-use order.
std::vector<FuncPtr> direct_callees(const FuncContents& f);
// The variable that numbers the points which an iteration updates at once; null: it updates one.
const ReductionVariable* point_number(const Definition& definition);
int number_of_points(const Definition& definition);
// Visits every expression of a definition: args, values, predicate, rvar bounds.
void for_each_expr(const Definition& definition, const std::function<void(const Expr&)>& visit);
// The same of all definitions of a Func.
void for_each_expr(const FuncContents& f, const std::function<void(const Expr&)>& visit);
Definition map_exprs(const Definition& definition, const std::function<Expr(const Expr&)>& map);
// As of one expression (ir/visit.h), for all of a definition, and of a Func.
template <class... Fs>
void walk(const Definition& definition, Fs&&... fs) {
  for_each_expr(definition, [&](const Expr& root) { walk(root, fs...); });
}
template <class... Fs>
void walk(const FuncContents& f, Fs&&... fs) {
  for (int s = 0; s < f.stage_count(); ++s) walk(f.stage(s), fs...);
}
template <class... Fs>
bool any_node(const Definition& definition, Fs&&... fs) {
  bool found = false;
  for_each_expr(definition, [&](const Expr& root) { found = found || any_node(root, fs...); });
  return found;
}

// Scalar and buffer parameters reached from the outputs, in first-use order.
std::vector<std::shared_ptr<ParameterContents>> parameters_of(const std::vector<FuncPtr>& outputs);

}  // namespace graph
}  // namespace retrograde
