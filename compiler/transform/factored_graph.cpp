#include "transform/factored_graph.h"

#include <algorithm>

#include "graph/copy_graph.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::transform {

FactoredGraph in_turn(const FactoredGraph& first, FactoredGraph second) {
  FactoredGraph result;
  result.outputs = std::move(second.outputs);
  for (const auto& [f, copy] : first.copies) {
    const FuncPtr* again = find_or_null(second.copies, copy.get());
    result.copies[f] = again ? *again : copy;
  }
  for (const FuncPtr& factor : first.factors) {
    const FuncPtr* copy = find_or_null(second.copies, factor.get());
    result.factors.push_back(copy ? *copy : factor);
  }
  const auto is_of_first = [&](const FuncContents* f) {
    const auto is_f = [&](const auto& entry) { return entry.second.get() == f; };
    return std::ranges::any_of(first.copies, is_f) ||
           std::ranges::find(first.factors, f, &FuncPtr::get) != first.factors.end();
  };
  for (const auto& [f, copy] : second.copies) {
    if (!is_of_first(f)) result.copies[f] = copy;
  }
  append(result.factors, second.factors);
  result.notes = first.notes;
  append(result.notes, second.notes);
  return result;
}

bool is_users(const FuncContents& f) {
  return !f.made && !f.is_extern() && !f.custom_derivatives && !has_directives(f);
}

std::vector<Definition> stages_of(const FuncContents& f) {
  std::vector<Definition> stages;
  for (int s = 0; s < f.stage_count(); ++s) stages.push_back(f.stage(s));
  return stages;
}

GraphFactoring::GraphFactoring(const std::vector<FuncPtr>& outputs)
    : outputs_(outputs), order_(topological_order(outputs)) {}

bool GraphFactoring::reads_copies(const FuncContents& f) const {
  return !result_.copies.empty() &&
         std::ranges::any_of(direct_callees(f), [&](const FuncPtr& g) { return is_copied(*g); });
}

void GraphFactoring::copy(const FuncPtr& f, const std::vector<Definition>& stages,
                          const FactorReads& reads) {
  const FuncPtr copied = std::make_shared<FuncContents>(*f);
  result_.copies[f.get()] = copied;
  const auto map = [&](const Expr& e) { return redirected(e, reads); };
  for (size_t s = 0; s < stages.size(); ++s)
    copied->stage(static_cast<int>(s)) = map_exprs(stages[s], map);
  if (!copied->extern_definition) return;
  for (ExternArgument& arg : copied->extern_definition->args) {
    const auto* other = arg.func ? find_or_null(result_.copies, arg.func.get()) : nullptr;
    if (other) arg.func = *other;
  }
}

Expr GraphFactoring::redirected(const Expr& e, const FactorReads& reads) const {
  return rewrite(e, [&](const Expr& node, const auto& recurse) -> Expr {
    if (const Expr* read = find_or_null(reads, node.get())) return *read;
    const auto* call = node.as<Call>();
    if (call && graph::is_weak_read(*call))
      return graph::owning_read(*call, mapped(call->args, recurse));
    if (!call || call->call_type != CallType::Func) return {};
    const FuncPtr* copied =
        find_or_null(result_.copies, static_cast<const FuncContents*>(call->symbol.raw()));
    if (!copied) return {};
    const SymbolRef symbol = call->symbol.is_weak() ? SymbolRef::weak(*copied) : SymbolRef(*copied);
    return call_func(call->name, call->type, mapped(call->args, recurse), call->component, symbol);
  });
}

void GraphFactoring::add_factor(const FuncPtr& factor, const std::string& note) {
  result_.factors.push_back(factor);
  result_.notes.push_back(note);
}

FactoredGraph GraphFactoring::finish() {
  for (const FuncPtr& f : outputs_) {
    const auto* copied = find_or_null(result_.copies, f.get());
    result_.outputs.push_back(copied ? *copied : f);
  }
  for (const auto& entry : result_.copies) redirect_prefetches(*entry.second, result_.copies);
  return std::move(result_);
}

}  // namespace retrograde::transform
