#include "autoschedule/read_window.h"

#include <algorithm>

#include "autoschedule/read_estimate.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "simplify/simplify.h"

namespace retrograde::autoschedule {

namespace {

using Found = std::optional<ReadWindow>;

ReadWindow point(double value) { return {"", 0, value, value}; }

// Times a factor, of which the sign turns the ends.
ReadWindow scaled(const ReadWindow& w, double by) {
  return {w.loop, w.scale * by, std::min(w.low * by, w.high * by),
          std::max(w.low * by, w.high * by)};
}

Found sum(const ReadWindow& a, const ReadWindow& b) {
  if (!a.loop.empty() && !b.loop.empty() && a.loop != b.loop) return std::nullopt;
  return ReadWindow{a.loop.empty() ? b.loop : a.loop, a.scale + b.scale, a.low + b.low,
                    a.high + b.high};
}

class WindowFinder {
 public:
  WindowFinder(const FuncContents& f, const Definition& stage) : f_(f), stage_(stage) {}

  Found of(const Expr& any_index) const {
    const Expr index = unclamped(any_index, [&](const Expr& e) { return moves(e); });
    if (const auto constant = as_const_int(index)) return point(static_cast<double>(*constant));
    if (const auto* v = index.as<Variable>()) return of_variable(v->name);
    if (const auto* cast = index.as<Cast>())
      return cast->value.type().is_float() ? std::nullopt : of(cast->value);
    const auto* binary = index.as<Binary>();
    if (!binary) return std::nullopt;
    const Found a = of(binary->a), b = of(binary->b);
    if (!a || !b) return std::nullopt;
    switch (index.kind()) {
      case Kind::Add:
        return sum(*a, *b);
      case Kind::Sub:
        return sum(*a, scaled(*b, -1));
      case Kind::Mul:
        return product(*a, *b);
      case Kind::Div:
        return quotient(*a, *b);
      case Kind::Mod:
        return remainder(*b);
      case Kind::Min:
      case Kind::Max:
        return either(*a, *b);
      default:
        return std::nullopt;
    }
  }

 private:
  bool moves(const Expr& e) const {
    return std::any_of(f_.args.begin(), f_.args.end(),
                       [&](const std::string& v) { return uses_variable(e, v); }) ||
           std::any_of(stage_.rvars.begin(), stage_.rvars.end(),
                       [&](const auto& r) { return uses_variable(e, r.var); });
  }

  Found of_variable(const std::string& name) const {
    if (std::find(f_.args.begin(), f_.args.end(), name) != f_.args.end())
      return ReadWindow{name, 1, 0, 0};
    for (const ReductionVariable& r : stage_.rvars) {
      const auto min = as_const_int(simplify(r.min)), extent = as_const_int(simplify(r.extent));
      if (r.var == name && min && extent)
        return ReadWindow{"", 0, static_cast<double>(*min),
                          static_cast<double>(*min + *extent - 1)};
    }
    return std::nullopt;
  }

  static bool is_constant(const ReadWindow& w) { return w.loop.empty() && w.low == w.high; }
  static Found product(const ReadWindow& a, const ReadWindow& b) {
    if (is_constant(b)) return scaled(a, b.low);
    return is_constant(a) ? Found(scaled(b, a.low)) : std::nullopt;
  }
  // Rounded down: by less than one.
  static Found quotient(const ReadWindow& a, const ReadWindow& b) {
    if (!is_constant(b) || b.low < 1) return std::nullopt;
    ReadWindow result = scaled(a, 1 / b.low);
    result.low -= (b.low - 1) / b.low;
    return result;
  }
  static Found remainder(const ReadWindow& b) {
    if (!is_constant(b) || b.low < 1) return std::nullopt;
    return ReadWindow{"", 0, 0, b.low - 1};
  }
  static Found either(const ReadWindow& a, const ReadWindow& b) {
    if (a.loop != b.loop || a.scale != b.scale) return std::nullopt;
    return ReadWindow{a.loop, a.scale, std::min(a.low, b.low), std::max(a.high, b.high)};
  }

  const FuncContents& f_;
  const Definition& stage_;
};

}  // namespace

std::optional<ReadWindow> read_window(const Expr& index, const FuncContents& f,
                                      const Definition& stage) {
  return WindowFinder(f, stage).of(without_lets(index));
}

}  // namespace retrograde::autoschedule
