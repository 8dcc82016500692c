#include "autodiff/matrices/colour_dimension.h"

#include <algorithm>
#include <unordered_map>

#include "autodiff/sums/generated_definitions.h"
#include "diagnostics/error.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

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
    return value_or(lifted_, output.get(), nullptr);
  }

 private:
  bool depends(const FuncContents& f) const {
    return std::ranges::any_of(direct_callees(f),
                               [&](const FuncPtr& g) { return lifted_.contains(g.get()); });
  }

  void lift(const FuncPtr& f) {
    // The pattern of derivatives, which is computed earlier, refuses extern stages.
    if (f->is_extern()) internal_error("an extern stage lies on the way of several seeds");
    const FuncPtr result = make_func(Role::Coloured, f->name + "_by_colour", f->name);
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
    return mapped(list, [&](const Expr& e) { return map(e); });
  }
  Expr map(const Expr& root) const {
    return map_func_calls(root, [&](const Call& call, std::vector<Expr> args) {
      auto found = lifted_.find(call.symbol.raw());
      if (found == lifted_.end()) return Expr();
      args.push_back(colour_);
      return call_value(found->second, args, call.component);
    });
  }

  Expr colour_;
  std::unordered_map<const Symbol*, FuncPtr> lifted_;
};

}  // namespace

FuncPtr with_seeds(const FuncPtr& output, const FuncPtr& seed, const FuncPtr& seeds) {
  return Lifter(seed, seeds).run(output);
}

}  // namespace retrograde::autodiff
