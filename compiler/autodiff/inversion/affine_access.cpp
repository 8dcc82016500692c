#include "autodiff/inversion/affine_access.h"

#include <algorithm>
#include <functional>

#include "autodiff/inversion/isl_bridge.h"
#include "autodiff/inversion/isl_maps.h"
#include "ir/build.h"
#include "ir/print.h"

namespace retrograde::autodiff {

namespace {

void split_conjunction(const Expr& e, std::vector<Expr>& conjuncts) {
  if (const auto* both = e.as<And>()) {
    split_conjunction(both->a, conjuncts);
    split_conjunction(both->b, conjuncts);
  } else if (const auto* n = e.as<Not>(); n && n->a.as<Or>()) {
    split_conjunction(!n->a.as<Or>()->a, conjuncts);
    split_conjunction(!n->a.as<Or>()->b, conjuncts);
  } else {
    conjuncts.push_back(e);
  }
}

class IndexResolution {
 public:
  IndexResolution(const AccessQuery& query, bool may_fix, AffineAccess& access)
      : query_(query), may_fix_(may_fix), access_(access) {}

  // An obstacle is a subexpression that isl cannot represent. If it depends only on variables that the other indices
  // determine, it is constant over the fibre and becomes a parameter. Indices with any other obstacle are not inverted.
  void run() {
    IslContext context(query_.operations);
    IslBridge bridge(context, names_of(query_.domain.vars));
    for (bool progress = true; progress;) {
      progress = false;
      access_.takes_part.assign(query_.indices.size(), false);
      std::set<Expr, StructuralLess> obstacles;
      isl::map inverse = relation(bridge, obstacles).reverse();
      for (const Expr& obstacle : obstacles) {
        if (!may_fix_ || !is_fixed_by(inverse, obstacle)) continue;
        bridge.make_parameter(obstacle);
        access_.fixed.push_back(obstacle);
        progress = true;
      }
      if (!progress) note_obstacles(obstacles);
    }
    find_residual(bridge);
  }

 private:
  isl::map relation(IslBridge& bridge, std::set<Expr, StructuralLess>& obstacles) {
    int dims = static_cast<int>(query_.indices.size());
    isl::map result = universe_map(bridge.ctx(), query_.domain.vars.size(), query_.indices.size());
    for (const isl::set& range : bridge.ranges_of(query_.domain.vars))
      result = result.intersect_domain(range);
    for (int d = 0; d < dims; ++d) {
      bridge.clear_obstacles();
      auto index = bridge.affine(query_.indices[static_cast<size_t>(d)]);
      access_.takes_part[static_cast<size_t>(d)] = index.has_value();
      if (index)
        result = result.intersect(output_equals(*index, d, dims));
      else
        obstacles.insert(bridge.obstacles().begin(), bridge.obstacles().end());
    }
    return result;
  }

  bool is_fixed_by(const isl::map& inverse, const Expr& e) const {
    for (size_t j = 0; j < query_.domain.vars.size(); ++j) {
      if (!uses_variable(e, query_.domain.vars[j].name)) continue;
      if (!is_single_valued(only_output(inverse, static_cast<int>(j)))) return false;
    }
    return true;
  }

  // Records the obstacles for the note: data, and expressions that are not quasi-affine, such as x % w and x * y.
  void note_obstacles(const std::set<Expr, StructuralLess>& obstacles) {
    for (const Expr& e : obstacles) {
      std::set<std::string> data;
      walk(e, [&](const Call& call) {
        if (call.call_type != CallType::Operator) data.insert(quoted(call.name));
      });
      std::string reason = data.empty() ? quoted(ir::print(e)) + " in an index is not affine" : "";
      for (const std::string& name : data)
        reason += (reason.empty() ? "an index depends on " : ", ") + name;
      access_.note += (access_.note.empty() ? "" : "; ") + reason;
    }
  }

  // Conjuncts that isl cannot represent stay expressions.
  void find_residual(IslBridge& bridge) {
    std::vector<Expr> affine;
    for (const Expr& e : access_.conjuncts)
      (bridge.condition(e) ? affine : access_.residual).push_back(e);
    access_.conjuncts = affine;
  }

  const AccessQuery& query_;
  const bool may_fix_;
  AffineAccess& access_;
};

// The stage variables that occur outside of parameters.
std::vector<size_t> variables_in(const Expr& e, const AccessQuery& query,
                                 const AffineAccess& access) {
  std::set<std::string> found;
  walk(e, [&](const Expr& node) {
    if (const auto* v = node.as<Variable>()) found.insert(v->name);
    return std::ranges::none_of(access.fixed, [&](const Expr& f) { return equal(f, node); });
  });
  std::vector<size_t> result;
  for (size_t j = 0; j < query.domain.vars.size(); ++j) {
    if (found.contains(query.domain.vars[j].name)) result.push_back(j);
  }
  return result;
}

}  // namespace

AffineAccess conjuncts_of(const AccessQuery& query) {
  AffineAccess access;
  if (query.domain.predicate.defined()) split_conjunction(query.domain.predicate, access.conjuncts);
  return access;
}

void resolve_indices(const AccessQuery& query, bool may_fix, AffineAccess& access) {
  access.fixed.clear();
  access.note.clear();
  IndexResolution(query, may_fix, access).run();
}

std::vector<Group> linked_groups(const AccessQuery& query, const AffineAccess& access) {
  size_t vars = query.domain.vars.size(), dims = query.indices.size();
  // Union-find over variables, then dimensions, then conjuncts.
  std::vector<size_t> leader(vars + dims + access.conjuncts.size());
  for (size_t i = 0; i < leader.size(); ++i) leader[i] = i;
  std::function<size_t(size_t)> find = [&](size_t i) {
    return leader[i] == i ? i : leader[i] = find(leader[i]);
  };
  auto link = [&](const Expr& e, size_t node) {
    for (size_t j : variables_in(e, query, access)) leader[find(j)] = find(node);
  };
  for (size_t d = 0; d < dims; ++d) {
    if (access.takes_part[d]) link(query.indices[d], vars + d);
  }
  for (size_t k = 0; k < access.conjuncts.size(); ++k) link(access.conjuncts[k], vars + dims + k);
  std::map<size_t, Group> groups;
  for (size_t j = 0; j < vars; ++j) groups[find(j)].vars.push_back(query.domain.vars[j]);
  for (size_t d = 0; d < dims; ++d) {
    if (!access.takes_part[d]) continue;
    Group& g = groups[find(vars + d)];
    g.dims.push_back(static_cast<int>(d));
    g.indices.push_back(query.indices[d]);
    if (!query.region.empty()) g.region.push_back(query.region[d]);
  }
  for (size_t k = 0; k < access.conjuncts.size(); ++k)
    groups[find(vars + dims + k)].predicate.push_back(access.conjuncts[k]);
  std::vector<Group> result;
  for (auto& [key, group] : groups) result.push_back(std::move(group));
  return result;
}

}  // namespace retrograde::autodiff
