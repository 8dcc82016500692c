#include "autodiff/sweeps/synthesis.h"

#include <algorithm>

#include "autodiff/inversion/read_inversions.h"
#include "autodiff/report/absent_gradients.h"
#include "autodiff/report/synthesis_account.h"
#include "autodiff/rules/derivative_rules.h"
#include "autodiff/sweeps/active_symbols.h"
#include "autodiff/sweeps/custom_rules.h"
#include "autodiff/sweeps/input_shape.h"
#include "autodiff/sweeps/passed_reads.h"
#include "autodiff/sweeps/reverse_sweep.h"
#include "autodiff/sweeps/shared_adjoints.h"
#include "autodiff/updates/update_context.h"
#include "autodiff/updates/versions.h"
#include "diagnostics/error.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/lists.h"
#include "ir/print.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

class Synthesis {
 public:
  Synthesis(const Seed& seed, const SynthesisOptions& options)
      : seed_(seed),
        options_(options),
        order_(topological_order({seed.output})),
        regions_(order_, seed.region),
        ranges_(order_),
        active_(seed.output, order_, options),
        versions_(options.versions) {}

  SynthesisResult run() {
    add_seed();
    for (auto f = order_.rbegin(); f != order_.rend(); ++f) {
      if (active_.contains(f->get())) differentiate(*f);
    }
    for (const auto& parameter : parameters_of({seed_.output})) finish_parameter(parameter);
    forget_covered();
    explain_absent({seed_.output, order_, options_, active_, covered_,
                    [&](const Symbol* symbol) { return target_of(symbol); }},
                   result_, account_);
    result_.output = {seed_.output, seed_.region};
    list_gradients();
    result_.explanations = account_.take();
    return std::move(result_);
  }

 private:
  // Derivatives come from definitions, or from a rule.
  void refuse_without_rule(const FuncContents& f) const {
    if (f.custom_derivatives) {
      unsupported(text("propagate adjoints through ", quoted(f.name)),
                  "a Func with a custom tangent needs a rule for adjoints, too",
                  "the output depends on it, and it has none: its definitions need not agree with "
                  "the rule",
                  "Give it a custom_adjoint");
    }
    unsupported(text("differentiate ", quoted(seed_.output->name)),
                "derivatives come from definitions",
                text("it depends on ", quoted(f.name), ", which the C function ",
                     quoted(f.extern_definition->function), " computes"),
                text("Give ", quoted(f.name),
                     " a custom_adjoint, leave its inputs out of what is "
                     "differentiated by, or differentiate what comes after it, with its values in "
                     "an ImageParam"));
  }

  // ---- contributions ----

  // Over the bounds that were given: updates of the output may reach further, where the seed is 0.
  void add_seed() {
    const FuncPtr& f = seed_.output;
    add_pointwise(f.get(), f->args, seed_.region, regions_.loop_variables(f.get(), f->args),
                  seed_.values);
  }

  // values(args), one for each value of the symbol, inside of a box; undefined ones are zero.
  // `read`: elements that anybody looks at; may be empty (unknown).
  void add_pointwise(const Symbol* symbol, const std::vector<std::string>& args, const Box& box,
                     const std::vector<LoopVariable>& read, const std::vector<Expr>& values) {
    passed_.close(symbol);
    AccessQuery query{{}, {}, args, read};
    for (size_t d = 0; d < args.size(); ++d)
      query.domain.vars.push_back({args[d], box[d].min, box[d].max});
    query.indices = variables_of(args);
    Inversion inversion = invert_access(query);
    for (size_t k = 0; k < values.size(); ++k) {
      if (!values[k].defined()) continue;
      for (const Gather& g : inversion.gathers)
        pending_[symbol].push_back({static_cast<int>(k), g, substitute(values[k], g.iteration)});
    }
  }

  AdjointTarget target_of(const Symbol* symbol) const {
    const auto* f = dynamic_cast<const FuncContents*>(symbol);
    const InputShape shape = shape_of(symbol);
    const std::vector<std::string> args = f ? f->args : implicit_names(shape.dimensions);
    return {shape.name, args, mapped(shape.types, adjoint_type),
            regions_.loop_variables(symbol, args)};
  }

