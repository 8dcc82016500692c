// Wrappers and clones come first, for they are made from Funcs without schedules; then cuts of
// updates; then loops; then levels, which name loops.
#include "testing/apply_schedule.h"

#include "diagnostics/error.h"

namespace retrograde::fuzz {

namespace {

using Kind = Directive::Kind;
using Where = Placement::Where;

class Applier {
 public:
  Applier(const ScheduleSpec& schedule, BuiltPipeline& built)
      : schedule_(schedule), built_(built) {}

  void run() {
    built_.selector.set(schedule_.selector);
    for (const DerivedFunc& derived : schedule_.derived) derive(derived);
    for (size_t f = 0; f < built_.funcs.size(); ++f) {
      if (exists(static_cast<int>(f))) apply_loops(static_cast<int>(f));
    }
    for (size_t f = 0; f < built_.funcs.size(); ++f) {
      if (exists(static_cast<int>(f))) apply_to_func(schedule_.funcs[f], built_.funcs[f]);
    }
    for (const Companion& companion : schedule_.companions) join(companion);
  }

 private:
  bool exists(int f) const {
    const int first = static_cast<int>(built_.funcs.size() - schedule_.derived.size());
    return f < first || schedule_.derived[f - first].kind != DerivedFunc::Kind::None;
  }

  // ---- derived Funcs ----

  void derive(const DerivedFunc& derived) {
    Func& source = built_.funcs[derived.source];
    std::vector<RDom> domains;
    Func made;
    switch (derived.kind) {
      case DerivedFunc::Kind::None:
        break;
      case DerivedFunc::Kind::Wrapper:
        made = derived.consumer < 0 ? source.in() : source.in(built_.funcs[derived.consumer]);
        break;
      case DerivedFunc::Kind::Clone:
        made = source.clone_in(built_.funcs[derived.consumer]);
        domains = built_.domains[derived.source];
        break;
      case DerivedFunc::Kind::Factored:
        made = factor(derived);
        domains = {built_.domains[derived.source][derived.stage - 1]};
        break;
    }
    built_.funcs.push_back(made);
    built_.domains.push_back(domains);
  }

  Func factor(const DerivedFunc& derived) {
    const RDom& domain = built_.domains[derived.source][derived.stage - 1];
    Stage stage = built_.funcs[derived.source].stage(derived.stage);
    if (derived.factor > 0) {
      stage.split(loop_of(derived.split_loop, domain), RVar(derived.outer), RVar(derived.inner),
                  derived.factor);
    }
    std::vector<std::pair<RVar, Var>> preserved;
    for (size_t i = 0; i < derived.preserved.size(); ++i) {
      preserved.emplace_back(loop_of(derived.preserved[i], domain).rvar, Var(derived.variables[i]));
    }
    return stage.rfactor(preserved);
  }

  // ---- loops ----

  static VarOrRVar loop_of(const std::string& name, const RDom& domain) {
    if (!is_reduction_loop(name)) return Var(name);
    if (is_reduction_variable(name)) return domain[name[1] - '0'];
    return RVar(name);
  }

  const RDom& domain_of(int f, int stage) const {
    static const RDom none;
    return stage == 0 || built_.domains[f].empty() ? none : built_.domains[f][stage - 1];
  }

  void apply_loops(int f) {
    const FuncScheduleSpec& spec = schedule_.funcs[f];
    for (size_t s = 0; s < spec.stages.size(); ++s) {
      const int stage = static_cast<int>(s);
      for (const Directive& directive : spec.stages[s].directives) {
        apply_directive(directive, built_.funcs[f].stage(stage), domain_of(f, stage));
      }
    }
  }

  void apply_directive(const Directive& directive, Stage stage, const RDom& domain) {
    std::vector<VarOrRVar> loops;
    for (const std::string& name : directive.loops) loops.push_back(loop_of(name, domain));
    switch (directive.kind) {
      case Kind::Split:
        stage.split(loops[0], loops[1], loops[2], directive.factor, directive.tail);
        break;
      case Kind::Fuse:
        stage.fuse(loops[0], loops[1], loops[2]);
        break;
      case Kind::Rename:
        stage.rename(loops[0], loops[1]);
        break;
      case Kind::Reorder:
        stage.reorder(loops);
        break;
      case Kind::Serial:
        stage.serial(loops[0]);
        break;
      case Kind::NeverPartition:
        stage.never_partition(loops);
        break;
      case Kind::AlwaysPartition:
        stage.always_partition(loops);
        break;
      case Kind::Atomic:
        stage.atomic();
        break;
      case Kind::AllowRaces:
        stage.allow_race_conditions();
        break;
      case Kind::Prefetch:
        prefetch(directive, stage, loops);
        break;
      case Kind::Specialize:
        specialize(directive, stage, domain);
        break;
      case Kind::SpecializeFail:
        stage.specialize_fail("no specialization fits");
        break;
      case Kind::Vectorize:
      case Kind::Unroll:
      case Kind::Parallel:
        apply_kind(directive, stage, loops[0]);
        break;
    }
  }

