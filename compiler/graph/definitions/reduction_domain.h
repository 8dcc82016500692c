// reduction_domain.h -- the reduction loops of an update definition.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::graph {

// Reduction variables, innermost first, as listed in the RDom.
struct ReductionVariable {
  std::string var;  // unique in the process: "r$0.x"
  Expr min, extent;
  // Not a loop: its values number the points that one iteration of the other variables updates
  // together. Values, coordinates and predicates of all these points are computed before the first
  // is stored; the stores then happen in order. At most one per domain, the last; it starts at 0
  // and has a constant extent.
  bool numbers_points = false;
};
// The Symbol behind each RVar's Variable node.
struct ReductionDomainContents : Symbol {
  std::vector<ReductionVariable> vars;
  Expr predicate;       // RDom::where; undefined when none; may only grow until the domain is used
  bool frozen = false;  // used in a definition: where() is an error from now on
};

using DomainPtr = std::shared_ptr<ReductionDomainContents>;
// Creates a domain of these loops, already frozen; add_loop may add more.
DomainPtr make_domain(std::vector<ReductionVariable> loops = {});
// Adds a loop around the others with a unique name like `name`; returns its variable.
Expr add_loop(const DomainPtr& domain, const std::string& name, const Expr& min,
              const Expr& extent);
// The variable of a loop of the domain.
Expr loop_variable(const DomainPtr& domain, const std::string& name);

// The reduction domain that a variable belongs to; null for any other variable.
DomainPtr domain_of(const Variable& variable);
// `e` with every reference to `symbol`'s entity replaced by this one (weak or strong).
Expr rebind_symbol(const Expr& e, const SymbolRef& symbol);
// `e` with the variables of the symbol `from` bound to another symbol.
Expr rebind_symbol(const Expr& e, const Symbol* from, const SymbolRef& to);

}  // namespace retrograde::graph
