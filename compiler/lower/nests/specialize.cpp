#include "lower/nests/specialize.h"

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"
#include "lower/checks/run_time_check.h"
#include "retrograde_runtime.h"
#include "simplify/simplify.h"

namespace retrograde::lower {
namespace {

// A known fact: a condition without And, Or and Not, and its value.
struct Known {
  Expr condition;
  bool value;
};

void take_apart(const Expr& condition, bool value, std::vector<Known>& known,
                Substitution& constants) {
  known.push_back({condition, value});
  if (const Not* n = condition.as<Not>()) return take_apart(n->a, !value, known, constants);
  const Binary* op = condition.as<Binary>();
  if (!op) {
    if (const Variable* v = condition.as<Variable>()) constants[v->name] = Expr(value);
    return;
  }
  if (condition.kind() == (value ? Kind::And : Kind::Or)) {
    take_apart(op->a, value, known, constants);
    take_apart(op->b, value, known, constants);
  } else if (condition.kind() == (value ? Kind::EQ : Kind::NE)) {
    const Variable* v = op->a.as<Variable>();
    if (v && is_const(op->b)) constants[v->name] = op->b;
    const Variable* w = op->b.as<Variable>();
    if (w && is_const(op->a)) constants[w->name] = op->a;
  }
}

Definition assuming(const Definition& definition, const Expr& condition, bool value) {
  std::vector<Known> known;
  Substitution constants;
  take_apart(condition, value, known, constants);
  // Other specializations leave conditions in simplified form.
  take_apart(simplify(condition), value, known, constants);
  StepRewriter under([&](const Expr& e, const auto&) -> Expr {
    if (const Variable* v = e.as<Variable>()) {
      if (const auto* it = find_or_null(constants, v->name)) return *it;
    }
    if (!e.type().is_bool() || !e.type().is_scalar()) return {};
    for (const Known& fact : known) {
      if (equal(e, fact.condition)) return Expr(fact.value);
    }
    return {};
  });
  Definition result =
      map_exprs(definition, [&](const Expr& e) { return e.defined() ? simplify(under(e)) : e; });
  if (is_const_true(result.predicate.defined() ? result.predicate : const_false()))
    result.predicate = Expr();
  return result;
}

}  // namespace

std::vector<Variant> variants_of(const LoopedFunc& f, int stage) {
  std::vector<Variant> variants;
  Definition left = f.stages[stage];  // for the case that no condition so far holds
  const std::vector<StageLoops> specializations = std::move(left.schedule.specializations);
  left.schedule.specializations.clear();
  auto with = [&](const Definition& definition) {
    LoopedFunc copy = f;
    copy.stages[stage] = definition;
    return copy;
  };
  for (const StageLoops& special : specializations) {
    if (!special.failure.empty()) {
      variants.push_back({special.condition, special.failure, with(left)});
      if (!special.condition.defined()) return variants;
      continue;
    }
    Definition definition = assuming(left, special.condition, true);
    definition.schedule = special;
    definition.schedule.condition = Expr();
    variants.push_back({special.condition, "", with(definition)});
    left = assuming(left, special.condition, false);
  }
  variants.push_back({{}, "", with(left)});
  return variants;
}

std::vector<const StageLoops*> schedules_of(const StageLoops& schedule) {
  std::vector<const StageLoops*> all = {&schedule};
  for (const StageLoops& special : schedule.specializations) {
    for (const StageLoops* nested : schedules_of(special)) all.push_back(nested);
  }
  return all;
}

Stmt fail_specialized(const LoopedFunc& f, const std::string& message) {
  return run_time_check(const_false(), retrograde_error_specialize_fail,
                        text("cannot run ", quoted(f.name()),
                             ": one of its specializations must fit; none did: ", message,
                             ". Pass arguments that one of them fits, or drop specialize_fail."));
}

}  // namespace retrograde::lower
