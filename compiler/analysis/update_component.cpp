#include "analysis/update_component.h"

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::analysis {

bool is_bitwise(const Expr& e) {
  return as_op(e, Op::bitwise_and, Op::bitwise_or, Op::bitwise_xor, Op::bitwise_not);
}

// ---- the update as a function of x and of unknowns g ----

Expr Abstraction::operator()(const Expr& e) {
  return done_.get(e, [&] { return abstract(e); });
}

bool Abstraction::depends(const Expr& e) {
  return depends_.get(e, [&] {
    const Variable* v = e.as<Variable>();
    bool result = v && xs_.count(v->name) != 0;
    for_each_child(e, [&](const Expr& child) { result = depends(child) || result; });
    return result;
  });
}

Expr Abstraction::unknown(const Expr& e) {
  for (const auto& [name, value] : unknowns) {
    if (value.type() == e.type() && equal(value, e)) return variable(name, e.type());
  }
  const std::string name = text("g", unknowns.size());
  unknowns.emplace_back(name, e);
  return variable(name, e.type());
}

Expr Abstraction::abstract(const Expr& e) {
  if (!depends(e)) return unknown(e);
  if (e.as<Add>() || e.as<Sub>()) return sum(e);
  if (e.as<Mul>()) return product(e);
  return map_children(e, [&](const Expr& child) { return (*this)(child); });
}

void Abstraction::collect_terms(const Expr& e, bool negative, Expr& fixed, Expr& varying) {
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

Expr Abstraction::sum(const Expr& e) {
  Expr fixed, varying;
  collect_terms(e, false, fixed, varying);
  return fixed.defined() ? binary(Kind::Add, varying, unknown(fixed)) : varying;
}

void Abstraction::collect_factors(const Expr& e, Expr& fixed, Expr& varying) {
  if (const Mul* both = e.as<Mul>(); both && depends(e)) {
    collect_factors(both->a, fixed, varying);
    collect_factors(both->b, fixed, varying);
    return;
  }
  Expr& target = depends(e) ? varying : fixed;
  const Expr factor = depends(e) ? (*this)(e) : e;
  target = target.defined() ? binary(Kind::Mul, target, factor) : factor;
}

Expr Abstraction::product(const Expr& e) {
  Expr fixed, varying;
  collect_factors(e, fixed, varying);
  return fixed.defined() ? binary(Kind::Mul, varying, unknown(fixed)) : varying;
}

// ---- values whose updates depend on each other ----

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

}  // namespace retrograde::analysis
