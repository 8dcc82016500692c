#include "autodiff/inversion/isl_points.h"

#include <algorithm>

#include "autodiff/inversion/isl_bridge.h"

namespace retrograde::autodiff {

namespace {

// Overlapping pieces are made disjoint before their points are counted. That may take longer than any table of points
// is worth, so it has a budget.
constexpr unsigned long enumerating_operations = 1'000'000;

using Points = std::vector<std::vector<int64_t>>;
struct Collector {
  int dims;
  int64_t most;
  Points points;
};

isl_stat collect(__isl_take isl_point* p, void* user) {
  auto& into = *static_cast<Collector*>(user);
  std::vector<int64_t> point;
  for (int d = 0; d < into.dims; ++d) {
    isl_val* v = isl_point_get_coordinate_val(p, isl_dim_set, d);
    point.push_back(isl_val_get_num_si(v));  // 0 without a value; isl then records the failure
    isl_val_free(v);
  }
  isl_point_free(p);
  into.points.push_back(std::move(point));
  return static_cast<int64_t>(into.points.size()) > into.most ? isl_stat_error : isl_stat_ok;
}

}  // namespace

std::optional<std::vector<ConstantRange>> ranges_of(const isl::set& s) {
  if (s.is_empty()) return std::nullopt;
  const bool is_bounded = isl_set_is_bounded(s.get()) == isl_bool_true;
  throw_if_failed(isl_set_get_ctx(s.get()));
  if (!is_bounded) return std::nullopt;
  std::vector<ConstantRange> result;
  for (int d = 0, n = isl_set_dim(s.get(), isl_dim_set); d < n; ++d) {
    const isl::val min = s.dim_min_val(d), max = s.dim_max_val(d);
    if (!min.is_int() || !max.is_int()) return std::nullopt;
    result.push_back({min.num_si(), max.num_si()});
  }
  return result;
}

std::optional<Points> points_of(const isl::set& s, int64_t most) {
  Collector into{static_cast<int>(isl_set_dim(s.get(), isl_dim_set)), most, {}};
  const auto all = found_within(isl_set_get_ctx(s.get()), enumerating_operations, [&] {
    return isl_set_foreach_point(s.get(), collect, &into) == isl_stat_ok;
  });
  if (!all.value_or(false)) return std::nullopt;
  std::ranges::sort(into.points);
  return std::move(into.points);
}

}  // namespace retrograde::autodiff
