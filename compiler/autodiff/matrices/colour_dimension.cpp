#include "autodiff/matrices/colour_dimension.h"

#include <unordered_map>

#include "autodiff/sweeps/accumulation.h"
#include "diagnostics/error.h"
#include "frontend/language/var.h"
#include "graph/define.h"
#include "graph/function.h"
#include "ir/build.h"
#include "ir/variables.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

class Lifter {
 public:
  Lifter(const FuncPtr& seed, const FuncPtr& seeds) : colour_(variable(unique_name("colour"))) {
    lifted_[seed.get()] = seeds;
  }

  FuncPtr run(const FuncPtr& output) {
    for (const FuncPtr& f : topological_order({output})) {
      if (!lifted_.contains(f.get()) && depends(*f)) lift(f);
    }
    auto found = lifted_.find(output.get());
    return found == lifted_.end() ? nullptr : found->second;
  }

 private:
  bool depends(const FuncContents& f) const {
    for (const FuncPtr& callee : direct_callees(f)) {
      if (lifted_.contains(callee.get())) return true;
    }
    return false;
  }

  void lift(const FuncPtr& f) {
    // The pattern of derivatives, which is found before, refuses extern stages.
    if (f->is_extern()) internal_error("an extern stage lies on the way of several seeds");
    const FuncPtr result = make_func(Role::Coloured);
    result->name = claim_name(f->name + "_by_colour");
    result->made->of = f->name;
    if (f->made) result->made->traits = f->made->traits;
    lifted_[f.get()] = result;
    std::vector<Expr> args = variables_of(f->args);
    args.push_back(colour_);
    define_pure(result, args, map_all(f->pure->values));
    for (const Definition& update : f->updates) {
      args = map_all(update.args);
      args.push_back(colour_);
      append_update(result, args, map_all(update.values), update.rvars, map(update.predicate));
    }
  }

  std::vector<Expr> map_all(const std::vector<Expr>& list) const {
    std::vector<Expr> result;
    for (const Expr& e : list) result.push_back(map(e));
    return result;
  }
  Expr map(const Expr& root) const {
    if (!root.defined()) return root;
    return rewrite(root, [&](const Expr& e, const std::function<Expr(const Expr&)>& recurse) {
      Expr mapped = map_children(e, recurse);
      const auto* call = mapped.as<Call>();
      if (!call || call->call_type != CallType::Func) return mapped;
      auto found = lifted_.find(call->symbol.raw());
      if (found == lifted_.end()) return mapped;
      std::vector<Expr> args = call->args;
      args.push_back(colour_);
      return call_func(found->second->name, call->type, args, call->component,
                       SymbolRef(found->second));
    });
  }

  Expr colour_;
  std::unordered_map<const Symbol*, FuncPtr> lifted_;
};

}  // namespace

FuncPtr with_seeds(const FuncPtr& output, const FuncPtr& seed, const FuncPtr& seeds) {
  return Lifter(seed, seeds).run(output);
}

}  // namespace retrograde::ir
