#include "analysis/associativity.h"

#include <algorithm>
#include <functional>
#include <set>

#include "analysis/associativity_laws.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

// What an element of an identity may be.
enum class Unit : uint8_t { Zero, One, Highest, Lowest, True, False, Ones, Any };

struct Candidate {
  std::vector<Expr> values;  // over xs and ys
  std::vector<Unit> identity;
};

bool is_bitwise(const Expr& e) {
  const Call* call = e.as<Call>();
  return call && (call->is_op(Op::bitwise_and) || call->is_op(Op::bitwise_or) ||
                  call->is_op(Op::bitwise_xor) || call->is_op(Op::bitwise_not));
}

// ---- the update as a function of x and of unknowns g ----

// Sums and products with what is free of x gathered in one term or factor, and every largest part
// that is free of x replaced by a variable: x + a - b becomes x + g.
class Abstraction {
 public:
  explicit Abstraction(const std::vector<std::string>& xs) : xs_(xs.begin(), xs.end()) {}

  Expr operator()(const Expr& e) {
    const auto found = done_.find(e.get());
    if (found != done_.end()) return found->second.second;
    Expr result = abstract(e);
    done_[e.get()] = {e, result};
    return result;
  }

  std::vector<std::pair<std::string, Expr>> unknowns;  // name -> what it stands for

 private:
  std::unordered_set<std::string> xs_;
  std::unordered_map<const ExprNode*, std::pair<Expr, Expr>> done_;
  std::unordered_map<const ExprNode*, bool> depends_;

  bool depends(const Expr& e) {
    const auto found = depends_.find(e.get());
    if (found != depends_.end()) return found->second;
    bool result = false;
    if (const Variable* v = e.as<Variable>()) result = xs_.count(v->name) != 0;
    for_each_child(e, [&](const Expr& child) { result = depends(child) || result; });
    return depends_[e.get()] = result;
  }

  Expr unknown(const Expr& e) {
    for (const auto& [name, value] : unknowns) {
      if (value.type() == e.type() && equal(value, e)) return variable(name, e.type());
    }
    const std::string name = text("g", unknowns.size());
    unknowns.emplace_back(name, e);
    return variable(name, e.type());
  }

  Expr abstract(const Expr& e) {
    if (!depends(e)) return unknown(e);
    if (e.as<Add>() || e.as<Sub>()) return sum(e);
    if (e.as<Mul>()) return product(e);
    return map_children(e, [&](const Expr& child) { return (*this)(child); });
  }

  void collect_terms(const Expr& e, bool negative, Expr& fixed, Expr& varying) {
    const Binary* both = e.as<Binary>();
    if (depends(e) && both && (both->kind == Kind::Add || both->kind == Kind::Sub)) {
      collect_terms(both->a, negative, fixed, varying);
      collect_terms(both->b, negative != (both->kind == Kind::Sub), fixed, varying);
      return;
    }
    Expr& target = depends(e) ? varying : fixed;
    const Expr term = depends(e) ? (*this)(e) : e;
    if (!target.defined()) {
      target = negative ? binary(Kind::Sub, make_zero(e.type()), term) : term;
    } else {
      target = binary(negative ? Kind::Sub : Kind::Add, target, term);
    }
  }

  Expr sum(const Expr& e) {
    Expr fixed, varying;
    collect_terms(e, false, fixed, varying);
    return fixed.defined() ? binary(Kind::Add, varying, unknown(fixed)) : varying;
  }

  void collect_factors(const Expr& e, Expr& fixed, Expr& varying) {
    if (const Mul* both = e.as<Mul>(); both && depends(e)) {
      collect_factors(both->a, fixed, varying);
      collect_factors(both->b, fixed, varying);
      return;
    }
    Expr& target = depends(e) ? varying : fixed;
    const Expr factor = depends(e) ? (*this)(e) : e;
    target = target.defined() ? binary(Kind::Mul, target, factor) : factor;
  }

  Expr product(const Expr& e) {
    Expr fixed, varying;
    collect_factors(e, fixed, varying);
    return fixed.defined() ? binary(Kind::Mul, varying, unknown(fixed)) : varying;
  }
};

// ---- values whose updates depend on each other ----

// Sets of values that are connected by "the new i reads the old j".
std::vector<std::vector<int>> components_of(const std::vector<Expr>& values,
                                            const std::vector<std::string>& xs) {
  const int count = static_cast<int>(values.size());
  std::vector<int> group(count);
  for (int i = 0; i < count; i++) group[i] = i;
  for (int i = 0; i < count; i++) {
    for (int j = 0; j < count; j++) {
      if (group[i] == group[j] || !uses_variable(values[i], xs[j])) continue;
      const int from = group[j], to = group[i];
      for (int& g : group) g = g == from ? to : g;
    }
  }
  std::vector<std::vector<int>> components;
  std::vector<int> place(count, -1);
  for (int i = 0; i < count; i++) {
    if (place[group[i]] < 0) {
      place[group[i]] = static_cast<int>(components.size());
      components.emplace_back();
    }
    components[place[group[i]]].push_back(i);
  }
  return components;
}

