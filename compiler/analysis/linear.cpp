// Linear forms are kept sorted by the structural order of their atoms, so that adding two is a
// merge and equal sums have equal text. Collection is memoised by node: a DAG that shares sums
// costs its nodes, not its paths.
#include "analysis/linear.h"

#include <algorithm>
#include <unordered_map>

#include "ir/build.h"
#include "ir/equal.h"

namespace retrograde::ir {

namespace {

// A form with more terms than this is an atom to the expressions around it: keeps collection linear
// in the DAG.
constexpr size_t max_terms = 32;
// Operands of nested min (max) that are compared with each other.
constexpr size_t max_operands = 8;

int64_t floor_div(int64_t a, int64_t b) { return a / b - (a % b < 0); }

LinearForm constant_form(Type type, int64_t value) { return {type, {}, value}; }
LinearForm atom_form(const Expr& e) { return {e.type(), {{e, 1}}, 0}; }

// a + factor * b; nullopt when a number does not fit 64 bits.
std::optional<LinearForm> checked_plus(const LinearForm& a, const LinearForm& b, int64_t factor) {
  LinearForm sum{a.type, {}, 0};
  int64_t product;
  if (__builtin_mul_overflow(b.constant, factor, &product) ||
      __builtin_add_overflow(a.constant, product, &sum.constant)) {
    return std::nullopt;
  }
  auto ia = a.terms.begin(), ib = b.terms.begin();
  while (ia != a.terms.end() || ib != b.terms.end()) {
    int order = ia == a.terms.end()          ? 1
                : ib == b.terms.end()        ? -1
                : ia->atom.same_as(ib->atom) ? 0
                                             : compare(ia->atom, ib->atom);
    LinearTerm term;
    if (order < 0) {
      term = *ia++;
    } else {
      term.atom = ib->atom;
      if (__builtin_mul_overflow(ib->coefficient, factor, &term.coefficient)) return std::nullopt;
      if (order == 0 &&
          __builtin_add_overflow(term.coefficient, ia++->coefficient, &term.coefficient)) {
        return std::nullopt;
      }
      ++ib;
    }
    if (term.coefficient != 0) sum.terms.push_back(std::move(term));
  }
  return sum;
}

// The multiples of `divisor` in `f`, divided by it, and what is left (its constant in [0,
// divisor)).
struct Quotient {
  LinearForm whole, rest;
};
Quotient divide(const LinearForm& f, int64_t divisor) {
  Quotient q{constant_form(f.type, floor_div(f.constant, divisor)), constant_form(f.type, 0)};
  q.rest.constant = f.constant - q.whole.constant * divisor;
  for (const LinearTerm& term : f.terms) {
    if (term.coefficient % divisor == 0) {
      q.whole.terms.push_back({term.atom, term.coefficient / divisor});
    } else {
      q.rest.terms.push_back(term);
    }
  }
  return q;
}

bool is_nothing(const LinearForm& f) { return f.terms.empty() && f.constant == 0; }

class Collector {
 public:
  LinearForm form(const Expr& e) {
    if (!has_linear_form(e.type())) return atom_form(e);
    auto it = memo_.find(e.get());
    if (it != memo_.end()) return it->second;
    LinearForm result = collect(e);
    if (result.terms.size() > max_terms) result = atom_form(e);
    memo_.emplace(e.get(), result);
    return result;
  }

 private:
  LinearForm collect(const Expr& e) {
    if (auto value = as_const_int(e)) return constant_form(e.type(), *value);
    if (const Cast* cast = e.as<Cast>()) return collect_cast(e, *cast);
    const Binary* binary = e.as<Binary>();
    if (!binary) return atom_form(e);
    switch (e.kind()) {
      case Kind::Add:
        return checked_plus(form(binary->a), form(binary->b), 1).value_or(atom_form(e));
      case Kind::Sub:
        return checked_plus(form(binary->a), form(binary->b), -1).value_or(atom_form(e));
      case Kind::Mul:
        return collect_product(e, form(binary->a), form(binary->b));
      case Kind::Div:
      case Kind::Mod:
        return collect_division(e, *binary);
      default:
        return atom_form(e);
    }
  }

  LinearForm collect_product(const Expr& e, const LinearForm& a, const LinearForm& b) {
    if (!a.is_constant() && !b.is_constant()) return atom_form(e);
    const LinearForm& sum = a.is_constant() ? b : a;
    int64_t factor = a.is_constant() ? a.constant : b.constant;
    return checked_plus(constant_form(e.type(), 0), sum, factor).value_or(atom_form(e));
  }

