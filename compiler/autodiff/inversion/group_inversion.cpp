#include "autodiff/inversion/group_inversion.h"

#include <algorithm>
#include <optional>

#include "analysis/interval.h"
#include "autodiff/inversion/fibre_plan.h"
#include "autodiff/inversion/isl_bridge.h"
#include "autodiff/inversion/isl_maps.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// A border is folded into the interior if that multiplies the iterations by at most this factor.
constexpr double fold_tolerance = 2.5;
// A border is folded into an interior of fewer iterations an element only if the indices need no select between the
// two. For a longer interior it is folded anyway, because the border alone would be a large update.
constexpr double short_interior = 4;

// The access relation of a group, with its domain and context.
struct GroupRelation {
  GroupRelation(const Group& group, const std::vector<Expr>& fixed, unsigned long operations)
      : context(operations),
        group(group),
        bridge(context, names_of(group.vars)),
        domain(bridge.universe()),
        not_empty(bridge.universe()) {
    for (const Expr& e : fixed) bridge.make_parameter(e);
    for (const Expr& index : group.indices) affine.push_back(*bridge.affine(index));
    build_domain();
  }

  IslContext context;  // must outlive every isl object below
  const Group& group;
  IslBridge bridge;
  isl::set domain, box;             // iterations with and without the predicate
  isl::set not_empty;               // parameters for which the target has elements
  std::vector<isl::set> own_range;  // range of each variable alone
  std::vector<isl::pw_aff> affine;  // affine forms of the indices

  int var_count() const { return static_cast<int>(group.vars.size()); }
  int index_count() const { return static_cast<int>(group.indices.size()); }
  // {z -> y} for all z, not restricted to the domain.
  isl::map values_of(const std::vector<isl::pw_aff>& indices) const {
    isl::map result = universe_map(bridge.ctx(), group.vars.size(), group.indices.size());
    for (int d = 0; d < index_count(); ++d) {
      result = result.intersect(output_equals(indices[static_cast<size_t>(d)], d, index_count()));
    }
    return result;
  }

  FibrePlan plan(const isl::map& piece) {
    return plan_fibre({group.vars, bridge, box, own_range}, piece);
  }

 private:
  void build_domain() {
    own_range = bridge.ranges_of(group.vars);
    for (const isl::set& range : own_range) domain = domain.intersect(range);
    std::vector<isl::set> conditions;
    for (const Expr& e : group.predicate) conditions.push_back(*bridge.condition(e));
    for (const LoopVariable& v : group.region) assume_not_empty(v);
    domain = domain.intersect(not_empty);
    box = domain;
    for (const isl::set& s : conditions) domain = coalesced(domain.intersect(s));
  }

  // Assumes that the target has elements, since an empty one needs no work. Ends that introduce parameters of their
  // own, such as those that isl cannot represent, are skipped: they constrain nothing else and would lengthen the
  // search.
  void assume_not_empty(const LoopVariable& v) {
    if (!v.min.defined() || !v.max.defined()) return;
    const size_t known = bridge.parameters().size();
    isl::pw_aff min = bridge.bound(v.min), max = bridge.bound(v.max);
    if (bridge.parameters().size() == known) not_empty = not_empty.intersect(min.le_set(max));
  }
};

// ---- pieces ----

// The index in dimension d if it is the same for all points of the piece, as a function of the parameters.
std::optional<isl::pw_aff> fixed_index(const isl::map& piece, int d) {
  isl::map one = only_output(piece, d);
  int n = isl_map_dim(one.get(), isl_dim_in);
  isl::map constant =
      isl::manage(isl_map_project_out(one.copy(), isl_dim_in, 0, static_cast<unsigned>(n)));
  if (!is_single_valued(constant)) return std::nullopt;
  isl::pw_aff value = *function_of(constant);
  if (pieces_of(value) != 1) return std::nullopt;
  // Drops the conditions on parameters under which the piece has points.
  isl::pw_aff total;
  value.foreach_piece([&](isl::set, isl::multi_aff a) { total = isl::pw_aff(a.at(0)); });
  return total;
}

bool has_fixed_index(const isl::map& piece, int index_count) {
  for (int d = 0; d < index_count; ++d) {
    if (fixed_index(piece, d)) return true;
  }
  return false;
}

