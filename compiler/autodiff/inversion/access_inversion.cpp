#include "autodiff/inversion/access_inversion.h"

#include <algorithm>
#include <functional>

#include "autodiff/inversion/group_inversion.h"
#include "autodiff/inversion/isl_bridge.h"
#include "autodiff/inversion/isl_maps.h"
#include "autodiff/inversion/narrow_reductions.h"
#include "ir/build.h"
#include "ir/print.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

std::vector<std::string> names_of(const std::vector<LoopVariable>& vars) {
  return mapped(vars, &LoopVariable::name);
}

Scope<Interval> scope_of(const std::vector<LoopVariable>& vars) {
  Scope<Interval> scope;
  for (const LoopVariable& v : vars) scope.push(v.name, v.range());
  return scope;
}

Expr extent_of(const Interval& range) { return simplify(range.max - range.min + 1); }

std::optional<int64_t> constant_extent(const Interval& range) {
  return range.is_bounded() ? as_const_int(extent_of(range)) : std::nullopt;
}

bool can_prove_inside(const Interval& part, const Interval& outer) {
  const auto& [min, max] = outer;
  return (!min.defined() || (part.min.defined() && can_prove(part.min >= min))) &&
         (!max.defined() || (part.max.defined() && can_prove(part.max <= max)));
}

namespace {

// Selects the indices that can be inverted, forms the groups, and multiplies their pieces out.
class Inverter {
 public:
  explicit Inverter(const AccessQuery& query) : query_(query) {
    if (query.domain.predicate.defined()) split_conjunction(query.domain.predicate);
  }

  Inversion run() {
    Inversion result = attempt();
    if (!is_circular_) return result;
    may_fix_ = is_circular_ = false;
    fixed_.clear();
    note_.clear();
    return attempt();
  }

 private:
  Inversion attempt() {
    resolve_indices();
    std::vector<std::vector<GroupPiece>> pieces;
    std::vector<Group> groups = make_groups();
    for (const Group& group : groups)
      pieces.push_back(invert_group(group, fixed_, query_.operations));
    Inversion result;
    result.note = note_;
    std::vector<const GroupPiece*> chosen;
    multiply(groups, pieces, chosen, result);
    return result;
  }

  void split_conjunction(const Expr& e) {
    if (const auto* both = e.as<And>()) {
      split_conjunction(both->a);
      split_conjunction(both->b);
    } else if (const auto* n = e.as<Not>(); n && n->a.as<Or>()) {
      split_conjunction(!n->a.as<Or>()->a);
      split_conjunction(!n->a.as<Or>()->b);
    } else {
      conjuncts_.push_back(e);
    }
  }

  // An obstacle is a subexpression that isl cannot represent. If it depends only on variables that the other indices
  // determine, it is constant over the fibre and becomes a parameter. Indices with any other obstacle are not inverted.
  void resolve_indices() {
    IslContext context(query_.operations);
    IslBridge bridge(context, names_of(query_.domain.vars));
    for (bool progress = true; progress;) {
      progress = false;
      takes_part_.assign(query_.indices.size(), false);
      std::set<Expr, StructuralLess> obstacles;
      isl::map inverse = relation(bridge, obstacles).reverse();
      for (const Expr& obstacle : obstacles) {
        if (!may_fix_ || !is_fixed_by(inverse, obstacle)) continue;
        bridge.make_parameter(obstacle);
        fixed_.push_back(obstacle);
        progress = true;
      }
      if (!progress) note_obstacles(obstacles);
    }
    find_residual(bridge);
  }

  isl::map relation(IslBridge& bridge, std::set<Expr, StructuralLess>& obstacles) {
    int dims = static_cast<int>(query_.indices.size());
    isl::map result = universe_map(bridge.ctx(), query_.domain.vars.size(), query_.indices.size());
    for (const isl::set& range : bridge.ranges_of(query_.domain.vars))
      result = result.intersect_domain(range);
    for (int d = 0; d < dims; ++d) {
      bridge.clear_obstacles();
      auto index = bridge.affine(query_.indices[static_cast<size_t>(d)]);
      takes_part_[static_cast<size_t>(d)] = index.has_value();
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
      note_ += (note_.empty() ? "" : "; ") + reason;
    }
  }

