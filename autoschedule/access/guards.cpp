// The conditions under which a stage makes its accesses.
#include <algorithm>
#include <map>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "autoschedule/access/stage_reader.h"
#include "ir/build.h"
#include "ir/scalar.h"
#include "ir/visit.h"

namespace retrograde::planning {

double Guard::fraction() const {
  double result = 1;
  for (const Congruence& c : congruences) result /= static_cast<double>(c.modulus);
  return result;
}

namespace {

template <class T>
std::vector<T> common(const std::vector<T>& a, const std::vector<T>& b) {
  return ir::filtered(a, [&](const T& one) { return std::ranges::find(b, one) != b.end(); });
}

// Adds the conjuncts of a condition, or of its negation, to a guard.
class GuardReader {
 public:
  GuardReader(StageValues& values, Guard& guard) : values_(values), guard_(guard) {}

  void add(const Expr& e, bool is_true) {
    if (const auto* n = e.as<Not>()) return add(n->a, !is_true);
    const auto* marker = e.as<Call>();
    if (marker && marker->call_type == CallType::Operator && marker->is_marker())
      return add(marker->args[0], is_true);
    const auto* binary = e.as<Binary>();
    if (binary && e.kind() == (is_true ? Kind::And : Kind::Or)) {
      add(binary->a, is_true);
      return add(binary->b, is_true);
    }
    const bool is_index =
        binary && is_index_type(binary->a.type()) &&
        (add_congruence(e.kind(), *binary, is_true) || add_order(e.kind(), *binary, is_true));
    if (!is_index && !as_scalar(e)) note(guard_.others, values_.value(e));
  }

 private:
  template <class T>
  static void note(std::vector<T>& list, const T& one) {
    if (std::ranges::find(list, one) == list.end()) list.push_back(one);
  }

  // form mod m == remainder
  bool add_congruence(Kind kind, const Binary& n, bool is_true) {
    if (kind != (is_true ? Kind::EQ : Kind::NE)) return false;
    IndexForm form = values_.form(n.a);
    const auto remainder = as_const_int(n.b);
    if (!remainder || form.modulus == 0 || form.divisor != 1 || form.low != form.high) return false;
    const int64_t modulus = std::exchange(form.modulus, 0);
    const int64_t constant = std::exchange(form.low, 0);
    form.high = 0;
    note(guard_.congruences,
         {std::move(form), ir::euclidean_mod(*remainder - constant, modulus), modulus});
    return true;
  }

  // a < b  is  b - a - 1 >= 0
  bool add_order(Kind kind, const Binary& n, bool is_true) {
    const bool less = kind == Kind::LT || kind == Kind::LE;
    if (!less && kind != Kind::GT && kind != Kind::GE) return false;
    const bool strict = (kind == Kind::LT || kind == Kind::GT) == is_true;
    const bool turned = less != is_true;  // a is the greater one
    const auto& [low, high] = turned ? std::pair(n.b, n.a) : std::pair(n.a, n.b);
    const auto negative = scaled(values_.form(low), -1);
    auto form = negative ? plus(values_.form(high), *negative) : std::nullopt;
    if (form) form = plus(*form, constant_form(strict ? -1 : 0));
    if (form) note(guard_.nonnegative, *form);
    return form.has_value();
  }

  StageValues& values_;
  Guard& guard_;
};

// The selects around nodes, as a tree of conditions. Deeper selects add nothing, so that the conditions of two uses are
// compared in few steps.
constexpr int deepest_condition = 8;

class GuardedCalls {
 public:
  GuardedCalls(StageValues& values, size_t& nodes) : values_(values), nodes_(nodes) {}

  void visit(const std::vector<Expr>& roots,
             ir::FunctionRef<void(const Call&, const Guard&)> on_call) {
    for (const Expr& root : roots) order(root);
    for (const Expr& root : roots) reach(root, 0);
    for (auto e = order_.rbegin(); e != order_.rend(); ++e) pass_on(*e);
    for (const Expr& e : order_) {
      if (const auto* call = e.as<Call>()) on_call(*call, guard(around_.at(e.get())));
    }
  }

 private:
  struct Condition {
    int outer, depth;
    Guard guard;  // with those around it
  };

  // Operands before the nodes that use them.
  void order(const Expr& e) {
    if (!seen_.insert(e.get()).second) return;
    ++nodes_;
    for_each_child(e, [&](const Expr& child) { order(child); });
    order_.push_back(e);
  }

  void reach(const Expr& e, int condition) {
    const auto [entry, is_new] = around_.try_emplace(e.get(), condition);
    if (!is_new) entry->second = common_condition(entry->second, condition);
  }

  void pass_on(const Expr& e) {
    const int condition = around_.at(e.get());
    if (const auto* select = e.as<Select>())
      pass_on_arms(condition, {select->condition, select->when_true, select->when_false});
    else if (const auto* branch = as_op(e, Op::if_then_else))
      pass_on_arms(condition, branch->args);
    else
      for_each_child(e, [&](const Expr& child) { reach(child, condition); });
  }

  // `parts`: a condition, and the arms where it is true and where it is false.
  void pass_on_arms(int outer, const std::vector<Expr>& parts) {
    reach(parts[0], outer);
    reach(parts[1], inside(outer, parts[0], true));
    reach(parts[2], inside(outer, parts[0], false));
  }

  int inside(int outer, const Expr& condition, bool is_true) {
    const int depth = conditions_[static_cast<size_t>(outer)].depth + 1;
    if (depth > deepest_condition) return outer;
    const auto [entry, is_new] =
        known_.try_emplace({outer, condition.get(), is_true}, static_cast<int>(conditions_.size()));
    if (is_new) {
      Guard inner = guard(outer);
      GuardReader(values_, inner).add(condition, is_true);
      conditions_.push_back({outer, depth, std::move(inner)});
    }
    return entry->second;
  }

  int common_condition(int a, int b) const {
    while (a != b) {
      const Condition &of_a = conditions_[static_cast<size_t>(a)],
                      &of_b = conditions_[static_cast<size_t>(b)];
      if (of_a.depth >= of_b.depth) a = of_a.outer;
      if (of_b.depth >= of_a.depth) b = of_b.outer;
    }
    return a;
  }

  const Guard& guard(int condition) const {
    return conditions_[static_cast<size_t>(condition)].guard;
  }

  StageValues& values_;
  size_t& nodes_;
  std::unordered_set<const ir::ExprNode*> seen_;
  std::vector<Expr> order_;
  std::unordered_map<const ir::ExprNode*, int> around_;
  std::vector<Condition> conditions_{{-1, 0, {}}};
  std::map<std::tuple<int, const ir::ExprNode*, bool>, int> known_;
};

}  // namespace

Guard intersection(const Guard& a, const Guard& b) {
  return {common(a.congruences, b.congruences), common(a.nonnegative, b.nonnegative),
          common(a.others, b.others)};
}

Guard guard_of(const Expr& condition, bool is_true, StageValues& values) {
  Guard guard;
  GuardReader(values, guard).add(condition, is_true);
  return guard;
}

void for_each_guarded_call(const std::vector<Expr>& roots, StageValues& values, size_t& nodes,
                           ir::FunctionRef<void(const Call&, const Guard&)> visit) {
  GuardedCalls(values, nodes).visit(roots, visit);
}

}  // namespace retrograde::planning
