#include "graph/definitions/reduction_domain.h"

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::graph {

DomainPtr make_domain(std::vector<ReductionVariable> loops) {
  const auto domain = std::make_shared<ReductionDomainContents>();
  domain->vars = std::move(loops);
  domain->frozen = true;
  return domain;
}

Expr add_loop(const DomainPtr& domain, const std::string& name, const Expr& min,
              const Expr& extent) {
  domain->vars.push_back({unique_name(name), min, extent});
  return loop_variable(domain, domain->vars.back().var);
}

Expr loop_variable(const DomainPtr& domain, const std::string& name) {
  return variable(name, Int(32), SymbolRef(domain));
}

DomainPtr domain_of(const Variable& variable) {
  if (!variable.symbol.defined()) return nullptr;
  return std::dynamic_pointer_cast<ReductionDomainContents>(variable.symbol.lock());
}

Expr rebind_symbol(const Expr& e, const SymbolRef& symbol) {
  return rebind_symbol(e, symbol.raw(), symbol);
}

Expr rebind_symbol(const Expr& e, const Symbol* from, const SymbolRef& to) {
  return rewrite(e, [&](const Expr& part, const auto&) {
    const Variable* v = part.as<Variable>();
    return v && v->symbol.raw() == from ? variable(v->name, v->type, to) : Expr();
  });
}

}  // namespace retrograde::graph
