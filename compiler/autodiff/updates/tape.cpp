#include "autodiff/updates/tape.h"

#include "autodiff/sweeps/local_derivative.h"
#include "autodiff/updates/self_reads.h"
#include "autodiff/updates/tape_layout.h"
#include "autodiff/updates/versions.h"
#include "diagnostics/error.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "graph/function.h"
#include "ir/build.h"

namespace retrograde::autodiff {

namespace {

class Tape {
 public:
  Tape(const UpdateContext& context, UpdateAdjoint& result)
      : c_(context),
        f_(context.f),
        result_(result),
        layout_(context),
        now_(iteration_number(context.definition.rvars)),
        iterations_(iteration_count(context.definition.rvars)) {}

  void run() {
    check_slots(1);
    begin_adjoint();
    seeds_ = saved_seeds();
    SweepResult sweep = c_.sweep_iterations(adjoint_, [&] { return seeds_; });
    find_needed(sweep);
    if (!needed_.empty()) keep_values();
    append_reverse(sweep);
    hand_over();
  }

 private:
  void check_slots(int an_iteration) const {
    double kept = least_iterations(c_.definition.rvars) * an_iteration;
    check_numbers(c_, layout_.least_elements() + kept, "the slots of a tape");
  }

  // The adjoint on the tape. It is exactly 0 for elements that are never read and for those that were overwritten,
  // hence masked.
  void begin_adjoint() {
    adjoint_ = begin_tape(f_->name + "_adj_tape", result_.current.func);
    adjoint_->made->traits.masked = true;
  }

  // A tape that starts with the elements of `from` and 0 in all other slots.
  FuncPtr begin_tape(const std::string& name, const FuncPtr& from) const {
    FuncPtr tape = make_func(Role::Tape, name, f_->name);
    const DomainPtr domain = make_domain();
    const Expr number = add_loop(domain, "element", make_zero(Int(32)), layout_.elements());
    define_pure(tape, layout_.with_pure(layout_.slot()), mapped(from->types, make_zero));
    append_update(tape, layout_.with_pure(number), values_of(from, layout_.element(number)),
                  domain->vars, {});
    return tape;
  }

  // Value k of `tape` in a slot.
  Expr at(const FuncPtr& tape, const Expr& slot, size_t k) const {
    return call_value(tape, layout_.with_pure(slot), static_cast<int>(k));
  }

  // a(i) of the current iteration.
  std::vector<Expr> saved_seeds() const {
    return c_.adjoints_at(adjoint_, layout_.with_pure(layout_.elements() + now_));
  }

  // ---- kept values ----

  // Finds the needed reads whose values are lost.
  void find_needed(const SweepResult& sweep) {
    FinalValues finals(c_);
    for (const Expr& read : c_.needed_reads(sweep)) {
      if (!finals.contains(read)) needed_.push_back(read);
    }
  }

  // Builds f_tape, which runs the update again and records the values that it reads.
  void keep_values() {
    c_.check_versions_are_kept(needed_.front());
    FuncPtr before = clone_prefix(c_.query.f, c_.query.stage);
    FuncPtr tape = begin_tape(f_->name + "_tape", before);

    std::vector<std::vector<Expr>> places;
    std::vector<SlotWrite> steps;
    for (const Expr& read : needed_)
      kept_at_.push_back(static_cast<int>(place_number(places, as_call_of(read, f_)->args)));
    int width = static_cast<int>(places.size());
    check_slots(width);
    auto kept_slot = [&](int i) { return layout_.elements() + now_ * width + i; };
    for (int i = 0; i < width; ++i) {
      Expr from = on_tape(layout_.slot_of(places[static_cast<size_t>(i)]), tape);
      steps.push_back({kept_slot(i), all_values(tape, from)});
    }
    steps.push_back(write_step(tape));
    append_steps(tape, steps, {}, c_.domain.predicate);
    c_.take_room(tape, slots_of(width), result_);
    for (size_t i = 0; i < needed_.size(); ++i) {
      const Call* call = as_call_of(needed_[i], f_);
      result_.self_values[needed_[i]] =
          at(tape, kept_slot(kept_at_[i]), static_cast<size_t>(call->component));
    }
    append(result_.helpers, {before, tape});
    explain_kept(tape, width);
  }

  // Extents of the tape: the pure dimensions, then the slots.
  std::vector<Expr> slots_of(int width) const {
    std::vector<Expr> extents;
    const std::vector<Expr> all = c_.extents();
    for (size_t d = 0; d < all.size(); ++d) {
      if (c_.pure[d]) extents.push_back(all[d]);
    }
    extents.push_back(layout_.elements() + iterations_ * width);
    return extents;
  }

  void explain_kept(const FuncPtr& tape, int width) {
    c_.note(text(" overwrites values that its partials need: ", quoted(tape->name), " keeps ",
                 width, width == 1 ? " place" : " places", " of ", total_bytes(f_->types),
                 " bytes in each iteration"),
            result_);
  }

