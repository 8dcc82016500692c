// Contributions that share an update: equal gathers are one, with the sum of their terms. Scatters
// over one domain, as those to the corners of the cell in which a pixel is read, are the taps of one
// update, over its domain and then over them.
#pragma once

#include <vector>

#include "autodiff/sweeps/accumulation.h"

namespace retrograde::autodiff {

// One place of an update, as one corner of a cell between which a pixel is read.
struct Tap {
  std::vector<Expr> place;
  std::vector<Expr> sums;  // one a value; undefined: nothing is added
};

// One update: its iterations, with the taps as the last loop where there are several, and what each
// does. `over` is the gather, or scatter, of the first tap.
struct Iterations {
  Gather over;
  std::vector<ReductionVariable> rvars;
  bool has_taps = false;
  Tap all;
  Expr predicate;
};

// What two gathers must agree on to share an update, with the reduction variables numbered. To be
// taps of one, scatters need not agree on the places that are no pure dimensions.
std::string shape_of(const Gather& g, bool with_places = true);

// Of the contributions that are not pointwise, to a Func of so many values.
std::vector<Iterations> updates_of(const std::vector<Contribution>& contributions, size_t values);

}  // namespace retrograde::autodiff