  void differentiate(const FuncPtr& f) {
    auto found = pending_.find(f.get());
    if (found == pending_.end() || found->second.empty()) return;
    AdjointTarget target = target_of(f.get());
    AdjointFunc adjoint = make_adjoint(target, f->name + "_adj", found->second);
    bool extendable = true;  // nothing has read it yet
    record(*f, f->stage_count() - 1, adjoint);
    register_func(adjoint, f->name, target.region);
    if (f->custom_derivatives || f->is_extern()) {
      if (active_.is_passed_by(f.get())) contribute_by_rule(f, adjoint.func);
      return;
    }
    for (int s = f->stage_count() - 1; s >= 1; --s) {
      const int own_stages = adjoint.func->stage_count();
      UpdateAdjoint update = differentiate_update(
          {f, s, regions_, target, adjoint, extendable, versions_, options_.checkpoints,
           [&](const Expr& leaf) { return active_.contains(leaf); }, ranges_});
      if (adjoint.func->stage_count() > own_stages) keep_unextended(*f, s, adjoint, own_stages);
      if (update.current.func != adjoint.func)
        register_func(update.current, f->name, target.region);
      append(result_.funcs, update.helpers);
      std::vector<Expr> seeds =
          update.seeds.empty() ? adjoints_at_write(*f, s, update.current.func) : update.seeds;
      for (const IterationDomain& domain : update.domains)
        contribute_stage(f, update.values, seeds, domain, update.self_values, update.keeps_steps);
      for (const GivenAdjoint& g : update.given) {
        if (active_.contains(g.leaf.leaf)) add_contribution(f, g.leaf, g.domain);
      }
      account_.add(update.explanations);
      if (update.previous.func && is_zero_over(*update.previous.func, target.region)) {
        stop_at_update(*f, s, target);
        return;
      }
      if (update.previous.func) register_func(update.previous, f->name, target.region);
      adjoint = update.previous.func ? update.previous : update.current;
      extendable = update.previous.func != nullptr;
      record(*f, s - 1, adjoint);
    }
    if (!pass_on(*f)) contribute_pure(f, adjoint.func);
    pending_.erase(f.get());
  }

  // Whether the readers of a Func that only looks another one up have contributed to that one
  // themselves. The Func keeps its own adjoint, for who asks for it.
  bool pass_on(const FuncContents& f) {
    std::vector<PassedRead> further;
    for (const PassedRead& read : passed_.of(&f)) {
      const SweepResult sweep = sweep_reverse(
          {looked_up(f, *read.read.leaf.as<Call>())}, {read.read.adjoint},
          [&](const Expr& leaf) { return active_.contains(leaf); },
          [&](const Expr& leaf) { return ranges_.may_be_infinite(leaf); });
      for (const LeafAdjoint& leaf : sweep.leaves) {
        if (!is_short(inversion_of(*read.reader, leaf, read.domain))) return false;
        further.push_back({read.reader, leaf, read.domain});
      }
    }
    for (const PassedRead& read : further) add_contribution(read.reader, read.read, read.domain);
    return !further.empty();
  }

  static bool is_zero_over(const FuncContents& f, const std::vector<LoopVariable>& region) {
    BoundsMap bounds;
    for (const LoopVariable& v : region) bounds[v.name] = {v.min, v.max};
    return f.is_pure() && std::ranges::all_of(f.pure->values, [&](const Expr& v) {
             return is_zero(simplify(v, bounds));
           });
  }
  // Nothing of the stages before the update is left where anybody reads.
  void stop_at_update(const FuncContents& f, int stage, const AdjointTarget& target) {
    explain(Explanation::Kind::Zero, f.name,
            text("before update ", stage - 1, ", which overwrites every element that is read"));
    AdjointFunc zero = make_adjoint(target, text(f.name, "_adj_before_update", stage - 1), {});
    for (int s = 0; s < stage; ++s) record(f, s, zero);
    pending_.erase(&f);
  }

  // The reverse of a recurrence goes on in the adjoint of what comes after it, which then also
  // holds what later iterations read of earlier ones. Who asks for the adjoint after the update
  // gets one without.
  void keep_unextended(const FuncContents& f, int stage, AdjointFunc adjoint, int own_stages) {
    if (!active_.is_requested(&f)) return;
    adjoint.func =
        clone_prefix(adjoint.func, own_stages, text(f.name, "_adj_after_update", stage - 1));
    record(f, stage, adjoint);
  }

