#include "analysis/associativity_laws.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::analysis {

namespace {

using Order = CaseFacts::Order;

Order reversed(Order order) {
  if (order == Order::Less) return Order::Greater;
  return order == Order::Greater ? Order::Less : order;
}

// The order of a and c, from the orders of a and b and of b and c.
Order composed(Order ab, Order bc) {
  if (ab == Order::Unknown || bc == Order::Unknown) return Order::Unknown;
  if (ab == Order::Equal) return bc;
  return bc == Order::Equal || bc == ab ? ab : Order::Unknown;
}

[[noreturn]] void undecided(const std::string& why) { throw LawQuestion{-1, -1, why}; }

Polynomial constant_polynomial(int64_t value) {
  return value == 0 ? Polynomial{} : Polynomial{{Monomial{}, value}};
}

void add_term(Polynomial& sum, const Monomial& monomial, uint64_t coefficient) {
  int64_t& total = sum[monomial];
  total = static_cast<int64_t>(static_cast<uint64_t>(total) + coefficient);
  if (total == 0) sum.erase(monomial);
}

Polynomial add(Polynomial a, const Polynomial& b, int64_t factor) {
  for (const auto& [monomial, coefficient] : b)
    add_term(a, monomial, static_cast<uint64_t>(coefficient) * static_cast<uint64_t>(factor));
  return a;
}

Polynomial multiply(const Polynomial& a, const Polynomial& b) {
  Polynomial result;
  for (const auto& [ma, ca] : a) {
    for (const auto& [mb, cb] : b) {
      Monomial both;
      std::merge(ma.begin(), ma.end(), mb.begin(), mb.end(), std::back_inserter(both));
      add_term(result, both, static_cast<uint64_t>(ca) * static_cast<uint64_t>(cb));
    }
  }
  if (result.size() > 1000) undecided("it has too many terms");
  return result;
}

bool is_constant(const Polynomial& p) {
  return p.empty() || (p.size() == 1 && p.begin()->first.empty());
}
int64_t constant_of(const Polynomial& p) { return p.empty() ? 0 : p.begin()->second; }

int as_atom(const Polynomial& p) {
  const bool single = p.size() == 1 && p.begin()->first.size() == 1 && p.begin()->second == 1;
  return single ? p.begin()->first[0] : -1;
}

}  // namespace

// ---- facts ----

Order CaseFacts::order(int a, int b) const {
  if (a == b) return Order::Equal;
  return value_or(orders_, {a, b}, Order::Unknown);
}

bool CaseFacts::set(int a, int b, Order order) {
  const Order known = this->order(a, b);
  if (known != Order::Unknown) return known == order;
  orders_[{a, b}] = order;
  orders_[{b, a}] = reversed(order);
  return true;
}

bool CaseFacts::assume(const std::vector<Atom>& atoms, int a, int b, Order order) {
  return set(a, b, order) && close(atoms);
}

// Transitive closure; nothing is above the highest atom or below the lowest.
bool CaseFacts::close(const std::vector<Atom>& atoms) {
  bool changed = true;
  while (changed) {
    changed = false;
    const auto now = orders_;
    for (const auto& [ab, first] : now) {
      if (first == Order::Greater && atoms[ab.second].kind == Atom::Kind::Highest) return false;
      if (first == Order::Less && atoms[ab.second].kind == Atom::Kind::Lowest) return false;
      for (const auto& [bc, second] : now) {
        if (bc.first != ab.second || bc.second == ab.first) continue;
        const Order derived = composed(first, second);
        if (derived == Order::Unknown) continue;
        const Order known = this->order(ab.first, bc.second);
        if (known != Order::Unknown && known != derived) return false;
        if (known != Order::Unknown) continue;
        set(ab.first, bc.second, derived);
        changed = true;
      }
    }
  }
  return true;
}

int CaseFacts::representative(int atom) const {
  int result = atom;
  for (const auto& [pair, order] : orders_) {
    if (pair.first == atom && order == Order::Equal) result = std::min(result, pair.second);
  }
  return result;
}

// ---- values ----

LawValue LawEvaluator::value(const Expr& e, const LawEnvironment& environment) {
  memo_.clear();
  environment_ = &environment;
  return get(e);
}

