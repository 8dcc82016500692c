// Small steps on isl maps between flat, anonymous tuples.
#pragma once

#include <isl/cpp.h>

namespace retrograde::autodiff {

// All pairs of tuples of such lengths, and none of them.
isl::map universe_map(isl_ctx* ctx, size_t in, size_t out);
isl::map empty_map(isl_ctx* ctx, size_t in, size_t out);
// The map with output `which` alone.
isl::map only_output(const isl::map& m, int which);
// {in -> (z0..zn-1) : z_which = e(in)}
isl::map output_equals(const isl::pw_aff& e, int which, int n);
bool is_single_valued(const isl::map& m);

}  // namespace retrograde::autodiff
