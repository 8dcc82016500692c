#include "autodiff/updates/versions.h"

#include "autodiff/sums/generated_definitions.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

FuncPtr clone_prefix(const FuncPtr& f, int stages, const std::string& name, Role role,
                     ExprMap map) {
  FuncPtr g =
      make_func(role, name.empty() ? text(f->name, "_before_update", stages - 1) : name, f->name);
  if (f->made) g->made->traits = f->made->traits;
  define_pure(g, variables_of(f->args), mapped(f->pure->values, map));
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
    append(args, extra);
    return call_value(g, args, call.component);
  });
}

Expr iteration_number(const std::vector<ReductionVariable>& rvars) {
  const DomainPtr domain = make_domain(rvars);
  Expr result = make_zero(Int(32)), stride = make_one(Int(32));
  for (const ReductionVariable& r : rvars) {
    result = result + (loop_variable(domain, r.var) - r.min) * stride;
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

Substitution mirrored(const std::vector<ReductionVariable>& loops) {
  Substitution places;
  for (const ReductionVariable& r : loops) places[r.var] = mirrored(r, variable(r.var));
  return places;
}

Substitution add_copies(const DomainPtr& domain, const std::vector<ReductionVariable>& rvars) {
  Substitution names;
  for (const ReductionVariable& r : rvars) names[r.var] = add_loop(domain, r.var, r.min, r.extent);
  return names;
}

Expr choose_step(const Expr& condition, const Expr& a, const Expr& b) {
  return equal(a, b) ? a : call_op(Op::if_then_else, a.type(), {condition, a, b});
}

}  // namespace retrograde::autodiff
