#include "autodiff/sweeps/synthesis.h"

#include <algorithm>

#include "autodiff/report/absent_gradients.h"
#include "autodiff/sums/contributions.h"
#include "autodiff/sums/distinct_nodes.h"
#include "autodiff/sums/generated_definitions.h"
#include "autodiff/sums/kept_values.h"
#include "autodiff/sums/shared_adjoints.h"
#include "autodiff/sums/shared_terms.h"
#include "autodiff/sweeps/chosen_values.h"
#include "autodiff/sweeps/custom_rules.h"
#include "autodiff/sweeps/input_shape.h"
#include "autodiff/updates/update_context.h"
#include "autodiff/updates/versions.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// Throws: an extern stage, or a Func with a rule for the other mode only, has no definitions to differentiate.
[[noreturn]] void refuse_without_rule(const FuncContents& f, const std::vector<FuncPtr>& outputs) {
  if (f.custom_derivatives) {
    unsupported(text("propagate adjoints through ", quoted(f.name)),
                "a Func with a custom tangent needs a rule for adjoints, too",
                "the output depends on it, and it has none: its definitions need not agree with "
                "the rule",
                "Give it a custom_adjoint");
  }
  std::string names;
  for (const FuncPtr& output : outputs) names += (names.empty() ? "" : ", ") + quoted(output->name);
  unsupported("differentiate " + names, "derivatives come from definitions",
              text(outputs.size() == 1 ? "it depends on " : "they depend on ", quoted(f.name),
                   ", which the C function ", quoted(f.extern_definition->function), " computes"),
              text("Give ", quoted(f.name),
                   " a custom_adjoint, leave its inputs out of what is "
                   "differentiated by, or differentiate what comes after it, with its values in "
                   "an ImageParam"));
}

bool is_zero_over(const FuncContents& f, const std::vector<LoopVariable>& region) {
  BoundsMap bounds;
  for (const LoopVariable& v : region) bounds[v.name] = {v.min, v.max};
  return f.is_pure() && std::ranges::all_of(f.pure->values, [&](const Expr& v) {
           return is_zero(simplify(v, bounds));
         });
}

// Replaces values of f in the leaf's indices, too, because an index may depend on them.
LeafAdjoint with_self_values(const LeafAdjoint& leaf, const FuncPtr& f,
                             const SelfValues& self_values) {
  const auto known = [&](const Expr& e) { return with_values(e, f, self_values); };
  return {map_children(leaf.leaf, known), known(leaf.adjoint)};
}

// The adjoints of the requested parameters. Those of Funcs are included if requested, or if there are no parameters.
std::vector<WantedFunc> gradients_of(const Primal& primal, const SynthesisResult& result) {
  std::vector<WantedFunc> gradients;
  const auto add = [&](const Symbol* symbol, const auto& built, const auto& key) {
    const auto found = built.find(key);
    if (found == built.end() || !primal.active.is_requested(symbol)) return;
    gradients.push_back(
        {found->second, mapped(primal.target_of(symbol).region, &LoopVariable::range)});
  };
  for (const auto& p : parameters_of(primal.outputs)) add(p.get(), result.parameters, p.get());
  if (!gradients.empty() && !primal.options.only_requested) return gradients;
  for (const FuncPtr& f : primal.order)
    add(f.get(), result.after_stage, std::pair(f.get(), f->stage_count() - 1));
  return gradients;
}

class Synthesis {
 public:
  Synthesis(const Seeds& seeds, const SynthesisOptions& options)
      : primal_(seeds, options), contributions_(primal_, account_), versions_(options.versions) {}

  SynthesisResult run() {
    // A seed covers the specified bounds. Updates of the output, and its consumers, may reach further, where it is 0.
    for (const auto& [output, region, values] : primal_.seeds) {
      contributions_.add_pointwise(output.get(), output->args, region,
                                   primal_.regions.loop_variables(output.get(), output->args),
                                   values);
      result_.outputs.push_back({output, region});
    }
    for (auto f = primal_.order.rbegin(); f != primal_.order.rend(); ++f) {
      if (primal_.active.contains(f->get())) differentiate(*f);
    }
    for (const auto& parameter : parameters_of(primal_.outputs)) finish_parameter(*parameter);
    covered_.insert(contributions_.without_adjoint().begin(),
                    contributions_.without_adjoint().end());
    // Covered Funcs may get an adjoint along paths beside the rule. That is not the gradient of the output by them.
    std::erase_if(result_.after_stage,
                  [&](const auto& entry) { return covered_.contains(entry.first.first); });
    explain_absent(primal_, covered_, result_, account_);
    result_.gradients = gradients_of(primal_, result_);
    result_.explanations = account_.take();
    return std::move(result_);
  }