std::vector<isl::map> split_pieces(const GroupRelation& relation) {
  struct Part {
    isl::set where;
    std::vector<isl::pw_aff> indices;
  };
  std::vector<Part> parts{{relation.domain, {}}};
  for (const isl::pw_aff& index : relation.affine) {
    std::vector<Part> next;
    for (const Part& part : parts) {
      index.foreach_piece([&](isl::set where, isl::multi_aff value) {
        isl::set both = coalesced(part.where.intersect(where));
        if (both.is_empty()) return;
        next.push_back({both, part.indices});
        next.back().indices.push_back(isl::pw_aff(value.at(0)));
      });
    }
    parts = std::move(next);
  }
  std::vector<isl::map> result;
  for (const Part& part : parts) {
    // Two boxes are cheaper than a union of disjoint sets such as x < 0 or x >= n.
    isl_set* disjoint = isl_set_make_disjoint(part.where.copy());
    isl::set sets = coalesced(isl::manage(disjoint));
    isl::map values = relation.values_of(part.indices);
    sets.foreach_basic_set(
        [&](isl::basic_set b) { result.push_back(values.intersect_domain(isl::set(b))); });
  }
  return result;
}

// Whether the indices are the same expressions over the whole domain. Otherwise every vector of the interior would
// select between its own indices and those of a border.
bool in_one_piece(const FibrePlan& plan) {
  return std::ranges::all_of(plan.coordinates,
                             [](const FibreCoordinate& c) { return pieces_of(c.value) == 1; });
}

// Splits the relation where the indices have different pieces; keeps it whole if that costs little.
std::vector<isl::map> choose_pieces(GroupRelation& relation) {
  isl::map whole = coalesced(relation.values_of(relation.affine).intersect_domain(relation.domain));
  std::vector<isl::map> split = split_pieces(relation);
  if (split.empty()) return {};  // the stage reads no element
  if (split.size() == 1) return {whole};
  FibrePlan all = relation.plan(whole);
  if (all.free_vars.empty()) return {whole};
  double interior = 0;
  for (const isl::map& piece : split) {
    FibrePlan p = relation.plan(piece);
    if (!has_fixed_index(piece, relation.index_count())) interior = std::max(interior, p.cost);
  }
  bool folds = interior > 1 && all.cost <= fold_tolerance * interior &&
               (interior >= short_interior || in_one_piece(all));
  return folds ? std::vector<isl::map>{whole} : split;
}

// ---- expressions ----

// y_d as a function on the plan's space.
isl::pw_aff element_dim(const isl::set& space, int d) {
  isl_local_space* local = isl_local_space_from_space(isl_set_get_space(space.get()));
  return isl::manage(isl_pw_aff_var_on_domain(local, isl_dim_set, static_cast<unsigned>(d)));
}
// The same function on a space with more inputs at the end.
isl::pw_aff pad(const isl::pw_aff& e, const isl::set& space) {
  int have = isl_pw_aff_dim(e.get(), isl_dim_in), want = isl_set_dim(space.get(), isl_dim_set);
  return isl::manage(isl_pw_aff_insert_dims(e.copy(), isl_dim_in, static_cast<unsigned>(have),
                                            static_cast<unsigned>(want - have)));
}
// An expression of the parameters alone, as a function on the plan's space.
isl::pw_aff constant_on(const isl::set& space, const isl::pw_aff& e) {
  const auto have = static_cast<unsigned>(isl_pw_aff_dim(e.get(), isl_dim_in));
  return pad(isl::manage(isl_pw_aff_drop_dims(e.copy(), isl_dim_in, 0, have)), space);
}

// Expresses one piece in terms of the elements that it reads.
class PieceExpressions {
 public:
  PieceExpressions(GroupRelation& relation, const isl::map& piece)
      : r_(relation), piece_(piece), plan_(relation.plan(piece)) {}

  GroupPiece emit() {
    GroupPiece g;
    std::vector<Expr> names = element_names(g);
    for (int v : plan_.free_vars) {
      const LoopVariable& loop = r_.group.vars[static_cast<size_t>(v)];
      const FibreCoordinate& c = plan_.coordinates[static_cast<size_t>(v)];
      g.free.push_back(
          {v, c.extent == unbounded ? extent_of(loop.range()) : make_const(Int(32), c.extent)});
      names.push_back(variable(rho_name(loop.name)));
    }
    for (int j = 0; j < r_.var_count(); ++j) {
      const FibreCoordinate& c = plan_.coordinates[static_cast<size_t>(j)];
      g.iteration[r_.group.vars[static_cast<size_t>(j)].name] =
          simplify(r_.bridge.to_expr(c.value, names));
    }
    add_predicate(g, names);
    protect(g);
    return g;
  }

 private:
  // y: the names of elements, or fixed indices.
  std::vector<Expr> element_names(GroupPiece& g) {
    for (int d = 0; d < r_.index_count(); ++d) {
      auto fixed = fixed_index(piece_, d);
      g.lhs.push_back(fixed ? simplify(r_.bridge.to_expr(*fixed))
                            : variable(element_name(r_.group.dims[static_cast<size_t>(d)])));
      g.pure.push_back(!fixed);
    }
    return g.lhs;
  }

