#include "graph/copy_graph.h"

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::graph {

namespace {

// One rewriter for all definitions, so that shared nodes are copied once.
class Copier : public Rewriter {
 public:
  GraphCopy run(const std::vector<FuncPtr>& outputs) {
    for (const FuncPtr& f : topological_order(outputs)) copy(f);
    for (const FuncPtr& output : outputs) copies_.outputs.push_back(copies_.of.at(output.get()));
    for (const auto& entry : copies_.of) redirect_prefetches(*entry.second, copies_.of);
    return std::move(copies_);
  }

 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override {
    const Expr mapped = children(e);
    const Call* call = mapped.as<Call>();
    if (call && is_weak_read(*call)) return owning_read(*call, call->args);
    if (!call || call->call_type != CallType::Func) return mapped;
    const FuncPtr& callee = copies_.of.at(static_cast<const FuncContents*>(call->symbol.raw()));
    const SymbolRef symbol = call->symbol.is_weak() ? SymbolRef::weak(callee) : SymbolRef(callee);
    return call_func(call->name, call->type, call->args, call->component, symbol);
  }

 private:
  void copy(const FuncPtr& f) {
    const FuncPtr copy = std::make_shared<FuncContents>(*f);
    copies_.of[f.get()] = copy;
    for (int s = 0; s < f->stage_count(); ++s)
      copy->stage(s) = map_exprs(f->stage(s), [&](const Expr& e) { return (*this)(e); });
    if (!copy->extern_definition) return;
    for (ExternArgument& arg : copy->extern_definition->args) {
      if (arg.kind == ExternArgument::Kind::Func) arg.func = copies_.of.at(arg.func.get());
    }
  }

  GraphCopy copies_;
};

}  // namespace

bool is_weak_read(const Call& call) {
  return call.call_type == CallType::Image && call.symbol.is_weak();
}

Expr owning_read(const Call& call, std::vector<Expr> args) {
  return call_image(call.name, call.type, std::move(args), SymbolRef(call.symbol.lock()));
}

void redirect_prefetches(FuncContents& f, const FuncCopies& copies) {
  for (int s = 0; s < f.stage_count(); ++s) {
    for (PrefetchDirective& prefetch : f.stage(s).schedule.prefetches) {
      const auto* source = static_cast<const FuncContents*>(prefetch.symbol.raw());
      if (const auto* copy = find_or_null(copies, source)) prefetch.symbol = SymbolRef::weak(*copy);
    }
  }
}

GraphCopy copy_graph(const std::vector<FuncPtr>& outputs) { return Copier().run(outputs); }

}  // namespace retrograde::graph
