#include "autodiff/checkpoint.h"

#include <algorithm>
#include <array>

#include "autodiff/checkpoint_plan.h"
#include "autodiff/revolve.h"
#include "autodiff/versions.h"
#include "frontend/buffer.h"
#include "frontend/define.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

// Rows of the table: what one pass over the inner loops does.
enum class Action : int { Store, Restore, Advance, Record, Adjoint };

// One write of an action: place <- values.
struct Write {
  Expr place;
  std::vector<Expr> values;
};

using Table = std::vector<std::array<int, 3>>;  // action, step, slot

Table table_of(const std::vector<RevolveAction>& actions) {
  Table rows;
  auto add = [&](Action action, const RevolveAction& a) {
    rows.push_back({static_cast<int>(action), a.step, std::max(a.slot, 0)});
  };
  for (const RevolveAction& a : actions) {
    switch (a.kind) {
      case RevolveAction::Kind::Store:
        add(Action::Store, a);
        break;
      case RevolveAction::Kind::Restore:
        add(Action::Restore, a);
        break;
      case RevolveAction::Kind::Advance:
        add(Action::Advance, a);
        break;
      case RevolveAction::Kind::Reverse:
        add(Action::Record, a);
        add(Action::Adjoint, a);
        break;
    }
  }
  return rows;
}

Buffer<int> in_memory(const Table& rows) {
  Buffer<int> table(3, static_cast<int>(rows.size()));
  for (size_t i = 0; i < rows.size(); ++i) {
    for (int c = 0; c < 3; ++c) table(c, static_cast<int>(i)) = rows[i][static_cast<size_t>(c)];
  }
  return table;
}

int count_rows(const Table& rows, Action action) {
  return static_cast<int>(std::count_if(rows.begin(), rows.end(), [&](const auto& row) {
    return row[0] == static_cast<int>(action);
  }));
}

class CheckpointedLoop {
 public:
  CheckpointedLoop(const UpdateContext& context, UpdateAdjoint& result)
      : c_(context),
        f_(context.f),
        result_(result),
        layout_(context),
        machine_(std::make_shared<AdjointContents>()) {}

  void run() {
    machine_->name = claim_name(f_->name + "_checkpoints");
    plan_ = plan_checkpoints(c_, layout_, result_.current.func, machine_);
    table_ = table_of(actions());
    lay_out();
    define_machine();
    record_ = record_writes();
    adjoint_ = adjoint_writes();
    append_loop();
    note_work();
    hand_over();
  }

 private:
  std::vector<RevolveAction> actions() const {
    if (needs_values()) return revolve_schedule(plan_.steps, plan_.states);
    std::vector<RevolveAction> reversals;  // nothing is computed again
    for (int step = plan_.steps - 1; step >= 0; --step)
      reversals.push_back({RevolveAction::Kind::Reverse, step});
    return reversals;
  }
  bool needs_values() const { return !plan_.needed.empty(); }

  // ---- slots ----

  void lay_out() {
    Expr next = layout_.elements() * 2;
    at_hand_ = simplify(next);
    noted_ = simplify(at_hand_ + 1);
    next = noted_ + plan_.inner_count * static_cast<int>(plan_.places.size());
    for (CheckpointPlan::Given& g : plan_.given) {
      g.start = simplify(next);
      next = next + plan_.inner_count * (g.over_time ? plan_.steps : g.width());
    }
    kept_ = simplify(next);
    size_ = simplify(kept_ + layout_.elements() * (needs_values() ? plan_.states : 0));
  }
  Expr adjoint_slot(const Expr& element) const { return element + layout_.elements(); }
  Expr note_slot(size_t place) const {
    return noted_ + iteration_number(plan_.inner) * static_cast<int>(plan_.places.size()) +
           static_cast<int>(place);
  }
  Expr given_slot(const CheckpointPlan::Given& g) const {
    if (g.over_time) return g.start + iteration_number(c_.definition.rvars);
    return g.start + iteration_number(plan_.inner) * g.width();
  }

