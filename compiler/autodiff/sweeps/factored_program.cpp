#include "autodiff/sweeps/factored_program.h"

#include <algorithm>
#include <optional>
#include <unordered_map>

#include "autodiff/sweeps/regions.h"
#include "diagnostics/error.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "transform/coarse_values.h"

namespace retrograde::autodiff {

namespace {

// An analysis of the graph, which few programs need.
class LazyRegions {
 public:
  LazyRegions(const std::vector<FuncPtr>& outputs, std::map<const Symbol*, Box> regions)
      : outputs_(outputs), regions_(std::move(regions)) {}

  // The range of a variable of a stage; unbounded: not known, or the Func is never read.
  Interval range(const FuncContents& f, int stage, const std::string& variable) {
    if (!all_) all_.emplace(topological_order(outputs_), regions_);
    if (all_->of(&f).size() != f.args.size()) return {};
    const std::vector<LoopVariable> loops = all_->domain(f, stage).vars;
    const auto loop = std::ranges::find(loops, variable, &LoopVariable::name);
    return loop == loops.end() ? Interval() : loop->range();
  }

 private:
  const std::vector<FuncPtr>& outputs_;
  const std::map<const Symbol*, Box> regions_;
  std::optional<Regions> all_;
};

// The regions of copied outputs.
std::map<const Symbol*, Box> renamed(const std::map<const Symbol*, Box>& regions,
                                     const FuncCopies& copies) {
  std::map<const Symbol*, Box> result;
  for (const auto& [symbol, box] : regions) {
    const FuncPtr* copy = find_or_null(copies, static_cast<const FuncContents*>(symbol));
    result[copy ? copy->get() : symbol] = box;
  }
  return result;
}

// Rules of users refer to the original Funcs.
bool may_be_copied(const FuncCopies& copies) {
  return std::ranges::none_of(copies, [](const auto& entry) {
    return entry.first->custom_derivatives || entry.first->is_extern();
  });
}

using Originals = std::unordered_map<const Symbol*, FuncPtr>;  // by copy

Originals originals_of(const std::vector<FuncPtr>& outputs, const FuncCopies& copies) {
  Originals originals;
  for (const FuncPtr& f : topological_order(outputs)) {
    if (const FuncPtr* copy = find_or_null(copies, f.get())) originals[copy->get()] = f;
  }
  return originals;
}

// Generated Funcs read the original Funcs instead of copies.
class Redirection {
 public:
  explicit Redirection(const Originals& originals) : originals_(originals) {}

  void apply(const FuncPtr& f) const {
    const auto map = [this](const Expr& e) { return redirected(e); };
    for (int s = 0; s < f->stage_count(); ++s) f->stage(s) = map_exprs(f->stage(s), map);
    for (AdjointWork& work : f->made->work) {
      work.values = mapped(work.values, map);
      work.loops = mapped(work.loops, map);
    }
  }

 private:
  Expr redirected(const Expr& e) const {
    return map_func_calls(e, [&](const Call& call, const std::vector<Expr>& args) {
      const FuncPtr* original = find_or_null(originals_, call.symbol.raw());
      return original ? call_func((*original)->name, call.type, args, call.component,
                                  SymbolRef(*original))
                      : Expr();
    });
  }
  const Originals& originals_;
};

// Every generated Func of the result.
std::vector<FuncPtr> generated(const SynthesisResult& result, const std::vector<FuncPtr>& factors) {
  std::vector<FuncPtr> roots = result.funcs;
  append(roots, factors);
  for (const auto& entry : result.after_stage) roots.push_back(entry.second);
  for (const auto& entry : result.parameters) roots.push_back(entry.second);
  for (const auto& entry : result.accumulators) roots.push_back(entry.second);
  std::vector<FuncPtr> funcs = topological_order(roots);
  std::erase_if(funcs, [](const FuncPtr& f) { return !f->made; });
  return funcs;
}

// Moves the adjoints of copies to the original Funcs.
void rename_adjoints(SynthesisResult& result, const Originals& originals) {
  decltype(result.after_stage) renamed;
  for (const auto& [key, adjoint] : result.after_stage) {
    const FuncPtr* original = find_or_null(originals, key.first);
    renamed[{original ? original->get() : key.first, key.second}] = adjoint;
  }
  result.after_stage = std::move(renamed);
}

}  // namespace

FactoredGraph with_factors(const std::vector<FuncPtr>& outputs,
                           const std::map<const Symbol*, Box>& regions) {
  LazyRegions all(outputs, regions);
  const auto range = [&](const FuncContents& f, int stage, const std::string& variable) {
    return all.range(f, stage, variable);
  };
  const FactoredGraph coarse =
      transform::hoist_coarse_values(outputs, range, transform::SumOrder::Free);
  LazyRegions of_coarse(coarse.outputs, renamed(regions, coarse.copies));
  LazyRegions& current = coarse.factors.empty() ? all : of_coarse;
  const auto values = [&](const FuncContents& f, int stage, const std::string& variable) {
    return constant_extent(current.range(f, stage, variable));
  };
  FactoredGraph invariant = hoist_invariant_factors(coarse.outputs, values);
  return transform::in_turn(coarse, std::move(invariant));
}

SynthesisResult synthesize_factored(const Seeds& seeds, const SynthesisOptions& options,
                                    Synthesize synthesize) {
  const std::vector<FuncPtr> outputs = outputs_of(seeds);
  const FactoredGraph factored = with_factors(outputs, regions_of(seeds));
  if (factored.factors.empty() || !may_be_copied(factored.copies))
    return synthesize(seeds, options);
  Seeds copied = seeds;
  for (size_t i = 0; i < seeds.size(); ++i) copied[i].output = factored.outputs[i];
  SynthesisOptions own = options;
  for (const auto& [f, copy] : factored.copies) {
    if (own.requested.erase(f) > 0) own.requested.insert(copy.get());
  }
  SynthesisResult result = synthesize(copied, own);
  const Originals originals = originals_of(outputs, factored.copies);
  rename_adjoints(result, originals);
  const Redirection redirection(originals);
  for (const FuncPtr& f : generated(result, factored.factors)) redirection.apply(f);
  result.funcs.insert(result.funcs.begin(), factored.factors.begin(), factored.factors.end());
  for (size_t i = 0; i < seeds.size(); ++i) result.outputs[i].func = seeds[i].output;
  for (size_t i = 0; i < factored.factors.size(); ++i) {
    result.explanations.push_back(
        {Explanation::Kind::Version, factored.factors[i]->made->of, factored.notes[i]});
  }
  return result;
}

}  // namespace retrograde::autodiff
