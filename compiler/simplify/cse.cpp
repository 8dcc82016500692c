// Finds common subexpressions by hash-consing: structurally equal nodes become one node, and nodes
// with several parents become Lets, in dependence order.
#include "simplify/cse.h"

#include <unordered_map>
#include <unordered_set>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::simplification {

namespace {

// Makes structurally equal nodes identical. Children are made unique before their parent is looked
// up, so each comparison looks only one level deep.
class HashCons : public Rewriter {
 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override { return *unique_.insert(children(e)).first; }

 private:
  std::unordered_set<Expr, StructuralHash, StructuralEqual> unique_;
};

// Nodes that a Let must not bind, such as reported errors, which are no values, and undef, which is
// any value.
bool must_stay(const Expr& e) {
  const auto* call = e.as<Call>();
  if (!call || call->call_type != CallType::Operator) return false;
  const Conduct conduct = op_info(call->op).conduct;
  return conduct == Conduct::InPlace || conduct == Conduct::ActsInPlace;
}

// Cheaper to repeat than to name: leaves, and operations on leaves that cost no instruction.
bool is_trivial(const Expr& e) {
  if (e.kind() == Kind::Variable || is_const(e) || e.kind() == Kind::StringImm) return true;
  if (const auto* splat = e.as<Broadcast>()) return is_trivial(splat->value);
  if (const auto* ramp = e.as<Ramp>()) return is_trivial(ramp->base) && is_const(ramp->stride);
  if (const auto* bits = e.as<Reinterpret>()) return is_trivial(bits->value);
  return e.type().is_handle() || (e.kind() == Kind::Call && e.as<Call>()->args.empty());
}

// The argument of strict_float stays inside it: in a Let outside, it might be contracted.
bool is_strict(const Expr& e) { return as_op(e, Op::strict_float); }
// Parts of such an argument that are the same anywhere: elements that it reads, and strict values.
bool is_exact(const Expr& e) {
  const auto* call = e.as<Call>();
  const bool is_element =
      call && (call->call_type == CallType::Func || call->call_type == CallType::Image);
  return is_element || e.kind() == Kind::Load || is_strict(e);
}

// Counts the parents of each node among the nodes that are evaluated unconditionally.
class UseCounter {
 public:
  explicit UseCounter(const std::vector<Expr>& es) {
    for (const Expr& e : es) count(e);
  }
  bool is_shared(const Expr& e) const { return value_or(uses_, e.get(), 0) > 1; }

 private:
  void count(const Expr& e) {
    if (uses_[e.get()]++ > 0) return;
    if (const Call* branch = as_op(e, Op::if_then_else)) {
      count(branch->args[0]);  // the arms run only when selected
    } else {
      for_each_child(e,
                     [&](const Expr& child) { is_strict(e) ? count_exact(child) : count(child); });
    }
  }
  // The exact parts of a strict argument, which are shared if a part around them is: so it is visited twice.
  void count_exact(const Expr& e) {
    if (is_exact(e)) return count(e);
    if (as_op(e, Op::if_then_else) || inside_[e.get()]++ > 1) return;
    for_each_child(e, [&](const Expr& child) { count_exact(child); });
  }
  std::unordered_map<const ExprNode*, int> uses_;
  std::unordered_map<const ExprNode*, int> inside_;  // of strict arguments
};

// The first value, wrapped in its Lets.
Expr wrap(const SharedLets& shared) { return make_lets(shared.lets, shared.values[0]); }

SharedLets make_lets(const std::vector<Expr>& es);

class LetMaker : public Rewriter {
 public:
  LetMaker(const UseCounter& uses, Lets& lets) : uses_(uses), lets_(lets) {}

 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override {
    if (is_strict(e))
      return name(e, map_children(e, [&](const Expr& child) { return exact_(child); }));
    const Call* choice = as_op(e, Op::if_then_else);
    return name(e, choice ? branch(*choice) : children(e));
  }

 private:
  // The replacement of e, whose children have been replaced in `rebuilt`.
  Expr name(const Expr& e, Expr rebuilt) {
    if (!gets_name(e)) return rebuilt;
    const std::string name = unique_name("t");
    lets_.emplace_back(name, rebuilt);
    return variable(name, rebuilt.type());
  }

  // Values shared within one arm are bound inside it, under names of its own: both arms may contain
  // the same inner if_then_else.
  Expr branch(const Call& e) {
    const auto arm = [&](const Expr& value) { return wrap(make_lets({named_(value)})); };
    return call_op(e.op, e.type, {(*this)(e.args[0]), arm(e.args[1]), arm(e.args[2])});
  }
  bool gets_name(const Expr& e) const {
    return uses_.is_shared(e) && !is_trivial(e) && !must_stay(e);
  }

  const UseCounter& uses_;
  Lets& lets_;
  // Replaces unconditionally evaluated nodes by their names. Arms are left to their own Lets, so
  // that an arm inside an arm is bound once, by the arm around it.
  StepRewriter named_{[this](const Expr& e, const auto&) {
    return gets_name(e) ? (*this)(e) : is_strict(e) ? e : Expr();
  }};
  // Replaces the parts of strict arguments that have names.
  StepRewriter exact_{[this](const Expr& e, const auto&) {
    return is_exact(e) ? (*this)(e) : as_op(e, Op::if_then_else) ? e : Expr();
  }};
};

// Replaces names by the values of the enclosing Lets. Names are unique, so one memo serves all
// scopes.
class LetExpander : public Rewriter {
 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override {
    if (const auto* let = e.as<Let>()) {
      values_[let->name] = (*this)(let->value);
      return (*this)(let->body);
    }
    if (const auto* var = e.as<Variable>()) return value_or(values_, var->name, e);
    return children(e);
  }

 private:
  std::unordered_map<std::string, Expr> values_;
};

// Expects expressions without Lets.
SharedLets make_lets(const std::vector<Expr>& es) {
  HashCons unique;
  const auto shared = mapped(es, [&](const Expr& e) { return unique(e); });
  const UseCounter uses(shared);
  SharedLets result;
  LetMaker maker(uses, result.lets);
  for (const Expr& e : shared) result.values.push_back(maker(e));
  return result;
}

}  // namespace

SharedLets introduce_lets(const std::vector<Expr>& es) {
  LetExpander expand;
  return make_lets(mapped(es, [&](const Expr& e) { return expand(e); }));
}

Expr introduce_lets(const Expr& e) { return wrap(introduce_lets(std::vector<Expr>{e})); }

Expr expand_lets(const Expr& e) { return LetExpander()(e); }

}  // namespace retrograde::simplification
