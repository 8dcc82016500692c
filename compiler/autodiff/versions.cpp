#include "autodiff/versions.h"

#include "autodiff/accumulation.h"
#include "autodiff/default_schedule.h"
#include "autodiff/reverse_sweep.h"
#include "frontend/define.h"
#include "frontend/var.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

FuncPtr clone_prefix(const FuncPtr& f, int stages) {
  FuncPtr g = std::make_shared<AdjointContents>();
  g->name = claim_name(f->name + "_before_update" + std::to_string(stages - 1));
  std::vector<Expr> args;
  for (const std::string& arg : f->args) args.push_back(variable(arg));
  define_pure(g, args, f->pure->values);
  for (int s = 1; s < stages; ++s) {
    Definition copy =
        map_exprs(f->stage(s), [&](const Expr& e) { return redirect_calls(e, f, g, false); });
    append_update(g, copy.args, copy.values, copy.rvars, copy.predicate);
  }
  return g;
}

Expr call_instead(const Expr& e, const FuncPtr& f, const FuncPtr& g,
                  const std::vector<Expr>& extra) {
  return rewrite(e, [&](const Expr& part, const std::function<Expr(const Expr&)>& recurse) {
    const auto* call = part.as<Call>();
    if (!call || call->call_type != CallType::Func || call->symbol.raw() != f.get())
      return map_children(part, recurse);
    std::vector<Expr> args;
    for (const Expr& arg : call->args) args.push_back(recurse(arg));
    args.insert(args.end(), extra.begin(), extra.end());
    return call_value(g, args, call->value_index);
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

namespace {

bool reads_at_pure_point_only(const FuncPtr& f, const Definition& definition) {
  bool ok = true;
  for (size_t d = 0; d < f->args.size(); ++d) ok &= is_pure_position(*f, definition, d);
  for_each_expr(definition, [&](const Expr& root) {
    walk(root, [&](const Expr& e) {
      const auto* call = e.as<Call>();
      if (!call || call->call_type != CallType::Func || call->symbol.raw() != f.get()) return ok;
      for (size_t d = 0; d < f->args.size(); ++d) {
        const auto* v = call->args[d].as<Variable>();
        ok &= v && v->name == f->args[d];
      }
      return ok;
    });
  });
  return ok;
}

}  // namespace

std::optional<Versions> keep_versions(const FuncPtr& f, int stage, const FuncPtr& before,
                                      const Box& region) {
  const Definition& definition = f->stage(stage);
  if (definition.rvars.empty() || !reads_at_pure_point_only(f, definition)) return std::nullopt;
  FuncPtr g = std::make_shared<AdjointContents>();
  g->name = claim_name(f->name + "_versions");
  std::vector<Expr> args;
  for (const std::string& arg : f->args) args.push_back(variable(arg));
  std::vector<Expr> point = args;
  point.push_back(variable(unique_name("version")));
  std::vector<Expr> initial;
  for (size_t k = 0; k < f->types.size(); ++k)
    initial.push_back(call_value(before, args, static_cast<int>(k)));
  define_pure(g, point, initial);

  Expr t = iteration_number(definition.rvars);
  std::vector<Expr> lhs = args, old = args, values;
  lhs.push_back(t + 1);
  old.push_back(t);
  for (size_t k = 0; k < f->types.size(); ++k) {
    Expr value = call_instead(without_lets(definition.values[k]), f, g, {t});
    if (definition.predicate.defined()) {
      value = make_select(without_lets(definition.predicate), value,
                          call_value(g, old, static_cast<int>(k)));
    }
    values.push_back(value);
  }
  append_update(g, lhs, values, definition.rvars, {});
  Box box = region;
  box.push_back({make_zero(Int(32)), iteration_count(definition.rvars)});
  return Versions{g, box};
}

}  // namespace retrograde::ir
