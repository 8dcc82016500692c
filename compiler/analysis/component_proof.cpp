#include "analysis/component_proof.h"

#include <algorithm>
#include <functional>

#include "analysis/associativity_laws.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::analysis {

namespace {

// ---- laws ----

// The atoms of a claim, and environments that bind operands to them.
class Operands {
 public:
  std::vector<Atom> atoms;

  using Atoms = std::vector<std::pair<int, Atom::Kind>>;
  Atoms fresh(const std::vector<Expr>& like) {
    Atoms result;
    for (const Expr& e : like)
      result.push_back(add(e.type().is_bool() ? Atom::Kind::Truth : Atom::Kind::Number));
    return result;
  }
  std::pair<int, Atom::Kind> add(Atom::Kind kind) {
    atoms.push_back({kind});
    return {static_cast<int>(atoms.size()) - 1, kind};
  }
};

using Values = std::vector<LawValue>;

void bind_values(LawEnvironment& environment, const std::vector<std::string>& names,
                 const Values& values) {
  for (size_t i = 0; i < names.size(); i++) environment[names[i]] = values[i];
}

// Proves the laws of one candidate.
class Laws {
 public:
  Laws(const Component& component, const Candidate& candidate)
      : component_(component), candidate_(candidate) {
    x_ = operands_.fresh(component.update);
    y_ = operands_.fresh(component.update);
    z_ = operands_.fresh(component.update);
    for (const auto& [name, e] : component.gs) {
      g_.push_back(operands_.add(e.type().is_bool() ? Atom::Kind::Truth : Atom::Kind::Number));
      g_names_.push_back(name);
    }
    for (size_t i = 0; i < component.size(); i++) {
      const Unit unit = candidate.identity[i];
      const bool bool_type = component.type(i).is_bool();
      id_.push_back(operands_.add(unit == Unit::Highest  ? Atom::Kind::Highest
                                  : unit == Unit::Lowest ? Atom::Kind::Lowest
                                  : bool_type            ? Atom::Kind::Truth
                                                         : Atom::Kind::Number));
    }
  }

  // op(op(x, y), z) == op(x, op(y, z))
  bool is_associative() const {
    return prove(false, [&](LawEvaluator& e) {
      const Values x = values(e, x_), y = values(e, y_), z = values(e, z_);
      return same(e, op(e, op(e, x, y), z), op(e, x, op(e, y, z)));
    });
  }
  // op(x, id) == x
  bool has_identity(bool ignore_ties) const {
    return prove(ignore_ties, [&](LawEvaluator& e) {
      const Values x = values(e, x_);
      return same(e, op(e, x, identity(e)), x);
    });
  }
  // op(x, y) == op(y, x)
  bool is_commutative(bool ignore_ties) const {
    return prove(ignore_ties, [&](LawEvaluator& e) {
      const Values x = values(e, x_), y = values(e, y_);
      return same(e, op(e, x, y), op(e, y, x));
    });
  }
  // F(x, g) == op(x, F(id, g))
  bool represents_update(bool ignore_ties) const {
    return prove(ignore_ties, [&](LawEvaluator& e) {
      const Values x = values(e, x_);
      return same(e, update(e, x), op(e, x, update(e, identity(e))));
    });
  }
  // The g that equals F_i(id, g), unless the identity's extremes take part; -1 when there is none.
  int unknown_in(size_t i) const {
    int found = -1;
    prove(true, [&](LawEvaluator& e) {
      const LawValue value = update(e, identity(e))[i];
      for (size_t k = 0; k < g_.size(); k++) {
        if (e.equal(value, e.atom(g_[k].first, g_[k].second))) found = static_cast<int>(k);
      }
      return found < 0;
    });
    return found;
  }
  // After a failed proof, the reason.
  const std::string& obstacle() const { return obstacle_; }

 private:
  const Component& component_;
  const Candidate& candidate_;
  Operands operands_;
  Operands::Atoms x_, y_, z_, g_, id_;
  std::vector<std::string> g_names_;
  mutable std::string obstacle_;

  bool prove(bool ignore_ties, const LawClaim& claim) const {
    try {
      return holds_always(operands_.atoms, component_.bitwise, ignore_ties, claim);
    } catch (const LawQuestion& question) {
      obstacle_ = question.unknown;
      return false;
    }
  }