  Expr at(const Expr& slot, size_t k) const {
    return call_value(machine_, layout_.with_pure(slot), static_cast<int>(k));
  }
  // The value of f, its adjoint, a sum, that the slot holds.
  Expr value_at(const Expr& slot, size_t k) const { return cast_to(f_->types[k], at(slot, k)); }
  Expr adjoint_at(const Expr& slot, size_t k) const {
    return cast_to(c_.query.target.types[k], at(slot, k));
  }
  Expr sum_at(const Expr& slot) const { return at(slot, static_cast<size_t>(plan_.sum_value)); }
  std::vector<Expr> all_values(const Expr& slot) const {
    std::vector<Expr> values;
    for (size_t k = 0; k < plan_.types.size(); ++k) values.push_back(at(slot, k));
    return values;
  }

  void define_machine() {
    FuncPtr before = clone_prefix(c_.query.f, c_.query.stage);
    Expr slot = layout_.slot(), elements = layout_.elements();
    std::vector<Expr> initial;
    for (size_t k = 0; k < plan_.types.size(); ++k) {
      Type type = plan_.types[k];
      Expr zero = make_zero(type), adjoint = zero;
      int index = static_cast<int>(k);
      if (f_->types[k].is_float()) {
        Expr a = call_value(result_.current.func, layout_.element(slot - elements), index);
        adjoint = make_select(slot < elements * 2, cast_to(type, a), zero);
      }
      Expr value = cast_to(type, call_value(before, layout_.element(slot), index));
      initial.push_back(make_select(slot < elements, value, adjoint));
    }
    machine_->types.clear();  // the definition says them again
    define_pure(machine_, layout_.with_pure(slot), initial);
    result_.helpers.push_back(before);
    result_.helpers.push_back(machine_);
  }

  // ---- one iteration of a step ----

  // Reads of f as they are in the current state.
  Expr in_state(const Expr& e) const {
    return rewrite(e, [&](const Expr& node, const auto& recurse) -> Expr {
      const Call* call = as_call_of(node, f_);
      if (!call) return map_children(node, recurse);
      std::vector<Expr> args;
      for (const Expr& arg : call->args) args.push_back(recurse(arg));
      return value_at(layout_.slot_of(args), static_cast<size_t>(call->value_index));
    });
  }
  // Reads of f as the step noted them.
  Expr noted(const Expr& e) const {
    return rewrite(e, [&](const Expr& node, const auto& recurse) -> Expr {
      const Call* call = as_call_of(node, f_);
      for (size_t i = 0; call && i < plan_.needed.size(); ++i) {
        if (equal(plan_.needed[i], node))
          return value_at(note_slot(plan_.place_of[i]), static_cast<size_t>(call->value_index));
      }
      return map_children(node, recurse);
    });
  }

  // Forward: the values that are needed later, then the write.
  std::vector<Write> record_writes() const {
    std::vector<Write> writes;
    for (size_t i = 0; i < plan_.places.size(); ++i)
      writes.push_back({note_slot(i), all_values(in_state(layout_.slot_of(plan_.places[i])))});
    Write last{in_state(layout_.slot_of(c_.write)), {}};
    Expr inside = in_state(layout_.is_inside(c_.write));
    for (size_t k = 0; k < plan_.types.size(); ++k) {
      Expr value = cast_to(plan_.types[k], in_state(c_.values[k]));
      last.values.push_back(make_select(inside, value, at(last.place, k)));
    }
    writes.push_back(last);
    return writes;
  }