 private:
  void differentiate(const FuncPtr& f) {
    const std::vector<Contribution> contributions = contributions_.take(f.get());
    if (contributions.empty()) return;
    AdjointTarget target = primal_.target_of(f.get());
    AdjointFunc adjoint = make_adjoint(target, f->name + "_adj", contributions);
    bool extendable = true;  // no consumer yet
    record(*f, f->stage_count() - 1, adjoint);
    register_func(adjoint, target);
    if (f->custom_derivatives || f->is_extern()) {
      if (primal_.active.is_passed_by(f.get())) contribute_by_rule(f, adjoint.func);
      return;
    }
    for (int s = f->stage_count() - 1; s >= 1; --s) {
      const int own_stages = adjoint.func->stage_count();
      UpdateAdjoint update = differentiate_update(
          {f, s, primal_.regions, target, adjoint, extendable, versions_,
           primal_.options.checkpoints,
           [&](const Expr& leaf) { return primal_.active.contains(leaf); }, primal_.ranges});
      if (adjoint.func->stage_count() > own_stages) keep_unextended(*f, s, adjoint, own_stages);
      if (update.current.func != adjoint.func) register_func(update.current, target);
      contribute_update(f, s, update);
      if (update.previous.func && is_zero_over(*update.previous.func, target.region)) {
        stop_at_update(*f, s, target);
        return;
      }
      if (update.previous.func) register_func(update.previous, target);
      adjoint = update.previous.func ? update.previous : update.current;
      extendable = update.previous.func != nullptr;
      record(*f, s - 1, adjoint);
    }
    if (contributions_.pass_on(*f)) return;
    contribute_definition(f, adjoint.func);
  }

  void contribute_update(const FuncPtr& f, int stage, const UpdateAdjoint& update) {
    append(result_.funcs, update.helpers);
    const std::vector<Expr> seeds = update.seeds.empty()
                                        ? primal_.adjoints_at_write(*f, stage, update.current.func)
                                        : update.seeds;
    for (const IterationDomain& domain : update.domains)
      contribute_stage(f, update.values, seeds, domain, update.self_values, update.keeps_steps);
    for (const DirectContribution& g : update.direct) {
      if (primal_.active.contains(g.leaf.leaf)) contributions_.add(f, g.leaf, g.domain);
    }
    account_.add(update.explanations);
  }

  // The update overwrites every element that is read, so the adjoints of the stages before it are zero.
  void stop_at_update(const FuncContents& f, int stage, const AdjointTarget& target) {
    account_.add(
        Explanation::Kind::Zero, f.name,
        text("before update ", stage - 1, ", which overwrites every element that is read"));
    AdjointFunc zero = make_adjoint(target, text(f.name, "_adj_before_update", stage - 1), {});
    for (int s = 0; s < stage; ++s) record(f, s, zero);
  }

  // The reverse of a recurrence extends the adjoint of the Func after the update, which then also contains what later
  // iterations read of earlier ones. A requested adjoint after the update gets a copy without the extension.
  void keep_unextended(const FuncContents& f, int stage, AdjointFunc adjoint, int own_stages) {
    if (!primal_.active.is_requested(&f)) return;
    adjoint.func =
        clone_prefix(adjoint.func, own_stages, text(f.name, "_adj_after_update", stage - 1));
    record(f, stage, adjoint);
  }

  void contribute_by_rule(const FuncPtr& f, const FuncPtr& adjoint) {
    if (!has_custom_adjoint(*f)) refuse_without_rule(*f, primal_.outputs);
    CustomAdjointResult rule = run_custom_adjoint(
        f, adjoint, primal_.regions, [&](const Symbol* s) { return primal_.active.contains(s); },
        [&](const Symbol* s) { return primal_.is_named(s); });
    for (const CustomContribution& c : rule.contributions) add_custom(*f, c);
    for (const std::string& name : rule.zeros) {
      account_.add(Explanation::Kind::Zero, name,
                   text("by the custom adjoint of ", quoted(f->name)));
    }
    for (const FuncPtr& inner : rule.covered) {
      covered_.insert(inner.get());
      account_.add(Explanation::Kind::Custom, inner->name,
                   text("inside of the custom adjoint of ", quoted(f->name),
                        ": it has no adjoint of its own"));
    }
  }
  void add_custom(const FuncContents& f, const CustomContribution& c) {
    const AdjointTarget target = primal_.target_of(c.input.get());
    const std::vector<Expr> args = variables_of(target.args);
    const std::vector<Type> types = shape_of(c.input.get()).types;
    std::vector<Expr> values = values_of(c.adjoint, args);
    for (size_t k = 0; k < types.size(); ++k)
      values[k] = types[k].is_float() ? cast_to(target.types[k], values[k]) : Expr();
    const Box& box = primal_.regions.of(c.input.get());
    if (box.size() != args.size()) {
      account_.add(
          Explanation::Kind::Zero, target.name,
          text("the output reads no element of it, at most its bounds: the contribution of the "
               "custom adjoint of ",
               quoted(f.name), " is ignored"));
      return;
    }
    contributions_.add_pointwise(c.input.get(), target.args, box, {}, values);
    result_.funcs.push_back(c.adjoint);
    account_.add(Explanation::Kind::Custom, f.name,
                 text("its custom adjoint contributes ", quoted(c.adjoint->name), " to ",
                      quoted(target.name)));
  }