  static Values values(LawEvaluator& e, const Operands::Atoms& atoms) {
    Values result;
    for (const auto& [index, kind] : atoms) result.push_back(e.atom(index, kind));
    return result;
  }

  Values identity(LawEvaluator& e) const {
    Values result;
    for (size_t i = 0; i < id_.size(); i++) {
      LawValue value;
      switch (candidate_.identity[i]) {
        case Unit::Zero:
        case Unit::One:
          value.is_truth = component_.bitwise;
          if (candidate_.identity[i] == Unit::One) value.number = {{Monomial{}, 1}};
          break;
        case Unit::True:
        case Unit::Ones:
          value.is_truth = value.truth = true;
          break;
        case Unit::False:
          value.is_truth = true;
          break;
        default:
          value = e.atom(id_[i].first, id_[i].second);
      }
      result.push_back(std::move(value));
    }
    return result;
  }

  Values op(LawEvaluator& e, const Values& x, const Values& y) const {
    LawEnvironment environment;
    bind_values(environment, component_.xs, x);
    bind_values(environment, component_.ys, y);
    return mapped(candidate_.values,
                  [&](const Expr& value) { return e.value(value, environment); });
  }

  Values update(LawEvaluator& e, const Values& x) const {
    LawEnvironment environment;
    bind_values(environment, component_.xs, x);
    bind_values(environment, g_names_, values(e, g_));
    return mapped(component_.update,
                  [&](const Expr& value) { return e.value(value, environment); });
  }