  // Backward: a = A[W]; A[W] = 0; A[R_k] += a dV/dv_k; then what others get.
  std::vector<Write> adjoint_writes() const {
    Expr written = adjoint_slot(noted(layout_.slot_of(c_.write)));
    std::vector<Write> writes{{at_hand_, all_values(written)}, {written, {}}};
    for (Type t : plan_.types) writes[1].values.push_back(make_zero(t));
    std::vector<std::vector<Expr>> places{c_.write};  // of the writes after the first
    for (const LeafAdjoint& leaf : plan_.passed_on) {
      const Call* call = as_call_of(leaf.leaf, f_);
      auto known = std::find_if(places.begin(), places.end(),
                                [&](const auto& p) { return same_args(p, call->args); });
      size_t i = static_cast<size_t>(known - places.begin()) + 1;
      if (known == places.end()) {
        places.push_back(call->args);
        Expr slot = adjoint_slot(noted(layout_.slot_of(call->args)));
        writes.push_back({slot, all_values(slot)});
      }
      size_t k = static_cast<size_t>(call->value_index);
      Expr term = make_select(noted(layout_.is_inside(call->args)), noted(leaf.adjoint),
                              make_zero(leaf.adjoint.type()));
      Type type = c_.query.target.types[k];
      Expr& value = writes[i].values[k];
      value = cast_to(plan_.types[k], cast_to(type, value) + cast_to(type, term));
    }
    for (const CheckpointPlan::Given& g : plan_.given) append_given(g, writes);
    return writes;
  }
  void append_given(const CheckpointPlan::Given& g, std::vector<Write>& writes) const {
    Expr slot = given_slot(g), old = sum_at(slot);
    Expr term = cast_to(old.type(), noted(g.leaf.adjoint));
    auto write = [&](const Expr& place, const Expr& value) {
      writes.push_back({place, all_values(place)});
      writes.back().values[static_cast<size_t>(plan_.sum_value)] = value;
    };
    if (g.over_time) return write(slot, term);
    if (!g.compensated) return write(slot, old + term);
    // What old + term loses, exactly: D. Knuth, The Art of Computer Programming 2, section 4.2.2,
    // theorem B.
    term = exactly(term);
    Expr sum = exactly(old + term), from_term = exactly(sum - old);
    Expr lost = exactly(exactly(old - exactly(sum - from_term)) + exactly(term - from_term));
    write(slot + 1, exactly(sum_at(slot + 1) + lost));
    write(slot, sum);
  }
  static Expr exactly(const Expr& e) { return call_op(Op::strict_float, e.type(), {e}); }

  // ---- the loop over actions ----

  struct Branch {
    Expr is_chosen, runs;
    Write write;
  };

  void append_loop() {
    Buffer<int> table = in_memory(table_);
    auto rdom = std::make_shared<ReductionDomainContents>();
    auto add_loop = [&](const std::string& name, const Expr& min, const Expr& extent) {
      rdom->vars.push_back({unique_name(name), min, extent});
      return rdom->vars.back().var;
    };
    // All loops first: variables refer to the finished domain.
    add_loop("write", make_zero(Int(32)), writes_per_iteration());
    for (const ReductionVariable& r : plan_.inner) add_loop(r.var, r.min, r.extent);
    add_loop("action", make_zero(Int(32)), make_const(Int(32), table.dim(1).extent()));
    rdom->frozen = true;
    auto loop = [&](size_t i) { return variable(rdom->vars[i].var, Int(32), SymbolRef(rdom)); };

    for (size_t i = 0; i < plan_.inner.size(); ++i) {
      const ReductionVariable& r = plan_.inner[i];
      forward_[r.var] = loop(i + 1);
      backward_[r.var] = r.min + (r.min + (r.extent - 1) - loop(i + 1));
    }
    Expr row = loop(rdom->vars.size() - 1);
    Expr step = clamp(entry(table, 1, row), 0, plan_.steps - 1);
    forward_[plan_.time.var] = backward_[plan_.time.var] = plan_.time.min + step;
    forward_[plan_.at_hand] = backward_[plan_.at_hand] = at_hand_;

    std::vector<ReductionVariable> pass(rdom->vars.begin(), rdom->vars.end() - 1);
    Expr number = substitute(iteration_number(pass), names_of(pass, rdom));
    Branch all = one_of(branches(entry(table, 0, row), loop(0), number,
                                 clamp(entry(table, 2, row), 0, std::max(plan_.states - 1, 0))));
    append_update(machine_, layout_.with_pure(clamp(all.write.place, 0, size_ - 1)),
                  all.write.values, rdom->vars, all.runs);
  }
  static Substitution names_of(const std::vector<ReductionVariable>& loops,
                               const std::shared_ptr<ReductionDomainContents>& rdom) {
    Substitution names;
    for (const ReductionVariable& r : loops)
      names[r.var] = variable(r.var, Int(32), SymbolRef(rdom));
    return names;
  }
  // Copies of a state go through the same loops: enough for all elements.
  Expr writes_per_iteration() const {
    Expr most = make_const(Int(32), static_cast<int>(std::max(record_.size(), adjoint_.size())));
    if (!needs_values()) return most;
    Expr inner = max(plan_.inner_count, 1);
    return simplify(max(most, (layout_.elements() + inner - 1) / inner));
  }