  void contribute_by_rule(const FuncPtr& f, const FuncPtr& adjoint) {
    if (!has_custom_adjoint(*f)) refuse_without_rule(*f);
    CustomAdjointResult rule = run_custom_adjoint(
        f, adjoint, regions_, [&](const Symbol* s) { return active_.contains(s); },
        [&](const Symbol* s) { return options_.only_requested && options_.requested.contains(s); });
    for (const CustomContribution& c : rule.contributions) add_custom(*f, c);
    for (const std::string& name : rule.zeros) {
      explain(Explanation::Kind::Zero, name, text("by the custom adjoint of ", quoted(f->name)));
    }
    for (const FuncPtr& inner : rule.covered) {
      covered_.insert(inner.get());
      explain(Explanation::Kind::Custom, inner->name,
              text("inside of the custom adjoint of ", quoted(f->name),
                   ": it has no adjoint of its own"));
    }
  }
  void add_custom(const FuncContents& f, const CustomContribution& c) {
    const AdjointTarget target = target_of(c.input.get());
    const std::vector<Expr> args = variables_of(target.args);
    const std::vector<Type> types = shape_of(c.input.get()).types;
    std::vector<Expr> values = values_of(c.adjoint, args);
    for (size_t k = 0; k < types.size(); ++k)
      values[k] = types[k].is_float() ? cast_to(target.types[k], values[k]) : Expr();
    const Box& box = regions_.of(c.input.get());
    if (box.size() != args.size()) {
      explain(Explanation::Kind::Zero, target.name,
              text("the output reads no element of it, at most its bounds: what the custom adjoint "
                   "of ",
                   quoted(f.name), " contributes does not count"));
      return;
    }
    add_pointwise(c.input.get(), target.args, box, {}, values);
    result_.funcs.push_back(c.adjoint);
    explain(Explanation::Kind::Custom, f.name,
            text("its custom adjoint contributes ", quoted(c.adjoint->name), " to ",
                 quoted(target.name)));
  }

  void record(const FuncContents& f, int stage, const AdjointFunc& adjoint) {
    result_.after_stage[{&f, stage}] = adjoint.func;
  }

  void contribute_pure(const FuncPtr& f, const FuncPtr& adjoint) {
    contribute_stage(f, mapped(f->pure->values, without_lets), adjoints_at_write(*f, 0, adjoint),
                     regions_.domain(*f, 0), {}, false);
  }

  std::vector<Expr> adjoints_at_write(const FuncContents& f, int stage,
                                      const FuncPtr& adjoint) const {
    return numbered(f.types.size(), [&](size_t k) {
      return f.types[k].is_float() ? adjoint_at(f, stage, adjoint, static_cast<int>(k)) : Expr();
    });
  }

  void contribute_stage(const FuncPtr& f, const std::vector<Expr>& values,
                        const std::vector<Expr>& seeds, const IterationDomain& domain,
                        const SelfValues& self_values, bool keeps_steps) {
    SweepResult sweep = sweep_reverse(
        values, seeds,
        [&](const Expr& leaf) { return active_.contains(leaf) && symbol_of(leaf) != f.get(); },
        [&](const Expr& leaf) { return ranges_.may_be_infinite(leaf); });
    for (const std::string& note : sweep.notes) explain(Explanation::Kind::Zero, f->name, note);
    for (LeafAdjoint& leaf : sweep.leaves) {
      leaf = {with_values_in_indices(leaf.leaf, f, self_values),
              with_values(leaf.adjoint, f, self_values)};
    }
    if (keeps_steps) {
      add_sharing(f, sweep.leaves, seeds, domain);
    } else {
      for (const LeafAdjoint& leaf : sweep.leaves) add_contribution(f, leaf, domain);
    }
  }
  // What the contributions share is computed once an iteration.
  void add_sharing(const FuncPtr& f, const std::vector<LeafAdjoint>& leaves,
                   const std::vector<Expr>& seeds, const IterationDomain& domain) {
    SharedAdjoints shared = share_adjoints(f->name + "_adj_inner", domain, leaves, seeds, regions_);
    if (shared.func) {
      const size_t kept = shared.func->types.size();
      result_.funcs.push_back(shared.func);
      explain(Explanation::Kind::Version, f->name,
              text(quoted(shared.func->name), " keeps ", kept,
                   kept == 1 ? " inner adjoint" : " inner adjoints",
                   " of each iteration, from which ", leaves.size(), " contributions go on"));
    }
    for (size_t i = 0; i < leaves.size(); ++i)
      add_contribution(f, leaves[i], shared.adjoints[i], domain);
  }

  bool is_inside(const Expr& index, const FuncContents& f, int stage, const Interval& range) const {
    return can_prove_inside(bounds_of(index, scope_of(regions_.domain(f, stage).vars)), range);
  }

  // The adjoint where the stage writes. A place that depends on data may lie outside of all that is
  // read: 0 there.
  Expr adjoint_at(const FuncContents& f, int stage, const FuncPtr& adjoint, int k) const {
    std::vector<Expr> place;
    Expr inside = const_true();
    const Box& box = regions_.of(&f);
    for (size_t d = 0; d < f.args.size(); ++d) {
      Expr index = without_lets(f.stage(stage).args[d]);
      if (depends_on_data(index) && box[d].is_bounded() && !is_inside(index, f, stage, box[d])) {
        inside = inside && index >= box[d].min && index <= box[d].max;
        index = clamp(index, box[d].min, box[d].max);
      }
      place.push_back(index);
    }
    Expr value = call_value(adjoint, place, k);
    return is_const_true(inside) ? value : make_select(inside, value, make_zero(value.type()));
  }

