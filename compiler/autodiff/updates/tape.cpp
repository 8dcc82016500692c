#include "autodiff/updates/tape.h"

#include <algorithm>

#include "autodiff/sweeps/local_derivative.h"
#include "autodiff/updates/recurrence.h"
#include "autodiff/updates/tape_layout.h"
#include "autodiff/updates/versions.h"
#include "diagnostics/error.h"
#include "frontend/language/var.h"
#include "graph/define.h"
#include "graph/function.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

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

  // Its elements outside of what is read, and those that were overwritten, are exactly 0.
  void begin_adjoint() {
    adjoint_ = begin_tape(f_->name + "_adj_tape", result_.current.func);
    adjoint_->made->traits.masked = true;
  }

  // A tape whose elements are those of `from`, and whose other slots are 0.
  FuncPtr begin_tape(const std::string& name, const FuncPtr& from) const {
    FuncPtr tape = make_func(Role::Tape);
    tape->made->of = f_->name;
    tape->name = claim_name(name);
    auto rdom = std::make_shared<ReductionDomainContents>();
    rdom->frozen = true;
    rdom->vars.push_back({unique_name("element"), make_zero(Int(32)), layout_.elements()});
    const Expr number = variable(rdom->vars[0].var, Int(32), SymbolRef(rdom));
    std::vector<Expr> zeros, values;
    for (size_t k = 0; k < f_->types.size(); ++k) {
      values.push_back(call_value(from, layout_.element(number), static_cast<int>(k)));
      zeros.push_back(make_zero(values.back().type()));
    }
    define_pure(tape, layout_.with_pure(layout_.slot()), zeros);
    append_update(tape, layout_.with_pure(number), values, rdom->vars, {});
    return tape;
  }

  // Value k of `tape` in slot s.
  Expr at(const FuncPtr& tape, const Expr& slot, size_t k) const {
    return call_value(tape, layout_.with_pure(slot), static_cast<int>(k));
  }

  // a(i), for the iteration at hand.
  std::vector<Expr> saved_seeds() const {
    std::vector<Expr> seeds;
    for (size_t k = 0; k < f_->types.size(); ++k) {
      seeds.push_back(f_->types[k].is_float() ? at(adjoint_, layout_.elements() + now_, k)
                                              : Expr());
    }
    return seeds;
  }

  // ---- kept values ----

  // Of the reads that are needed those whose value is lost.
  void find_needed(const SweepResult& sweep) {
    FinalValues finals(c_);
    for (const Expr& read : c_.needed_reads(sweep)) {
      if (!finals.contains(read)) needed_.push_back(read);
    }
  }

  // f_tape runs the update again and records what it reads.
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
    result_.helpers.push_back(before);
    result_.helpers.push_back(tape);
    explain_kept(tape, width);
  }

  // Extents of the tape: those of the pure dimensions, then slots.
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
    int bytes = 0;
    for (Type t : f_->types) bytes += t.bytes();
    explain(text("update ", c_.query.stage - 1, " overwrites values that its partials need: ",
                 quoted(tape->name), " keeps ", width, width == 1 ? " place" : " places", " of ",
                 bytes, " bytes in each iteration"));
  }

  // Reads of f become reads of its elements on the tape.
  Expr on_tape(const Expr& e, const FuncPtr& tape) const {
    return map_calls_of(e, f_, [&](const Call& call, const std::vector<Expr>& args) {
      return at(tape, layout_.slot_of(args), static_cast<size_t>(call.component));
    });
  }
  std::vector<Expr> all_values(const FuncPtr& tape, const Expr& slot) const {
    std::vector<Expr> values;
    for (size_t k = 0; k < f_->types.size(); ++k) values.push_back(at(tape, slot, k));
    return values;
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
    std::vector<std::vector<Expr>> places{c_.write};  // of the steps after the first
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
    Substitution reversed;
    for (const ReductionVariable& r : c_.definition.rvars)
      reversed[r.var] = mirrored(r, variable(r.var));
    Expr predicate = layout_.is_inside(c_.write);
    if (c_.domain.predicate.defined()) predicate = c_.domain.predicate && predicate;
    append_steps(adjoint_, steps, reversed, predicate);
  }

  // One update: in step s of an iteration, step s's place gets its values.
  void append_steps(const FuncPtr& tape, const std::vector<SlotWrite>& steps,
                    const Substitution& reversed, const Expr& predicate) {
    auto rdom = std::make_shared<ReductionDomainContents>();
    rdom->frozen = true;
    int count = static_cast<int>(steps.size());
    rdom->vars.push_back({unique_name("step"), make_zero(Int(32)), make_const(Int(32), count)});
    Expr step = variable(rdom->vars[0].var, Int(32), SymbolRef(rdom));
    const Substitution names = add_copies(rdom, c_.definition.rvars);
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
    append_update(tape, layout_.with_pure(place), values, rdom->vars,
                  predicate.defined() ? here(kept(predicate)) : Expr());
    std::vector<Expr> loops;
    for (const ReductionVariable& r : c_.definition.rvars) loops.push_back(r.extent);
    tape->made->work = {
        work_of(steps, tape, std::move(loops), [&](const Expr& e) { return kept(e); })};
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
    result_.previous = make_adjoint(c_.query.target, name_before(*f_, c_.query.stage), {}, before);
    result_.helpers.push_back(adjoint_);
    result_.values = c_.values;
    result_.keeps_steps = true;
    result_.seeds = seeds_;
    IterationDomain domain = c_.domain;
    if (domain.predicate.defined())
      domain.predicate = with_values(domain.predicate, c_.query.f, result_.self_values);
    result_.domains = {domain};
    explain(text("update ", c_.query.stage - 1, " is run backward one iteration after the other: ",
                 quoted(adjoint_->name), " keeps the adjoint of each"));
  }

  void explain(const std::string& detail) {
    result_.explanations.push_back({Explanation::Kind::Version, f_->name, detail});
  }

  const UpdateContext& c_;
  FuncContents* f_;
  UpdateAdjoint& result_;
  TapeLayout layout_;
  Expr now_, iterations_;  // number of the iteration, and how many there are
  FuncPtr adjoint_;
  std::vector<Expr> seeds_;
  std::vector<Expr> needed_;  // reads of f whose values are kept, inner ones first
  std::vector<int> kept_at_;  // of each
};

}  // namespace

void differentiate_by_tape(const UpdateContext& context, UpdateAdjoint& result) {
  Tape(context, result).run();
}

}  // namespace retrograde::ir
