// function.h -- the contents of a Func, as plain data: its definitions, schedule, provenance and constraints. The classes
// of the public API (Func, Stage, RDom, Param, ImageParam) are handles to these.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "graph/definitions/parameter_contents.h"
#include "graph/definitions/provenance.h"
#include "graph/definitions/reduction_domain.h"
#include "graph/directives/directive.h"
#include "graph/schedule.h"
#include "ir/visit.h"

namespace retrograde {

// Name mangling of an extern stage's symbol. Default follows the target: C, unless it has
// c_plus_plus_name_mangling.
enum class NameMangling : uint8_t { Default, C, CPlusPlus };

namespace graph {

// The bytes of one value of each type.
int total_bytes(const std::vector<Type>& types);

struct SourceLocation {
  std::string file;
  int line = 0;
};

// One definition: args <- values for all points of the pure args and the reduction variables at
// which the predicate holds.
struct Definition {
  std::vector<Expr> args;    // in a pure definition exactly the Func's args as Variables
  std::vector<Expr> values;  // one per Tuple element; all loads of a point happen before its stores
  Expr predicate;            // undefined: always true
  std::vector<ReductionVariable> rvars;
  StageLoops schedule;
};

// Func::define_extern: a stage that a C function computes on buffers.
struct ExternArgument {
  enum class Kind : uint8_t { Func, Buffer, Expr };
  Kind kind = Kind::Expr;
  std::shared_ptr<FuncContents> func;
  std::shared_ptr<ParameterContents> buffer;
  Expr expr;
};
struct ExternDefinition {
  std::string function;  // the symbol's name
  std::vector<ExternArgument> args;
  NameMangling mangling = NameMangling::Default;
};

// Pipeline::add_requirement: calls fail with the message unless the condition holds.
struct Requirement {
  Expr condition;             // over parameters only
  std::vector<Expr> message;  // parts, concatenated
};

// The user's derivative rules for a Func, which replace its definitions when it is differentiated. A graph only keeps
// them; the code that runs them derives its own type.
struct DerivativeRules {
  virtual ~DerivativeRules() = default;
};

// The contents of a Func: the Symbol behind each Call to it.
struct FuncContents : Symbol, std::enable_shared_from_this<FuncContents> {
  std::string name;                // unique in the process
  SourceLocation declared_at;      // where the user's handle was created
  std::vector<std::string> args;   // pure variables, dimension 0 first
  std::vector<Type> types;         // of each value
  std::optional<Definition> pure;  // empty until defined
  std::vector<Definition> updates;
  FuncPlacement schedule;
  std::vector<LoggedDirective> log;  // all directives of the Func and its stages, in order
  std::vector<std::shared_ptr<ParameterContents>>
      outputs;                            // constraints on its buffers when it is an output
  std::vector<Requirement> requirements;  // on calls when it is an output
  bool frozen = false;                    // another Func uses it: no more updates
  uint64_t version =
      0;  // increases with every definition and directive; code compiled earlier is stale
  TraceSchedule trace;
  std::string debug_file;  // debug_to_file: the file to write after it is computed; empty: none
  // When set, `pure` has args but no values and no loops, and there are no updates.
  std::optional<ExternDefinition> extern_definition;
  // Null when there are none; clones share it.
  std::shared_ptr<const DerivativeRules> custom_derivatives;
  // Func::in and clone_in: consumers named here read the wrapper instead; "" stands for all others.
  std::map<std::string, std::shared_ptr<FuncContents>> wrappers;
  // Func::copy_input: images named here are read through these Funcs.
  std::map<std::string, std::shared_ptr<FuncContents>> copied_inputs;
  // The types of the declaration Func f(type, dims); empty when not declared.
  std::vector<Type> required_types;
  int required_dimensions = -1;
  std::optional<Provenance> made;  // empty for a Func that the user wrote

  bool is_defined() const { return pure.has_value(); }
  int dimensions() const { return static_cast<int>(args.size()); }
  int stage_count() const { return pure ? 1 + static_cast<int>(updates.size()) : 0; }
  const Definition& stage(int index) const { return index == 0 ? *pure : updates[index - 1]; }
  Definition& stage(int index) { return index == 0 ? *pure : updates[index - 1]; }
  bool is_extern() const { return extern_definition.has_value(); }
  bool is_pure() const { return updates.empty() && !is_extern(); }
};
using FuncPtr = std::shared_ptr<FuncContents>;

// Creates a Func for the compiler; the caller adds its name and definitions.
FuncPtr make_func(Role role);
// Creates a Func for the compiler with a unique name like `name`, on behalf of the Func `of`.
FuncPtr make_func(Role role, const std::string& name, const std::string& of = "");

// The provenance of the called Func; null when the user wrote it, or no Func is called.
const Provenance* provenance_of(const Call& call);
// The Func behind a Call (CallType::Func); InternalError when it no longer exists.
FuncPtr func_of(const Call& call);

// Every Func that the outputs depend on, outputs included, producers before consumers. The order
// depends only on the program. UserError on recursion among Funcs and on undefined Funcs; it shows
// the path.
std::vector<FuncPtr> topological_order(const std::vector<FuncPtr>& outputs);
// Funcs called directly by any stage of f (f itself excluded), in first-use order.
std::vector<FuncPtr> direct_callees(const FuncContents& f);
// The variable that numbers the points which one iteration updates together; null for a single
// point.
const ReductionVariable* point_number(const Definition& definition);
int number_of_points(const Definition& definition);
// Visits every expression of a definition: args, values, predicate, rvar bounds.
void for_each_expr(const Definition& definition, const std::function<void(const Expr&)>& visit);
// Visits every expression of all definitions of a Func.
void for_each_expr(const FuncContents& f, const std::function<void(const Expr&)>& visit);
Definition map_exprs(const Definition& definition, const std::function<Expr(const Expr&)>& map);
// walk() of ir/visit.h for all expressions of a definition or a Func.
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

// Scalar and buffer parameters that the outputs depend on, in first-use order.
std::vector<std::shared_ptr<ParameterContents>> parameters_of(const std::vector<FuncPtr>& outputs);

}  // namespace graph
}  // namespace retrograde