  // Conjuncts that isl cannot represent stay expressions.
  void find_residual(IslBridge& bridge) {
    std::vector<Expr> affine;
    for (const Expr& e : conjuncts_) (bridge.condition(e) ? affine : residual_).push_back(e);
    conjuncts_ = affine;
  }

  // ---- groups ----

  std::vector<Group> make_groups() const {
    size_t vars = query_.domain.vars.size(), dims = query_.indices.size();
    // Union-find over variables, then dimensions, then conjuncts.
    std::vector<size_t> leader(vars + dims + conjuncts_.size());
    for (size_t i = 0; i < leader.size(); ++i) leader[i] = i;
    std::function<size_t(size_t)> find = [&](size_t i) {
      return leader[i] == i ? i : leader[i] = find(leader[i]);
    };
    auto link = [&](const Expr& e, size_t node) {
      for (size_t j : variables_in(e)) leader[find(j)] = find(node);
    };
    for (size_t d = 0; d < dims; ++d) {
      if (takes_part_[d]) link(query_.indices[d], vars + d);
    }
    for (size_t k = 0; k < conjuncts_.size(); ++k) link(conjuncts_[k], vars + dims + k);
    std::map<size_t, Group> groups;
    for (size_t j = 0; j < vars; ++j) groups[find(j)].vars.push_back(query_.domain.vars[j]);
    for (size_t d = 0; d < dims; ++d) {
      if (!takes_part_[d]) continue;
      Group& g = groups[find(vars + d)];
      g.dims.push_back(static_cast<int>(d));
      g.indices.push_back(query_.indices[d]);
      if (!query_.region.empty()) g.region.push_back(query_.region[d]);
    }
    for (size_t k = 0; k < conjuncts_.size(); ++k)
      groups[find(vars + dims + k)].predicate.push_back(conjuncts_[k]);
    std::vector<Group> result;
    for (auto& [key, group] : groups) result.push_back(std::move(group));
    return result;
  }

  // The stage variables that occur outside of parameters.
  std::vector<size_t> variables_in(const Expr& e) const {
    std::set<std::string> found;
    walk(e, [&](const Expr& node) {
      if (const auto* v = node.as<Variable>()) found.insert(v->name);
      return std::ranges::none_of(fixed_, [&](const Expr& f) { return equal(f, node); });
    });
    std::vector<size_t> result;
    for (size_t j = 0; j < query_.domain.vars.size(); ++j) {
      if (found.contains(query_.domain.vars[j].name)) result.push_back(j);
    }
    return result;
  }

  void multiply(const std::vector<Group>& groups,
                const std::vector<std::vector<GroupPiece>>& pieces,
                std::vector<const GroupPiece*>& chosen, Inversion& result) const {
    if (chosen.size() == groups.size()) {
      result.gathers.push_back(combine(groups, chosen));
      return;
    }
    for (const GroupPiece& piece : pieces[chosen.size()]) {
      chosen.push_back(&piece);
      multiply(groups, pieces, chosen, result);
      chosen.pop_back();
    }
  }