  static bool same(LawEvaluator& e, const Values& a, const Values& b) {
    for (size_t i = 0; i < a.size(); i++) {
      if (!e.equal(a[i], b[i])) return false;
    }
    return true;
  }
};

// ---- candidates ----

using Operator = std::function<Expr(const Expr&, const Expr&)>;

Operator op_of(Kind kind) {
  return [kind](const Expr& a, const Expr& b) { return binary(kind, a, b); };
}
Operator op_of(Op op) {
  return [op](const Expr& a, const Expr& b) { return call_op(op, {a, b}); };
}

void add_single_operators(const Component& c, std::vector<Candidate>& candidates) {
  const Expr x = variable(c.xs[0], c.type(0)), y = variable(c.ys[0], c.type(0));
  const auto add = [&](const Operator& op, Unit unit) {
    candidates.push_back({{op(x, y)}, {unit}});
  };
  if (c.bitwise) {
    add(op_of(Op::bitwise_or), Unit::Zero);
    add(op_of(Op::bitwise_xor), Unit::Zero);
    add(op_of(Op::bitwise_and), Unit::Ones);
  } else if (c.type(0).is_bool()) {
    add(op_of(Kind::Or), Unit::False);
    add(op_of(Kind::And), Unit::True);
    add(op_of(Kind::NE), Unit::False);
    add(op_of(Kind::EQ), Unit::True);
  } else {
    add(op_of(Kind::Add), Unit::Zero);
    add(op_of(Kind::Mul), Unit::One);
    add(op_of(Kind::Min), Unit::Highest);
    add(op_of(Kind::Max), Unit::Lowest);
  }
}

// Proposes the extreme of value `key` together with the other values at it. `later`: the later of
// equal ones wins.
void add_extremes(const Component& c, std::vector<Candidate>& candidates) {
  for (size_t key = 0; key < c.size(); key++) {
    if (c.type(key).is_bool()) continue;
    const Expr x = variable(c.xs[key], c.type(key)), y = variable(c.ys[key], c.type(key));
    for (const Kind better : {Kind::LT, Kind::GT, Kind::LE, Kind::GE}) {
      Candidate candidate;
      for (size_t i = 0; i < c.size(); i++) {
        candidate.values.push_back(make_select(binary(better, y, x), variable(c.ys[i], c.type(i)),
                                               variable(c.xs[i], c.type(i))));
        const bool least = better == Kind::LT || better == Kind::LE;
        candidate.identity.push_back(i != key ? Unit::Any : least ? Unit::Highest : Unit::Lowest);
      }
      candidates.push_back(std::move(candidate));
    }
  }
}

// The identities that may fit each value, judging by how the update uses it.
std::vector<std::vector<Unit>> possible_units(const Component& c) {
  std::vector<std::vector<Unit>> result;
  for (size_t i = 0; i < c.size(); i++) {
    bool ordered = false, arithmetic = false;
    for (const Expr& value : c.update) {
      walk(value, [&](const Expr& e) {
        const Binary* b = e.as<Binary>();
        if (b && (uses_variable(b->a, c.xs[i]) || uses_variable(b->b, c.xs[i]))) {
          const bool ring = e.as<Add>() || e.as<Sub>() || e.as<Mul>();
          (ring ? arithmetic : ordered) = true;
        }
        return true;
      });
    }
    std::vector<Unit> units;
    if (c.type(i).is_bool()) units = {Unit::False, Unit::True};
    if (arithmetic) units.insert(units.end(), {Unit::One, Unit::Zero});
    if (ordered && !c.type(i).is_bool()) units.insert(units.end(), {Unit::Highest, Unit::Lowest});
    units.push_back(Unit::Any);
    result.push_back(std::move(units));
  }
  return result;
}

// Proposes the update itself, with y in place of the g that it returns for an identity.
void add_update_itself(const Component& c, const std::vector<Unit>& identity,
                       std::vector<Candidate>& candidates) {
  const Candidate probe{c.update, identity};
  const Laws laws(c, probe);
  Substitution places;
  for (size_t i = 0; i < c.size(); i++) {
    const int g = laws.unknown_in(i);
    if (g < 0 || places.count(c.gs[g].first) || c.gs[g].second.type() != c.type(i)) continue;
    places[c.gs[g].first] = variable(c.ys[i], c.type(i));
  }
  if (places.size() != c.gs.size()) return;
  Candidate candidate{{}, identity};
  for (const Expr& value : c.update) candidate.values.push_back(substitute(value, places));
  candidates.push_back(std::move(candidate));
}

void add_all_identities(const Component& c, std::vector<Candidate>& candidates) {
  const std::vector<std::vector<Unit>> units = possible_units(c);
  std::vector<Unit> identity(c.size());
  int left = 1024;
  const std::function<void(size_t)> choose = [&](size_t i) {
    if (i == c.size()) {
      if (left-- > 0) add_update_itself(c, identity, candidates);
      return;
    }
    for (const Unit unit : units[i]) {
      identity[i] = unit;
      choose(i + 1);
    }
  };
  if (c.size() <= 6) choose(0);
}

// ---- proof ----

std::optional<Accepted> prove(const Component& c, const Candidate& candidate) {
  const Laws laws(c, candidate);
  const bool exact = laws.has_identity(false);
  if (!exact && !laws.has_identity(true)) return {};
  if (!laws.represents_update(!exact) || !laws.is_associative()) return {};
  const bool in_all_cases = laws.is_commutative(false);
  return Accepted{candidate, in_all_cases || laws.is_commutative(true), !exact || !in_all_cases};
}

}  // namespace

namespace {

// Whether the update compares several of its values, as one that decides equal extremes by their places.
bool decides_ties(const Component& c) {
  std::vector<bool> compared(c.size());
  for (const Expr& value : c.update) {
    walk(value, [&](const Expr& e) {
      const Binary* b = e.as<Binary>();
      const bool compares = b && (e.as<LT>() || e.as<GT>() || e.as<LE>() || e.as<GE>());
      for (size_t i = 0; compares && i < c.size(); ++i)
        compared[i] = compared[i] || uses_variable(e, c.xs[i]);
      return true;
    });
  }
  return std::ranges::count(compared, true) > 1;
}

}  // namespace

std::optional<Accepted> prove(const Component& c) {
  std::vector<Candidate> candidates;
  if (c.size() == 1) add_single_operators(c, candidates);
  if (c.size() > 1) add_extremes(c, candidates);
  std::optional<Accepted> first;
  for (const Candidate& candidate : candidates) {
    auto accepted = prove(c, candidate);
    if (!accepted) continue;
    if (!accepted->breaks_ties || !decides_ties(c)) return accepted;
    if (!first) first = std::move(accepted);
  }
  candidates.clear();
  if (c.size() > 1) add_all_identities(c, candidates);
  for (const Candidate& candidate : candidates) {
    auto accepted = prove(c, candidate);
    if (accepted && (!first || !accepted->breaks_ties)) return accepted;
  }
  return first;
}

}  // namespace retrograde::analysis
