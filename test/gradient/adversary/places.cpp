#include "gradient/adversary/places.h"

#include "gradient/adversary/program.h"

namespace retrograde::gradient {

Expr Places::other(const std::vector<Expr>& all) {
  if (all.empty()) return 1;
  return all[static_cast<size_t>(choices_.below(static_cast<int>(all.size())))];
}

Expr Places::affine(const Expr& u, const std::vector<Expr>& all) {
  switch (choices_.below(9)) {
    case 0:
      return u;
    case 1:
      return u + choices_.around_zero(3);
    case 2:
      return choices_.between(0, natural_size) - u;
    case 3:
      return 2 * u + choices_.around_zero(2);
    case 4:
      return 3 * u - choices_.between(0, 4);
    case 5:
      return u + other(all);
    case 6:
      return u - other(all) + choices_.between(0, 2);
    case 7:
      return other(all);
    default:
      return Expr(choices_.around_zero(4));
  }
}

Expr Places::piecewise(const Expr& u, const std::vector<Expr>& all) {
  switch (choices_.below(12)) {
    case 0:
      return clamp(u + choices_.around_zero(2), 0, natural_size - 1);
    case 1:
      return u / choices_.between(2, 3) + choices_.around_zero(1);
    case 2:
      return (u + choices_.around_zero(4)) % choices_.between(2, natural_size);
    case 3:
      return select(condition(all), affine(u, all), affine(u, all));
    case 4:
      return min(u, choices_.between(0, 3));
    case 5:
      return max(u, other(all));
    case 6:
      return min(u, other(all) + choices_.around_zero(1));
    case 7:
      return clamp(affine(u, all), choices_.around_zero(2), count_ + choices_.around_zero(1));
    case 8:
      return 2 * (u / 2) + 1 - u % 2;  // neighbours change places
    case 9:
      return u / 2 + (u % 2) * choices_.between(1, 3);
    case 10:
      return (choices_.between(2, 13) * u + choices_.between(0, 3)) % natural_size;
    default:
      return (-u) % choices_.between(2, 4);
  }
}

Expr Places::odd(const Expr& u, const std::vector<Expr>& all) {
  switch (choices_.below(9)) {
    case 0:
      return by_data(u, natural_size);
    case 1:
      return u + by_data(u, 3);
    case 2:
      return clamp(u * other(all), 0, natural_size);
    case 3:
      return cast<int>(abs(u - choices_.between(0, 4)));
    case 4:
      return u + count_;
    case 5:
      return u & 3;
    case 6:
      return u >> 1;
    case 7:
      return by_data(other(all), natural_size) + u % 2;
    default:
      return likely(u) + cast<int>(condition(all));
  }
}

Expr Places::near(const Expr& u, const std::vector<Expr>& all) {
  switch (choices_.below(10)) {
    case 0:
    case 1:
    case 2:
      return u;
    case 3:
    case 4:
    case 5:
      return affine(u, all);
    case 6:
    case 7:
      return piecewise(u, all);
    case 8:
      return odd(u, all);
    default:
      return piecewise(affine(u, all), all);
  }
}

Expr Places::inside(const Expr& u, const std::vector<Expr>& all, const Expr& n) {
  switch (choices_.below(5)) {
    case 0:
      return clamp(near(u, all), 0, n - 1);
    case 1:
      return near(u, all) % n;
    case 2:
      return min(max(near(u, all), 0), n - 1);
    case 3:
      return by_data(u, n);
    default:
      return n - 1 - clamp(near(u, all), 0, n - 1);
  }
}

Expr Places::by_data(const Expr& u, const Expr& n) {
  return clamp(data_(clamp(u, 0, data_.width() - 1)), 0, n - 1);
}

Expr Places::condition(const std::vector<Expr>& all) {
  const Expr u = other(all);
  switch (choices_.below(9)) {
    case 0:
      return u < choices_.between(0, 4);
    case 1:
      return u == choices_.between(0, 4);
    case 2:
      return u % 2 == choices_.below(2);
    case 3:
      return u <= other(all);
    case 4:
      return u + other(all) < choices_.between(1, 6);
    case 5:
      return u != choices_.between(0, 4);
    case 6:
      return by_data(u, natural_size) > choices_.between(0, 3);
    case 7:
      return u >= 1 && u < count_;
    default:
      return !(u > 1) || other(all) == 0;
  }
}

}  // namespace retrograde::gradient
