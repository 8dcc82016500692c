#include "autodiff/sums/distinct_nodes.h"

#include "autodiff/sweeps/local_derivative.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

namespace {

// A key that is equal for equal nodes, whose children are replaced by their numbers. Symbols are compared by address,
// since two images may have the same name.
std::string key_of(const Expr& shallow) {
  const auto* call = shallow.as<Call>();
  const auto* v = shallow.as<Variable>();
  const Symbol* symbol = call ? call->symbol.raw() : v ? v->symbol.raw() : nullptr;
  return ir::print(shallow) + "@" + std::to_string(reinterpret_cast<uintptr_t>(symbol));
}

}  // namespace

DistinctNodes::DistinctNodes(const std::vector<Expr>& roots) : kept_(post_order(roots)) {
  std::unordered_map<std::string, size_t> by_key;
  std::vector<Expr> names;
  for (const Expr& e : kept_) {
    Expr shallow = map_children(e, [&](const Expr& child) { return names[number_of(child)]; });
    auto [known, is_distinct] = by_key.try_emplace(key_of(shallow), nodes_.size());
    by_node_[e.get()] = known->second;
    if (!is_distinct) continue;
    names.push_back(variable("node#" + std::to_string(nodes_.size()), e.type()));
    nodes_.push_back(e);
  }
}

std::vector<Expr> with_equal_nodes_shared(const std::vector<Expr>& roots) {
  const DistinctNodes distinct(roots);
  std::vector<Expr> shared, result;
  const auto in_shared = [&](const Expr& e) { return shared[distinct.number_of(e)]; };
  for (const Expr& e : distinct.nodes())
    shared.push_back(is_leaf(e) ? e : map_children(e, in_shared));
  for (const Expr& root : roots)
    result.push_back(root.defined() ? shared[distinct.number_of(root)] : Expr());
  return result;
}

}  // namespace retrograde::autodiff
