#include "autodiff/inversion/group_inversion.h"

#include <algorithm>
#include <optional>

#include "analysis/interval.h"
#include "autodiff/inversion/fibre_plan.h"
#include "autodiff/inversion/isl_bridge.h"
#include "autodiff/inversion/isl_maps.h"
#include "ir/build.h"
#include "ir/lists.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

// Folding a border into the interior may cost this much more iterations before the two are split.
constexpr double fold_tolerance = 2.5;
// An interior of fewer iterations an element than this does not choose between its own places and
// those of a border. A larger one stays one update all the same: its border would be a large update
// of its own.
constexpr double short_interior = 4;

class GroupInverter {
 public:
  GroupInverter(const Group& group, const std::vector<Expr>& fixed, unsigned long operations)
      : context_(operations),
        group_(group),
        bridge_(context_, names_of(group.vars)),
        domain_(bridge_.universe()),
        not_empty_(bridge_.universe()) {
    for (const Expr& e : fixed) bridge_.make_parameter(e);
    for (const Expr& index : group.indices) affine_.push_back(*bridge_.affine(index));
    build_domain();
  }

  std::vector<GroupPiece> run() {
    return mapped(choose_pieces(), [&](const isl::map& piece) { return emit(piece); });
  }

 private:
  int var_count() const { return static_cast<int>(group_.vars.size()); }
  int index_count() const { return static_cast<int>(group_.indices.size()); }

  void build_domain() {
    own_range_ = bridge_.ranges_of(group_.vars);
    for (const isl::set& range : own_range_) domain_ = domain_.intersect(range);
    std::vector<isl::set> conditions;
    for (const Expr& e : group_.predicate) conditions.push_back(*bridge_.condition(e));
    for (const LoopVariable& v : group_.region) assume_not_empty(v);
    domain_ = domain_.intersect(not_empty_);
    box_ = domain_;
    for (const isl::set& s : conditions) domain_ = coalesced(domain_.intersect(s));
  }

  // Where the target has no element there is nothing to do. Ends over parameters of their own, as
  // those that isl cannot follow, say nothing about the others, and would make the search longer.
  void assume_not_empty(const LoopVariable& v) {
    if (!v.min.defined() || !v.max.defined()) return;
    const size_t known = bridge_.parameters().size();
    isl::pw_aff min = bridge_.bound(v.min), max = bridge_.bound(v.max);
    if (bridge_.parameters().size() == known) not_empty_ = not_empty_.intersect(min.le_set(max));
  }

  // {z -> y} over all of z: the domain is not applied.
  isl::map relation_of(const std::vector<isl::pw_aff>& indices) const {
    isl::map result = universe_map(bridge_.ctx(), group_.vars.size(), group_.indices.size());
    for (int d = 0; d < index_count(); ++d) {
      result = result.intersect(output_equals(indices[static_cast<size_t>(d)], d, index_count()));
    }
    return result;
  }

  FibrePlan plan(const isl::map& piece) {
    return plan_fibre({group_.vars, bridge_, box_, own_range_}, piece);
  }

  // The relation split where the indices' pieces differ, or whole where that costs little.
  std::vector<isl::map> choose_pieces() {
    isl::map whole = coalesced(relation_of(affine_).intersect_domain(domain_));
    std::vector<isl::map> split = split_pieces();
    if (split.empty()) return {};  // no point of the stage reads anything
    if (split.size() == 1) return {whole};
    FibrePlan all = plan(whole);
    if (all.free_vars.empty()) return {whole};
    double interior = 0;
    for (const isl::map& piece : split) {
      FibrePlan p = plan(piece);
      if (!has_fixed_index(piece)) interior = std::max(interior, p.cost);
    }
    bool folds = interior > 1 && all.cost <= fold_tolerance * interior &&
                 (interior >= short_interior || in_one_piece(all));
    return folds ? std::vector<isl::map>{whole} : split;
  }

  // Whether the places that are read are the same sums all over the domain. Where they are not,
  // every vector of the interior would choose between those of the borders.
  static bool in_one_piece(const FibrePlan& plan) {
    return std::ranges::all_of(plan.coordinates,
                               [](const FibreCoordinate& c) { return pieces_of(c.value) == 1; });
  }

  std::vector<isl::map> split_pieces() const {
    struct Part {
      isl::set where;
      std::vector<isl::pw_aff> indices;
    };
    std::vector<Part> parts{{domain_, {}}};
    for (const isl::pw_aff& index : affine_) {
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
      // A union of disjoint sets (x < 0 or x >= n) is cheaper as two boxes.
      isl_set* disjoint = isl_set_make_disjoint(part.where.copy());
      isl::set sets = coalesced(isl::manage(disjoint));
      isl::map values = relation_of(part.indices);
      sets.foreach_basic_set(
          [&](isl::basic_set b) { result.push_back(values.intersect_domain(isl::set(b))); });
    }
    return result;
  }

