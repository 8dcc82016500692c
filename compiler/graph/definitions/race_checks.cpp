#include "graph/definitions/race_checks.h"

#include <algorithm>
#include <map>
#include <optional>

#include "analysis/interval.h"
#include "analysis/never_meet.h"
#include "graph/definitions/associative_update.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/lets.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::graph {

namespace {

// Pure variables keep their positions on both sides, so two conflicting points agree in them.
MeetingPoints points_of(const Definition& update) {
  MeetingPoints points;
  for (const ReductionVariable& r : update.rvars) {
    const Expr min = cast_to(Int(32), r.min), extent = cast_to(Int(32), r.extent);
    points.variables.push_back({r.var, min, min + extent - 1});
  }
  if (update.predicate.defined()) points.conditions.push_back(update.predicate);
  return points;
}

// The loops over reduction variables, by name, as variables of `points` that have names of their own, since a loop may
// be named after what it is a part of. nullopt: a split has no constant factor, or a loop is fused of several.
std::optional<std::map<std::string, std::string>> add_loops(MeetingPoints& points,
                                                            const std::vector<Split>& splits) {
  struct Loop {
    std::string variable;
    Expr min;
  };
  std::map<std::string, Loop> loops;
  for (const MeetingPoints::Variable& root : points.variables)
    loops[root.name] = {root.name, root.min};
  for (const Split& split : splits) {
    if (split.kind == Split::Kind::Fuse) {
      if (loops.contains(split.outer) || loops.contains(split.inner)) return std::nullopt;
      continue;
    }
    const auto old = loops.extract(split.old_var);
    if (!old) continue;
    const Loop whole = old.mapped();
    if (split.kind == Split::Kind::Rename) {
      loops[split.outer] = whole;
      continue;
    }
    const auto factor = as_const_int(split.factor);
    if (!factor) return std::nullopt;
    const Loop outer{whole.variable + "/", 0}, inner{whole.variable + "%", 0};
    points.variables.push_back({outer.variable, {}, {}});
    points.variables.push_back({inner.variable, 0, static_cast<int>(*factor - 1)});
    points.conditions.push_back(variable(whole.variable) ==
                                whole.min + variable(outer.variable) * static_cast<int>(*factor) +
                                    variable(inner.variable));
    loops[split.outer] = outer;
    loops[split.inner] = inner;
  }
  std::map<std::string, std::string> names;
  for (const auto& [name, loop] : loops) names[name] = loop.variable;
  return names;
}

// Whether no iteration writes the element that this call reads.
bool is_never_written(const Call& call, const Definition& update) {
  Scope<Interval> domain;
  for (const ReductionVariable& r : update.rvars) {
    const Expr min = cast_to(Int(32), r.min), extent = cast_to(Int(32), r.extent);
    domain.push(r.var, {min, simplify(min + extent - 1)});
  }
  for (size_t d = 0; d < update.args.size(); d++) {
    const Interval written = bounds_of(update.args[d], domain);
    const Interval read = bounds_of(call.args[d], domain);
    if (!written.is_bounded() || !read.is_bounded()) continue;
    if (can_prove(read.max < written.min) || can_prove(read.min > written.max)) return true;
  }
  return false;
}

bool is_parity(const Expr& e) {
  const auto constant = as_const_int(e);
  const auto* remainder = e.as<Mod>();
  return remainder ? as_const_int(remainder->b) == 2
                   : constant && (*constant == 0 || *constant == 1);
}

// Parities that differ: one is 1 minus the other. Proofs use equations, not their negations.
Expr as_equation(const Expr& condition) {
  const auto* negated = condition.as<Not>();
  const Binary* sides = condition.as<NE>();
  if (negated) sides = negated->a.as<EQ>();
  if (!sides || !is_parity(sides->a) || !is_parity(sides->b)) return condition;
  return sides->a == 1 - sides->b;
}

// The reads of a Func by its own update, each with the condition under which its value matters: both
// arms of a select may be evaluated, but only one is taken. In a kernel, all that is evaluated matters.
class OwnReads {
 public:
  OwnReads(const FuncContents& f, const Definition& update, bool in_kernel = false)
      : f_(f), update_(update), in_kernel_(in_kernel) {}