// One component, with its variables renamed x0.., y0.., g0..
struct Component {
  std::vector<Expr> update;  // over xs and gs
  std::vector<std::string> xs, ys;
  std::vector<std::pair<std::string, Expr>> gs;
  bool bitwise = false;
  size_t size() const { return update.size(); }
  Type type(size_t i) const { return update[i].type(); }
};

// ---- laws ----

// The atoms of a claim, and environments made of them.
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
  // The g that F_i(id, g) is, when nothing reaches the identity's extremes; -1: none.
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
  // Why the laws are not proven, after a proof failed.
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
    Values result;
    for (const Expr& value : candidate_.values) result.push_back(e.value(value, environment));
    return result;
  }

  Values update(LawEvaluator& e, const Values& x) const {
    LawEnvironment environment;
    bind_values(environment, component_.xs, x);
    bind_values(environment, g_names_, values(e, g_));
    Values result;
    for (const Expr& value : component_.update) result.push_back(e.value(value, environment));
    return result;
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

// The extreme of value `key`, and what else came with it. `later`: of equal ones the later wins.
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

// The identities that may fit each value, by what the update does with it.
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

// The update itself with y in the places of the g that it gives from an identity.
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

// ---- proof of one component ----

struct Accepted {
  Candidate candidate;
  bool commutative = false;
  bool breaks_ties = false;
};

// Ties: of equal extremes another may win than in the order of the update; values stay the same.
std::optional<Accepted> prove(const Component& c, const Candidate& candidate) {
  const Laws laws(c, candidate);
  const bool exact = laws.has_identity(false);
  if (!exact && !laws.has_identity(true)) return {};
  if (!laws.represents_update(!exact) || !laws.is_associative()) return {};
  const bool in_all_cases = laws.is_commutative(false);
  return Accepted{candidate, in_all_cases || laws.is_commutative(true), !exact || !in_all_cases};
}

std::optional<Accepted> prove(const Component& c) {
  std::vector<Candidate> candidates;
  if (c.size() == 1) add_single_operators(c, candidates);
  if (c.size() > 1) add_extremes(c, candidates);
  for (const Candidate& candidate : candidates) {
    if (auto accepted = prove(c, candidate)) return accepted;
  }
  candidates.clear();
  if (c.size() > 1) add_all_identities(c, candidates);
  for (const Candidate& candidate : candidates) {
    if (auto accepted = prove(c, candidate)) return accepted;
  }
  return {};
}

// ---- evidence ----

// The first thing in the update that no law is known of; empty when there is none.
std::string obstacle_in(const Component& c) {
  for (const Expr& value : c.update) {
    std::string found;
    walk(value, [&](const Expr& e) {
      const Binary* b = e.as<Binary>();
      if (b && (b->kind == Kind::Div || b->kind == Kind::Mod))
        found = b->kind == Kind::Div ? "it divides the old value" : "it takes a remainder of it";
      const Call* call = e.as<Call>();
      if (call && !is_bitwise(e) && !call->is_op(Op::likely))
        found = text("it passes the old value to ", call->name);
      if (e.as<Cast>()) found = "it converts the old value to another type and back";
      return found.empty();
    });
    if (!found.empty()) return found;
  }
  return "";
}

// The form of the update, and what in it no law is known of.
std::string why_not(const Component& c) {
  std::string form;
  for (size_t i = 0; i < c.size(); i++) form += text(i ? ", " : "", c.xs[i], " = ", c.update[i]);
  bool reads_old = false;
  for (const Expr& value : c.update) {
    for (const std::string& x : c.xs) reads_old = reads_old || uses_variable(value, x);
  }
  if (!reads_old)
    return text("it replaces the old value (", form, "), and replacing has no identity");
  const std::string obstacle = obstacle_in(c);
  return text("it is of the form ", form, ", which ",
              obstacle.empty() ? "is not proven to be an associative operator with an identity"
                               : "cannot be proven associative: " + obstacle);
}

Expr identity_value(Unit unit, Type type, bool is_sum) {
  switch (unit) {
    case Unit::Zero:  // -0.0 + x is x for every float, also for -0.0
      return type.is_float() && is_sum ? make_const(type, -0.0) : make_zero(type);
    case Unit::One:
      return make_one(type);
    case Unit::Highest:
      return type.max();
    case Unit::Lowest:
      return type.min();
    case Unit::True:
      return const_true();
    case Unit::False:
      return const_false();
    case Unit::Ones:
      return type.is_uint() ? make_uint_const(type, type.max_uint()) : make_const(type, -1);
    case Unit::Any:
      return {};
  }
  internal_error("an identity of unknown kind");
}

// ---- the whole update ----

class Prover {
 public:
  Prover(const std::vector<Expr>& values, const std::vector<std::string>& xs)
      : values_(values), xs_(xs) {
    op_.xs = xs;
    op_.values.resize(values.size());
    op_.identity.resize(values.size());
    op_.commutative = true;
    for (size_t i = 0; i < values.size(); i++) op_.ys.push_back(unique_name("y"));
  }

  AssociativityProof run() {
    std::vector<std::vector<int>> groups = components_of(values_, xs_);
    for (size_t k = 0; k < groups.size(); k++) {
      if (prove_group(groups[k])) continue;
      const std::vector<int> larger = with_sharing(groups, k);
      if (larger.size() > groups[k].size() && prove_group(larger)) continue;
      proof_.why_not = why_not(component(groups[k]));
      return proof_;
    }
    proof_.op = std::move(op_);
    return proof_;
  }

 private:
  const std::vector<Expr>& values_;
  const std::vector<std::string>& xs_;
  AssociativeOp op_;
  AssociativityProof proof_;

  // A value that is left alone, and that no other value of its group depends on.
  bool is_untouched(const std::vector<int>& group) const {
    const Variable* v = values_[group[0]].as<Variable>();
    return group.size() == 1 && v && v->name == xs_[group[0]];
  }

  static std::string suffix(const std::vector<int>& group, size_t k) {
    return group.size() > 1 ? std::to_string(k) : "";
  }

  Component component(const std::vector<int>& group) const {
    Component c;
    Substitution rename;
    Abstraction abstraction(xs_);
    for (size_t k = 0; k < group.size(); k++) {
      c.xs.push_back("x" + suffix(group, k));
      c.ys.push_back("y" + suffix(group, k));
      rename[xs_[group[k]]] = variable(c.xs[k], values_[group[k]].type());
    }
    for (const int i : group) c.update.push_back(substitute(abstraction(values_[i]), rename));
    c.gs = abstraction.unknowns;
    for (const Expr& value : c.update)
      walk(value, [&](const Expr& e) { return !(c.bitwise = c.bitwise || is_bitwise(e)); });
    return c;
  }

  bool prove_group(const std::vector<int>& group) {
    if (is_untouched(group)) {
      op_.values[group[0]] = values_[group[0]];
      return true;
    }
    const Component c = component(group);
    const std::optional<Accepted> accepted = prove(c);
    if (!accepted) return false;
    Substitution back;
    for (size_t k = 0; k < group.size(); k++) {
      const Type type = values_[group[k]].type();
      back[c.xs[k]] = variable(xs_[group[k]], type);
      back[c.ys[k]] = variable(op_.ys[group[k]], type);
    }
    for (size_t k = 0; k < group.size(); k++) {
      const Expr& value = accepted->candidate.values[k];
      op_.values[group[k]] = substitute(value, back);
      op_.identity[group[k]] =
          identity_value(accepted->candidate.identity[k], values_[group[k]].type(),
                         group.size() == 1 && value.as<Add>());
    }
    op_.breaks_ties = op_.breaks_ties || accepted->breaks_ties;
    if (!accepted->commutative) {
      op_.commutative = false;
      proof_.why_not_commutative = "its operator depends on the order of its operands";
    }
    return true;
  }

  // The group and all that have an unknown in common with it: x -> a x + b composes only as a pair.
  std::vector<int> with_sharing(const std::vector<std::vector<int>>& groups, size_t k) const {
    std::vector<Component> components;
    for (const auto& group : groups) components.push_back(component(group));
    std::vector<bool> taken(groups.size());
    std::vector<size_t> queue{k};
    taken[k] = true;
    for (size_t at = 0; at < queue.size(); at++) {
      for (size_t other = 0; other < groups.size(); other++) {
        if (taken[other] || !share_unknown(components[queue[at]], components[other])) continue;
        taken[other] = true;
        queue.push_back(other);
      }
    }
    std::vector<int> result;
    for (const size_t group : queue)
      result.insert(result.end(), groups[group].begin(), groups[group].end());
    std::sort(result.begin(), result.end());
    return result;
  }

  static bool share_unknown(const Component& a, const Component& b) {
    for (const auto& [name_a, e] : a.gs) {
      for (const auto& [name_b, f] : b.gs) {
        if (e.type() == f.type() && !is_const(e) && equal(e, f)) return true;
      }
    }
    return false;
  }
};

}  // namespace

AssociativityProof prove_associative(const std::vector<Expr>& values,
                                     const std::vector<std::string>& xs) {
  return Prover(values, xs).run();
}

}  // namespace retrograde::ir
