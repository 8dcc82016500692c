// Collection is memoised by node, so a DAG of shared sums costs the number of its nodes, not its
// paths.
#include "analysis/linear.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/node_memo.h"

namespace retrograde::analysis {

namespace {

// A form with more terms than this is an atom in the expressions around it, which keeps collection
// linear in the DAG.
constexpr size_t most_terms = 32;
// How many operands of nested min (max) are compared with each other.
constexpr size_t max_operands = 8;
// The limit on pairs of sums visited in one comparison.
constexpr int most_compared = 64;

bool is_nothing(const Sum& f) { return f.terms.empty() && f.constant == 0; }

class Collector {
 public:
  Sum form(const Expr& e) {
    if (!has_linear_form(e.type())) return linear_sum(e);
    return memo_.get(e, [&] {
      Sum result = collect(e);
      return result.terms.size() > most_terms ? linear_sum(e) : result;
    });
  }

 private:
  Sum collect(const Expr& e) {
    if (auto value = as_const_int(e)) return valid_or_atom(linear_sum(e.type(), *value), e);
    if (const Cast* cast = e.as<Cast>()) return collect_cast(e, *cast);
    const Binary* binary = e.as<Binary>();
    if (!binary) return linear_sum(e);
    switch (e.kind()) {
      case Kind::Add:
        return valid_or_atom(plus(form(binary->a), form(binary->b)), e);
      case Kind::Sub:
        return valid_or_atom(plus(form(binary->a), form(binary->b), -1), e);
      case Kind::Mul:
        return collect_product(e, form(binary->a), form(binary->b));
      case Kind::Div:
      case Kind::Mod:
        return collect_division(e, *binary);
      default:
        return linear_sum(e);
    }
  }

  static Sum valid_or_atom(const Sum& sum, const Expr& e) {
    return sum.valid ? sum : linear_sum(e);
  }

  Sum collect_product(const Expr& e, const Sum& a, const Sum& b) {
    if (!a.is_constant() && !b.is_constant()) return linear_sum(e);
    return valid_or_atom(a.is_constant() ? times(b, a.constant) : times(a, b.constant), e);
  }

  // (d*q + r) / d == q + r / d  and  (d*q + r) % d == r % d  for d > 0.
  Sum collect_division(const Expr& e, const Binary& binary) {
    auto divisor = as_const_int(binary.b);
    if (!divisor || *divisor <= 0) return linear_sum(e);
    Sum numerator = form(binary.a);
    DividedSum q = divide_terms(numerator, *divisor);
    bool is_div = e.kind() == Kind::Div;
    if (q.remainder.terms.empty()) return is_div ? q.quotient : q.remainder;
    Sum rest = linear_sum(e);
    if (!is_nothing(q.quotient)) {
      Expr numerator_rest = to_expr(q.remainder);
      if (!numerator_rest.defined()) return linear_sum(e);
      rest = linear_sum(binary_of(e.kind(), numerator_rest, *divisor));
    }
    return is_div ? valid_or_atom(plus(q.quotient, rest), e) : rest;
  }

  static Expr binary_of(Kind kind, const Expr& a, int64_t b) {
    return binary(kind, a, make_const(a.type(), b));
  }

  // Widening distributes over sums, since the narrower sum does not overflow.
  Sum collect_cast(const Expr& e, const Cast& cast) {
    Type from = cast.value.type();
    if (!has_linear_form(from) || from.bits() > e.type().bits()) return linear_sum(e);
    Sum inner = form(cast.value), sum = linear_sum(e.type(), inner.constant);
    bool is_atom = inner.terms.size() == 1 && inner.terms[0].atom.same_as(cast.value);
    if (is_atom) return linear_sum(e);
    for (const Term& term : inner.terms) sum.add(cast_to(e.type(), term.atom), term.factor);
    return sum;
  }