  // (d*q + r) / d == q + r / d  and  (d*q + r) % d == r % d  for d > 0.
  LinearForm collect_division(const Expr& e, const Binary& binary) {
    auto divisor = as_const_int(binary.b);
    if (!divisor || *divisor <= 0) return atom_form(e);
    LinearForm numerator = form(binary.a);
    Quotient q = divide(numerator, *divisor);
    bool is_div = e.kind() == Kind::Div;
    if (q.rest.terms.empty()) return is_div ? q.whole : q.rest;
    LinearForm rest = atom_form(e);
    if (!is_nothing(q.whole)) {
      Expr numerator_rest = to_expr(q.rest);
      if (!numerator_rest.defined()) return atom_form(e);
      rest = atom_form(binary_of(e.kind(), numerator_rest, *divisor));
    }
    return is_div ? checked_plus(q.whole, rest, 1).value_or(atom_form(e)) : rest;
  }

  static Expr binary_of(Kind kind, const Expr& a, int64_t b) {
    return binary(kind, a, make_const(a.type(), b));
  }

  // Widening distributes over sums, since the narrower sum does not overflow.
  LinearForm collect_cast(const Expr& e, const Cast& cast) {
    Type from = cast.value.type();
    if (!has_linear_form(from) || from.bits() > e.type().bits()) return atom_form(e);
    LinearForm inner = form(cast.value), sum = constant_form(e.type(), inner.constant);
    bool is_atom = inner.terms.size() == 1 && inner.terms[0].atom.same_as(cast.value);
    if (is_atom) return atom_form(e);
    for (const LinearTerm& term : inner.terms) {
      sum = plus(sum, atom_form(cast_to(e.type(), term.atom)), term.coefficient);
    }
    return sum;
  }

