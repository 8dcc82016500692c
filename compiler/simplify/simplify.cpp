// Entry points and dispatch.
#include "simplify/simplify.h"

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"
#include "simplify/simplifier.h"
#include "simplify/simplify_memo.h"

namespace retrograde::simplification {

namespace {
thread_local SimplifyMemo* innermost_memo = nullptr;
}  // namespace

SimplifyMemo::SimplifyMemo()
    : simplifier_(std::make_unique<Simplifier>(BoundsMap())), outer_(innermost_memo) {
  innermost_memo = this;
}
SimplifyMemo::~SimplifyMemo() { innermost_memo = outer_; }
SimplifyMemo* SimplifyMemo::innermost() { return innermost_memo; }

Expr simplify(const Expr& e, const BoundsMap& bounds) {
  if (!e.defined()) return e;
  if (SimplifyMemo* memo = SimplifyMemo::innermost(); memo && bounds.empty())
    return memo->simplifier()(e);
  return Simplifier(bounds)(e);
}

Stmt simplify(const Stmt& s) {
  if (!s.defined()) return s;
  return drop_dead_lets(Simplifier(BoundsMap())(s));
}

bool can_prove(const Expr& condition, const BoundsMap& bounds) {
  return is_const_true(simplify(condition, bounds));
}

// Orders variables so that the bounds of each mention only earlier ones.
Simplifier::Simplifier(const BoundsMap& bounds) {
  std::unordered_set<std::string> done;
  const std::function<void(const std::string&)> bind = [&](const std::string& name) {
    const auto found = bounds.find(name);
    if (found == bounds.end() || !done.insert(name).second) return;
    for (const Expr& end : {found->second.min, found->second.max}) {
      if (!end.defined()) continue;
      walk(end, [&](const Variable& var) { bind(var.name); });
    }
    const auto simplified = [&](const Expr& end) { return end.defined() ? (*this)(end) : end; };
    const Expr min = simplified(found->second.min), max = simplified(found->second.max);
    facts_.bind(name, min, max);
    forget();
  };
  for (const auto& [name, ends] : bounds) bind(name);
}

Expr Simplifier::operator()(const Expr& e) {
  if (const auto* var = e.as<Variable>()) {
    if (const auto* found = find_or_null(replacements_, var->name)) return *found;
    const Expr number = constant_of(e);
    return number.defined() ? number : e;
  }
  if (e.kind() <= Kind::StringImm) return e;
  if (const auto* found = find_or_null(memo_, e.get())) return found->value;
  Expr result = node(e);
  if (equal(result, e)) result = e;
  memo_.emplace(e.get(), Entry{e, result});
  memo_.emplace(result.get(), Entry{result, result});
  return result;
}

Expr Simplifier::node(const Expr& e) {
  Simplifier& s = *this;
  return match(
      e, [&](const Binary& n) { return apply(n.kind, s(n.a), s(n.b)); },
      [&](const Not& n) { return negate(s(n.a)); },
      [&](const Select& n) { return select(s(n.condition), s(n.when_true), s(n.when_false)); },
      [&](const Cast& n) { return cast(n.type, s(n.value)); },
      [&](const Ramp& n) { return ramp(s(n.base), s(n.stride), n.lanes); },
      [&](const Broadcast& n) { return broadcast(s(n.value), n.lanes); },
      [&](const Call& n) { return call(e, n); }, [&](const Let&) { return let(e); },
      [&](const VectorReduce& n) { return vector_reduce(n); },
      [&](const Load& n) {
        Expr index = s(n.index), predicate = n.predicate.defined() ? s(n.predicate) : Expr();
        const auto* splat = index.as<Broadcast>();
        if (splat && !predicate.defined()) {
          const Type type = n.type.with_lanes(splat->value.type().lanes());
          return broadcast(make_load(type, n.name, splat->value, {}, n.symbol), splat->lanes);
        }
        return make_load(n.type, n.name, index, predicate, n.symbol);
      },
      [&](const ExprNode&) {
        return map_children(e, [&](const Expr& child) { return s(child); });
      });
}

Expr Simplifier::apply(Kind kind, const Expr& a, const Expr& b) {
  if (Expr splat = distribute_broadcast(kind, a, b); splat.defined()) return splat;
  if (++depth_ > 60) {  // limits the recursion of rules on the results of rules
    --depth_;
    return binary(kind, a, b);
  }
  Expr result = apply_rule(kind, a, b);
  --depth_;
  return result;
}

Expr Simplifier::apply_rule(Kind kind, const Expr& a, const Expr& b) {
  switch (kind) {
    case Kind::Add:
      return add(a, b);
    case Kind::Sub:
      return sub(a, b);
    case Kind::Mul:
      return mul(a, b);
    case Kind::Div:
      return div(a, b);
    case Kind::Mod:
      return mod(a, b);
    case Kind::Min:
    case Kind::Max:
      return min_max(kind, a, b);
    case Kind::EQ:
      return equals(a, b);
    case Kind::NE:
      return negate(equals(a, b));
    case Kind::LT:
    case Kind::LE:
      return less(kind, a, b);
    case Kind::GT:
      return less(Kind::LT, b, a);
    case Kind::GE:
      return less(Kind::LE, b, a);
    default:
      return logical(kind, a, b);
  }
}

Expr Simplifier::constant(const Expr& like, int64_t value) const {
  return make_const(like.type(), value);
}

// ---- scopes ----

Simplifier::Binding::Binding(Simplifier& owner, const std::string& name, const Expr& min,
                             const Expr& max, const Expr& replacement)
    : owner_(owner), name_(name) {
  // Results for the same name in another scope do not hold here.
  if (!owner.seen_names_.insert(name).second) {
    owner.forget();
    owner.definitions_.erase(name);
  }
  if (owner.loops_around_ > 0) owner.varying_.insert(name);
  if (replacement.defined()) {
    owner.replacements_[name] = replacement;
  } else {
    owner.facts_.bind(name, min, max);
  }
}

Simplifier::Binding::~Binding() {
  owner_.replacements_.erase(name_);
  owner_.facts_.unbind(name_);
  owner_.definitions_.erase(name_);
}

Simplifier::ScopedCondition::ScopedCondition(Simplifier& owner, const Expr& condition)
    : owner_(owner), assumption_(owner.facts_, condition) {
  if (condition.defined()) owner_.memo_.clear();
  owner_.learn_constants(condition, learned_);
}

Simplifier::ScopedCondition::~ScopedCondition() {
  owner_.memo_.clear();
  owner_.forget_constants(learned_);
}

}  // namespace retrograde::simplification