  static void apply_kind(const Directive& directive, Stage stage, const VarOrRVar& loop) {
    const bool splits = directive.factor > 0;
    switch (directive.kind) {
      case Kind::Vectorize:
        if (splits) {
          stage.vectorize(loop, directive.factor, directive.tail);
        } else {
          stage.vectorize(loop);
        }
        break;
      case Kind::Unroll:
        if (splits) {
          stage.unroll(loop, directive.factor, directive.tail);
        } else {
          stage.unroll(loop);
        }
        break;
      default:
        if (splits) {
          stage.parallel(loop, directive.factor, directive.tail);
        } else {
          stage.parallel(loop);
        }
    }
  }

  void prefetch(const Directive& directive, Stage stage, const std::vector<VarOrRVar>& loops) {
    if (directive.source >= 0) {
      stage.prefetch(built_.funcs[directive.source], loops[0], loops[1], directive.factor);
    } else {
      stage.prefetch(built_.images[-1 - directive.source], loops[0], loops[1], directive.factor);
    }
  }

  void specialize(const Directive& directive, Stage stage, const RDom& domain) {
    const Stage special = stage.specialize(Expr(built_.selector) == directive.condition);
    for (const Directive& inner : directive.nested) apply_directive(inner, special, domain);
  }

  void join(const Companion& companion) {
    built_.funcs[companion.func].compute_with(built_.funcs[companion.with], Var(companion.loop),
                                              companion.align);
  }

  // ---- the Func as a whole ----

  LoopLevel level(int consumer, int stage, const std::string& loop) const {
    if (loop == "root") return LoopLevel::root();
    return LoopLevel(built_.funcs[consumer], loop_of(loop, domain_of(consumer, stage)));
  }

  void apply_to_func(const FuncScheduleSpec& spec, Func& func) {
    apply_placement(spec.placement, func);
    for (const DimensionRule& rule : spec.rules) apply_rule(rule, func);
    if (!spec.storage_order.empty()) {
      std::vector<Var> order;
      const std::vector<Var> args = func.args();
      for (const int d : spec.storage_order) order.push_back(args[d]);
      func.reorder_storage(order);
    }
    if (spec.memory != MemoryType::Auto) func.store_in(spec.memory);
    if (spec.memoized) func.memoize();
    if (spec.async) func.async();
    if (spec.traced) func.trace_loads().trace_stores().trace_realizations();
  }

  void apply_placement(const Placement& placement, Func& func) {
    switch (placement.where) {
      case Where::Default:
        return;
      case Where::Inline:
        func.compute_inline();
        return;
      case Where::Root:
        func.compute_root();
        return;
      case Where::At:
        break;
    }
    if (!placement.hoist_loop.empty()) {
      func.hoist_storage(
          level(placement.hoist_consumer, placement.hoist_stage, placement.hoist_loop));
    }
    if (!placement.store_loop.empty()) {
      func.store_at(level(placement.store_consumer, placement.store_stage, placement.store_loop));
    }
    func.compute_at(level(placement.consumer, placement.stage, placement.compute_loop));
  }

  static void apply_rule(const DimensionRule& rule, Func& func) {
    const Var var = func.args()[rule.dimension];
    switch (rule.kind) {
      case DimensionRule::Kind::Bound:
        func.bound(var, rule.a, rule.b);
        break;
      case DimensionRule::Kind::BoundExtent:
        func.bound_extent(var, rule.a);
        break;
      case DimensionRule::Kind::AlignBounds:
        func.align_bounds(var, rule.a, rule.b);
        break;
      case DimensionRule::Kind::AlignExtent:
        func.align_extent(var, rule.a);
        break;
      case DimensionRule::Kind::AlignStorage:
        func.align_storage(var, rule.a);
        break;
      case DimensionRule::Kind::BoundStorage:
        func.bound_storage(var, rule.a);
        break;
      case DimensionRule::Kind::FoldStorage:
        func.fold_storage(var, rule.a, rule.b != 0);
        break;
    }
  }

  const ScheduleSpec& schedule_;
  BuiltPipeline& built_;
};

}  // namespace

void apply(const ScheduleSpec& schedule, BuiltPipeline& built) { Applier(schedule, built).run(); }

}  // namespace retrograde::fuzz