LawValue LawEvaluator::atom(int index, Atom::Kind kind) const {
  LawValue result;
  result.is_truth = bitwise_ || kind == Atom::Kind::Truth;
  if (!result.is_truth) {
    result.number = {{Monomial{facts_.representative(index)}, 1}};
    return result;
  }
  const auto found = facts_.truths.find(index);
  if (found == facts_.truths.end()) throw LawQuestion{index, -1, ""};
  result.truth = found->second;
  return result;
}

bool LawEvaluator::equal(const LawValue& a, const LawValue& b) const {
  if (a.is_truth != b.is_truth) return false;
  if (a.is_truth) return a.truth == b.truth;
  // Both values come from this case. Assumptions may have been added since, but none was revoked.
  return a.number == b.number;
}

const LawValue& LawEvaluator::get(const Expr& e) {
  if (const auto* found = find_or_null(memo_, e.get())) return *found;
  LawValue result = evaluate(e);
  return memo_[e.get()] = std::move(result);
}

bool LawEvaluator::truth(const Expr& e) {
  const LawValue& v = get(e);
  if (!v.is_truth) undecided("a number is used as a condition");
  return v.truth;
}

const Polynomial& LawEvaluator::number(const Expr& e) {
  const LawValue& v = get(e);
  if (v.is_truth) undecided(bitwise_ ? "it mixes bits and arithmetic" : "a condition is a number");
  return v.number;
}

int LawEvaluator::compare(const Polynomial& a, const Polynomial& b) const {
  if (a == b) return 0;
  if (is_constant(a) && is_constant(b)) return constant_of(a) < constant_of(b) ? -1 : 1;
  const int first = as_atom(a), second = as_atom(b);
  if (first < 0 || second < 0) undecided("it compares the results of arithmetic");
  switch (facts_.order(first, second)) {
    case Order::Less:
      return -1;
    case Order::Equal:
      return 0;
    case Order::Greater:
      return 1;
    case Order::Unknown:
      break;
  }
  throw LawQuestion{first, second, ""};
}

LawValue LawEvaluator::constant(const Expr& e, double real, int64_t integer) const {
  LawValue result;
  if (e.type().is_bool()) {
    result.is_truth = true;
    result.truth = integer != 0;
  } else if (bitwise_) {
    const bool ones = integer == -1 ||
                      (e.type().is_uint() && static_cast<uint64_t>(integer) == e.type().max_uint());
    if (integer != 0 && !ones) undecided("it has a constant with some bits set");
    result.is_truth = true;
    result.truth = ones;
  } else {
    if (e.type().is_float() && (real != static_cast<double>(static_cast<int32_t>(real))))
      undecided("it has a constant that is no integer");
    result.number = constant_polynomial(e.type().is_float() ? static_cast<int64_t>(real) : integer);
  }
  return result;
}

LawValue LawEvaluator::evaluate(const Expr& e) {
  return match(
      e, [&](const IntImm& n) { return constant(e, 0, n.value); },
      [&](const UIntImm& n) { return constant(e, 0, static_cast<int64_t>(n.value)); },
      [&](const FloatImm& n) {
        if (!(n.value > -2e9 && n.value < 2e9)) undecided("it has a constant that is too large");
        return constant(e, n.value, 0);
      },
      [&](const Variable& n) {
        const auto found = environment_->find(n.name);
        if (found == environment_->end()) undecided("it uses " + quoted(n.name));
        return found->second;
      },
      [&](const Binary& n) { return binary(n); },
      [&](const Not& n) {
        LawValue result;
        result.is_truth = true;
        result.truth = !truth(n.a);
        return result;
      },
      [&](const Select& n) { return truth(n.condition) ? get(n.when_true) : get(n.when_false); },
      [&](const Call& n) { return call(n); },
      [&](const Cast&) -> LawValue { undecided("it converts the old value to another type"); },
      [&](const ExprNode&) -> LawValue { undecided("it is not made of operators it knows"); });
}

