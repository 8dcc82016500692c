#include "autodiff/updates/update_relations.h"

#include <ranges>

#include "autodiff/inversion/isl_maps.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

namespace {

isl::map empty_like(const isl::map& m) {
  return isl::manage(isl_map_empty(isl_map_get_space(m.get())));
}

}  // namespace

UpdateRelations::UpdateRelations(const IterationDomain& domain, const std::vector<Expr>& write,
                                 const std::vector<bool>& pure)
    : domain_expr_(domain),
      write_indices_(write),
      pure_(pure),
      bridge_(context_, names_of(domain.vars)) {
  domain_ = domain_set(bridge_, domain, predicate_is_affine_);
  write_ = access(bridge_, write);
  if (write_) write_ = write_->intersect_domain(domain_);
}

isl::set UpdateRelations::domain_set(IslBridge& bridge, const IterationDomain& domain,
                                     bool& exact) const {
  isl::set result = bridge.universe();
  for (const isl::set& range : bridge.ranges_of(domain.vars)) result = result.intersect(range);
  std::vector<Expr> conditions;
  add_conjuncts(domain.predicate, conditions);
  for (const Expr& e : conditions | std::views::reverse) {
    if (auto s = bridge.condition(e)) {
      result = result.intersect(*s);
    } else {
      exact = false;
    }
  }
  return coalesced(result);
}

std::optional<isl::map> UpdateRelations::access(IslBridge& bridge,
                                                const std::vector<Expr>& indices) const {
  const int dims = static_cast<int>(indices.size());
  isl::map result = universe_map(bridge.ctx(), static_cast<size_t>(bridge.rank()), indices.size());
  for (int d = 0; d < dims; ++d) {
    auto e = bridge.affine(indices[static_cast<size_t>(d)]);
    if (!e) return std::nullopt;
    result = result.intersect(output_equals(*e, d, dims));
  }
  return result;
}

bool UpdateRelations::write_is_injective() const {
  const bool result = isl_map_is_injective(write_->get()) == isl_bool_true;
  throw_if_failed(context_.ctx);
  return result;
}

Expr UpdateRelations::written(const std::vector<Expr>& names) const {
  return bridge_.to_expr(coalesced(write_->range()), names);
}

// The order of iterations: reduction variables are ordered, the last one outermost. Points that differ in pure
// variables are not ordered, since they never write the same element.
isl::map UpdateRelations::earlier() const {
  isl::map same = isl::manage(
      isl_map_universe(isl_space_map_from_set(isl_set_get_space(bridge_.universe().get()))));
  isl::map result = empty_like(same);
  for (int l = bridge_.rank() - 1; l >= 0; --l) {
    if (!domain_expr_.vars[static_cast<size_t>(l)].is_reduction) continue;
    unsigned at = static_cast<unsigned>(l);
    result =
        result.unite(isl::manage(isl_map_order_gt(same.copy(), isl_dim_in, l, isl_dim_out, l)));
    same = isl::manage(isl_map_equate(same.copy(), isl_dim_in, static_cast<int>(at), isl_dim_out,
                                      static_cast<int>(at)));
  }
  return result;
}

Expr UpdateRelations::last_writers() const {
  isl::map same_element = write_->apply_range(write_->reverse());
  isl::set overwritten = same_element.intersect(earlier().reverse()).domain();
  isl::set last = coalesced(domain_.subtract(overwritten)).gist(domain_);
  return bridge_.to_expr(last, variables_of(names_of(domain_expr_.vars)));
}

std::optional<UpdateRelations::Read> UpdateRelations::read(const std::vector<Expr>& indices) {
  auto map = access(bridge_, indices);
  if (!map) return std::nullopt;
  Read r;
  r.map = map->intersect_domain(domain_);
  isl::map writer = r.map.apply_range(write_->reverse());  // {i -> j : j writes what i reads}
  isl::map before = writer.intersect(earlier());
  r.sees_new = coalesced(before.domain());
  r.never_new = r.sees_new.is_empty();
  r.always_new = domain_.is_subset(r.sees_new);
  r.overwritten = !writer.subtract(before).is_empty();
  r.sees_new_condition =
      bridge_.to_expr(r.sees_new.gist(domain_), variables_of(names_of(domain_expr_.vars)));
  return r;
}

