#include "autodiff/inversion/access_inversion.h"

#include <algorithm>

#include "autodiff/inversion/affine_access.h"
#include "autodiff/inversion/group_inversion.h"
#include "autodiff/inversion/isl_bridge.h"
#include "autodiff/inversion/narrow_reductions.h"
#include "autodiff/inversion/split_at_select.h"
#include "ir/build.h"
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

// Inverts each group of linked indices, and multiplies the pieces of the groups out.
class Inverter {
 public:
  explicit Inverter(const AccessQuery& query) : query_(query), access_(conjuncts_of(query)) {}

  Inversion run() {
    Inversion result = attempt(true);
    if (!is_circular_) return result;
    is_circular_ = false;
    return attempt(false);
  }

 private:
  Inversion attempt(bool may_fix) {
    resolve_indices(query_, may_fix, access_);
    std::vector<std::vector<GroupPiece>> pieces;
    std::vector<Group> groups = linked_groups(query_, access_);
    for (const Group& group : groups)
      pieces.push_back(invert_group(group, access_.fixed, query_.operations));
    Inversion result;
    result.note = access_.note;
    std::vector<const GroupPiece*> chosen;
    multiply(groups, pieces, chosen, result);
    if (std::ranges::none_of(result.gathers, &Gather::scatters)) result.note.clear();
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
    for (size_t round = 0; round < access_.fixed.size(); ++round) {
      Substitution now = g.iteration;
      for (auto& [name, e] : g.iteration) e = substitute(e, now);
    }
    note_circular(g.iteration);
    append(predicate, access_.residual);
    for (Expr& e : predicate) e = substitute(e, g.iteration);
    const bool is_selected = extents.empty() && selects_in_row(g);
    for (size_t d = 0; d < g.lhs.size(); ++d) {
      if (!access_.takes_part[d] && !is_selected) g.scatters = true;
      g.lhs[d] = substitute(access_.takes_part[d] ? g.lhs[d] : query_.indices[d], g.iteration);
    }
    if (is_selected) {
      const Expr element = variable(query_.target_args[0]);
      predicate.push_back(element == g.lhs[0]);
      g.lhs[0] = element;
      g.pure[0] = true;
    }
    if (!predicate.empty()) g.predicate = conjunction(predicate);
    rename(g, extents);
    return g;
  }

  // Whether only the index along rows depends on data, as that of a label in rows of logits, while each row is read by
  // one iteration at most. Then each element of a row asks whether it is the one that is read.
  bool selects_in_row(const Gather& g) const {
    if (g.lhs.size() < 2 || access_.takes_part[0]) return false;
    for (size_t d = 1; d < g.lhs.size(); ++d) {
      if (!access_.takes_part[d] || !g.pure[d]) return false;
    }
    return true;
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
  AffineAccess access_;
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

Inversion invert_access(const AccessQuery& query) {
  try {
    std::vector<AccessQuery> parts = split_at_select(query);
    if (parts.empty()) return Inverter(query).run();
    Inversion result;
    for (const AccessQuery& part : parts) {
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
