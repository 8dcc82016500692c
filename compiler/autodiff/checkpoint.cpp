#include "autodiff/checkpoint.h"

#include <algorithm>
#include <set>

#include "autodiff/adjoint_contents.h"
#include "autodiff/revolve.h"
#include "autodiff/tape_layout.h"
#include "autodiff/versions.h"
#include "diagnostics/error.h"
#include "frontend/buffer.h"
#include "frontend/define.h"
#include "ir/build.h"
#include "ir/print.h"
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

constexpr int64_t most_actions = int64_t{1} << 24;

int64_t rows_of(int64_t steps, int64_t states) {
  return revolve_advances(steps, states) + 2 * steps + 2 * steps;
}

Buffer<int> table_of(const std::vector<RevolveAction>& actions) {
  std::vector<std::array<int, 3>> rows;
  auto add = [&](Action a, int step, int slot) {
    rows.push_back({static_cast<int>(a), step, std::max(slot, 0)});
  };
  for (const RevolveAction& a : actions) {
    switch (a.kind) {
      case RevolveAction::Kind::Store:
        add(Action::Store, a.step, a.slot);
        break;
      case RevolveAction::Kind::Restore:
        add(Action::Restore, a.step, a.slot);
        break;
      case RevolveAction::Kind::Advance:
        add(Action::Advance, a.step, a.slot);
        break;
      case RevolveAction::Kind::Reverse:
        add(Action::Record, a.step, a.slot);
        add(Action::Adjoint, a.step, a.slot);
        break;
    }
  }
  Buffer<int> table(3, static_cast<int>(rows.size()));
  for (size_t i = 0; i < rows.size(); ++i) {
    for (int c = 0; c < 3; ++c) table(c, static_cast<int>(i)) = rows[i][static_cast<size_t>(c)];
  }
  return table;
}

class CheckpointedLoop {
 public:
  CheckpointedLoop(const UpdateContext& context, UpdateAdjoint& result)
      : c_(context),
        f_(context.f),
        result_(result),
        layout_(context),
        time_(c_.definition.rvars.back()),
        inner_(c_.definition.rvars.begin(), c_.definition.rvars.end() - 1),
        inner_count_(iteration_count(inner_)) {}

  void run() {
    steps_ = number_of_steps();
    machine_ = std::make_shared<AdjointContents>();
    machine_->name = claim_name(f_->name + "_checkpoints");
    sweep_and_plan();
    states_ = number_of_states();
    actions_ = revolve_actions();
    lay_out();
    define_machine();
    append_loop();
    hand_over();
  }

 private:
  // ---- the budget ----

  int number_of_steps() const {
    auto n = as_const_int(simplify(time_.extent));
    if (!n || *n > most_actions) {
      user_error(c_.asked(), "a loop that is checkpointed has a constant number of steps",
                 text("the extent of ", quoted(time_.var), ", its outermost loop, is ",
                      print(simplify(time_.extent))),
                 "Make it a constant, or leave out the budget and pass "
                 "AdjointOptions{.overwritten = Overwritten::Store}");
    }
    return static_cast<int>(*n);
  }

  int number_of_states() const {
    int64_t states = c_.query.checkpoints.states;
    if (c_.query.checkpoints.bytes > 0) states = states_in_bytes(c_.query.checkpoints.bytes);
    states = std::min<int64_t>(states, steps_);
    if (!needed_.empty() && rows_of(steps_, states) > most_actions) {
      user_error(c_.asked(), text("a schedule has at most ", most_actions, " actions"),
                 text(steps_, " steps with room for ", states,
                      states == 1 ? " state compute " : " states compute ",
                      revolve_advances(steps_, states), " steps again"),
                 "Give a larger budget: AdjointOptions::checkpoint_states");
    }
    return static_cast<int>(states);
  }

  // Of all elements of the pure dimensions; undefined while an extent is not constant.
  std::optional<int64_t> bytes_of_state() const {
    auto elements = as_const_int(layout_.elements());
    if (!elements) return std::nullopt;
    int64_t bytes = *elements;
    const Box& box = c_.query.regions.of(f_);
    for (size_t d = 0; d < c_.pure.size(); ++d) {
      if (!c_.pure[d]) continue;
      auto extent =
          box[d].is_bounded() ? as_const_int(simplify(box[d].max - box[d].min + 1)) : std::nullopt;
      if (!extent) return std::nullopt;
      bytes *= *extent;
    }
    int width = 0;
    for (Type t : types_) width += t.bytes();
    return bytes * width;
  }

