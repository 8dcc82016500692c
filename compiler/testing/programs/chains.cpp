// Generates chains of Funcs at changing resolution, such as pyramids, resamplers and filters.
//
// Each Func reads a few elements of the previous ones, along one dimension closer together, further apart or shifted.
// Under schedules that store further out than they compute, nearly every Func is a sliding window of its own shape.
#include "testing/programs/maker.h"

namespace retrograde::fuzz {

// The index that a consumer at `u` reads: up- or downsampled by 2 to 4, more often adjacent.
Expr Maker::resampled(const Expr& u, int factor, bool reads_coarser) {
  const int offset = c_.around_zero(2);
  if (factor == 1) return u + offset;
  return (reads_coarser ? u / factor : u * factor) + offset;
}

void Maker::add_link() {
  Func f("l" + std::to_string(p_.funcs.size()));
  const bool is_first = p_.funcs.empty();
  const std::vector<Var> vars =
      first_variables(is_first ? c_.pick(s_.dimensions) : p_.funcs.back().dimensions());
  Point at{{vars.begin(), vars.end()}, {}, Func(), {}};
  if (is_first) {
    Expr value = c_.chance(50) ? cast(Int(32), read_image(at)) : Expr(0);
    for (size_t d = 0; d < vars.size(); ++d) value = value + vars[d] * (d == 0 ? 1 : 37);
    f(vars) = kept_small(value, wide_modulus);
    return finish(f);
  }
  const auto along = static_cast<size_t>(c_.below(static_cast<int>(vars.size())));
  Expr value;
  for (int reads = c_.between(1, 3); reads > 0; --reads) {
    // The last Func, so that the chain is connected; then any earlier one.
    const bool is_last = !value.defined() || c_.chance(60);
    const Func& source =
        is_last ? p_.funcs.back()
                : p_.funcs[static_cast<size_t>(c_.below(static_cast<int>(p_.funcs.size())))];
    const bool resamples = c_.chance(45), coarser = c_.chance(60) || !may_stride();
    std::vector<Expr> place(vars.begin(), vars.end());
    place[along] = resampled(vars[along], resamples ? c_.between(2, 4) : 1, coarser);
    const Expr read = source(place);
    value = value.defined() ? value + read * c_.between(1, 3) : read;
  }
  f(vars) = kept_small(value, wide_modulus);
  // Some have an update: not pure, but pure along the window.
  if (c_.chance(10)) {
    std::vector<Expr> place(vars.begin(), vars.end());
    f(vars) = kept_small(f(vars) + p_.funcs.back()(place), wide_modulus);
  }
  finish(f);
}

}  // namespace retrograde::fuzz
