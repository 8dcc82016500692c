#include "autodiff/reverse_sweep.h"

#include <unordered_map>
#include <unordered_set>

#include "autodiff/derivative_rules.h"
#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::ir {

namespace {

// Children before parents, each node once; explicit stack, since user-made DAGs can be deep.
std::vector<Expr> post_order(const std::vector<Expr>& roots) {
  std::vector<Expr> order;
  std::unordered_set<const ExprNode*> seen;
  std::vector<std::pair<Expr, bool>> stack;
  for (auto root = roots.rbegin(); root != roots.rend(); ++root) {
    if (root->defined()) stack.emplace_back(*root, false);
  }
  while (!stack.empty()) {
    auto [e, children_done] = stack.back();
    stack.pop_back();
    if (children_done) {
      order.push_back(e);
    } else if (seen.insert(e.get()).second) {
      stack.emplace_back(e, true);
      for_each_child(e, [&](const Expr& child) { stack.emplace_back(child, false); });
    }
  }
  return order;
}

bool is_leaf(const Expr& e) {
  const auto* call = e.as<Call>();
  return e.as<Variable>() ||
         (call && (call->call_type == CallType::Func || call->call_type == CallType::Image));
}

// Operators whose value may be infinite or NaN at finite operands.
bool is_risky_op(Op op) {
  switch (op) {
    case Op::sqrt:
    case Op::exp:
    case Op::log:
    case Op::pow:
    case Op::tan:
    case Op::asin:
    case Op::acos:
    case Op::sinh:
    case Op::cosh:
    case Op::acosh:
    case Op::atanh:
    case Op::fast_exp:
    case Op::fast_log:
    case Op::fast_pow:
    case Op::fast_inverse:
    case Op::fast_inverse_sqrt:
    case Op::strong_mul:
      return true;
    default:
      return false;
  }
}

class Sweep {
 public:
  Sweep(const std::vector<Expr>& values, const std::vector<Expr>& seeds,
        FunctionRef<bool(const Expr&)> is_wanted)
      : order_(post_order(values)) {
    for (const Expr& e : order_) classify(e, is_wanted);
    for (size_t i = 0; i < values.size(); ++i) {
      if (values[i].defined() && seeds[i].defined()) add(values[i], seeds[i], false);
    }
  }

  SweepResult run() {
    for (auto e = order_.rbegin(); e != order_.rend(); ++e) {
      auto it = adjoints_.find(e->get());
      if (it == adjoints_.end() || is_zero(it->second.sum)) continue;
      State state = it->second;
      if (is_leaf(*e)) {
        result_.leaves.push_back({*e, state.sum});
      } else {
        propagate(*e, state);
      }
    }
    return std::move(result_);
  }

 private:
  struct State {
    Expr sum;
    bool masked = false;  // exactly 0 on points whose branch was not taken
  };

  void classify(const Expr& e, FunctionRef<bool(const Expr&)> is_wanted) {
    bool active = false, risky = e.kind() == Kind::Div && e.type().is_float();
    if (is_leaf(e)) {
      active = e.type().is_float() && is_wanted(e);
    } else {
      for_each_child(e, [&](const Expr& child) {
        active |= active_.contains(child.get());
        risky |= risky_.contains(child.get());
      });
      // Derivatives pass through floating values only.
      if (!e.type().is_float()) note_if_lost(e, active), active = false;
      const auto* call = e.as<Call>();
      risky |= call && (call->call_type == CallType::Extern || is_risky_op(call->op));
    }
    if (const auto* div = e.as<Div>(); div && is_const(div->b) && !risky_.contains(div->a.get()))
      risky = false;
    if (active) active_.insert(e.get());
    if (risky) risky_.insert(e.get());
    if (is_leaf(e) && !e.as<Variable>()) loads_.insert(e.get());
    for_each_child(e, [&](const Expr& child) {
      if (loads_.contains(child.get())) loads_.insert(e.get());
    });
  }

  void note_if_lost(const Expr& e, bool active) {
    if (!active) return;
    if (e.as<Cast>())
      result_.notes.insert("a cast to " + to_string(e.type()) + " has derivative 0");
  }