  int64_t states_in_bytes(int64_t budget) const {
    auto bytes = bytes_of_state();
    if (!bytes) {
      user_error(c_.asked(), "a budget in bytes needs to know the size of a state",
                 text("an extent of ", quoted(f_->name), " is known at run time only"),
                 "Give a number of states: AdjointOptions::checkpoint_states");
    }
    if (*bytes > budget) {
      user_error(
          c_.asked(), "the budget must have room for one state, the first",
          text("a state of ", quoted(f_->name), " has ", *bytes, " bytes, the budget is ", budget),
          text("Give at least ", *bytes, " bytes"));
    }
    return budget / *bytes;
  }

  std::vector<RevolveAction> revolve_actions() const {
    if (!needed_.empty()) return revolve_schedule(steps_, states_);
    std::vector<RevolveAction> reversals;  // no value is needed: none is computed again
    for (int step = steps_ - 1; step >= 0; --step)
      reversals.push_back({RevolveAction::Kind::Reverse, step});
    return reversals;
  }

  // ---- what a step needs and gives ----

  // Sums, or single values, of what iterations contribute at one place of another Func or image.
  struct Given {
    LeafAdjoint leaf;
    bool over_time = false;  // one value for each iteration of each step
    Expr start;              // first slot
  };

  void sweep_and_plan() {
    choose_types({});
    // Values of a step pass through the adjoints of later ones: what masks or blows up one of them
    // may do so to all.
    auto& traits = machine_->traits;
    if (auto* current = dynamic_cast<AdjointContents*>(result_.current.func.get()))
      traits.add(current->traits);
    traits.masked = true;
    bool singular = false;
    SweepResult sweep;
    do {
      singular = traits.singular;
      sweep = c_.sweep(seeds());
      for (const LeafAdjoint& leaf : sweep.leaves)
        traits.singular |= traits_of(leaf.adjoint).singular;
    } while (traits.singular != singular);
    choose_types(sweep.leaves);
    sweep = c_.sweep(seeds());
    for (const LeafAdjoint& leaf : sweep.leaves) {
      if (as_call_of(leaf.leaf, f_)) {
        passed_on_.push_back(leaf);
      } else {
        plan_given(leaf);
      }
    }
    find_needed(sweep);
  }

  // The machine holds f's values exactly, and adjoints: its floating-point types are those of the
  // adjoints, the first as wide as anything that is summed.
  void choose_types(const std::vector<LeafAdjoint>& leaves) {
    types_.clear();
    machine_->types.clear();
    for (size_t k = 0; k < f_->types.size(); ++k) {
      bool floating = f_->types[k].is_float();
      if (floating && sum_value_ < 0) sum_value_ = static_cast<int>(k);
      types_.push_back(floating ? c_.query.target.types[k] : f_->types[k]);
    }
    Type& widest = types_[static_cast<size_t>(sum_value_)];
    for (const LeafAdjoint& leaf : leaves) {
      if (leaf.adjoint.type().bits() > widest.bits()) widest = leaf.adjoint.type();
    }
    machine_->types = types_;
  }

  void plan_given(const LeafAdjoint& leaf) {
    bool over_time = c_.domain.predicate.defined() && uses_variable(c_.domain.predicate, time_.var);
    for_each_child(leaf.leaf, [&](const Expr& index) {
      over_time |= uses_variable(index, time_.var);
      if (!calls(index, f_)) return;
      unsupported(
          c_.asked(), "a checkpointed loop forgets the values that its steps saw",
          text("where ", print(leaf.leaf), " is read depends on values of ", quoted(f_->name)),
          "Leave out the budget and pass AdjointOptions{.overwritten = "
          "Overwritten::Store}");
    });
    given_.push_back({leaf, over_time, {}});
  }