  void add_predicate(GroupPiece& g, const std::vector<Expr>& names) {
    isl::set context = rho_box().intersect(fixed_elements());
    isl::set needed = coalesced(plan_.valid.gist(context));
    needed = isl::manage(isl_set_gist_params(needed.release(), assumed().release()));
    // Coalescing leaves some unions that equal a single basic set.
    isl::set hull = isl::manage(isl_set_from_basic_set(isl_set_simple_hull(needed.copy())));
    if (hull.is_equal(needed)) needed = hull;
    if (isl_set_plain_is_universe(needed.get()) != isl_bool_true)
      g.predicate.push_back(r_.bridge.to_expr(needed, names));
  }

  // Constraints that hold wherever a gather adds a nonzero term: adjoints are 0 outside of the stage's pure variables.
  // They are not assumed of reduction variables: a reduction domain may be empty while the adjoint read is not 0.
  isl::set assumed() const {
    isl::set pure = r_.not_empty;
    for (size_t i = 0; i < r_.group.vars.size(); ++i) {
      if (!r_.group.vars[i].is_reduction) pure = pure.intersect(r_.own_range[i]);
    }
    return isl::manage(isl_set_params(pure.release()));
  }

  isl::set whole_space() const {
    return isl::manage(isl_set_universe(isl_set_get_space(plan_.valid.get())));
  }

  isl::set rho_box() const {
    isl::set box = whole_space();
    for (size_t k = 0; k < plan_.free_vars.size(); ++k) {
      const FibreCoordinate& c = plan_.coordinates[static_cast<size_t>(plan_.free_vars[k])];
      unsigned at = static_cast<unsigned>(r_.index_count()) + static_cast<unsigned>(k);
      isl_set* s = isl_set_lower_bound_si(box.release(), isl_dim_set, at, 0);
      if (c.extent != unbounded) {
        s = isl_set_upper_bound_val(s, isl_dim_set, at,
                                    isl_val_int_from_si(r_.bridge.ctx(), c.extent - 1));
      }
      box = isl::manage(s);
      if (c.extent == unbounded) {
        // rho runs over the variable's own range: base + rho <= max.
        isl::map at_most = output_equals(pad(c.value, box), plan_.free_vars[k], r_.var_count());
        isl::map in_range =
            at_most.intersect_range(r_.own_range[static_cast<size_t>(plan_.free_vars[k])]);
        box = box.intersect(in_range.domain());
      }
    }
    return box;
  }

  // {y : y_d is the index that all points of the piece share}
  isl::set fixed_elements() const {
    isl::set result = whole_space();
    for (int d = 0; d < r_.index_count(); ++d) {
      if (auto fixed = fixed_index(piece_, d)) {
        result = result.intersect(element_dim(result, d).eq_set(constant_on(result, *fixed)));
      }
    }
    return result;
  }

  // Where the predicate is false, the iteration may lie outside of the domain, and its reads outside of buffers. It is
  // clamped into the domain unless interval arithmetic, as bounds inference uses it, proves it inside for every
  // element. If bounds are constant, the simplifier drops these clamps again.
  void protect(GroupPiece& g) const {
    Scope<Interval> scope;
    for (int d : r_.group.dims) scope.push(element_name(d), Interval::everything());
    for (const auto& free : g.free) {
      const std::string& name = r_.group.vars[static_cast<size_t>(free.var)].name;
      scope.push(rho_name(name), {make_zero(Int(32)), simplify(free.extent - 1)});
    }
    for (const LoopVariable& v : r_.group.vars) {
      Expr& e = g.iteration[v.name];
      if (is_const(e)) continue;
      Interval range = bounds_of(e, scope);
      bool above = !v.min.defined() || (range.min.defined() && can_prove(range.min >= v.min));
      bool below = !v.max.defined() || (range.max.defined() && can_prove(range.max <= v.max));
      if (above && below) continue;
      e = likely(e);
      // The extent may be 0 at run time; the last point of an empty domain then lies before its first.
      const bool may_be_empty = v.min.defined() && v.max.defined() && !can_prove(v.min <= v.max);
      if (v.min.defined() && !may_be_empty) e = max(e, v.min);
      if (v.max.defined()) e = min(e, v.max);
      if (may_be_empty) e = max(e, v.min);
    }
  }

  GroupRelation& r_;
  const isl::map& piece_;
  const FibrePlan plan_;
};

}  // namespace

std::string element_name(int d) { return "element$" + std::to_string(d); }
std::string rho_name(const std::string& stage_var) { return "rho$" + stage_var; }

std::vector<GroupPiece> invert_group(const Group& group, const std::vector<Expr>& fixed,
                                     unsigned long operations) {
  GroupRelation relation(group, fixed, operations);
  return mapped(choose_pieces(relation),
                [&](const isl::map& piece) { return PieceExpressions(relation, piece).emit(); });
}

}  // namespace retrograde::autodiff
