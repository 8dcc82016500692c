// taps.h -- merges contributions into shared update definitions.
//
// Equal gathers become one update with the sum of their terms. Scatters over one domain, such as those to the corners
// of the cell that a pixel interpolates, become the taps of one update: it loops over the domain and then over the
// taps.
#pragma once

#include <vector>

#include "autodiff/sums/accumulation.h"

namespace retrograde::autodiff {

// One index of an update, such as one corner of an interpolation cell.
struct Tap {
  std::vector<Expr> place;
  std::vector<Expr> sums;  // for each value; undefined: no term
};

// One update: its iterations, with the taps as the last loop if there are several, and the body. `over` is the gather
// or scatter of the first tap.
struct Iterations {
  Gather over;
  std::vector<ReductionVariable> rvars;
  bool has_taps = false;
  Tap all;
  Expr predicate;
};

// A key that is equal for gathers that can share an update; reduction variables are numbered in it. For taps of one
// scatter the indices outside of the pure dimensions may differ: `with_places` is then false.
std::string shape_of(const Gather& g, bool with_places = true);

// `e`, in terms of the reduction variables of `from`, in terms of those of `to`, which has the same shape.
Expr in_domain_of(const Gather& to, const Gather& from, const Expr& e);

// The updates for those contributions that are not pointwise, to a Func with `values` values.
std::vector<Iterations> updates_of(const std::vector<Contribution>& contributions, size_t values);

}  // namespace retrograde::autodiff
