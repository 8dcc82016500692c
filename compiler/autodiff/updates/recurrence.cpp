// Adjoints of an update that overwrites elements, or carries values from element to element.
#include "autodiff/updates/recurrence.h"

#include <algorithm>

#include "autodiff/sums/carried_sums.h"
#include "autodiff/updates/self_reads.h"
#include "frontend/language/var.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

class Recurrence {
 public:
  Recurrence(const UpdateContext& context, UpdateAdjoint& result)
      : c_(context), f_(context.f), result_(result), relations_(c_.domain, c_.write, c_.pure) {}

  // Returns whether the update has one of the shapes; changes `result` only then.
  bool run() {
    if (!relations_.write_is_affine()) return false;
    if (!relations_.write_is_injective()) return last_writers();
    auto reads = find_self_reads(c_, relations_);
    if (!reads) return false;
    SweepResult sweep = c_.sweep_at_write(result_.current.func);
    mark(*reads, c_, sweep);
    bool has_recurrence = false;
    for (const SelfRead& r : *reads) has_recurrence |= r.carries_adjoint && !r.relation.never_new;
    if (has_recurrence && !find_order(*reads)) return false;
    Expr written = written_elements();
    if (!written.defined()) return false;
    if (!keep_needed_values(*reads, c_, relations_, result_)) return false;
    if (has_recurrence) {
      if (carries_long_sums(contributions(*reads, sweep, true))) {
        carry_in_double();
      } else {
        own_current();
      }
      sweep = c_.sweep_iterations(result_.current.func,
                                  [&] { return c_.adjoints_at_write(result_.current.func); });
      append_reverse_loop(contributions(*reads, sweep, true));
    }
    start_previous(written, contributions(*reads, sweep, false));
    result_.values = c_.values;
    result_.domains = {c_.domain};
    result_.keeps_steps = true;
    return true;
  }

 private:
  std::vector<Contribution> contributions(const std::vector<SelfRead>& reads,
                                          const SweepResult& sweep, bool to_new) const {
    return self_contributions(reads, c_, sweep, result_.self_values, to_new);
  }

  // Several iterations may write an element and none reads it, so only the last writer counts.
  bool last_writers() {
    if (c_.reads_self() || !relations_.predicate_is_affine()) return false;
    result_.values = c_.values;
    result_.domains = {restricted(c_.domain, relations_.last_writers())};
    start_previous(relations_.written(c_.point), {});
    return true;
  }

  // The recurrence extends the adjoint after the stage; if that one has consumers, a copy is extended.
  void own_current() {
    if (c_.query.extendable) return;
    result_.current =
        make_adjoint(c_.query.target, name_of_own(), {}, values_of(result_.current.func, c_.point));
  }

  std::string name_of_own() const { return text(f_->name, "_adj_update", c_.query.stage - 1); }

  // ---- what is carried from element to element ----

  bool carries_long_sums(const std::vector<Contribution>& contributions) const {
    const auto& types = c_.query.target.types;
    if (std::ranges::all_of(types, [](Type t) { return t.bits() == 64; })) return false;
    double elements = 1;  // each of which may depend on the one before
    for (const ReverseLoop& loop : order_) {
      if (!loop.carries) continue;
      const LoopVariable& range = c_.query.target.region[static_cast<size_t>(loop.dim)];
      auto extent = constant_extent(range.range());
      elements *= extent ? static_cast<double>(*extent) : many_carried;
    }
    return elements >= many_carried &&
           carries_sums(mapped(contributions, &Contribution::adjoint), result_.current.func.get());
  }

  void carry_in_double() {
    AdjointTarget wide = c_.query.target;
    std::ranges::fill(wide.types, Float(64));
    exact_ = make_adjoint(wide, name_of_own() + "_carried", {},
                          values_of(result_.current.func, c_.point))
                 .func;
    result_.current = make_adjoint(c_.query.target, name_of_own(), {}, values_of(exact_, c_.point));
    result_.current.helpers = {exact_};
    result_.current.accumulator = exact_;
    c_.note(": its adjoint carries long sums from element to element, in double", result_);
  }
  // The Func in which the recurrence runs.
  const FuncPtr& carrying() const { return exact_ ? exact_ : result_.current.func; }
  Expr as_carried(const Expr& term) const {
    return exact_ ? carried_in_double(term, result_.current.func, exact_) : term;
  }

