#include "autodiff/borders/join_borders.h"

#include <algorithm>
#include <optional>
#include <unordered_set>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/markers.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

std::vector<Expr> conjuncts_of(const Expr& predicate) {
  std::vector<Expr> result;
  if (predicate.defined()) add_conjuncts(predicate, result);
  return result;
}

bool contains(const std::vector<Expr>& conjuncts, const Expr& e) {
  return std::ranges::any_of(conjuncts, [&](const Expr& other) { return equal(e, other); });
}

bool say_the_same(const std::vector<Expr>& a, const std::vector<Expr>& b) {
  const auto all_in = [](const auto& some, const auto& others) {
    return std::ranges::all_of(some, [&](const Expr& e) { return contains(others, e); });
  };
  return all_in(a, b) && all_in(b, a);
}

// If the condition on `arg` ends right before `place`, returns it extended by that element; else an undefined Expr.
Expr moved_past(const Expr& condition, const std::string& arg, const Expr& place) {
  const auto is_arg = [&](const Expr& e) {
    const auto* variable = e.as<Variable>();
    return variable && variable->name == arg;
  };
  const auto is_at = [&](const Expr& e) { return equal(simplify(e), place); };
  if (const auto* less = condition.as<LT>()) {
    if (is_arg(less->a) && is_at(less->b)) return less->a <= place;
    if (is_arg(less->b) && is_at(less->a)) return place <= less->b;
  }
  if (const auto* at_most = condition.as<LE>()) {
    if (is_arg(at_most->a) && is_at(at_most->b + 1)) return at_most->a <= place;
    if (is_arg(at_most->b) && is_at(at_most->a - 1)) return place <= at_most->b;
  }
  return {};
}

// Whether the two agree except in dimension d, where `border` has a single index and `inner` runs over all elements.
bool are_beside_each_other(const Contribution& inner, const Contribution& border, size_t d) {
  const Gather &a = inner.gather, &b = border.gather;
  if (inner.component != border.component || a.rdom || a.scatters || !a.pure[d]) return false;
  for (size_t i = 0; i < a.lhs.size(); ++i) {
    if (i != d && (a.pure[i] != b.pure[i] || !equal(a.lhs[i], b.lhs[i]))) return false;
  }
  return true;
}

// The predicate of both terms together; nullopt if the border's term does not continue the interior's.
std::optional<Expr> joined(const Contribution& inner, const Contribution& border, size_t d,
                           const std::string& arg) {
  if (!are_beside_each_other(inner, border, d)) return std::nullopt;
  const Expr place = border.gather.lhs[d];
  const Substitution there{{arg, place}};
  std::vector<Expr> all, others;
  bool moved = false;
  for (const Expr& condition : conjuncts_of(inner.gather.predicate)) {
    const Expr past = moved ? Expr() : moved_past(condition, arg, place);
    moved |= past.defined();
    all.push_back(past.defined() ? past : condition);
    const Expr here = past.defined() ? past : simplify(substitute(condition, there));
    if (!past.defined() && !is_const_true(here)) others.push_back(here);
  }
  if (!moved || !say_the_same(others, conjuncts_of(border.gather.predicate))) return std::nullopt;
  const auto plain = [](const Expr& e) { return simplify(without_likely(e)); };
  if (!equal(plain(substitute(inner.adjoint, there)), plain(border.adjoint))) return std::nullopt;
  return simplify(conjunction(all));
}

bool is_border(const Gather& g, size_t d) {
  return !g.rdom && !g.scatters && !g.pure[d] && is_const(g.lhs[d]);
}

// Merges the border into one of `others` and returns that one; null if none fits.
Contribution* join(const Contribution& border, const std::vector<Contribution*>& others,
                   const AdjointTarget& target) {
  for (size_t d = 0; d < border.gather.lhs.size(); ++d) {
    if (!is_border(border.gather, d)) continue;
    for (Contribution* inner : others) {
      const auto predicate = joined(*inner, border, d, target.args[d]);
      if (!predicate) continue;
      inner->gather.predicate = *predicate;
      return inner;
    }
  }
  return nullptr;
}

size_t fixed_dimensions(const Contribution* c) {
  return static_cast<size_t>(std::count(c->gather.pure.begin(), c->gather.pure.end(), false));
}

}  // namespace

void join_borders(std::vector<Contribution>& contributions, const AdjointTarget& target) {
  std::vector<Contribution*> left;
  for (Contribution& c : contributions) left.push_back(&c);
  size_t most = 0;
  for (const Contribution* c : left) most = std::max(most, fixed_dimensions(c));
  const size_t all = left.size();
  for (; most > 0; --most) {  // corners are merged into sides before sides into the interior
    // A side may fit only after the corners of its neighbours have been merged.
    for (bool more = true; more;) {
      const size_t before = left.size();
      std::unordered_set<const Contribution*> gone;
      for (const Contribution* border : left) {
        if (fixed_dimensions(border) == most && join(*border, left, target)) gone.insert(border);
      }
      std::erase_if(left, [&](const Contribution* c) { return gone.contains(c); });
      more = left.size() < before;
    }
  }
  if (left.size() == all) return;
  std::vector<Contribution> result = mapped(left, [&](const Contribution* c) { return *c; });
  contributions = std::move(result);
}

}  // namespace retrograde::autodiff