  std::vector<Access> find() {
    const std::vector<Expr> values = mapped(update_.values, without_lets);  // alive while visited
    for (const Expr& value : values) visit(value, {});
    if (visits_ > most_visits) {  // paths through shared nodes
      reads_.clear();
      for (const Expr& read : own_reads(f_, update_)) add(read, {});
      return reads_;
    }
    Definition places = update_;
    places.values.clear();
    for (const Expr& read : own_reads(f_, places)) add(read, {});
    return reads_;
  }

 private:
  static constexpr int most_visits = 5000;

  void add(const Expr& read, const Expr& where) {
    reads_.push_back({read.as<Call>()->args, where});
  }

  void visit(const Expr& e, const Expr& where) {
    if (++visits_ > most_visits || (!where.defined() && !always_.insert(e.get()).second)) return;
    if (as_call_of(e, &f_)) add(e, where);
    const auto* select = e.as<Select>();
    const Call* lazy = as_op(e, Op::if_then_else);
    if (select && !in_kernel_) {
      choose(select->condition, select->when_true, select->when_false, where);
    } else if (lazy) {
      choose(lazy->args[0], lazy->args[1], lazy->args[2], where);
    } else {
      for_each_child(e, [&](const Expr& child) { visit(child, where); });
    }
  }
  void choose(const Expr& condition, const Expr& if_true, const Expr& if_false, const Expr& where) {
    const auto with = [&](const Expr& more) { return where.defined() ? where && more : more; };
    visit(condition, where);
    visit(if_true, with(as_equation(condition)));
    visit(if_false, with(as_equation(logical_not(condition))));
  }

  const FuncContents& f_;
  const Definition& update_;
  const bool in_kernel_;
  std::unordered_set<const ExprNode*> always_;  // nodes that are evaluated at every point
  int visits_ = 0;
  std::vector<Access> reads_;
};

// The condition under which an update changes the element that it writes: c in f(p) = select(c, value, f(p)).
// Undefined: always.
Expr changes_where(const FuncContents& f, const Definition& update) {
  Expr condition;
  for (size_t k = 0; k < update.values.size(); ++k) {
    const Expr value = without_lets(update.values[k]);
    const auto* choice = value.as<Select>();
    if (!choice || !choice->condition.type().is_scalar()) return {};
    const auto keeps = [&](const Expr& arm) {
      return is_old_value(arm, f, update, static_cast<int>(k));
    };
    if (!keeps(choice->when_true) && !keeps(choice->when_false)) return {};
    const Expr& asked = choice->condition;
    const Expr here = as_equation(keeps(choice->when_false) ? asked : logical_not(asked));
    if (condition.defined() && !equal(condition, here)) return {};
    condition = here;
  }
  return condition;
}

// Those behind position `i`: the variables of the loops around that of position `i`.
std::unordered_set<std::string> names_after(const std::vector<std::string>& loops, size_t i) {
  return {loops.begin() + static_cast<std::ptrdiff_t>(i) + 1, loops.end()};
}

}  // namespace

Expr read_of_other_element(const FuncContents& f, const Definition& update) {
  for (const Expr& read : own_reads(f, update)) {
    if (!is_old_value(read, f, update) && !is_never_written(*read.as<Call>(), update)) return read;
  }
  return {};
}

bool can_prove_race_free(const FuncContents& f, const Definition& update, const std::string& rvar,
                         const std::unordered_set<std::string>& around, bool in_kernel,
                         analysis::ProofEffort effort) {
  MeetingPoints points = points_of(update);
  points.effort = effort;
  const Access write{update.args, {}};
  if (!can_prove_never_meet(points, rvar, write, write, around)) return false;
  const Access change{update.args, in_kernel ? Expr() : changes_where(f, update)};
  return std::ranges::all_of(OwnReads(f, update, in_kernel).find(), [&](const Access& read) {
    return can_prove_never_meet(points, rvar, change, read, around);
  });
}

