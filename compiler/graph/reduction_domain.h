// reduction_domain.h -- the loops that belong to an update definition.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "ir/expr.h"

namespace retrograde::graph {

// Reduction variables innermost first, as listed in the RDom.
struct ReductionVariable {
  std::string var;  // unique in the process: "r$0.x"
  Expr min, extent;
  // No loop: its values number the points that one iteration of the others updates at once. Values,
  // places and predicates of all of them are computed before the first is stored; then they are
  // stored in order. At most one of a domain, the last; from 0 on, of constant extent.
  bool numbers_points = false;
};
// Symbol behind each RVar's Variable node.
struct ReductionDomainContents : Symbol {
  std::vector<ReductionVariable> vars;
  Expr predicate;       // RDom::where, undefined when none; may only grow until the domain is used
  bool frozen = false;  // used in a definition: where() is an error from now on
};

using DomainPtr = std::shared_ptr<ReductionDomainContents>;
// A domain that is used: of these loops, and of those that add_loop gives it.
DomainPtr make_domain(std::vector<ReductionVariable> loops = {});
// One more loop around the others, called after `name`: its variable.
Expr add_loop(const DomainPtr& domain, const std::string& name, const Expr& min,
              const Expr& extent);
// The variable of a loop of the domain.
Expr loop_variable(const DomainPtr& domain, const std::string& name);

// The reduction domain that a variable belongs to; null for any other variable.
DomainPtr domain_of(const Variable& variable);
// `e` with every mention of `symbol`'s entity made through this very reference (weak or strong).
Expr rebind_symbol(const Expr& e, const SymbolRef& symbol);
// With the variables of the symbol `from` referring to another.
Expr rebind_symbol(const Expr& e, const Symbol* from, const SymbolRef& to);

}  // namespace retrograde::graph
