#include "autodiff/inversion/fibre_plan.h"

#include <isl/ilp.h>

#include <algorithm>

#include "autodiff/inversion/isl_maps.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

isl::pw_aff insert_input(const isl::pw_aff& e) {
  int n = isl_pw_aff_dim(e.get(), isl_dim_in);
  return isl::manage(isl_pw_aff_insert_dims(e.copy(), isl_dim_in, static_cast<unsigned>(n), 1));
}
isl::map insert_input(const isl::map& m) {
  int n = isl_map_dim(m.get(), isl_dim_in);
  return isl::manage(isl_map_insert_dims(m.copy(), isl_dim_in, static_cast<unsigned>(n), 1));
}

// The largest difference between two outputs of one input; nullopt if unbounded, or bounded by parameters only.
std::optional<int64_t> spread(const isl::map& one_output) {
  isl::map pairs = one_output.reverse().apply_range(one_output);
  const isl::val largest = pairs.deltas().dim_max_val(0);
  return largest.is_int() ? std::optional<int64_t>(largest.num_si()) : std::nullopt;
}

int64_t stride_of(const isl::map& one_output) {
  isl_stride_info* info = isl_map_get_range_stride_info(one_output.get(), 0);
  isl_val* v = isl_stride_info_get_stride(info);
  isl_stride_info_free(info);
  return std::max<int64_t>(isl::manage(v).num_si(), 1);
}

isl::pw_aff smallest_output(const isl::map& one_output) {
  isl_pw_multi_aff* pma = isl_map_lexmin_pw_multi_aff(one_output.copy());
  isl::pw_aff result = isl::manage(isl_pw_multi_aff_get_pw_aff(pma, 0));
  isl_pw_multi_aff_free(pma);
  return coalesced(result);
}

// Settles the variables one after the other and keeps the remaining fibre.
class FibrePlanner {
 public:
  explicit FibrePlanner(const FibreSpace& space) : space_(space) {}

  FibrePlan plan(const isl::map& piece) {
    FibrePlan result;
    result.coordinates.resize(space_.vars.size());
    isl::map loose = isl::manage(isl_map_gist_domain(piece.copy(), space_.box.copy()));
    Fibre fibre{piece.reverse(), loose.reverse()};
    std::vector<int> open;
    for (int j = 0; j < var_count(); ++j) open.push_back(j);
    while (!open.empty()) {
      settle_determined(fibre, open, result);
      if (!open.empty()) free_cheapest(fibre, open, result);
    }
    result.valid = coalesced(fibre.exact.domain());
    return result;
  }

 private:
  struct Fibre {
    isl::map exact, loose;  // (y, rho...) -> z; loose: without the domain
  };

  int var_count() const { return static_cast<int>(space_.vars.size()); }

  void settle_determined(Fibre& fibre, std::vector<int>& open, FibrePlan& plan) {
    for (auto it = open.begin(); it != open.end();) {
      isl::map exact = only_output(fibre.exact, *it), loose = only_output(fibre.loose, *it);
      if (!is_single_valued(exact)) {
        ++it;
        continue;
      }
      // Without the domain's borders the expression has fewer pieces.
      auto& c = plan.coordinates[static_cast<size_t>(*it)];
      std::optional<isl::pw_aff> value;
      if (is_single_valued(loose)) value = function_of(loose);
      if (!value || pieces_of(*value) != 1) value = function_of(exact);
      c.value = *value;
      it = open.erase(it);
    }
  }

  struct Candidate {
    int var = -1;
    int64_t extent = unbounded;
    int64_t stride = 1;
    bool is_static = false;
  };

