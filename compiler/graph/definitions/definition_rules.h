// definition_rules.h -- the rules that both sides of a definition must obey.
//
// They are checked in this order: number of arguments, defined expressions, types, free variables.
// For pure definitions, the arguments must be distinct Vars. For updates, all reduction variables
// must come from one domain, the Func must not be frozen, and a pure variable must keep its position
// in every reference of the Func to itself.
#pragma once

#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

// The names in a definition: each free variable once, without names bound by lets.
struct NamesInDefinition {
  std::vector<const Variable*> free;
  std::vector<const Call*> self_calls;
  std::vector<FuncPtr> callees;
};
NamesInDefinition names_in(const FuncContents& f, const std::vector<Expr>& roots);

// Checks one definition of a Func. Each check throws CompileError if its rule is broken, the
// constructor if an argument is undefined.
class DefinitionRules {
 public:
  DefinitionRules(const FuncContents& f, const std::vector<Expr>& args, bool is_update);

  // ---- of every definition ----

  void check_values(const std::vector<Expr>& values) const;
  // An undef value means that nothing is stored; an undef coordinate has no meaning. `exprs`: all
  // expressions of both sides.
  void check_coordinates(const std::vector<Expr>& args, const std::vector<Expr>& exprs) const;
  // `exprs`: all expressions of both sides, as the user wrote them.
  void check_constants(const std::vector<Expr>& exprs) const;
  void check_free_variables(const NamesInDefinition& names,
                            const std::vector<std::string>& args) const;
  // The reduction domain of a definition, null when it has none. `result`: the domain, if already
  // known.
  DomainPtr domain_in(const NamesInDefinition& names, DomainPtr result = nullptr) const;

  // ---- of the pure definition ----

  void check_is_first() const;
  // The names of the arguments.
  std::vector<std::string> pure_names(const std::vector<Expr>& args) const;
  void check_declared(size_t dimensions, const std::vector<Expr>& values) const;
  void check_no_reduction(const DomainPtr& domain) const;

  // ---- of updates ----

  // `names`: those of the new values.
  void check_is_updatable(const NamesInDefinition& names) const;
  void check_arity(const std::vector<Expr>& args) const;
  // `whose`: the definition or declaration with these types.
  void check_types(const std::vector<Expr>& values, const std::vector<Type>& types,
                   const char* whose) const;
  // The coordinates of the left-hand side as int32.
  std::vector<Expr> update_coordinates(const std::vector<Expr>& args) const;
  // Dimensions in which the left-hand side is the pure variable itself; their iterations are
  // independent. The name is empty in the others.
  std::vector<std::string> pure_positions(const std::vector<Expr>& args) const;
  void check_self_calls(const NamesInDefinition& names, const std::vector<std::string>& pure) const;
  void check_bounds(const ReductionDomainContents& domain) const;

 private:
  void check_direct_reads(const NamesInDefinition& names) const;

  const FuncContents& f_;
  std::string asked_;  // begins messages: "define "f"(x, r.x)"
};

// CompileError unless `e` has one value throughout a call: it may contain parameters, buffer
// metadata, constants and operators. `what` names it in the message: "the condition".
void check_over_parameters(const Expr& e, const char* what, const std::string& asked);

}  // namespace retrograde::graph