  Gather combine(const std::vector<Group>& groups,
                 const std::vector<const GroupPiece*>& chosen) const {
    Gather g;
    g.lhs.resize(query_.indices.size());
    g.pure.assign(query_.indices.size(), false);
    std::vector<Expr> predicate;
    std::map<std::string, Expr> extents;
    for (size_t k = 0; k < groups.size(); ++k) {
      const GroupPiece& piece = *chosen[k];
      for (size_t d = 0; d < groups[k].dims.size(); ++d) {
        g.lhs[static_cast<size_t>(groups[k].dims[d])] = piece.lhs[d];
        g.pure[static_cast<size_t>(groups[k].dims[d])] = piece.pure[d];
      }
      g.iteration.insert(piece.iteration.begin(), piece.iteration.end());
      append(predicate, piece.predicate);
      for (const auto& free : piece.free)
        extents[groups[k].vars[static_cast<size_t>(free.var)].name] = free.extent;
    }
    // Parameters contain stage variables, which are replaced by their expressions. Parameters may be nested, so the
    // substitution is repeated.
    for (size_t round = 0; round < fixed_.size(); ++round) {
      Substitution now = g.iteration;
      for (auto& [name, e] : g.iteration) e = substitute(e, now);
    }
    note_circular(g.iteration);
    append(predicate, residual_);
    for (Expr& e : predicate) e = substitute(e, g.iteration);
    for (size_t d = 0; d < g.lhs.size(); ++d) {
      if (!takes_part_[d]) g.scatters = true;
      g.lhs[d] = substitute(takes_part_[d] ? g.lhs[d] : query_.indices[d], g.iteration);
    }
    if (!predicate.empty()) g.predicate = conjunction(predicate);
    rename(g, extents);
    return g;
  }

  // For f(x + s(x), x) isl may choose x = e0 - s(x), which is circular. Without parameters it chooses x = e1.
  void note_circular(const Substitution& iteration) const {
    for (const auto& [name, e] : iteration) {
      for (const LoopVariable& v : query_.domain.vars) is_circular_ |= uses_variable(e, v.name);
    }
  }

  // Renames the inversion's own variables to those of the target and of a new reduction domain.
  void rename(Gather& g, const std::map<std::string, Expr>& extents) const {
    Substitution names;
    for (size_t d = 0; d < query_.indices.size(); ++d) {
      names[element_name(static_cast<int>(d))] = variable(query_.target_args[d]);
    }
    if (!extents.empty()) {
      g.rdom = make_domain();
      std::string base = unique_name("rho");
      for (const LoopVariable& v : query_.domain.vars) {  // innermost first, as in the stage
        auto it = extents.find(v.name);
        if (it == extents.end()) continue;
        g.rdom->vars.push_back({base + "." + v.name, make_zero(Int(32)), it->second});
        names[rho_name(v.name)] = loop_variable(g.rdom, g.rdom->vars.back().var);
      }
    }
    for (auto& [name, e] : g.iteration) e = simplify(substitute(e, names));
    for (Expr& e : g.lhs) e = simplify(substitute(e, names));
    if (g.predicate.defined()) g.predicate = simplify(substitute(g.predicate, names));
    if (g.predicate.defined() && is_const_true(g.predicate)) g.predicate = Expr();
    if (query_.narrows) narrow_reductions(g, query_.target_args);
  }

  const AccessQuery& query_;
  std::vector<bool> takes_part_;  // for each index: whether it is inverted
  std::vector<Expr> fixed_;       // obstacles that became parameters
  std::vector<Expr> conjuncts_, residual_;
  std::string note_;
  bool may_fix_ = true;               // parameters are allowed
  mutable bool is_circular_ = false;  // a variable was expressed in terms of itself
};

}  // namespace

Gather scatter_access(const AccessQuery& query) {
  Gather g;
  g.scatters = true;
  std::string base = unique_name("rho");
  if (!query.domain.vars.empty()) g.rdom = std::make_shared<ReductionDomainContents>();
  for (const LoopVariable& v : query.domain.vars) {
    ReductionVariable rho{base + "." + v.name, v.min, extent_of(v.range())};
    g.iteration[v.name] = loop_variable(g.rdom, rho.var);
    g.rdom->vars.push_back(rho);
  }
  for (const Expr& index : query.indices) {
    g.lhs.push_back(substitute(index, g.iteration));
    g.pure.push_back(false);
  }
  if (query.domain.predicate.defined())
    g.predicate = substitute(query.domain.predicate, g.iteration);
  return g;
}