  bool has_fixed_index(const isl::map& piece) const {
    for (int d = 0; d < index_count(); ++d) {
      if (fixed_index(piece, d)) return true;
    }
    return false;
  }
  // The index in dimension d when it is the same for all points of the piece: a function of the
  // parameters.
  std::optional<isl::pw_aff> fixed_index(const isl::map& piece, int d) const {
    isl::map one = only_output(piece, d);
    int n = isl_map_dim(one.get(), isl_dim_in);
    isl::map constant =
        isl::manage(isl_map_project_out(one.copy(), isl_dim_in, 0, static_cast<unsigned>(n)));
    if (!is_single_valued(constant)) return std::nullopt;
    isl::pw_aff value = *function_of(constant);
    if (pieces_of(value) != 1) return std::nullopt;
    // Without the conditions on parameters under which the piece has points at all.
    isl::pw_aff total;
    value.foreach_piece([&](isl::set, isl::multi_aff a) { total = isl::pw_aff(a.at(0)); });
    return total;
  }

  // ---- expressions ----

  GroupPiece emit(const isl::map& piece) {
    FibrePlan p = plan(piece);
    GroupPiece g;
    std::vector<Expr> names = element_names(piece, g);
    for (int v : p.free_vars) {
      const LoopVariable& loop = group_.vars[static_cast<size_t>(v)];
      const FibreCoordinate& c = p.coordinates[static_cast<size_t>(v)];
      g.free.push_back(
          {v, c.extent == unbounded ? extent_of(loop.range()) : make_const(Int(32), c.extent)});
      names.push_back(variable(rho_name(loop.name)));
    }
    for (int j = 0; j < var_count(); ++j) {
      const FibreCoordinate& c = p.coordinates[static_cast<size_t>(j)];
      g.iteration[group_.vars[static_cast<size_t>(j)].name] =
          simplify(bridge_.to_expr(c.value, names));
    }
    add_predicate(piece, p, g, names);
    protect(g);
    return g;
  }

  // y: names of elements, or the fixed index.
  std::vector<Expr> element_names(const isl::map& piece, GroupPiece& g) {
    for (int d = 0; d < index_count(); ++d) {
      auto fixed = fixed_index(piece, d);
      g.lhs.push_back(fixed ? simplify(bridge_.to_expr(*fixed))
                            : variable(element_name(group_.dims[static_cast<size_t>(d)])));
      g.pure.push_back(!fixed);
    }
    return g.lhs;
  }

  void add_predicate(const isl::map& piece, const FibrePlan& p, GroupPiece& g,
                     const std::vector<Expr>& names) {
    isl::set context = rho_box(p).intersect(fixed_elements(piece, p));
    isl::set needed = coalesced(p.valid.gist(context));
    needed = isl::manage(isl_set_gist_params(needed.release(), assumed().release()));
    // Coalescing leaves unions that are one basic set all the same.
    isl::set hull = isl::manage(isl_set_from_basic_set(isl_set_simple_hull(needed.copy())));
    if (hull.is_equal(needed)) needed = hull;
    if (isl_set_plain_is_universe(needed.get()) != isl_bool_true)
      g.predicate.push_back(bridge_.to_expr(needed, names));
  }

  // What holds wherever a gather adds anything: the adjoints that it reads are 0 where a stage's
  // pure variables have no value. A reduction domain may be empty, and what is read is not 0 then.
  isl::set assumed() const {
    isl::set pure = not_empty_;
    for (size_t i = 0; i < group_.vars.size(); ++i) {
      if (!group_.vars[i].is_reduction) pure = pure.intersect(own_range_[i]);
    }
    return isl::manage(isl_set_params(pure.release()));
  }

