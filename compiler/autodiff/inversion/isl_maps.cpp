#include "autodiff/inversion/isl_maps.h"

#include "autodiff/inversion/isl_bridge.h"

namespace retrograde::autodiff {

namespace {

isl_space* space_of(isl_ctx* ctx, size_t in, size_t out) {
  return isl_space_alloc(ctx, 0, static_cast<unsigned>(in), static_cast<unsigned>(out));
}

}  // namespace

isl::map universe_map(isl_ctx* ctx, size_t in, size_t out) {
  return isl::manage(isl_map_universe(space_of(ctx, in, out)));
}
isl::map empty_map(isl_ctx* ctx, size_t in, size_t out) {
  return isl::manage(isl_map_empty(space_of(ctx, in, out)));
}

isl::map only_output(const isl::map& m, int which) {
  int n = isl_map_dim(m.get(), isl_dim_out);
  isl_map* result = m.copy();
  result = isl_map_project_out(result, isl_dim_out, static_cast<unsigned>(which + 1),
                               static_cast<unsigned>(n - which - 1));
  result = isl_map_project_out(result, isl_dim_out, 0, static_cast<unsigned>(which));
  return isl::manage(result);
}

isl::map output_equals(const isl::pw_aff& e, int which, int n) {
  isl_map* result = isl_map_from_pw_aff(e.copy());
  result = isl_map_insert_dims(result, isl_dim_out, 1, static_cast<unsigned>(n - which - 1));
  result = isl_map_insert_dims(result, isl_dim_out, 0, static_cast<unsigned>(which));
  return isl::manage(result);
}

bool is_single_valued(const isl::map& m) {
  const bool result = isl_map_is_single_valued(m.get()) == isl_bool_true;
  throw_if_failed(isl_map_get_ctx(m.get()));
  return result;
}

}  // namespace retrograde::autodiff