  // Redirects reads of f to its elements on the tape.
  Expr on_tape(const Expr& e, const FuncPtr& tape) const {
    return map_calls_of(e, f_, [&](const Call& call, const std::vector<Expr>& args) {
      return at(tape, layout_.slot_of(args), static_cast<size_t>(call.component));
    });
  }
  std::vector<Expr> all_values(const FuncPtr& tape, const Expr& slot) const {
    return values_of(tape, layout_.with_pure(slot));
  }

  SlotWrite write_step(const FuncPtr& tape) const {
    SlotWrite step{on_tape(layout_.slot_of(c_.write), tape), {}};
    Expr inside = on_tape(layout_.is_inside(c_.write), tape);
    for (size_t k = 0; k < f_->types.size(); ++k) {
      Expr value = on_tape(c_.values[k], tape);
      step.values.push_back(make_select(inside, value, at(tape, step.place, k)));
    }
    return step;
  }

  // ---- the reverse loop ----

  void append_reverse(const SweepResult& sweep) {
    Expr written = layout_.slot_of(c_.write);
    std::vector<SlotWrite> steps{{layout_.elements() + now_, all_values(adjoint_, written)}};
    steps.push_back({written, {}});
    for (size_t k = 0; k < f_->types.size(); ++k)
      steps[1].values.push_back(make_zero(c_.query.target.types[k]));
    std::vector<std::vector<Expr>> places{c_.write};  // places of the steps after the first
    for (const LeafAdjoint& leaf : sweep.leaves) {
      const Call* call = as_call_of(leaf.leaf, f_);
      if (!call) continue;
      const size_t i = place_number(places, call->args) + 1;
      if (i == steps.size()) {
        Expr slot = layout_.slot_of(call->args);
        steps.push_back({slot, all_values(adjoint_, slot)});
      }
      Expr& value = steps[i].values[static_cast<size_t>(call->component)];
      Expr inside = layout_.is_inside(call->args);
      Expr term = cast_to(value.type(), leaf.adjoint);
      value = value + make_select(inside, term, make_zero(term.type()));
    }
    Expr predicate = layout_.is_inside(c_.write);
    if (c_.domain.predicate.defined()) predicate = c_.domain.predicate && predicate;
    append_steps(adjoint_, steps, mirrored(c_.definition.rvars), predicate);
  }

  // Appends one update: step s of an iteration writes its values to its place.
  void append_steps(const FuncPtr& tape, const std::vector<SlotWrite>& steps,
                    const Substitution& reversed, const Expr& predicate) {
    const DomainPtr domain = make_domain();
    int count = static_cast<int>(steps.size());
    Expr step = add_loop(domain, "step", make_zero(Int(32)), make_const(Int(32), count));
    const Substitution names = add_copies(domain, c_.definition.rvars);
    auto here = [&](const Expr& e) {
      Expr order = reversed.empty() ? e : substitute(e, reversed);
      return with_values(substitute(order, names), c_.query.f, {});
    };
    auto chosen = [&](const std::function<Expr(const SlotWrite&)>& part) {
      Expr result = part(steps.back());
      for (int s = count - 2; s >= 0; --s)
        result = choose_step(step == s, part(steps[static_cast<size_t>(s)]), result);
      return here(kept(result));
    };
    std::vector<Expr> values;
    for (size_t k = 0; k < f_->types.size(); ++k) {
      Type type = tape->types[k];
      values.push_back(chosen([&](const SlotWrite& s) { return cast_to(type, s.values[k]); }));
    }
    Expr place = chosen([](const SlotWrite& s) { return s.place; });
    append_update(tape, layout_.with_pure(place), values, domain->vars,
                  predicate.defined() ? here(kept(predicate)) : Expr());
    tape->made->work = {work_of(steps, tape,
                                mapped(c_.definition.rvars, &ReductionVariable::extent),
                                [&](const Expr& e) { return kept(e); })};
  }
  Expr kept(const Expr& e) const { return replaced(e, result_.self_values); }

  // ---- what others see ----

  void hand_over() {
    std::vector<Expr> before;
    Expr inside = layout_.is_inside(c_.point);
    for (size_t k = 0; k < f_->types.size(); ++k) {
      Expr a = at(adjoint_, layout_.slot_of(c_.point), k);
      before.push_back(make_select(inside, a, make_zero(a.type())));
    }
    c_.hand_over(adjoint_, seeds_, before, result_);
    Expr& predicate = result_.domains[0].predicate;
    predicate = with_values(predicate, c_.query.f, result_.self_values);
    c_.note(text(" is run backward iteration by iteration: ", quoted(adjoint_->name),
                 " keeps the adjoint of each iteration"),
            result_);
  }

  const UpdateContext& c_;
  FuncContents* f_;
  UpdateAdjoint& result_;
  TapeLayout layout_;
  Expr now_, iterations_;  // number of the current iteration; number of iterations
  FuncPtr adjoint_;
  std::vector<Expr> seeds_;
  std::vector<Expr> needed_;  // reads of f whose values are kept, inner reads first
  std::vector<int> kept_at_;  // for each of needed_: its place within an iteration
};

}  // namespace

void differentiate_by_tape(const UpdateContext& context, UpdateAdjoint& result) {
  Tape(context, result).run();
}

}  // namespace retrograde::autodiff