  isl::set rho_box(const FibrePlan& p) const {
    isl::set box = isl::manage(isl_set_universe(isl_set_get_space(p.valid.get())));
    for (size_t k = 0; k < p.free_vars.size(); ++k) {
      const FibreCoordinate& c = p.coordinates[static_cast<size_t>(p.free_vars[k])];
      unsigned at = static_cast<unsigned>(index_count()) + static_cast<unsigned>(k);
      isl_set* s = isl_set_lower_bound_si(box.release(), isl_dim_set, at, 0);
      if (c.extent != unbounded) {
        s = isl_set_upper_bound_val(s, isl_dim_set, at,
                                    isl_val_int_from_si(bridge_.ctx(), c.extent - 1));
      }
      box = isl::manage(s);
      if (c.extent == unbounded) {
        // rho runs over the variable's own range: base + rho <= max.
        isl::map at_most = output_equals(pad(c.value, box), p.free_vars[k], var_count());
        isl::map in_range =
            at_most.intersect_range(own_range_[static_cast<size_t>(p.free_vars[k])]);
        box = box.intersect(in_range.domain());
      }
    }
    return box;
  }
  // The function on a space with more inputs at the end.
  static isl::pw_aff pad(const isl::pw_aff& e, const isl::set& space) {
    int have = isl_pw_aff_dim(e.get(), isl_dim_in), want = isl_set_dim(space.get(), isl_dim_set);
    return isl::manage(isl_pw_aff_insert_dims(e.copy(), isl_dim_in, static_cast<unsigned>(have),
                                              static_cast<unsigned>(want - have)));
  }

  // Where the predicate is false the point found may lie outside the domain, and what is read there
  // outside of buffers: it is clamped into the domain, unless interval arithmetic, which is what
  // bounds inference will use, shows that it is inside for every element. Where bounds are
  // constants the simplifier drops these clamps again.
  void protect(GroupPiece& g) const {
    Scope<Interval> scope;
    for (int d : group_.dims) scope.push(element_name(d), Interval::everything());
    for (const auto& free : g.free) {
      const std::string& name = group_.vars[static_cast<size_t>(free.var)].name;
      scope.push(rho_name(name), {make_zero(Int(32)), simplify(free.extent - 1)});
    }
    for (const LoopVariable& v : group_.vars) {
      Expr& e = g.iteration[v.name];
      if (is_const(e)) continue;
      Interval range = bounds_of(e, scope);
      bool above = !v.min.defined() || (range.min.defined() && can_prove(range.min >= v.min));
      bool below = !v.max.defined() || (range.max.defined() && can_prove(range.max <= v.max));
      if (above && below) continue;
      e = likely(e);
      // The first point of a domain whose run-time extent may be 0: its last one lies before it.
      const bool may_be_empty = v.min.defined() && v.max.defined() && !can_prove(v.min <= v.max);
      if (v.min.defined() && !may_be_empty) e = max(e, v.min);
      if (v.max.defined()) e = min(e, v.max);
      if (may_be_empty) e = max(e, v.min);
    }
  }

  // y_d as a function on the plan's space.
  static isl::pw_aff element_dim(const isl::set& space, int d) {
    isl_local_space* local = isl_local_space_from_space(isl_set_get_space(space.get()));
    return isl::manage(isl_pw_aff_var_on_domain(local, isl_dim_set, static_cast<unsigned>(d)));
  }
  // An expression of the parameters alone, as a function on the plan's space.
  static isl::pw_aff constant_on(const isl::set& space, const isl::pw_aff& e) {
    int have = isl_pw_aff_dim(e.get(), isl_dim_in), want = isl_set_dim(space.get(), isl_dim_set);
    isl_pw_aff* moved = isl_pw_aff_drop_dims(e.copy(), isl_dim_in, 0, static_cast<unsigned>(have));
    return isl::manage(isl_pw_aff_insert_dims(moved, isl_dim_in, 0, static_cast<unsigned>(want)));
  }
  static isl::set whole_space(const FibrePlan& p) {
    return isl::manage(isl_set_universe(isl_set_get_space(p.valid.get())));
  }

  // {y : y_d is the index that all points of the piece share}
  isl::set fixed_elements(const isl::map& piece, const FibrePlan& p) const {
    isl::set result = whole_space(p);
    for (int d = 0; d < index_count(); ++d) {
      if (auto fixed = fixed_index(piece, d)) {
        result = result.intersect(element_dim(result, d).eq_set(constant_on(result, *fixed)));
      }
    }
    return result;
  }

  IslContext context_;  // outlives every isl object below
  const Group& group_;
  IslBridge bridge_;
  isl::set domain_, box_;            // with and without the predicate
  isl::set not_empty_;               // where the target has elements
  std::vector<isl::set> own_range_;  // of each variable alone
  std::vector<isl::pw_aff> affine_;  // the indices
};

}  // namespace

std::string element_name(int d) { return "element$" + std::to_string(d); }
std::string rho_name(const std::string& stage_var) { return "rho$" + stage_var; }

std::vector<GroupPiece> invert_group(const Group& group, const std::vector<Expr>& fixed,
                                     unsigned long operations) {
  return GroupInverter(group, fixed, operations).run();
}

}  // namespace retrograde::ir
