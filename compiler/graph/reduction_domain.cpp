#include "graph/reduction_domain.h"

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::ir {

std::shared_ptr<ReductionDomainContents> domain_of(const Variable& variable) {
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

}  // namespace retrograde::ir