  void add_contribution(const FuncPtr& f, const LeafAdjoint& leaf, const IterationDomain& domain) {
    add_contribution(f, leaf, leaf.adjoint, domain);
  }
  // `adjoint`: that of the leaf, in other words.
  void add_contribution(const FuncPtr& f, const LeafAdjoint& leaf, const Expr& adjoint,
                        const IterationDomain& domain) {
    Symbol* symbol = symbol_of(leaf.leaf);
    const Inversion& inversion = inversion_of(*f, leaf, domain);
    if (may_pass_on(symbol)) passed_.note(symbol, {f, {leaf.leaf, adjoint}, domain});
    if (!inversion.note.empty())
      explain(Explanation::Kind::Scattered, shape_of(symbol).name,
              text("read by ", quoted(f->name), ": ", inversion.note));
    for (const Gather& g : inversion.gathers)
      pending_[symbol].push_back(contribution_of(leaf, adjoint, g));
  }
  bool may_pass_on(const Symbol* symbol) const {
    const auto* f = dynamic_cast<const FuncContents*>(symbol);
    return f && is_look_up(*f) && !(options_.only_requested && options_.requested.contains(symbol));
  }
  const Inversion& inversion_of(const FuncContents& reader, const LeafAdjoint& leaf,
                                const IterationDomain& domain) {
    const Symbol* symbol = symbol_of(leaf.leaf);
    const auto* call = leaf.leaf.as<Call>();
    const AdjointTarget target = target_of(symbol);
    AccessQuery query{domain, call ? call->args : std::vector<Expr>{}, target.args, target.region};
    return inversions_.of(reader, *symbol, query, leaf.adjoint);
  }
  static Contribution contribution_of(const LeafAdjoint& leaf, const Expr& adjoint,
                                      const Gather& g) {
    const auto* call = leaf.leaf.as<Call>();
    return {call ? call->component : 0, g, substitute(adjoint, g.iteration)};
  }

  // Where something is read may depend on values of f, too.
  static Expr with_values_in_indices(const Expr& leaf, const FuncPtr& f,
                                     const SelfValues& self_values) {
    return map_children(leaf, [&](const Expr& e) { return with_values(e, f, self_values); });
  }

  // ---- results ----

  void finish_parameter(const std::shared_ptr<ParameterContents>& p) {
    auto found = pending_.find(p.get());
    if (found == pending_.end()) return;
    AdjointFunc adjoint = make_adjoint(target_of(p.get()), p->name + "_adj", found->second);
    result_.parameters[p.get()] = adjoint.func;
    register_func(adjoint, p->name, target_of(p.get()).region);
  }

  void register_func(const AdjointFunc& adjoint, const std::string& primal,
                     const std::vector<LoopVariable>& region) {
    append(result_.funcs, adjoint.helpers);
    result_.funcs.push_back(adjoint.func);
    if (adjoint.accumulator) result_.accumulators[adjoint.func.get()] = adjoint.accumulator;
    account_.built(adjoint, primal, region);
  }

  void explain(Explanation::Kind kind, const std::string& subject, const std::string& detail) {
    account_.add(kind, subject, detail);
  }

  void list_gradients() {
    for (const auto& p : parameters_of({seed_.output})) {
      auto found = result_.parameters.find(p.get());
      if (found == result_.parameters.end() || !active_.is_requested(p.get())) continue;
      result_.gradients.push_back({found->second, box_of(target_of(p.get()).region)});
    }
    if (result_.gradients.empty() || options_.only_requested) list_func_gradients();
  }
  void list_func_gradients() {
    for (const FuncPtr& f : order_) {
      auto found = result_.after_stage.find({f.get(), f->stage_count() - 1});
      if (found == result_.after_stage.end() || !active_.is_requested(f.get())) continue;
      result_.gradients.push_back({found->second, box_of(target_of(f.get()).region)});
    }
  }
  static Box box_of(const std::vector<LoopVariable>& region) {
    return mapped(region, &LoopVariable::range);
  }

  // What reaches them past the rule alone is no gradient of the output by them.
  void forget_covered() {
    std::erase_if(result_.after_stage,
                  [&](const auto& entry) { return covered_.contains(entry.first.first); });
  }

  const Seed& seed_;
  const SynthesisOptions& options_;
  std::vector<FuncPtr> order_;
  Regions regions_;
  ValueRanges ranges_;
  ActiveSymbols active_;
  std::unordered_set<const Symbol*> covered_;  // inside of a custom adjoint that was used
  std::unordered_map<const Symbol*, std::vector<Contribution>> pending_;
  VersionBudget versions_;
  ReadInversions inversions_;
  PassedReads passed_;
  SynthesisAccount account_;
  SynthesisResult result_;
};

}  // namespace

SynthesisResult synthesize_adjoints(const Seed& seed, const SynthesisOptions& options) {
  return Synthesis(seed, options).run();
}

}  // namespace retrograde::ir