  // `write`: the number of the write in this iteration; `number`: of the write in this pass.
  std::vector<Branch> branches(const Expr& action, const Expr& write, const Expr& number,
                               const Expr& slot) const {
    auto is = [&](Action a) { return action == static_cast<int>(a); };
    auto within = [&](const std::vector<Write>& writes) {
      return write < static_cast<int>(writes.size());
    };
    Expr written = placed(layout_.is_inside(c_.write), backward_);
    std::vector<Branch> result{{is(Action::Adjoint),
                                has_run(backward_) && written && within(adjoint_),
                                chosen(adjoint_, write, backward_)}};
    if (!needs_values()) {
      result.push_back({const_true(), const_false(), result[0].write});
      return result;
    }
    result.push_back({is(Action::Record), has_run(forward_) && within(record_),
                      chosen(record_, write, forward_)});
    result.push_back(
        {is(Action::Advance), has_run(forward_) && write == 0, placed(record_.back(), forward_)});
    Expr in_state = number < layout_.elements();
    Expr element = clamp(number, 0, layout_.elements() - 1);
    Expr kept = kept_ + slot * layout_.elements() + element;
    result.push_back({is(Action::Store), in_state, {kept, all_values(element)}});
    result.push_back({is(Action::Restore), in_state, {element, all_values(kept)}});
    return result;
  }
  Expr has_run(const Substitution& places) const {
    return c_.domain.predicate.defined() ? placed(c_.domain.predicate, places) : const_true();
  }

  static Branch one_of(const std::vector<Branch>& branches) {
    Branch all = branches.back();
    for (size_t i = branches.size() - 1; i-- > 0;) {
      const Branch& b = branches[i];
      all.runs = choose(b.is_chosen, b.runs, all.runs);
      all.write = choose(b.is_chosen, b.write, all.write);
    }
    return all;
  }
  Write chosen(const std::vector<Write>& writes, const Expr& write,
               const Substitution& places) const {
    Write result = placed(writes.back(), places);
    for (size_t i = writes.size() - 1; i-- > 0;)
      result = choose(write == static_cast<int>(i), placed(writes[i], places), result);
    return result;
  }
  static Expr entry(const Buffer<int>& table, int column, const Expr& row) {
    auto p = table.parameter();
    return call_image(p->name, p->type, {Expr(column), row}, SymbolRef(p));
  }
  // Actions differ in what they cost: only the one at hand is evaluated.
  static Expr choose(const Expr& condition, const Expr& a, const Expr& b) {
    return equal(a, b) ? a : call_op(Op::if_then_else, a.type(), {condition, a, b});
  }
  static Write choose(const Expr& condition, const Write& a, const Write& b) {
    Write result{choose(condition, a.place, b.place), {}};
    for (size_t k = 0; k < a.values.size(); ++k)
      result.values.push_back(choose(condition, a.values[k], b.values[k]));
    return result;
  }
  Expr placed(const Expr& e, const Substitution& places) const {
    return with_values(substitute(e, places), c_.query.f, {});
  }
  Write placed(const Write& w, const Substitution& places) const {
    Write result{placed(w.place, places), {}};
    for (const Expr& v : w.values) result.values.push_back(placed(v, places));
    return result;
  }