LawValue LawEvaluator::binary(const Binary& e) {
  LawValue result;
  const auto truth_of = [&](bool truth) {
    result.is_truth = true;
    result.truth = truth;
    return result;
  };
  const auto number_of = [&](Polynomial p) {
    result.number = std::move(p);
    return result;
  };
  const auto order = [&] {
    const LawValue a = get(e.a), b = get(e.b);
    if (!a.is_truth && !b.is_truth) return compare(a.number, b.number);
    if (bitwise_ || (e.kind != Kind::EQ && e.kind != Kind::NE))
      undecided("it compares bits or conditions");
    return static_cast<int>(a.truth) - static_cast<int>(b.truth);
  };
  switch (e.kind) {
    case Kind::Add:
      return number_of(add(number(e.a), number(e.b), 1));
    case Kind::Sub:
      return number_of(add(number(e.a), number(e.b), -1));
    case Kind::Mul:
      return number_of(multiply(number(e.a), number(e.b)));
    case Kind::Min:
      return order() <= 0 ? get(e.a) : get(e.b);
    case Kind::Max:
      return order() >= 0 ? get(e.a) : get(e.b);
    case Kind::EQ:
      return truth_of(order() == 0);
    case Kind::NE:
      return truth_of(order() != 0);
    case Kind::LT:
      return truth_of(order() < 0);
    case Kind::LE:
      return truth_of(order() <= 0);
    case Kind::GT:
      return truth_of(order() > 0);
    case Kind::GE:
      return truth_of(order() >= 0);
    case Kind::And:
      return truth_of(truth(e.a) && truth(e.b));
    case Kind::Or:
      return truth_of(truth(e.a) || truth(e.b));
    default:
      undecided(e.kind == Kind::Div ? "it divides" : "it takes a remainder");
  }
}

LawValue LawEvaluator::call(const Call& call) {
  if (call.call_type != CallType::Operator)
    undecided(text("it passes the old value to ", call.name));
  LawValue result;
  result.is_truth = true;
  switch (call.op) {
    case Op::likely:
    case Op::likely_if_innermost:
      return get(call.args[0]);
    case Op::bitwise_and:
    case Op::bitwise_or:
    case Op::bitwise_xor: {
      if (!bitwise_) undecided("it mixes bits and arithmetic");
      const bool a = truth(call.args[0]), b = truth(call.args[1]);
      result.truth = call.op == Op::bitwise_and  ? a && b
                     : call.op == Op::bitwise_or ? a || b
                                                 : a != b;
      return result;
    }
    case Op::bitwise_not:
      if (!bitwise_) undecided("it mixes bits and arithmetic");
      result.truth = !truth(call.args[0]);
      return result;
    default:
      undecided(text("it applies ", call.name, " to the old value"));
  }
}

// ---- cases ----

namespace {

class CaseSplit {
 public:
  CaseSplit(const std::vector<Atom>& atoms, bool bitwise, bool ignore_ties, const LawClaim& claim)
      : atoms_(atoms), bitwise_(bitwise), ignore_ties_(ignore_ties), claim_(claim) {}

  bool holds(const CaseFacts& facts) {
    if (--cases_left_ < 0) undecided("there are too many cases");
    LawQuestion question;
    try {
      LawEvaluator evaluator(facts, bitwise_);
      return claim_(evaluator);
    } catch (const LawQuestion& asked) {
      question = asked;
    }
    if (!question.unknown.empty()) throw question;
    return question.b < 0 ? both_truths(facts, question.a) : all_orders(facts, question);
  }

 private:
  const std::vector<Atom>& atoms_;
  const bool bitwise_, ignore_ties_;
  const LawClaim& claim_;
  int cases_left_ = 20000;

  bool both_truths(const CaseFacts& facts, int atom) {
    for (const bool truth : {false, true}) {
      CaseFacts more = facts;
      more.truths[atom] = truth;
      if (!holds(more)) return false;
    }
    return true;
  }

  bool all_orders(const CaseFacts& facts, const LawQuestion& question) {
    for (const Order order : {Order::Less, Order::Equal, Order::Greater}) {
      if (order == Order::Equal && ignore_ties_) continue;
      CaseFacts more = facts;
      if (more.assume(atoms_, question.a, question.b, order) && !holds(more)) return false;
    }
    return true;
  }
};

}  // namespace

bool holds_always(const std::vector<Atom>& atoms, bool bitwise, bool ignore_ties,
                  const LawClaim& claim) {
  return CaseSplit(atoms, bitwise, ignore_ties, claim).holds(CaseFacts());
}

}  // namespace retrograde::analysis
