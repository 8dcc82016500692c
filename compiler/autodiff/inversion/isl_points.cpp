#include "autodiff/inversion/isl_points.h"

#include <algorithm>

namespace retrograde::ir {

namespace {

std::optional<int64_t> to_int64(__isl_take isl_val* v) {
  std::optional<int64_t> result;
  if (isl_val_is_int(v) == isl_bool_true) result = isl_val_get_num_si(v);
  isl_val_free(v);
  return result;
}

struct Collector {
  int dims;
  int64_t most;
  std::vector<std::vector<int64_t>> points;
};

isl_stat collect(__isl_take isl_point* p, void* user) {
  auto& into = *static_cast<Collector*>(user);
  std::vector<int64_t> point;
  for (int d = 0; d < into.dims; ++d)
    point.push_back(*to_int64(isl_point_get_coordinate_val(p, isl_dim_set, d)));
  isl_point_free(p);
  into.points.push_back(std::move(point));
  return static_cast<int64_t>(into.points.size()) > into.most ? isl_stat_error : isl_stat_ok;
}

}  // namespace

std::optional<std::vector<ConstantRange>> ranges_of(const isl::set& s) {
  if (isl_set_is_empty(s.get()) == isl_bool_true || isl_set_is_bounded(s.get()) != isl_bool_true)
    return std::nullopt;
  std::vector<ConstantRange> result;
  for (int d = 0, n = isl_set_dim(s.get(), isl_dim_set); d < n; ++d) {
    auto min = to_int64(isl_set_dim_min_val(s.copy(), d));
    auto max = to_int64(isl_set_dim_max_val(s.copy(), d));
    if (!min || !max) return std::nullopt;
    result.push_back({*min, *max});
  }
  return result;
}

std::optional<std::vector<std::vector<int64_t>>> points_of(const isl::set& s, int64_t most) {
  Collector into{static_cast<int>(isl_set_dim(s.get(), isl_dim_set)), most, {}};
  bool all = isl_set_foreach_point(s.get(), collect, &into) == isl_stat_ok;
  if (!all) return std::nullopt;
  std::sort(into.points.begin(), into.points.end());
  return std::move(into.points);
}

}  // namespace retrograde::ir