  void free_cheapest(Fibre& fibre, std::vector<int>& open, FibrePlan& plan) {
    Candidate best;
    for (int j : open) {
      Candidate c = candidate(fibre, j);
      if (best.var < 0 || is_better(c, best)) best = c;
    }
    int rho = static_cast<int>(plan.free_vars.size());
    isl::pw_aff base = base_of(fibre, best);
    int inputs = isl_map_dim(fibre.exact.get(), isl_dim_in);
    base = insert_input(base);
    isl_local_space* space = isl_local_space_from_space(isl_pw_aff_get_domain_space(base.get()));
    isl::pw_aff step =
        isl::manage(isl_pw_aff_var_on_domain(space, isl_dim_set, static_cast<unsigned>(inputs)));
    isl::pw_aff value =
        base.add(step.scale(isl::manage(isl_val_int_from_si(space_.bridge.ctx(), best.stride))));
    isl::map link = output_equals(value, best.var, var_count());
    fibre.exact = insert_input(fibre.exact).intersect(link);
    fibre.loose = insert_input(fibre.loose).intersect(link);
    plan.coordinates[static_cast<size_t>(best.var)] = {true, value, rho, best.is_static,
                                                       best.extent};
    plan.free_vars.push_back(best.var);
    plan.cost = best.extent == unbounded ? 1e30 : plan.cost * static_cast<double>(best.extent);
    open.erase(std::ranges::find(open, best.var));
  }

  Candidate candidate(const Fibre& fibre, int j) const {
    Candidate c;
    c.var = j;
    isl::map exact = only_output(fibre.exact, j);
    c.stride = stride_of(exact);
    if (auto s = spread(exact)) c.extent = *s / c.stride + 1;
    if (auto own = constant_extent(space_.vars[static_cast<size_t>(j)].range());
        own && c.stride == 1 && c.extent == *own)
      c.is_static = true;
    if (c.extent == unbounded) c.is_static = true, c.stride = 1;
    return c;
  }
  // Prefers fewer iterations, then the stage's own reduction variables, whose bounds stay.
  bool is_better(const Candidate& a, const Candidate& b) const {
    auto rank = [&](const Candidate& c) {
      const LoopVariable& v = space_.vars[static_cast<size_t>(c.var)];
      return std::tuple(c.extent == unbounded, c.extent, !v.is_reduction, !c.is_static);
    };
    return rank(a) < rank(b);
  }

  // The start of the free variable: its own minimum, else the smallest point of the fibre.
  isl::pw_aff base_of(const Fibre& fibre, const Candidate& c) {
    if (c.is_static) {
      const LoopVariable& v = space_.vars[static_cast<size_t>(c.var)];
      if (!v.min.defined()) {
        user_error("differentiate an access over an unbounded domain",
                   "every variable needs a range",
                   text("the Func with the dimension ", quoted(v.name),
                        " is read at indices that depend on data and have no bounds"),
                   "Clamp these indices, as in clamp(index, 0, extent - 1)");
      }
      return on_space(space_.bridge.bound(v.min), fibre.exact);
    }
    // Intersected with as little of the domain as keeps the extent, the expression has fewer pieces.
    isl::map own = fibre.loose.intersect_range(space_.own_range[static_cast<size_t>(c.var)]);
    for (const isl::map& m : {only_output(fibre.loose, c.var), only_output(own, c.var)}) {
      auto s = spread(m);
      if (!s || *s / c.stride + 1 != c.extent || stride_of(m) != c.stride) continue;
      isl::pw_aff base = smallest_output(m);
      if (pieces_of(base) == 1) return base;
    }
    return smallest_output(only_output(fibre.exact, c.var));
  }
  // An expression of the parameters alone, as a function of the fibre's inputs.
  isl::pw_aff on_space(const isl::pw_aff& e, const isl::map& fibre) const {
    isl_pw_aff* moved =
        isl_pw_aff_drop_dims(e.copy(), isl_dim_in, 0, static_cast<unsigned>(var_count()));
    int inputs = isl_map_dim(fibre.get(), isl_dim_in);
    return isl::manage(isl_pw_aff_insert_dims(moved, isl_dim_in, 0, static_cast<unsigned>(inputs)));
  }

  const FibreSpace& space_;
};

}  // namespace

std::optional<isl::pw_aff> function_of(const isl::map& one_output) {
  isl_pw_multi_aff* pma = isl_pw_multi_aff_from_map(isl_map_coalesce(one_output.copy()));
  isl::pw_aff result = isl::manage(isl_pw_multi_aff_get_pw_aff(pma, 0));
  isl_pw_multi_aff_free(pma);
  return coalesced(result);
}
unsigned pieces_of(const isl::pw_aff& e) {
  return static_cast<unsigned>(isl_pw_aff_n_piece(e.get()));
}

FibrePlan plan_fibre(const FibreSpace& space, const isl::map& piece) {
  return FibrePlanner(space).plan(piece);
}

}  // namespace retrograde::autodiff
