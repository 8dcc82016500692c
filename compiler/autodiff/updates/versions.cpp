#include "autodiff/updates/versions.h"

#include "autodiff/sweeps/accumulation.h"
#include "autodiff/sweeps/reverse_sweep.h"
#include "frontend/language/var.h"
#include "graph/define.h"
#include "graph/function.h"
#include "graph/own_reads.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/variables.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

FuncPtr clone_prefix(const FuncPtr& f, int stages, const std::string& name, Role role,
                     ExprMap map) {
  FuncPtr g = make_func(role);
  g->made->of = f->name;
  if (f->made) g->made->traits = f->made->traits;
  g->name =
      claim_name(name.empty() ? f->name + "_before_update" + std::to_string(stages - 1) : name);
  std::vector<Expr> values;
  for (const Expr& v : f->pure->values) values.push_back(map(v));
  define_pure(g, variables_of(f->args), values);
  for (int s = 1; s < stages; ++s) {
    Definition stage =
        map_exprs(f->stage(s), [&](const Expr& e) { return redirect_calls(map(e), f, g, false); });
    append_update(g, stage.args, stage.values, stage.rvars, stage.predicate);
  }
  return g;
}

Expr call_instead(const Expr& e, const FuncPtr& f, const FuncPtr& g,
                  const std::vector<Expr>& extra) {
  return map_calls_of(e, f.get(), [&](const Call& call, std::vector<Expr> args) {
    args.insert(args.end(), extra.begin(), extra.end());
    return call_value(g, args, call.component);
  });
}

Expr iteration_number(const std::vector<ReductionVariable>& rvars) {
  auto rdom = std::make_shared<ReductionDomainContents>();
  rdom->vars = rvars;
  rdom->frozen = true;
  Expr result = make_zero(Int(32)), stride = make_one(Int(32));
  for (const ReductionVariable& r : rvars) {
    result = result + (variable(r.var, Int(32), SymbolRef(rdom)) - r.min) * stride;
    stride = stride * r.extent;
  }
  return simplify(result);
}

Expr iteration_count(const std::vector<ReductionVariable>& rvars) {
  Expr result = make_one(Int(32));
  for (const ReductionVariable& r : rvars) result = result * r.extent;
  return simplify(result);
}

Expr mirrored(const ReductionVariable& loop, const Expr& at) {
  return loop.min + (loop.min + (loop.extent - 1) - at);
}

Substitution add_copies(const std::shared_ptr<ReductionDomainContents>& domain,
                        const std::vector<ReductionVariable>& rvars) {
  Substitution names;
  for (const ReductionVariable& r : rvars) {
    domain->vars.push_back({unique_name(r.var), r.min, r.extent});
    names[r.var] = variable(domain->vars.back().var, Int(32), SymbolRef(domain));
  }
  return names;
}

Expr choose_step(const Expr& condition, const Expr& a, const Expr& b) {
  return equal(a, b) ? a : call_op(Op::if_then_else, a.type(), {condition, a, b});
}

}  // namespace retrograde::ir