  void record(const FuncContents& f, int stage, const AdjointFunc& adjoint) {
    result_.after_stage[{&f, stage}] = adjoint.func;
  }

  // Adds the contributions of the pure definition.
  void contribute_definition(const FuncPtr& f, const FuncPtr& adjoint) {
    const StageValues stage = with_choices_as_values(
        {primal_.regions.domain(*f, 0),
         with_equal_nodes_shared(mapped(f->pure->values, without_lets)),
         primal_.adjoints_at_write(*f, 0, adjoint), values_of(f, variables_of(f->args))},
        [&](const Expr& leaf) { return primal_.active.contains(leaf); });
    std::vector<LeafAdjoint> leaves = leaves_of(*f, stage.values, stage.seeds);
    if (f->is_pure()) {
      for (LeafAdjoint& leaf : leaves) leaf = with_kept_values(leaf, stage.reads, stage.values);
    }
    add_sharing(f, leaves,
                share_terms(f->name + "_adj_terms", stage.domain, leaves, primal_.regions),
                stage.domain, "term");
  }

  void contribute_stage(const FuncPtr& f, const std::vector<Expr>& values,
                        const std::vector<Expr>& seeds, const IterationDomain& domain,
                        const SelfValues& self_values, bool keeps_steps) {
    std::vector<LeafAdjoint> leaves = leaves_of(*f, values, seeds);
    for (LeafAdjoint& leaf : leaves) leaf = with_self_values(leaf, f, self_values);
    if (keeps_steps) {
      add_sharing(f, leaves,
                  share_adjoints(f->name + "_adj_inner", domain, leaves, seeds, primal_.regions),
                  domain, "inner adjoint");
    } else {
      for (const LeafAdjoint& leaf : leaves) contributions_.add(f, leaf, domain);
    }
  }
  std::vector<LeafAdjoint> leaves_of(const FuncContents& f, const std::vector<Expr>& values,
                                     const std::vector<Expr>& seeds) {
    SweepResult sweep = primal_.sweep(values, seeds, &f);
    for (const std::string& note : sweep.notes) account_.add(Explanation::Kind::Zero, f.name, note);
    return std::move(sweep.leaves);
  }
  // Computes what the contributions have in common once for each iteration.
  void add_sharing(const FuncPtr& f, const std::vector<LeafAdjoint>& leaves,
                   const SharedAdjoints& shared, const IterationDomain& domain,
                   const std::string& what) {
    if (shared.func) {
      const size_t kept = shared.func->types.size();
      result_.funcs.push_back(shared.func);
      account_.add(Explanation::Kind::Version, f->name,
                   text(quoted(shared.func->name), " keeps ", kept, " ", what, kept == 1 ? "" : "s",
                        " of each iteration, shared by ", leaves.size(), " contributions"));
    }
    for (size_t i = 0; i < leaves.size(); ++i)
      contributions_.add(f, leaves[i], shared.adjoints[i], domain);
  }

  void finish_parameter(const ParameterContents& p) {
    const std::vector<Contribution> contributions = contributions_.take(&p);
    if (contributions.empty()) return;
    const AdjointTarget target = primal_.target_of(&p);
    AdjointFunc adjoint = make_adjoint(target, p.name + "_adj", contributions);
    result_.parameters[&p] = adjoint.func;
    register_func(adjoint, target);
  }

  void register_func(const AdjointFunc& adjoint, const AdjointTarget& primal) {
    append(result_.funcs, adjoint.helpers);
    result_.funcs.push_back(adjoint.func);
    if (adjoint.accumulator) result_.accumulators[adjoint.func.get()] = adjoint.accumulator;
    account_.built(adjoint, primal.name, primal.region);
  }

  const Primal primal_;
  SynthesisAccount account_;
  Contributions contributions_;
  VersionBudget versions_;
  // Funcs without an adjoint of their own: those inside of a custom adjoint, and those without a size.
  std::unordered_set<const Symbol*> covered_;
  SynthesisResult result_;
};

}  // namespace

std::vector<FuncPtr> outputs_of(const Seeds& seeds) { return mapped(seeds, &Seed::output); }

std::map<const Symbol*, Box> regions_of(const Seeds& seeds) {
  std::map<const Symbol*, Box> result;
  for (const Seed& seed : seeds) {
    Box& box = result[seed.output.get()];
    box = hull(box, seed.region);
  }
  return result;
}

SynthesisResult synthesize_adjoints(const Seeds& seeds, const SynthesisOptions& options) {
  return Synthesis(seeds, options).run();
}

}  // namespace retrograde::autodiff