  void find_needed(const SweepResult& sweep) {
    std::set<Expr, StructuralLess> found;
    auto need = [&](const Expr& e) {
      walk(e, [&](const Expr& node) {
        if (as_call_of(node, f_)) found.insert(node);
        return true;
      });
    };
    for (const LeafAdjoint& leaf : sweep.leaves) {
      need(leaf.adjoint);
      for_each_child(leaf.leaf, need);
    }
    for (const Expr& w : c_.write) need(w);
    for (const Expr& read : c_.self_reads()) {  // inner ones first
      if (!found.contains(read)) continue;
      needed_.push_back(read);
      const Call* call = as_call_of(read, f_);
      auto known = std::find_if(places_.begin(), places_.end(),
                                [&](const auto& p) { return same_args(p, call->args); });
      if (known == places_.end()) known = places_.insert(places_.end(), call->args);
      kept_at_.push_back(static_cast<int>(known - places_.begin()));
    }
  }

  // ---- slots ----

  void lay_out() {
    Expr next = layout_.elements() * 2;
    a_ = simplify(next);
    noted_ = simplify(a_ + 1);
    next = noted_ + inner_count_ * static_cast<int>(places_.size());
    for (Given& g : given_) {
      g.start = simplify(next);
      next = next + (g.over_time ? inner_count_ * steps_ : inner_count_);
    }
    kept_ = simplify(next);
    int kept_states = needed_.empty() ? 0 : states_;
    size_ = simplify(kept_ + layout_.elements() * kept_states);
  }
  Expr adjoint_slot(const Expr& element) const { return element + layout_.elements(); }

  Expr at(const Expr& slot, size_t k) const {
    return call_value(machine_, layout_.with_pure(slot), static_cast<int>(k));
  }
  // The value of f, and its adjoint, that the slot holds.
  Expr value_at(const Expr& slot, size_t k) const { return cast_to(f_->types[k], at(slot, k)); }
  Expr adjoint_at(const Expr& slot, size_t k) const {
    return cast_to(c_.query.target.types[k], at(slot, k));
  }
  std::vector<Expr> all_values(const Expr& slot) const {
    std::vector<Expr> values;
    for (size_t k = 0; k < types_.size(); ++k) values.push_back(at(slot, k));
    return values;
  }
  // Adjoints of the values that the iteration at hand wrote. Before the machine is defined they
  // stand at slot 0: only the sweep's shape counts then.
  std::vector<Expr> seeds() const {
    std::vector<Expr> result;
    for (size_t k = 0; k < types_.size(); ++k) {
      Expr slot = variable(a_name_);
      result.push_back(f_->types[k].is_float() ? adjoint_at(slot, k) : Expr());
    }
    return result;
  }

  void define_machine() {
    FuncPtr before = clone_prefix(c_.query.f, c_.query.stage);
    Expr slot = layout_.slot(), elements = layout_.elements();
    std::vector<Expr> initial;
    for (size_t k = 0; k < types_.size(); ++k) {
      Expr zero = make_zero(types_[k]), adjoint = zero;
      int index = static_cast<int>(k);
      if (f_->types[k].is_float()) {
        Expr a = call_value(result_.current.func, layout_.element(slot - elements), index);
        adjoint = make_select(slot < elements * 2, cast_to(types_[k], a), zero);
      }
      Expr value = cast_to(types_[k], call_value(before, layout_.element(slot), index));
      initial.push_back(make_select(slot < elements, value, adjoint));
    }
    machine_->types.clear();  // the definition says them again
    define_pure(machine_, layout_.with_pure(slot), initial);
    result_.helpers.push_back(before);
    result_.helpers.push_back(machine_);
  }

  // ---- the loop over actions ----