  // ---- what others see ----

  void note_work() {
    std::vector<Expr> inner;
    for (const ReductionVariable& r : plan_.inner) inner.push_back(r.extent);
    auto note = [&](const std::vector<Write>& writes, Action action, std::vector<Expr> loops) {
      AdjointWork work{{}, std::move(loops)};
      work.loops.emplace_back(count_rows(table_, action));
      for (const Write& w : writes) {
        work.values.push_back(redirect_calls(w.place, machine_, machine_, true));
        for (const Expr& v : w.values)
          work.values.push_back(redirect_calls(v, machine_, machine_, true));
      }
      machine_->work.push_back(std::move(work));
    };
    note(adjoint_, Action::Adjoint, inner);
    if (!needs_values()) return;
    note(record_, Action::Record, inner);
    note({record_.back()}, Action::Advance, inner);
    Write copy{make_zero(Int(32)), all_values(layout_.slot())};
    note({copy}, Action::Store, {layout_.elements()});
    note({copy}, Action::Restore, {layout_.elements()});
  }

  void hand_over() {
    std::vector<Expr> before;
    Expr inside = layout_.is_inside(c_.point);
    for (size_t k = 0; k < plan_.types.size(); ++k) {
      Expr a = f_->types[k].is_float() ? adjoint_at(adjoint_slot(layout_.slot_of(c_.point)), k)
                                       : make_zero(c_.query.target.types[k]);
      before.push_back(make_select(inside, a, make_zero(a.type())));
    }
    result_.previous = make_adjoint(c_.query.target, name_before(*f_, c_.query.stage), {}, before);
    for (const CheckpointPlan::Given& g : plan_.given) {
      Expr slot = given_slot(g), sum = sum_at(slot);
      if (g.compensated) sum = sum + sum_at(slot + 1);
      result_.given.push_back({{g.leaf.leaf, cast_to(g.leaf.adjoint.type(), sum)},
                               g.over_time ? c_.domain : one_step()});
    }
    explain_schedule();
  }
  IterationDomain one_step() const {
    IterationDomain domain = c_.domain;
    std::erase_if(domain.vars, [&](const LoopVariable& v) { return v.name == plan_.time.var; });
    return domain;
  }

  void explain_schedule() {
    const auto& bytes = plan_.bytes_of_state;
    std::string kept = text(plan_.states, plan_.states == 1 ? " kept state" : " kept states",
                            bytes ? text(" of ", *bytes, " bytes") : std::string());
    std::string what = text("from ", kept, ", ", count_rows(table_, Action::Advance),
                            " steps computed again beside the ", plan_.steps, " that are reversed");
    if (!needs_values()) what = "no value of it is needed, none is kept";
    result_.explanations.push_back(
        {Explanation::Kind::Version, f_->name,
         text("update ", c_.query.stage - 1, " is a loop of ", plan_.steps, " steps that ",
              quoted(machine_->name), " runs backward: ", what)});
  }

  const UpdateContext& c_;
  FuncContents* f_;
  UpdateAdjoint& result_;
  TapeLayout layout_;
  std::shared_ptr<AdjointContents> machine_;
  CheckpointPlan plan_;
  Table table_;
  Expr at_hand_, noted_, kept_, size_;   // first slots, and their number
  std::vector<Write> record_, adjoint_;  // one iteration of a step, over its own variables
  Substitution forward_, backward_;      // the loop's variables for these
};

}  // namespace

bool wants_checkpoints(const UpdateContext& c) {
  if (!c.query.checkpoints.is_given() || c.definition.rvars.empty()) return false;
  auto steps = as_const_int(simplify(c.definition.rvars.back().extent));
  return !steps || *steps > 0;
}

void differentiate_by_checkpoints(const UpdateContext& context, UpdateAdjoint& result) {
  CheckpointedLoop(context, result).run();
}

}  // namespace retrograde::ir
