#include "autodiff/sums/generated_definitions.h"

#include "autodiff/sweeps/local_derivative.h"
#include "graph/definitions/define.h"
#include "graph/directives/directive.h"
#include "ir/build.h"

namespace retrograde::autodiff {

Expr call_value(const FuncPtr& f, const std::vector<Expr>& args, int index) {
  return call_func(f->name, f->types.at(static_cast<size_t>(index)), args, index, SymbolRef(f));
}

std::vector<Expr> values_of(const FuncPtr& f, const std::vector<Expr>& args) {
  return numbered(f->types.size(),
                  [&](size_t k) { return call_value(f, args, static_cast<int>(k)); });
}

void note_traits(const FuncPtr& f, const std::vector<Expr>& adjoints) {
  if (!f->made) return;
  for (const Expr& e : adjoints) {
    if (e.defined()) f->made->traits.add(traits_of(e));
  }
}

namespace {

// Freezes the callees of this definition only; an adjoint may get hundreds of definitions.
void freeze_callees(const Definition& d, const FuncContents& f) {
  walk(d, [&](const Call& call) {
    const FuncPtr callee = call.call_type == CallType::Func ? func_of(call) : nullptr;
    if (callee && callee.get() != &f) callee->frozen = true;
  });
}

}  // namespace

void append_update(const FuncPtr& f, std::vector<Expr> args, std::vector<Expr> values,
                   const std::vector<ReductionVariable>& rvars, Expr predicate) {
  Definition update;
  note_traits(f, values);
  for (Expr& e : args) e = cast_to(Int(32), e);
  update.args = std::move(args);
  update.values = std::move(values);
  update.rvars = rvars;
  if (predicate.defined() && !is_const_true(predicate)) update.predicate = predicate;
  update = map_exprs(update, [&](const Expr& e) { return redirect_calls(e, f, f, true); });
  update.schedule.dims = first_loops(*f, update);
  freeze_callees(update, *f);
  f->updates.push_back(std::move(update));
  f->version++;
}

void append_sums(const FuncPtr& f, const std::vector<Expr>& args, const std::vector<Expr>& terms,
                 const std::vector<ReductionVariable>& rvars, const Expr& predicate) {
  std::vector<Expr> values = values_of(f, args);
  for (size_t k = 0; k < values.size(); ++k) {
    if (terms[k].defined()) values[k] = values[k] + cast_to(values[k].type(), terms[k]);
  }
  append_update(f, args, std::move(values), rvars, predicate);
}

}  // namespace retrograde::autodiff