namespace {

Expr negation(const Expr& e) {
  if (const auto* n = e.as<Or>()) return negation(n->a) && negation(n->b);
  if (const auto* n = e.as<And>()) return negation(n->a) || negation(n->b);
  if (const auto* n = e.as<Not>()) return n->a;
  const auto* b = e.as<Binary>();
  if (!b || b->a.type().is_float()) return logical_not(e);
  switch (b->kind) {
    case Kind::LT:
      return b->a >= b->b;
    case Kind::LE:
      return b->a > b->b;
    case Kind::GT:
      return b->a <= b->b;
    case Kind::GE:
      return b->a < b->b;
    default:
      return logical_not(e);
  }
}

AccessQuery restricted(AccessQuery query, size_t d, const Expr& index, const Expr& condition) {
  Expr& predicate = query.domain.predicate;
  predicate = predicate.defined() ? predicate && condition : condition;
  query.indices[d] = index;
  return query;
}

// Splits a query at a select, one branch of which isl cannot represent: select(inside, x, other). Each branch
// becomes a query of its own, so that a boundary condition of parametric size does not turn the interior into a
// scatter. Empty if there is nothing to split.
std::vector<AccessQuery> split_at_select(const AccessQuery& query) {
  IslContext context;
  IslBridge bridge(context, names_of(query.domain.vars));
  for (size_t d = 0; d < query.indices.size(); ++d) {
    const auto* s = query.indices[d].as<Select>();
    if (!s || bridge.affine(query.indices[d]) || !bridge.condition(s->condition)) continue;
    if (!bridge.affine(s->when_true) && !bridge.affine(s->when_false)) continue;
    std::vector<AccessQuery> parts{restricted(query, d, s->when_false, negation(s->condition))};
    // A disjunction is split into disjoint parts, whose domains are boxes again.
    Expr before = const_true(), rest = s->condition;
    for (const auto* either = rest.as<Or>(); either; either = rest.as<Or>()) {
      parts.push_back(restricted(query, d, s->when_true, before && either->a));
      before = before && negation(either->a);
      rest = either->b;
    }
    parts.push_back(restricted(query, d, s->when_true, before && rest));
    return parts;
  }
  return {};
}

// Tightens the bounds of variables by conjuncts like x < 5, so that reduction domains are short.
void tighten(IterationDomain& domain, const Expr& conjunct) {
  if (const auto* both = conjunct.as<And>()) {
    tighten(domain, both->a);
    tighten(domain, both->b);
    return;
  }
  const auto* c = conjunct.as<Binary>();
  if (!c || c->kind < Kind::LT || c->kind > Kind::GE || !c->a.type().is_int()) return;
  bool less = c->kind == Kind::LT || c->kind == Kind::LE,
       strict = c->kind == Kind::LT || c->kind == Kind::GT;
  auto apply = [&](const Expr& name, Expr bound, bool upper) {
    const auto* v = name.as<Variable>();
    for (const LoopVariable& other : domain.vars) {
      if (uses_variable(bound, other.name)) return;
    }
    for (LoopVariable& mine : domain.vars) {
      if (!v || mine.name != v->name || !mine.min.defined() || !mine.max.defined()) continue;
      if (strict) bound = upper ? bound - 1 : bound + 1;
      (upper ? mine.max : mine.min) = simplify(upper ? min(mine.max, bound) : max(mine.min, bound));
    }
  };
  apply(c->a, c->b, less);
  apply(c->b, c->a, !less);
}

}  // namespace

Inversion invert_access(const AccessQuery& query) {
  try {
    std::vector<AccessQuery> parts = split_at_select(query);
    if (parts.empty()) return Inverter(query).run();
    Inversion result;
    for (AccessQuery& part : parts) {
      tighten(part.domain, part.domain.predicate);
      Inversion one = invert_access(part);
      append(result.gathers, one.gathers);
      if (!one.note.empty()) result.note = one.note;
      result.gave_up |= one.gave_up;
    }
    return result;
  } catch (const isl::exception&) {
    return {{scatter_access(query)},
            "the search for the points that read an element takes too long, and was given up",
            true};
  }
}

}  // namespace retrograde::autodiff