  void add(const Expr& e, const Expr& adjoint, bool masked) {
    if (!active_.contains(e.get()) || is_zero(adjoint)) return;
    Expr converted = cast_to(adjoint_type(e.type()), adjoint);
    State& state = adjoints_[e.get()];
    state.sum = state.sum.defined() ? state.sum + converted : converted;
    state.masked |= masked;
  }

  void add_partials(const std::vector<Expr>& operands, const std::vector<Partial>& partials,
                    const State& state) {
    bool risky_operand = false, reads = false;
    for (const Expr& operand : operands) {
      risky_operand |= risky_.contains(operand.get());
      reads |= loads_.contains(operand.get());
    }
    for (size_t i = 0; i < operands.size(); ++i) {
      if (i >= partials.size() || !partials[i].factor.defined() ||
          !active_.contains(operands[i].get()))
        continue;
      Partial partial = partials[i];
      if (risky_operand || (state.masked && reads)) partial.strength = Strength::Strong;
      bool masks = partial.factor.as<Select>() != nullptr;
      add(operands[i], times_partial(state.sum, partial), state.masked || masks);
    }
  }

  void propagate(const Expr& e, const State& state) {
    if (!active_.contains(e.get())) return;
    match(
        e,
        [&](const Select& s) {
          Expr zero = make_zero(state.sum.type());
          add(s.true_value, make_select(s.condition, state.sum, zero), true);
          add(s.false_value, make_select(s.condition, zero, state.sum), true);
        },
        [&](const Cast& c) { add(c.value, state.sum, state.masked); },
        [&](const Broadcast&) {
          internal_error("vectors have no place in the definition of a Func");
        },
        [&](const Binary& b) {
          add_partials({b.a, b.b}, derivative_rule(e.kind()).partials({b.a, b.b}, e), state);
        },
        [&](const Call& call) { propagate_call(e, call, state); },
        [&](const ExprNode& node) {
          if (!has_derivative_rule(node.kind))
            internal_error(text("no derivative of a ", kind_name(node.kind)));
          unsupported(text("differentiate ", kind_name(node.kind)),
                      derivative_rule(node.kind).convention);
        });
  }

  void propagate_call(const Expr& e, const Call& call, const State& state) {
    if (call.call_type == CallType::Extern) {
      unsupported(text("differentiate the call of the C function ", quoted(call.name)),
                  "a C function has no known derivative",
                  "the gradient of one of its arguments is wanted",
                  text("wrap the argument in stop_gradient, or write ", quoted(call.name),
                       " in the language"));
    }
    const DerivativeRule& rule = derivative_rule(call.op);
    const char* name = op_info(call.op).name;
    switch (rule.cls) {
      case RuleClass::Smooth:
        return add_partials(call.args, rule.partials(call.args, e), state);
      case RuleClass::Transparent:
        return add(call.args[rule.transparent_arg], state.sum, state.masked);
      case RuleClass::Constant:
      case RuleClass::Blocked:
        result_.notes.insert(text(name, " has derivative 0 (", rule.convention, ")"));
        return;
      case RuleClass::NoRule:
        unsupported(text("differentiate ", name), rule.convention);
    }
  }

  std::vector<Expr> order_;
  std::unordered_set<const ExprNode*> active_, risky_, loads_;
  std::unordered_map<const ExprNode*, State> adjoints_;
  SweepResult result_;
};

}  // namespace

SweepResult sweep_reverse(const std::vector<Expr>& values, const std::vector<Expr>& seeds,
                          FunctionRef<bool(const Expr&)> is_wanted) {
  return Sweep(values, seeds, is_wanted).run();
}

namespace {
class LetRemover : public Rewriter {
 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override {
    const auto* let = e.as<Let>();
    return let ? (*this)(substitute(let->body, let->name, let->value)) : children(e);
  }
};
}  // namespace

Expr without_lets(const Expr& e) { return LetRemover()(e); }

}  // namespace retrograde::ir