  // Finds the order of p in A(p) += sum over reads of A(W(i)) dV/df. It runs against the order in which elements were
  // written.
  bool find_order(const std::vector<SelfRead>& reads) {
    if (!relations_.predicate_is_affine()) return false;
    std::vector<UpdateRelations::Read> relevant;
    std::vector<DomainPtr> sums;
    for (const SelfRead& r : reads) {
      if (!r.carries_adjoint || r.relation.never_new) continue;
      relevant.push_back(r.relation);
      // Several sums would have to run inside of one element, which is not supported.
      for (const Gather& g : inverted(c_, *as_call_of(r.call, f_), r.relation, true).gathers) {
        if (g.scatters) return false;
        if (g.rdom) sums.push_back(g.rdom);
      }
    }
    auto order = relations_.reverse_order(relevant);
    if (!order || sums.size() > 1) return false;
    order_ = *order;
    return true;
  }

  void append_reverse_loop(const std::vector<Contribution>& contributions) {
    const DomainPtr rdom = make_domain();
    Substitution place;
    // The variables of a sum run inside of the element.
    const Gather* summed = nullptr;
    for (const Contribution& c : contributions) {
      if (c.gather.rdom) summed = &c.gather;
    }
    Expr first = const_true();
    if (summed) {
      for (const ReductionVariable& r : summed->rdom->vars) {
        Expr v = add_loop(rdom, r.var, r.min, r.extent);
        place[r.var] = v;
        first = first && v == r.min;
      }
    }
    std::vector<Expr> lhs = reverse_place(rdom, place);
    std::vector<Expr> sums(c_.values.size());
    for (const Contribution& c : contributions) {
      Expr condition = element_condition(c.gather);
      if (c.gather.predicate.defined()) condition = condition && c.gather.predicate;
      condition = substitute(condition, place);
      if (summed && !c.gather.rdom) condition = condition && first;
      Expr term = as_carried(substitute(c.adjoint, place));
      term = make_select(condition, term, make_zero(term.type()));
      add_term(sums[static_cast<size_t>(c.component)], term);
    }
    append_sums(carrying(), lhs, sums, rdom->vars, {});
    result_.current.stages.push_back(Accumulation::Scatter);
    c_.note(" is a recurrence: its adjoint runs backward", result_);
  }

  // The current element of the reverse loops; adds it to `place`.
  std::vector<Expr> reverse_place(const DomainPtr& rdom, Substitution& place) const {
    std::vector<Expr> lhs = c_.point;
    for (const ReverseLoop& loop : order_) {
      size_t d = static_cast<size_t>(loop.dim);
      const LoopVariable& range = c_.query.target.region[d];
      Expr v = add_loop(rdom, "reverse", make_zero(Int(32)), extent_of(range.range()));
      lhs[d] = simplify(loop.descending ? range.max - v : range.min + v);
      place[f_->args[d]] = lhs[d];
    }
    return lhs;
  }

  // Whether the current element has the fixed indices of the gather.
  Expr element_condition(const Gather& g) const {
    Expr condition = const_true();
    for (size_t d = 0; d < g.lhs.size(); ++d) {
      if (!g.pure[d]) condition = condition && c_.point[d] == g.lhs[d];
    }
    return condition;
  }

  // The adjoint before the stage: 0 where the stage writes, plus the contributions of reads of older values. Values of
  // a Tuple that the stage does not change keep their adjoint.
  void start_previous(const Expr& written, const std::vector<Contribution>& contributions) {
    std::vector<Expr> initial = values_of(result_.current.func, c_.point);
    for (Expr& a : initial) a = make_select(simplify(written), make_zero(a.type()), a);
    result_.previous = c_.adjoint_before(initial, contributions);
  }

  // The condition, over `point`, under which the stage writes an element; undefined if unknown. Under a data-dependent
  // predicate these are the elements for which the predicate of their only iteration holds.
  Expr written_elements() const {
    if (relations_.predicate_is_affine()) return relations_.written(c_.point);
    Expr written = const_false();
    AccessQuery query{c_.domain, c_.write, c_.query.target.args, c_.query.target.region};
    for (const Gather& g : invert_access(query).gathers) {
      if (g.scatters || g.rdom) return {};
      Expr condition = element_condition(g);
      if (g.predicate.defined()) condition = condition && g.predicate;
      written = written || condition;
    }
    return written;
  }

  const UpdateContext& c_;
  FuncContents* f_;
  UpdateAdjoint& result_;
  UpdateRelations relations_;
  std::vector<ReverseLoop> order_;
  FuncPtr exact_;  // the sum in double that the current adjoint rounds; null: the adjoint itself
};

}  // namespace

bool differentiate_recurrence(const UpdateContext& context, UpdateAdjoint& result) {
  return Recurrence(context, result).run();
}

}  // namespace retrograde::autodiff