  NodeMemo<Sum> memo_;
};

// ---- min and max ----

// The operands of nested mins (or maxes) as sums: min(a, b) + 1 gives a + 1 and b + 1.
void add_operands(Kind kind, const Sum& f, std::vector<Sum>& operands) {
  bool nested = f.terms.size() == 1 && f.terms[0].factor == 1 && f.terms[0].atom.kind() == kind;
  if (!nested || operands.size() >= max_operands) {
    operands.push_back(f);
    return;
  }
  const Binary* inner = f.terms[0].atom.as<Binary>();
  for (const Expr& operand : {inner->a, inner->b}) {
    Sum shifted = linear_form(operand);
    shifted.add_constant(f.constant);
    add_operands(kind, shifted, operands);
  }
}

std::optional<int64_t> difference(const Sum& a, const Sum& b) {
  const Sum d = plus(a, b, -1);
  return d.valid && d.is_constant() ? std::optional(d.constant) : std::nullopt;
}

// Forms that consist of one quotient and a constant: p / k + c == (p + k*c) / k.
struct FloorQuotient {
  Sum numerator;
  int64_t divisor;
};
std::optional<FloorQuotient> as_quotient(const Sum& f) {
  if (!f.valid || f.terms.size() != 1 || f.terms[0].factor != 1) return std::nullopt;
  const Div* div = f.terms[0].atom.as<Div>();
  auto k = div ? as_const_int(div->b) : std::nullopt;
  if (!k || *k <= 0) return std::nullopt;
  const Sum numerator = plus(linear_form(div->a), linear_sum(f.type, f.constant), *k);
  return numerator.valid ? std::optional(FloorQuotient{numerator, *k}) : std::nullopt;
}

// A result <= 0 proves a <= b.
std::optional<int64_t> sign_of_difference(const Sum& a, const Sum& b) {
  if (auto d = difference(a, b)) return d;
  auto x = as_quotient(a), y = as_quotient(b);
  if (!x || !y || x->divisor != y->divisor) return std::nullopt;
  return difference(x->numerator, y->numerator);
}

// A sum that is a min or max of two sums, shifted by a constant; nothing for other sums.
struct Extreme {
  Kind kind;
  Sum a, b;
};
// `end` applies to promised values: a value promised to lie in a range equals the min of itself and
// the upper end, and the max of itself and the lower end.
std::optional<Extreme> as_extreme(const Sum& f, Kind end) {
  if (f.terms.size() != 1 || f.terms[0].factor != 1) return std::nullopt;
  const Expr& atom = f.terms[0].atom;
  const auto shifted = [&](Kind kind, const Expr& a, const Expr& b) {
    Extreme result{kind, linear_form(a), linear_form(b)};
    for (Sum* operand : {&result.a, &result.b}) operand->add_constant(f.constant);
    return result;
  };
  if (atom.kind() == Kind::Min || atom.kind() == Kind::Max)
    return shifted(atom.kind(), atom.as<Binary>()->a, atom.as<Binary>()->b);
  const auto* call = atom.as<Call>();
  if (!call || !call->is_op(Op::promise_clamped, Op::unsafe_promise_clamped)) return std::nullopt;
  return shifted(end, call->args[0], call->args[end == Kind::Min ? 2 : 1]);
}

// Whether a <= b is proven. First the exact rules: a max is at most b if all its operands are, and
// a is at most a min if it is at most all operands. Then the sufficient ones: one operand of a min,
// or of a max, is enough. (Whitman, Free lattices, 1941.)
bool is_at_most(const Sum& a, const Sum& b, int& budget) {
  if (--budget < 0) return false;
  if (const auto d = sign_of_difference(a, b)) return *d <= 0;
  const auto of_a = as_extreme(a, Kind::Min), of_b = as_extreme(b, Kind::Max);
  const auto is_left = [&](const Sum& x) { return is_at_most(x, b, budget); };
  const auto is_right = [&](const Sum& x) { return is_at_most(a, x, budget); };
  if (of_a && of_a->kind == Kind::Max) return is_left(of_a->a) && is_left(of_a->b);
  if (of_b && of_b->kind == Kind::Min) return is_right(of_b->a) && is_right(of_b->b);
  return (of_a && (is_left(of_a->a) || is_left(of_a->b))) ||
         (of_b && (is_right(of_b->a) || is_right(of_b->b)));
}

// min(kept, dropped) == kept where kept <= dropped; max(kept, dropped) == kept where kept >=
// dropped.
bool makes_redundant(Kind kind, const Sum& kept, const Sum& dropped) {
  int budget = most_compared;
  return kind == Kind::Min ? is_at_most(kept, dropped, budget) : is_at_most(dropped, kept, budget);
}

void add_unless_redundant(Kind kind, const Sum& candidate, std::vector<Sum>& kept) {
  auto covers = [&](const Sum& k) { return makes_redundant(kind, k, candidate); };
  if (std::ranges::any_of(kept, covers)) return;
  std::erase_if(kept, [&](const Sum& k) { return makes_redundant(kind, candidate, k); });
  kept.push_back(candidate);
}

Expr canonical_extreme(Kind kind, const Expr& a, const Expr& b) {
  if (a.same_as(b)) return a;
  if (!has_linear_form(a.type())) return binary(kind, a, b);
  // Operands of one side were compared when it was built, so the union of n boxes takes n^2 steps,
  // not n^3.
  std::vector<Sum> operands, more;
  add_operands(kind, linear_form(a), operands);
  add_operands(kind, linear_form(b), more);
  for (const Sum& candidate : more) add_unless_redundant(kind, candidate, operands);
  Expr result;
  for (const Sum& operand : operands) {
    Expr e = to_expr(operand);
    if (!e.defined()) return binary(kind, a, b);
    result = result.defined() ? binary(kind, result, e) : e;
  }
  return result;
}

}  // namespace

bool has_linear_form(Type type) { return type.is_int() && type.bits() >= 32 && type.is_scalar(); }

Sum linear_form(const Expr& e) { return Collector().form(e); }

std::optional<Sum> nonnegative_where(const Expr& comparison) {
  const auto* c = comparison.as<Binary>();
  if (!c || c->kind < Kind::LT || c->kind > Kind::GE || !has_linear_form(c->a.type()))
    return std::nullopt;
  const bool less = c->kind == Kind::LT || c->kind == Kind::LE,
             strict = c->kind == Kind::LT || c->kind == Kind::GT;
  Sum form = less ? plus(linear_form(c->b), linear_form(c->a), -1)
                  : plus(linear_form(c->a), linear_form(c->b), -1);
  form.add_constant(-int{strict});
  return form.valid ? std::optional(form) : std::nullopt;
}

std::optional<int64_t> constant_difference(const Expr& a, const Expr& b) {
  if (a.same_as(b) && has_linear_form(a.type())) return 0;
  if (a.type() != b.type() || !has_linear_form(a.type())) return std::nullopt;
  return difference(linear_form(a), linear_form(b));
}

Expr canonical(const Expr& e) {
  if (!has_linear_form(e.type())) return e;
  Sum form = linear_form(e);
  if (form.terms.size() == 1 && form.terms[0].atom.same_as(e)) return e;
  Expr result = to_expr(form);
  return result.defined() ? result : e;
}

Expr canonical_min(const Expr& a, const Expr& b) { return canonical_extreme(Kind::Min, a, b); }
Expr canonical_max(const Expr& a, const Expr& b) { return canonical_extreme(Kind::Max, a, b); }

Expr canonical_div(const Expr& e, int64_t divisor) {
  return canonical(binary(Kind::Div, e, make_const(e.type(), divisor)));
}

}  // namespace retrograde::analysis