  void append_loop() {
    Buffer<int> table = table_of(actions_);
    auto rdom = std::make_shared<ReductionDomainContents>();
    rdom->frozen = true;
    std::vector<Write> record = record_writes(), adjoint = adjoint_writes();
    Expr width = make_const(Int(32), static_cast<int>(std::max(record.size(), adjoint.size())));
    if (!needed_.empty())  // copies go through the same loops
      width = simplify(
          max(width, (layout_.elements() + inner_count_ - 1) / max(inner_count_, Expr(1))));
    Substitution forward, backward;
    auto add = [&](const std::string& name, const Expr& min, const Expr& extent) {
      rdom->vars.push_back({unique_name(name), min, extent});
      return [rdom, i = rdom->vars.size() - 1] {
        return variable(rdom->vars[i].var, Int(32), SymbolRef(rdom));
      };
    };
    Expr write = add("write", make_zero(Int(32)), width)();
    Expr number = make_zero(Int(32)), stride = width;  // of this pass through the inner loops
    for (const ReductionVariable& r : inner_) {
      Expr v = add(r.var, r.min, r.extent)();
      forward[r.var] = v;
      backward[r.var] = r.min + (r.min + (r.extent - 1) - v);
      number = number + (v - r.min) * stride;
      stride = stride * r.extent;
    }
    number = number + write;
    Expr row = add("action", make_zero(Int(32)), Expr(table.dim(1).extent()))();
    Expr kind = entry(table, 0, row);
    Expr step = clamp(entry(table, 1, row), 0, steps_ - 1);
    Expr slot = clamp(entry(table, 2, row), 0, std::max(states_ - 1, 0));
    forward[time_.var] = backward[time_.var] = time_.min + step;
    forward[a_name_] = backward[a_name_] = a_;

    auto is = [&](Action a) { return kind == static_cast<int>(a); };
    auto has_run = [&](const Substitution& places) {
      return c_.domain.predicate.defined() ? placed(c_.domain.predicate, places) : const_true();
    };
    Expr element = clamp(number, 0, layout_.elements() - 1);
    Expr kept_element = kept_ + slot * layout_.elements() + element;
    struct Branch {
      Expr condition, runs;
      Write write;
    };
    auto chosen = [&](const std::vector<Write>& writes, const Substitution& places) {
      Write result = placed(writes.back(), places);
      for (int i = static_cast<int>(writes.size()) - 2; i >= 0; --i)
        result = choose(write == i, placed(writes[static_cast<size_t>(i)], places), result);
      return result;
    };
    auto count = [](const std::vector<Write>& writes) { return static_cast<int>(writes.size()); };
    Expr backward_runs = has_run(backward) && placed(layout_.is_inside(c_.write), backward);
    std::vector<Branch> branches{
        {is(Action::Adjoint), backward_runs && write < count(adjoint), chosen(adjoint, backward)}};
    if (!needed_.empty()) {
      Write advance = placed(record.back(), forward);
      branches.push_back(
          {is(Action::Record), has_run(forward) && write < count(record), chosen(record, forward)});
      branches.push_back({is(Action::Advance), has_run(forward) && write == 0, advance});
      Expr in_state = number < layout_.elements();
      branches.push_back({is(Action::Store), in_state, {kept_element, all_values(element)}});
      branches.push_back({is(Action::Restore), in_state, {element, all_values(kept_element)}});
    } else {
      branches.push_back({const_true(), const_false(), branches[0].write});
    }
    Branch all = branches.back();
    for (size_t i = branches.size() - 1; i-- > 0;) {
      const Branch& b = branches[i];
      all.runs = choose(b.condition, b.runs, all.runs);
      all.write = choose(b.condition, b.write, all.write);
    }
    append_update(machine_, layout_.with_pure(clamp(all.write.place, 0, size_ - 1)),
                  all.write.values, rdom->vars, all.runs);
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
      for (size_t i = 0; i < needed_.size(); ++i) {
        if (!equal(needed_[i], node)) continue;
        const Call* call = as_call_of(node, f_);
        return value_at(note_slot(kept_at_[i]), static_cast<size_t>(call->value_index));
      }
      return map_children(node, recurse);
    });
  }
  Expr note_slot(int place) const {
    return noted_ + iteration_number(inner_) * static_cast<int>(places_.size()) + place;
  }

  // One iteration of the primal: the values that are needed later, then the write.
  std::vector<Write> record_writes() const {
    std::vector<Write> writes;
    for (size_t i = 0; i < places_.size(); ++i) {
      Expr from = in_state(layout_.slot_of(places_[i]));
      writes.push_back({note_slot(static_cast<int>(i)), all_values(from)});
    }
    Write last{in_state(layout_.slot_of(c_.write)), {}};
    Expr inside = in_state(layout_.is_inside(c_.write));
    for (size_t k = 0; k < types_.size(); ++k) {
      Expr value = cast_to(types_[k], in_state(c_.values[k]));
      last.values.push_back(make_select(inside, value, at(last.place, k)));
    }
    writes.push_back(last);
    return writes;
  }

  // One iteration backward: a = A[W]; A[W] = 0; A[R_k] += a dV/dv_k; then what others get.
  std::vector<Write> adjoint_writes() const {
    Expr written = adjoint_slot(noted(layout_.slot_of(c_.write)));
    std::vector<Write> writes{{a_, all_values(written)}, {written, {}}};
    for (Type t : types_) writes[1].values.push_back(make_zero(t));
    std::vector<std::vector<Expr>> places{c_.write};  // of the writes after the first
    for (const LeafAdjoint& leaf : passed_on_) {
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
      value = cast_to(types_[k], cast_to(type, value) + cast_to(type, term));
    }
    for (const Given& g : given_) writes.push_back(given_write(g));
    return writes;
  }
  Write given_write(const Given& g) const {
    Expr slot = given_slot(g);
    Write write{slot, all_values(slot)};
    Expr& sum = write.values[static_cast<size_t>(sum_value_)];
    Expr term = cast_to(sum.type(), noted(g.leaf.adjoint));
    sum = g.over_time ? term : sum + term;
    return write;
  }
  Expr given_slot(const Given& g) const {
    const auto& loops = g.over_time ? c_.definition.rvars : inner_;
    return g.start + iteration_number(loops);
  }

  // ---- what others see ----

  void hand_over() {
    std::vector<Expr> before;
    Expr inside = layout_.is_inside(c_.point);
    for (size_t k = 0; k < types_.size(); ++k) {
      Expr a = f_->types[k].is_float() ? adjoint_at(adjoint_slot(layout_.slot_of(c_.point)), k)
                                       : make_zero(c_.query.target.types[k]);
      before.push_back(make_select(inside, a, make_zero(a.type())));
    }
    result_.previous = make_adjoint(c_.query.target, name_before(*f_, c_.query.stage), {}, before);
    for (const Given& g : given_) {
      Expr sum = cast_to(g.leaf.adjoint.type(), at(given_slot(g), static_cast<size_t>(sum_value_)));
      result_.given.push_back({{g.leaf.leaf, sum}, g.over_time ? c_.domain : one_step()});
    }
    explain_schedule();
  }
  IterationDomain one_step() const {
    IterationDomain domain = c_.domain;
    std::erase_if(domain.vars, [&](const LoopVariable& v) { return v.name == time_.var; });
    return domain;
  }

  void explain_schedule() {
    auto bytes = bytes_of_state();
    std::string size = bytes ? text(" of ", *bytes, " bytes") : std::string();
    std::string what =
        needed_.empty() ? text("no value of it is needed, none is kept")
                        : text("from ", states_, states_ == 1 ? " kept state" : " kept states",
                               size, ", ", revolve_advances(steps_, states_),
                               " steps computed again beside the ", steps_, " that are reversed");
    result_.explanations.push_back(
        {Explanation::Kind::Version, f_->name,
         text("update ", c_.query.stage - 1, " is a loop of ", steps_, " steps that ",
              quoted(machine_->name), " runs backward: ", what)});
  }

  const UpdateContext& c_;
  FuncContents* f_;
  UpdateAdjoint& result_;
  TapeLayout layout_;
  const ReductionVariable& time_;
  std::vector<ReductionVariable> inner_;
  Expr inner_count_;
  int steps_ = 0, states_ = 0;
  std::shared_ptr<AdjointContents> machine_;
  std::vector<Type> types_;  // of the machine, one for each value of f
  int sum_value_ = -1;       // the value that sums use: the first of a floating-point type
  const std::string a_name_ = unique_name("adjoint_at_hand");
  std::vector<LeafAdjoint> passed_on_;     // to f itself
  std::vector<Given> given_;               // to others
  std::vector<Expr> needed_;               // reads of f that partials and places need, inner first
  std::vector<std::vector<Expr>> places_;  // the distinct places of those
  std::vector<int> kept_at_;               // of each needed read
  std::vector<RevolveAction> actions_;
  Expr a_, noted_, kept_, size_;  // first slots, and their number
};

}  // namespace

bool wants_checkpoints(const UpdateContext& c) {
  if (!c.query.checkpoints.is_given() || c.definition.rvars.empty()) return false;
  auto steps = as_const_int(simplify(c.definition.rvars.back().extent));
  return !steps || *steps > 1;
}

void differentiate_by_checkpoints(const UpdateContext& context, UpdateAdjoint& result) {
  CheckpointedLoop(context, result).run();
}

}  // namespace retrograde::ir