  std::unordered_map<const ExprNode*, LinearForm> memo_;
};

// ---- min and max ----

// The operands of nested mins (or maxes) as forms: min(a, b) + 1 is a + 1, b + 1.
void add_operands(Kind kind, const LinearForm& f, std::vector<LinearForm>& operands) {
  bool nested =
      f.terms.size() == 1 && f.terms[0].coefficient == 1 && f.terms[0].atom.kind() == kind;
  if (!nested || operands.size() >= max_operands) {
    operands.push_back(f);
    return;
  }
  const Binary* inner = f.terms[0].atom.as<Binary>();
  for (const Expr& operand : {inner->a, inner->b}) {
    LinearForm shifted = linear_form(operand);
    shifted.constant += f.constant;
    add_operands(kind, shifted, operands);
  }
}

std::optional<int64_t> difference(const LinearForm& a, const LinearForm& b) {
  auto d = checked_plus(a, b, -1);
  if (d && d->is_constant()) return d->constant;
  return std::nullopt;
}

// p / k + c == (p + k*c) / k, for forms that are nothing else.
struct FloorQuotient {
  LinearForm numerator;
  int64_t divisor;
};
std::optional<FloorQuotient> as_quotient(const LinearForm& f) {
  if (f.terms.size() != 1 || f.terms[0].coefficient != 1) return std::nullopt;
  const Div* div = f.terms[0].atom.as<Div>();
  auto k = div ? as_const_int(div->b) : std::nullopt;
  if (!k || *k <= 0) return std::nullopt;
  auto numerator = checked_plus(linear_form(div->a), constant_form(f.type, f.constant), *k);
  if (!numerator) return std::nullopt;
  return FloorQuotient{*numerator, *k};
}

// Not positive: a <= b for certain. Not negative: a >= b.
std::optional<int64_t> sign_of_difference(const LinearForm& a, const LinearForm& b) {
  if (auto d = difference(a, b)) return d;
  auto x = as_quotient(a), y = as_quotient(b);
  if (!x || !y || x->divisor != y->divisor) return std::nullopt;
  return difference(x->numerator, y->numerator);
}

// Whether min(kept, dropped) == kept for certain (for max with the order reversed). Looks through
// one level of the opposite operator: min(a, max(a, b)) == a.
bool makes_redundant(Kind kind, const LinearForm& kept, const LinearForm& dropped) {
  auto wins = [&](int64_t difference) {
    return kind == Kind::Min ? difference <= 0 : difference >= 0;
  };
  if (auto d = sign_of_difference(kept, dropped)) return wins(*d);
  std::vector<LinearForm> inner;
  add_operands(kind == Kind::Min ? Kind::Max : Kind::Min, dropped, inner);
  if (inner.size() < 2) return false;
  return std::any_of(inner.begin(), inner.end(), [&](const LinearForm& operand) {
    auto d = difference(kept, operand);
    return d && wins(*d);
  });
}

std::vector<LinearForm> without_redundant(Kind kind, const std::vector<LinearForm>& operands) {
  std::vector<LinearForm> kept;
  for (const LinearForm& candidate : operands) {
    auto covers = [&](const LinearForm& k) { return makes_redundant(kind, k, candidate); };
    if (std::any_of(kept.begin(), kept.end(), covers)) continue;
    std::erase_if(kept, [&](const LinearForm& k) { return makes_redundant(kind, candidate, k); });
    kept.push_back(candidate);
  }
  return kept;
}

Expr canonical_extreme(Kind kind, const Expr& a, const Expr& b) {
  if (a.same_as(b)) return a;
  if (!has_linear_form(a.type())) return binary(kind, a, b);
  std::vector<LinearForm> operands;
  add_operands(kind, linear_form(a), operands);
  add_operands(kind, linear_form(b), operands);
  Expr result;
  for (const LinearForm& operand : without_redundant(kind, operands)) {
    Expr e = to_expr(operand);
    if (!e.defined()) return binary(kind, a, b);
    result = result.defined() ? binary(kind, result, e) : e;
  }
  return result;
}

}  // namespace

bool has_linear_form(Type type) { return type.is_int() && type.bits() >= 32 && type.is_scalar(); }

int64_t LinearForm::coefficient_of(const std::string& variable) const {
  for (const LinearTerm& term : terms) {
    const Variable* v = term.atom.as<Variable>();
    if (v && v->name == variable) return term.coefficient;
  }
  return 0;
}

LinearForm linear_form(const Expr& e) { return Collector().form(e); }

LinearForm plus(const LinearForm& a, const LinearForm& b, int64_t factor_of_b) {
  auto sum = checked_plus(a, b, factor_of_b);
  if (!sum) unsupported("analyse an index expression", "its constants must fit 64 bits");
  return *sum;
}

LinearForm times(const LinearForm& a, int64_t factor) {
  return plus(constant_form(a.type, 0), a, factor);
}

Expr to_expr(const LinearForm& form) {
  if (form.terms.size() == 1 && form.terms[0].coefficient == 1 && form.constant == 0)
    return form.terms[0].atom;
  if (!form.type.can_represent(form.constant)) return {};
  Expr sum;
  auto add = [&](const LinearTerm& term) {
    int64_t c = term.coefficient;
    if (!sum.defined()) {
      sum = c == 1 ? term.atom : binary(Kind::Mul, term.atom, make_const(form.type, c));
    } else {
      int64_t magnitude = c < 0 ? -c : c;
      Expr product = magnitude == 1
                         ? term.atom
                         : binary(Kind::Mul, term.atom, make_const(form.type, magnitude));
      sum = binary(c < 0 ? Kind::Sub : Kind::Add, sum, product);
    }
  };
  for (const LinearTerm& term : form.terms) {
    if (!form.type.can_represent(term.coefficient) || !form.type.can_represent(-term.coefficient))
      return {};
  }
  for (const LinearTerm& term : form.terms) {
    if (term.coefficient > 0) add(term);
  }
  if (!sum.defined() && (form.constant != 0 || form.terms.empty())) {
    sum = make_const(form.type, form.constant);
    for (const LinearTerm& term : form.terms) add(term);
    return sum;
  }
  for (const LinearTerm& term : form.terms) {
    if (term.coefficient < 0) add(term);
  }
  if (form.constant > 0) sum = binary(Kind::Add, sum, make_const(form.type, form.constant));
  if (form.constant < 0) {
    sum = form.type.can_represent(-form.constant)
              ? binary(Kind::Sub, sum, make_const(form.type, -form.constant))
              : binary(Kind::Add, sum, make_const(form.type, form.constant));
  }
  return sum;
}

std::optional<LinearForm> nonnegative_where(const Expr& comparison) {
  const auto* c = comparison.as<Binary>();
  if (!c || c->kind < Kind::LT || c->kind > Kind::GE || !has_linear_form(c->a.type()))
    return std::nullopt;
  const bool less = c->kind == Kind::LT || c->kind == Kind::LE,
             strict = c->kind == Kind::LT || c->kind == Kind::GT;
  LinearForm form = less ? plus(linear_form(c->b), linear_form(c->a), -1)
                         : plus(linear_form(c->a), linear_form(c->b), -1);
  form.constant -= strict;
  return form;
}

std::optional<int64_t> constant_difference(const Expr& a, const Expr& b) {
  if (a.same_as(b) && has_linear_form(a.type())) return 0;
  if (a.type() != b.type() || !has_linear_form(a.type())) return std::nullopt;
  return difference(linear_form(a), linear_form(b));
}

Expr canonical(const Expr& e) {
  if (!has_linear_form(e.type())) return e;
  LinearForm form = linear_form(e);
  if (form.terms.size() == 1 && form.terms[0].atom.same_as(e)) return e;
  Expr result = to_expr(form);
  return result.defined() ? result : e;
}

Expr canonical_min(const Expr& a, const Expr& b) { return canonical_extreme(Kind::Min, a, b); }
Expr canonical_max(const Expr& a, const Expr& b) { return canonical_extreme(Kind::Max, a, b); }

Expr canonical_div(const Expr& e, int64_t divisor) {
  return canonical(binary(Kind::Div, e, make_const(e.type(), divisor)));
}

}  // namespace retrograde::ir
