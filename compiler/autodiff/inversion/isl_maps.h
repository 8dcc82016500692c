// isl_maps.h -- small operations on isl maps between flat, anonymous tuples.
#pragma once

#include <isl/cpp.h>

namespace retrograde::autodiff {

// The maps of all pairs, and of no pair, of tuples of these lengths.
isl::map universe_map(isl_ctx* ctx, size_t in, size_t out);
isl::map empty_map(isl_ctx* ctx, size_t in, size_t out);
// The map with output `which` alone.
isl::map only_output(const isl::map& m, int which);
// {in -> (z0..zn-1) : z_which = e(in)}
isl::map output_equals(const isl::pw_aff& e, int which, int n);
bool is_single_valued(const isl::map& m);

}  // namespace retrograde::autodiff
