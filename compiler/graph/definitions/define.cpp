// define.cpp -- builds definitions once definition_rules.h accepts both sides.
#include "graph/definitions/define.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "graph/definitions/definition_rules.h"
#include "graph/definitions/own_reads.h"
#include "graph/definitions/random_sequence.h"
#include "graph/directives/directive.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::graph {

namespace {

void freeze(const NamesInDefinition& names) {
  for (const FuncPtr& callee : names.callees) callee->frozen = true;
}

// A random number depends on the Func, the stage and the point where it is evaluated.
Expr bind_random(const Expr& e, const std::vector<Expr>& point) {
  return rewrite(e, [&](const Expr& part, const auto& recurse) -> Expr {
    const Call* call = as_op(part, Op::random);
    if (!call || call->args.size() != 1) return {};
    std::vector<Expr> words{recurse(call->args[0])};
    append(words, point);
    return call_op(Op::random, call->type, std::move(words));
  });
}

bool has_random(const std::vector<Expr>& values) {
  const auto is_random = [](const Call& call) { return call.is_op(Op::random); };
  return std::ranges::any_of(values, [&](const Expr& value) { return any_node(value, is_random); });
}

std::vector<Expr> bind_all_random(const FuncContents& f, int stage,
                                  const std::vector<std::string>& variables,
                                  std::vector<Expr> values) {
  if (!has_random(values)) return values;
  std::vector<Expr> point{Expr(static_cast<int32_t>(static_cast<uint32_t>(random_tag(f.name)) +
                                                    static_cast<uint32_t>(stage)))};
  for (const std::string& name : variables) point.push_back(variable(name));
  for (Expr& value : values) value = bind_random(value, point);
  return values;
}

std::vector<Expr> with(std::vector<Expr> all, const std::vector<Expr>& more) {
  append(all, more);
  return all;
}

// The domain in a form that an update of f may own. If its predicate reads f, ownership would be
// cyclic and leak both; such a domain is copied with weak references to f.
DomainPtr domain_for(const FuncPtr& f, const DomainPtr& domain) {
  if (!domain->predicate.defined()) return domain;
  const Expr released = redirect_calls(domain->predicate, f, f, true);
  if (released.same_as(domain->predicate)) return domain;
  const auto copy = std::make_shared<ReductionDomainContents>(*domain);
  copy->predicate = rebind_symbol(released, domain.get(), SymbolRef::weak(copy));
  return copy;
}

Definition make_update(const FuncPtr& f, std::vector<Expr> args, std::vector<Expr> values,
                       const DomainPtr& declared) {
  Definition update;
  update.args = std::move(args);
  update.values = std::move(values);
  DomainPtr domain = declared;
  if (declared) {
    declared->frozen = true;
    domain = domain_for(f, declared);
    update.rvars = domain->vars;
    if (domain->predicate.defined())
      update.predicate = rebind_symbol(domain->predicate, SymbolRef(domain));
  }
  return map_exprs(update, [&](const Expr& e) {
    const Expr own = redirect_calls(e, f, f, true);
    return domain == declared ? own : rebind_symbol(own, declared.get(), SymbolRef(domain));
  });
}

}  // namespace

void make_outputs(FuncContents& f) {
  if (!f.outputs.empty()) return;
  const std::vector<Type>& types = f.types.empty() ? f.required_types : f.types;
  const int dimensions = f.types.empty() ? f.required_dimensions : f.dimensions();
  for (size_t i = 0; i < types.size(); i++) {
    auto output = std::make_shared<ParameterContents>();
    output->name = types.size() == 1 ? f.name : f.name + "." + std::to_string(i);
    output->type = types[i];
    output->is_buffer = true;
    output->dimensions = dimensions;
    output->constraints.resize(static_cast<size_t>(dimensions));
    f.outputs.push_back(std::move(output));
  }
}

std::string source_location_of(const FuncContents& f) {
  return f.declared_at.file.empty() ? "" : text(f.declared_at.file, ":", f.declared_at.line);
}

std::string stage_name(const FuncContents& f, int stage) {
  return stage == 0 ? f.name : text(f.name, ".update(", stage - 1, ")");
}

Expr redirect_calls(const Expr& e, const FuncPtr& from, const FuncPtr& to, bool weak) {
  return map_calls_of(e, from.get(), [&](const Call& call, const std::vector<Expr>& args) {
    SymbolRef symbol = weak ? SymbolRef::weak(to) : SymbolRef(to);
    return call_func(to->name, call.type, args, call.component, std::move(symbol));
  });
}

void define_pure(const FuncPtr& f, const std::vector<Expr>& args, const std::vector<Expr>& raw) {
  const DefinitionRules rules(*f, args, false);
  rules.check_is_first();
  rules.check_values(raw);
  rules.check_constants(raw);
  const std::vector<std::string> variables = rules.pure_names(args);
  rules.check_declared(args.size(), raw);
  rules.check_no_reduction(rules.domain_in(names_in(*f, raw)));
  const std::vector<Expr> values = settled(raw);
  rules.check_coordinates({}, values);
  const NamesInDefinition names = names_in(*f, values);
  rules.check_free_variables(names, variables);

  freeze(names);
  f->args = variables;
  for (const Expr& value : values) f->types.push_back(value.type());
  Definition pure;
  pure.args = variables_of(variables);
  pure.values = bind_all_random(*f, 0, variables, values);
  f->pure = std::move(pure);
  f->pure->schedule.dims = first_loops(*f, *f->pure);
  f->schedule.storage_dims = variables;
  make_outputs(*f);
  f->version++;
}

// The domain comes from the expressions as written; all other checks apply to the folded
// expressions.
void define_update(const FuncPtr& f, const std::vector<Expr>& raw_args,
                   const std::vector<Expr>& raw_values, const DomainPtr& declared) {
  const DefinitionRules rules(*f, raw_args, true);
  rules.check_is_updatable(names_in(*f, raw_values));
  rules.check_arity(raw_args);
  rules.check_values(raw_values);
  rules.check_constants(with(raw_args, raw_values));
  rules.check_types(raw_values, f->types, "the first definition");
  const auto domain = rules.domain_in(names_in(*f, with(raw_args, raw_values)), declared);
  std::vector<Expr> exprs = settled(with(rules.update_coordinates(raw_args), raw_values));
  const auto first_value = exprs.begin() + static_cast<std::ptrdiff_t>(raw_args.size());
  const std::vector<Expr> args(exprs.begin(), first_value), values(first_value, exprs.end());
  if (domain && domain->predicate.defined()) exprs.push_back(domain->predicate);
  rules.check_coordinates(args, exprs);
  const NamesInDefinition names = names_in(*f, exprs);
  rules.domain_in(names, domain);  // the predicate may mention another domain
  if (domain) rules.check_bounds(*domain);
  const std::vector<std::string> pure = rules.pure_positions(args);
  rules.check_free_variables(names, pure);
  rules.check_self_calls(names, pure);

  freeze(names);
  auto variables = filtered(pure, [&](const std::string& name) { return !name.empty(); });
  if (domain) {
    for (const ReductionVariable& rvar : domain->vars) variables.push_back(rvar.var);
  }
  const int stage = f->stage_count();
  Definition update = make_update(f, args, bind_all_random(*f, stage, variables, values), domain);
  update.schedule.dims = first_loops(*f, update);
  f->updates.push_back(std::move(update));
  f->version++;
}

}  // namespace retrograde::graph