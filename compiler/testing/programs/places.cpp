// Integer expressions in the coordinates of a point: the indices at which a program reads or writes.
#include "testing/programs/maker.h"

namespace retrograde::fuzz {

bool Maker::may_stride() { return strides_ < s_.strides && ++strides_ > 0; }

Expr Maker::other(const std::vector<Expr>& all) {
  if (all.empty()) return 1;
  return all[static_cast<size_t>(c_.below(static_cast<int>(all.size())))];
}

Expr Maker::affine(const Expr& u, const std::vector<Expr>& all) {
  return c_.one_of<Expr>({
      [&] { return u; },
      [&] { return u + c_.around_zero(3); },
      [&] { return c_.between(0, natural_size) - u; },
      [&] { return (may_stride() ? 2 * u : u) + c_.around_zero(2); },
      [&] { return (may_stride() ? 3 * u : u) - c_.between(0, 4); },
      [&] { return may_stride() ? u + other(all) : u + 2; },
      [&] { return (may_stride() ? u - other(all) : u) + c_.between(0, 2); },
      [&] { return other(all); },
      [&] { return Expr(c_.around_zero(4)); },
  });
}

Expr Maker::piecewise(const Expr& u, const std::vector<Expr>& all) {
  return c_.one_of<Expr>({
      [&] { return clamp(u + c_.around_zero(2), 0, natural_size - 1); },
      [&] { return u / c_.between(2, 3) + c_.around_zero(1); },
      [&] { return (u + c_.around_zero(4)) % c_.between(2, natural_size); },
      [&] { return select(place_condition(all), affine(u, all), affine(u, all)); },
      [&] { return min(u, c_.between(0, 3)); },
      [&] { return max(u, other(all)); },
      [&] { return min(u, other(all) + c_.around_zero(1)); },
      [&] { return clamp(affine(u, all), c_.around_zero(2), p_.count + c_.around_zero(1)); },
      [&] { return 2 * (u / 2) + 1 - u % 2; },  // swaps neighbours
      [&] { return u / 2 + (u % 2) * c_.between(1, 3); },
      [&] { return (c_.between(2, 13) * u + c_.between(0, 3)) % natural_size; },
      [&] { return (-u) % c_.between(2, 4); },
  });
}

Expr Maker::odd(const Expr& u, const std::vector<Expr>& all) {
  return c_.one_of<Expr>({
      [&] { return by_data(u, natural_size); },
      [&] { return u + by_data(u, 3); },
      [&] { return clamp(u * other(all), 0, natural_size); },
      [&] { return cast<int>(abs(u - c_.between(0, 4))); },
      [&] { return u + p_.count; },
      [&] { return u & 3; },
      [&] { return u >> 1; },
      [&] { return by_data(other(all), natural_size) + u % 2; },
      [&] { return likely(u) + cast<int>(place_condition(all)); },
  });
}

Expr Maker::near(const Expr& u, const std::vector<Expr>& all) {
  return c_.one_of<Expr>({
      [&] { return u; },
      [&] { return u; },
      [&] { return u; },
      [&] { return affine(u, all); },
      [&] { return affine(u, all); },
      [&] { return affine(u, all); },
      [&] { return piecewise(u, all); },
      [&] { return piecewise(u, all); },
      [&] { return odd(u, all); },
      [&] { return piecewise(affine(u, all), all); },
  });
}

Expr Maker::inside(const Expr& u, const std::vector<Expr>& all, const Expr& n) {
  return c_.one_of<Expr>({
      [&] { return clamp(near(u, all), 0, n - 1); },
      [&] { return near(u, all) % n; },
      [&] { return min(max(near(u, all), 0), n - 1); },
      [&] { return by_data(u, n); },
      [&] { return n - 1 - clamp(near(u, all), 0, n - 1); },
  });
}

Expr Maker::by_data(const Expr& u, const Expr& n) {
  return clamp(p_.data(clamp(u, 0, p_.data.width() - 1)), 0, n - 1);
}

Expr Maker::place_condition(const std::vector<Expr>& all) {
  const Expr u = other(all);
  return c_.one_of<Expr>({
      [&] { return u < c_.between(0, 4); },
      [&] { return u == c_.between(0, 4); },
      [&] { return u % 2 == c_.below(2); },
      [&] { return u <= other(all); },
      [&] { return u + other(all) < c_.between(1, 6); },
      [&] { return u != c_.between(0, 4); },
      [&] { return by_data(u, natural_size) > c_.between(0, 3); },
      [&] { return u >= 1 && u < p_.count; },
      [&] { return !(u > 1) || other(all) == 0; },
  });
}

}  // namespace retrograde::fuzz
