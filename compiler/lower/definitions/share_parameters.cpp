#include "lower/definitions/share_parameters.h"

#include <algorithm>
#include <map>
#include <unordered_set>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

// The size of a tree, in nodes, from which it gets a name.
constexpr int large = 24;

class ParameterSharer : public Rewriter {
 public:
  std::vector<std::pair<std::string, Expr>> names;

 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override {
    const Expr result = children(e);
    if (result.type() != Int(32) || !is_arithmetic(result)) return result;
    const int size = tree_size(result);
    return size >= large ? named(result) : result;
  }

 private:
  std::map<Expr, Expr, StructuralLess> known_;
  std::unordered_set<std::string> made_;
  NodeMemo<int> sizes_;

  static bool is_arithmetic(const Expr& e) { return e.as<Binary>() || e.as<Select>(); }

  bool is_parameter(const Variable& v) const {
    return made_.contains(v.name) ||
           dynamic_cast<const ParameterContents*>(v.symbol.raw()) != nullptr;
  }

  // The size of an integer or condition that consists of parameters only; 0 for any other expression.
  int tree_size(const Expr& e) {
    return sizes_.get(e, [&] { return counted(e); });
  }
  int counted(const Expr& e) {
    if (const auto* v = e.as<Variable>()) return is_parameter(*v) ? 1 : 0;
    if (is_const(e)) return 1;
    const bool followed = is_arithmetic(e) || e.as<Not>() || e.as<Cast>();
    bool uniform = followed && !e.type().is_float();
    int size = 1;
    for_each_child(e, [&](const Expr& child) {
      const int below = uniform ? tree_size(child) : 0;
      uniform &= below > 0;
      size = std::min(size + below, 1 << 20);
    });
    return uniform ? size : 0;
  }

  Expr named(const Expr& e) {
    const Expr value = simplify(e);
    if (tree_size(value) < large) return value;
    auto [it, is_new] = known_.try_emplace(value);
    if (is_new) {
      names.emplace_back("shared." + std::to_string(names.size()), value);
      made_.insert(names.back().first);
      it->second = variable(names.back().first);
    }
    return it->second;
  }
};

bool has_memoized(const Program& program) {
  return std::any_of(program.funcs.begin(), program.funcs.end(),
                     [](const LoopedFunc& f) { return f.schedule.memoized; });
}

}  // namespace

void share_parameters(Program& program) {
  if (has_memoized(program)) return;
  ParameterSharer sharer;
  const auto share = [&](const Expr& e) { return sharer(e); };
  for (LoopedFunc& f : program.funcs) {
    for (Definition& stage : f.stages) stage = map_exprs(stage, share);
  }
  program.shared = std::move(sharer.names);
}

}  // namespace retrograde::lower
