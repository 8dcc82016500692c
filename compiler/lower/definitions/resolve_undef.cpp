// Finds the condition under which each value is defined, then removes the undefined arms from the value.
#include "lower/definitions/resolve_undef.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/memory_reads.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::lower {

bool mentions_undef(const Expr& e) {
  return any_node(e, [](const Expr& node) { return is_undef(node); });
}

namespace {

Expr both(const Expr& a, const Expr& b) {
  if (is_const_true(a) || is_const_false(b) || equal(a, b)) return b;
  if (is_const_true(b) || is_const_false(a)) return a;
  return binary(Kind::And, a, b);
}

Expr either(const Expr& a, const Expr& b) {
  if (is_const_false(a) || is_const_true(b) || equal(a, b)) return b;
  if (is_const_false(b) || is_const_true(a)) return a;
  return binary(Kind::Or, a, b);
}

// The conjunction, where `second` is not evaluated if `first` is false and guards its reads.
Expr first_then(const Expr& first, const Expr& second) {
  if (is_const_true(first) || !reads_memory(second, MemoryReads::Storage))
    return both(first, second);
  return call_op(Op::if_then_else, Bool(), {first, second, const_false()});
}

struct Choice {
  Expr condition, if_true, if_false;
  bool is_lazy;  // only the chosen arm may be evaluated
};
std::optional<Choice> as_choice(const Expr& e) {
  if (const Select* s = e.as<Select>())
    return Choice{s->condition, s->when_true, s->when_false, false};
  const Call* call = as_op(e, Op::if_then_else);
  if (!call) return std::nullopt;
  return Choice{call->args[0], call->args[1], call->args[2], true};
}

// The condition under which an expression does not come from an undef.
class WhereDefined {
 public:
  Expr operator()(const Expr& e) {
    return memo_.get(e, [&] { return compute(e); });
  }

 private:
  Expr compute(const Expr& e) {
    if (is_undef(e)) return const_false();
    if (auto choice = as_choice(e)) return where_chosen(*choice);
    if (const Let* let = e.as<Let>()) {
      Expr body = (*this)(let->body);
      return both((*this)(let->value),
                  is_const(body) ? body : make_let(let->name, let->value, body));
    }
    Expr where = const_true();
    for_each_child(e, [&](const Expr& child) { where = both(where, (*this)(child)); });
    return where;
  }

  Expr where_chosen(const Choice& choice) {
    Expr where = (*this)(choice.condition);
    Expr a = (*this)(choice.if_true), b = (*this)(choice.if_false);
    if (equal(a, b)) return both(where, a);
    if (choice.is_lazy && !(is_const(a) && is_const(b)))
      return both(where, call_op(Op::if_then_else, Bool(), {choice.condition, a, b}));
    const Expr& c = choice.condition;
    return both(where, either(both(c, a), both(logical_not(c), b)));
  }

  NodeMemo<Expr> memo_;
};

// A value that is equal where it is defined, without arms that are never defined.
Expr without_undef(const Expr& value, WhereDefined& where_defined) {
  return rewrite(value, [&](const Expr& e, const auto& recurse) -> Expr {
    if (auto choice = as_choice(e)) {
      if (is_const_false(where_defined(choice->if_false))) return recurse(choice->if_true);
      if (is_const_false(where_defined(choice->if_true))) return recurse(choice->if_false);
    }
    return {};
  });
}

class StageResolver {
 public:
  StageResolver(const LoopedFunc& f, Definition& definition) : f_(f), definition_(definition) {}

  void run() {
    for (const Expr& value : definition_.values) where_.push_back(where_defined_(value));
    for (size_t i = 0; i < where_.size(); ++i) {
      if (is_const_false(where_[i])) definition_.values[i] = undef_of(i);
    }
    check_alike();
    move_into_predicate();
  }

 private:
  Expr undef_of(size_t i) const { return call_op(Op::undef, definition_.values[i].type(), {}); }

  // Matches f(x)[0] = f(x)[0], which f(x)[1] = e generates for the other elements. Storing it is optional.
  bool keeps_old_value(size_t i) const {
    const Call* old = definition_.values[i].as<Call>();
    return old && old->call_type == CallType::Func && old->name == f_.name() &&
           old->component == static_cast<int>(i) &&
           std::ranges::equal(old->args, definition_.args,
                              [](const Expr& a, const Expr& b) { return equal(a, b); });
  }

  // Checks that the elements are defined in the same places; those never stored or unchanged are ignored.
  void check_alike() {
    for (size_t i = 0; i < where_.size(); ++i) {
      const Expr& where = where_[i];
      if (is_const_false(where) || keeps_old_value(i)) continue;
      if (common_.defined() && !equal(common_, where)) refuse(common_, where);
      common_ = where;
    }
  }

  [[noreturn]] void refuse(const Expr& a, const Expr& b) const {
    const auto condition = [](const Expr& e) {
      return is_const_true(e) ? std::string("always") : text("where ", e);
    };
    user_error("define " + quoted(f_.name()),
               "the elements of a Tuple are undefined in the same places, or everywhere",
               text("one is stored ", condition(a), " and another ", condition(b)),
               "Write the old value instead of undef, as in select(c, value, f(x)[0]), or one "
               "condition for all elements");
  }

  void move_into_predicate() {
    if (!common_.defined() || is_const_true(common_)) return;
    for (Expr& value : definition_.values) {
      if (!is_undef(value)) value = without_undef(value, where_defined_);
    }
    Expr& predicate = definition_.predicate;
    predicate = predicate.defined() ? first_then(predicate, common_) : common_;
  }

  const LoopedFunc& f_;
  Definition& definition_;
  WhereDefined where_defined_;
  std::vector<Expr> where_;  // the condition of each value
  Expr common_;              // the condition of all stored values
};

}  // namespace

void resolve_undef(Program& program) {
  for (LoopedFunc& f : program.funcs) {
    for (Definition& stage : f.stages) {
      if (std::ranges::any_of(stage.values, mentions_undef)) StageResolver(f, stage).run();
    }
  }
}

}  // namespace retrograde::lower