bool can_prove_same_order(const FuncContents& f, const Definition& update,
                          const std::vector<std::string>& loops_before,
                          const std::vector<std::string>& loops_after,
                          const std::vector<Split>& splits) {
  if (loops_before == loops_after) return true;
  MeetingPoints points = points_of(update);
  const auto names = add_loops(points, splits);
  const auto is_known = [&](const std::string& loop) { return names->contains(loop); };
  if (!names || !std::ranges::all_of(loops_before, is_known)) return false;
  const auto variable_of = [&](const std::string& loop) { return names->at(loop); };
  const std::vector<std::string> before = mapped(loops_before, variable_of),
                                 after = mapped(loops_after, variable_of);
  const Access write{update.args, {}}, change{update.args, changes_where(f, update)};
  const std::vector<Access> reads = OwnReads(f, update).find();
  const auto never_meet = [&](const PointOrder& order) {
    return can_prove_never_meet(points, order, write, write) &&
           std::ranges::all_of(reads, [&](const Access& read) {
             return can_prove_never_meet(points, order, change, read) &&
                    can_prove_never_meet(points, order, read, change);
           });
  };
  // The first point runs earlier in the order `before`, which the outermost variable in which the
  // points differ decides: `earlier`. It runs later in the order `after`, where `later` decides.
  for (size_t earlier = 0; earlier < before.size(); ++earlier) {
    for (size_t later = 0; later < after.size(); ++later) {
      PointOrder order{names_after(before, earlier), {before[earlier]}, {after[later]}};
      order.same.merge(names_after(after, later));
      const bool is_pair =
          !order.same.contains(before[earlier]) && !order.same.contains(after[later]);
      if (is_pair && before[earlier] != after[later] && !never_meet(order)) return false;
    }
  }
  return true;
}

bool can_prove_skewed_order(const FuncContents& f, const Definition& update,
                            const std::string& inner, const std::string& outer, int slope) {
  MeetingPoints points = points_of(update);
  PointOrder later{{}, {outer}, {}};  // the second point runs later,
  for (const ReductionVariable& r : update.rvars) {
    if (r.var != inner && r.var != outer) later.same.insert(r.var);
  }
  const std::string sum = inner + "+" + outer;
  points.variables.push_back({sum, {}, {}});
  points.conditions.push_back(variable(sum) == variable(inner) + slope * variable(outer));
  PointOrder equal = later, earlier = later;  // but its sum is equal or smaller
  equal.same.insert(sum);
  earlier.smaller.push_back(sum);
  const Access write{update.args, {}}, change{update.args, changes_where(f, update)};
  std::vector<std::pair<Access, Access>> pairs{{write, write}};
  for (const Access& read : OwnReads(f, update).find()) {
    pairs.emplace_back(change, read);
    pairs.emplace_back(read, change);
  }
  return std::ranges::all_of(pairs, [&](const auto& pair) {
    return can_prove_never_meet(points, equal, pair.first, pair.second) &&
           can_prove_never_meet(points, earlier, pair.first, pair.second);
  });
}

bool can_prove_commutative(const FuncContents& f, const Definition& update) {
  const AssociativityProof proof = prove_associative(f, update);
  return proof.op && proof.op->commutative && !proof.op->breaks_ties;
}

bool stores_one_value(const FuncContents& f, const Definition& update) {
  if (!own_reads(f, update).empty()) return false;
  return std::ranges::none_of(update.values, [&](const Expr& value) {
    return std::ranges::any_of(
        update.rvars, [&](const ReductionVariable& r) { return uses_variable(value, r.var); });
  });
}

}  // namespace retrograde::graph