bool UpdateRelations::sees_new_unless(const Read& read, const Expr& condition) {
  auto excepted = bridge_.condition(condition);
  return domain_.subtract(read.sees_new)
      .is_subset(excepted ? *excepted : domain_.subtract(domain_));
}

bool UpdateRelations::may_write(const Read& read, const IterationDomain& other,
                                const std::vector<Expr>& other_write) const {
  IslBridge bridge = bridge_.with_dims(names_of(other.vars));
  bool exact = true;
  isl::set domain = domain_set(bridge, other, exact);
  auto write = access(bridge, other_write);
  return !write || !read.map.range().intersect(write->intersect_domain(domain).range()).is_empty();
}

std::vector<ReverseLoop> UpdateRelations::first_guess() const {
  std::vector<ReverseLoop> loops;
  auto add = [&](size_t d, bool descending) {
    loops.push_back({static_cast<int>(d), descending, true});
  };
  std::vector<bool> done(write_indices_.size());
  for (const LoopVariable& v : domain_expr_.vars) {
    for (size_t d = 0; d < write_indices_.size(); ++d) {
      if (pure_[d] || done[d] || !v.is_reduction || !uses_variable(write_indices_[d], v.name))
        continue;
      done[d] = true;
      // Descending if the index increases with the variable.
      Expr step = substitute(write_indices_[d], v.name, make_const(Int(32), 1)) -
                  substitute(write_indices_[d], v.name, make_const(Int(32), 0));
      auto value = as_const_int(step);
      add(d, !value || *value >= 0);
    }
  }
  for (size_t d = 0; d < write_indices_.size(); ++d) {
    if (!pure_[d] && !done[d]) add(d, true);
  }
  return loops;
}

bool UpdateRelations::is_valid_order(const std::vector<ReverseLoop>& loops,
                                     const std::vector<Read>& reads) const {
  const size_t n = write_indices_.size();
  isl::map same = universe_map(bridge_.ctx(), n, n);
  isl::map order = empty_like(same);  // {element read -> element written, which is visited earlier}
  for (auto l = loops.rbegin(); l != loops.rend(); ++l) {
    isl_map* step = l->descending
                        ? isl_map_order_lt(same.copy(), isl_dim_in, l->dim, isl_dim_out, l->dim)
                        : isl_map_order_gt(same.copy(), isl_dim_in, l->dim, isl_dim_out, l->dim);
    order = order.unite(isl::manage(step));
    same = isl::manage(isl_map_equate(same.copy(), isl_dim_in, l->dim, isl_dim_out, l->dim));
  }
  for (const Read& r : reads) {
    isl::map pairs = r.map.intersect_domain(r.sees_new).reverse().apply_range(*write_);
    if (!pairs.is_subset(order)) return false;
  }
  return true;
}

// Elements that depend on each other and differ in a loop, but in none around it, come in the wrong order if the loop
// changes its direction. If there are none, either direction is valid, whatever the others are.
void UpdateRelations::find_carrying(std::vector<ReverseLoop>& loops,
                                    const std::vector<Read>& reads) const {
  for (ReverseLoop& loop : loops) {
    loop.descending = !loop.descending;
    loop.carries = !is_valid_order(loops, reads);
    loop.descending = loop.carries && !loop.descending;
  }
}

std::optional<std::vector<ReverseLoop>> UpdateRelations::reverse_order(
    const std::vector<Read>& reads) const {
  std::vector<ReverseLoop> guess = first_guess();
  for (unsigned flips = 0; flips < (1u << guess.size()); ++flips) {
    std::vector<ReverseLoop> loops = guess;
    for (size_t l = 0; l < loops.size(); ++l) {
      if (flips >> l & 1u) loops[l].descending = !loops[l].descending;
    }
    if (!is_valid_order(loops, reads)) continue;
    find_carrying(loops, reads);
    return loops;
  }
  return std::nullopt;
}

}  // namespace retrograde::autodiff
