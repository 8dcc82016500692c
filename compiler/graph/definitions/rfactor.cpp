// Factors an associative update into partial results and their combination:
//
//   f(x) = init                           f_intm(x, u) = identity
//   f(args(r, s)) = op(f(args), e(r, s))  f_intm(args(r, u), u) = op(f_intm(args, u), e(r, u))
//                                    =>   f(x) = init
//                                         f(x) = op(f(x), f_intm(x, s))
//
// Method: first apply the splits of reduction variables to the definition, so that each reduction
// loop becomes a variable of its own ("leaf"). The preserved leaves become pure variables of the
// new Func and the domain of the remaining update. Loops keep their names: the variables of a
// domain have fresh names, and a rename in the schedule restores the user's.
//
// The left-hand side of the combination keeps the coordinates that depend only on preserved
// variables. The others (such as a histogram's bin) become the pure variables, so all elements are
// combined.
#include <algorithm>
#include <map>
#include <unordered_set>

#include "diagnostics/error.h"
#include "graph/definitions/associative_update.h"
#include "graph/definitions/define.h"
#include "graph/definitions/own_reads.h"
#include "graph/definitions/reduction_leaves.h"
#include "graph/definitions/rfactor.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/memory_reads.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::graph {

namespace {

using Preserved = std::vector<std::pair<NamedLoop, std::string>>;

class Factoring {
 public:
  Factoring(const FuncPtr& f, int stage, const Preserved& preserved, std::string name,
            AssociativeOp op, Leaves leaves)
      : f_(f->shared_from_this()),
        update_(f->stage(stage)),
        stage_(stage),
        name_(std::move(name)),
        op_(std::move(op)),
        leaves_(std::move(leaves)) {
    for (const auto& [loop, var] : preserved) kept_[loop] = var;
    for (const Dim& dim : update_.schedule.dims) {
      if (!dim.is_reduction) continue;
      const auto leaf =
          std::ranges::find_if(leaves_.all, [&](const Leaf& l) { return l.loop == dim.var; });
      RETROGRADE_ASSERT(leaf != leaves_.all.end(), "a reduction loop without a variable");
      (kept_.count(dim.var) ? kept_leaves_ : removed_leaves_).push_back(*leaf);
    }
    for (const Leaf& leaf : removed_leaves_) removed_names_.insert(leaf.name);
    for (const Leaf& leaf : kept_leaves_) kept_vars_.push_back(variable(kept_.at(leaf.loop)));
    over_leaves_ = map_exprs(update_, [&](const Expr& e) { return substitute(e, leaves_.values); });
    add_conjuncts(over_leaves_.predicate, conjuncts_);
  }

  FuncPtr run() {
    make_intermediate();
    Definition merge = merged();
    Definition partial = partial_update();
    intermediate_->updates.push_back(std::move(partial));
    intermediate_->frozen = true;
    f_->stage(stage_) = std::move(merge);
    return intermediate_;
  }

 private:
  const FuncPtr f_;
  const Definition update_;  // the original update
  const int stage_;
  const std::string name_;  // of the new Func
  const AssociativeOp op_;
  const Leaves leaves_;
  std::map<std::string, std::string> kept_;  // loop -> pure variable of the intermediate Func
  std::vector<Leaf> kept_leaves_, removed_leaves_;
  std::unordered_set<std::string> removed_names_;
  std::vector<Expr> kept_vars_;  // variables of kept_leaves_
  Definition over_leaves_;       // the update in terms of leaves
  std::vector<Expr> conjuncts_;  // of its predicate
  FuncPtr intermediate_;

  // ---- the intermediate Func ----

  Expr identity(size_t i) const {
    if (op_.identity[i].defined()) return op_.identity[i];
    // Any value is correct; this one preserves the order of ties.
    const Expr& init = f_->pure->values[i];
    return is_const(init) ? init : make_zero(f_->types[i]);
  }

  void make_intermediate() {
    intermediate_ = std::make_shared<FuncContents>();
    intermediate_->name = claim_name(name_);
    intermediate_->declared_at = f_->declared_at;
    std::vector<Expr> args = variables_of(f_->args), values;
    append(args, kept_vars_);
    for (size_t i = 0; i < f_->types.size(); i++) values.push_back(identity(i));
    define_pure(intermediate_, args, values);
    std::vector<std::string>& storage = intermediate_->schedule.storage_dims;
    storage = f_->schedule.storage_dims;
    for (const Expr& var : kept_vars_) storage.push_back(var.as<Variable>()->name);
  }

  // A domain of these leaves, whose loops keep their names.
  static DomainPtr domain_of(const std::vector<Leaf>& leaves, Substitution& places,
                             std::vector<Split>& renames) {
    if (leaves.empty()) return nullptr;
    const DomainPtr domain = make_domain();
    const std::string prefix = unique_name("r") + ".";
    for (const Leaf& leaf : leaves) {
      const std::string name = prefix + leaf.loop.substr(leaf.loop.rfind('.') + 1);
      domain->vars.push_back({name, leaf.min, leaf.extent});
      places[leaf.name] = loop_variable(domain, name);
      Split rename;
      rename.kind = Split::Kind::Rename;
      rename.old_var = name;
      rename.outer = leaf.loop;
      rename.exact = true;
      renames.push_back(std::move(rename));
    }
    return domain;
  }

  static void set_domain(Definition& definition, const DomainPtr& domain) {
    definition.rvars = domain ? domain->vars : std::vector<ReductionVariable>{};
    if (domain && definition.predicate.defined())
      domain->predicate = rebind_symbol(definition.predicate, SymbolRef::weak(domain));
  }

  // The parts of the original schedule that do not depend on its list of loops.
  StageLoops schedule_with(const std::vector<Split>& renames) const {
    StageLoops schedule = update_.schedule;
    schedule.splits = leaves_.others;
    append(schedule.splits, renames);
    schedule.dims.clear();
    schedule.prefetches.clear();
    return schedule;
  }

  void take_prefetches(StageLoops& schedule) const {
    const auto has = [&](const std::string& loop) {
      return std::ranges::any_of(schedule.dims, [&](const Dim& dim) { return dim.var == loop; });
    };
    for (PrefetchDirective prefetch : update_.schedule.prefetches) {
      for (std::string* loop : {&prefetch.at, &prefetch.from}) {
        if (kept_.count(*loop)) *loop = kept_.at(*loop);
      }
      if (has(prefetch.at) && has(prefetch.from)) schedule.prefetches.push_back(prefetch);
    }
  }

  Definition partial_update() const {
    Substitution places;
    std::vector<Split> renames;
    const DomainPtr domain = domain_of(removed_leaves_, places, renames);
    for (size_t i = 0; i < kept_leaves_.size(); i++) places[kept_leaves_[i].name] = kept_vars_[i];
    const auto place = [&](const Expr& e) { return substitute(e, places); };

    Definition partial;
    partial.args = mapped(over_leaves_.args, place);
    append(partial.args, kept_vars_);
    for (const Expr& value : over_leaves_.values)
      partial.values.push_back(place(with_self_at(value, partial.args)));
    std::vector<Expr> conditions = mapped(leaves_.tails, place);
    append(conditions, mapped(conjuncts_, place));
    partial.predicate = guarded_conjunction(conditions);
    set_domain(partial, domain);
    partial.schedule = schedule_with(renames);
    for (Dim dim : update_.schedule.dims) {
      const auto kept = kept_.find(dim.var);
      if (dim.is_reduction && kept != kept_.end()) {
        dim.var = kept->second;
        dim.is_reduction = false;
      }
      partial.schedule.dims.push_back(std::move(dim));
    }
    take_prefetches(partial.schedule);
    return partial;
  }

  // The conjunction of the conditions; undefined when there are none. Conditions that read memory
  // are evaluated only where the others hold, because past the end of a split there is nothing to
  // read.
  static Expr guarded_conjunction(const std::vector<Expr>& conditions) {
    std::vector<Expr> plain, reading;
    for (const Expr& e : conditions)
      (reads_memory(e, MemoryReads::Functions) ? reading : plain).push_back(e);
    if (reading.empty()) return plain.empty() ? Expr() : conjunction(plain);
    const Expr last = conjunction(reading);
    if (plain.empty()) return last;
    return call_op(Op::if_then_else, Bool(), {conjunction(plain), last, const_false()});
  }

  // Replaces references to f by references to the intermediate Func at `args`.
  Expr with_self_at(const Expr& value, const std::vector<Expr>& args) const {
    return map_calls_of(value, f_.get(), [&](const Call& call, const std::vector<Expr>&) {
      return call_func(intermediate_->name, call.type, args, call.component,
                       SymbolRef::weak(intermediate_));
    });
  }

  // ---- the combination ----

  bool uses_removed(const Expr& e) const { return uses_any_variable(e, removed_names_); }

  // Conditions that hold for an entire partial result.
  std::vector<Expr> common_conditions() const {
    return filtered(conjuncts_, [&](const Expr& e) {
      return !uses_removed(e) && !reads_memory(e, MemoryReads::Functions);
    });
  }

  // A coordinate may stay when every value of the preserved variables that satisfies the conditions
  // has a partial result there.
  bool keeps_coordinate(const Expr& arg, bool all_conditions_common) const {
    return all_conditions_common && !uses_removed(arg) &&
           !reads_memory(arg, MemoryReads::Functions);
  }

  Definition merged() const {
    Substitution places;
    std::vector<Split> renames;
    const DomainPtr domain = domain_of(kept_leaves_, places, renames);
    const auto place = [&](const Expr& e) { return substitute(e, places); };

    Definition merge;
    const std::vector<Expr> conditions = common_conditions();
    std::vector<std::string> new_loops;
    for (size_t d = 0; d < f_->args.size(); d++) {
      const Expr& arg = over_leaves_.args[d];
      const Variable* v = arg.as<Variable>();
      const bool is_pure = v && !v->symbol.defined() && v->name == f_->args[d];
      if (is_pure || keeps_coordinate(arg, conditions.size() == conjuncts_.size())) {
        merge.args.push_back(place(arg));
      } else {
        merge.args.push_back(variable(f_->args[d]));
        new_loops.push_back(f_->args[d]);
      }
    }
    std::vector<Expr> read_at = merge.args;
    for (const Leaf& leaf : kept_leaves_) read_at.push_back(places.at(leaf.name));
    Substitution operands;
    for (size_t i = 0; i < f_->types.size(); i++) {
      operands[op_.xs[i]] =
          call_func(f_->name, f_->types[i], merge.args, static_cast<int>(i), SymbolRef::weak(f_));
      operands[op_.ys[i]] = call_func(intermediate_->name, f_->types[i], read_at,
                                      static_cast<int>(i), SymbolRef(intermediate_));
    }
    for (const Expr& value : op_.values) merge.values.push_back(substitute(value, operands));
    if (!conditions.empty()) merge.predicate = place(conjunction(conditions));
    set_domain(merge, domain);
    merge.schedule = schedule_with(renames);
    for (const Dim& dim : update_.schedule.dims) {
      if (!dim.is_reduction || kept_.count(dim.var)) merge.schedule.dims.push_back(dim);
    }
    for (const std::string& loop : new_loops) {
      Dim dim;
      dim.var = loop;
      merge.schedule.dims.push_back(std::move(dim));
    }
    return merge;
  }
};

// Whether the loops are the outermost among the reduction loops.
bool are_outermost(const StageLoops& schedule, const Preserved& preserved) {
  std::vector<std::string> order;  // innermost first
  for (const Dim& dim : schedule.dims) {
    if (dim.is_reduction) order.push_back(dim.var);
  }
  for (size_t i = order.size() - preserved.size(); i < order.size(); i++) {
    if (std::ranges::none_of(preserved, [&](const auto& pair) { return pair.first == order[i]; }))
      return false;
  }
  return true;
}

std::string as_list(const Preserved& preserved) {
  return listed(preserved, [](const auto& kept) {
    return text(quoted(kept.first), " as ", quoted(kept.second));
  });
}

}  // namespace

// 1. The stage is an update, not specialized and not fused with another. 2. Every RVar is a
// reduction loop, named once. 3. Every Var is new, named once. 4. The update is associative, with
// an identity. 5. It commutes, unless the loops are the outermost ones.
FuncPtr factor_out(const SchedulePlace& place, const Preserved& preserved,
                   const std::string& wanted) {
  const FuncContents& f = *place.f;
  const std::string asked = text("factor ", as_list(preserved), " out of ", place.name());
  if (place.stage == 0) {
    user_error(asked, "only an update that reduces is factored",
               place.name() + " is a first definition",
               "Call it on update(): f.update().rfactor(r, u)");
  }
  const StageLoops& schedule = place.schedule();
  if (!place.special.empty() || !schedule.specializations.empty()) {
    user_error(asked, "a specialized stage keeps its definition",
               place.name() + " has specializations", "Call rfactor before specialize");
  }
  if (schedule.fuse_level.kind == LoopLevel::Kind::At) {
    user_error(asked, "a stage in the loops of another one keeps its own",
               text("compute_with put it into the loops of ", quoted(schedule.fuse_level.func)),
               "Call rfactor before compute_with");
  }
  std::unordered_set<std::string> loops, variables;
  for (const auto& [loop, var] : preserved) {
    if (!schedule.dims[loop_index(place, loop, asked)].is_reduction) {
      user_error(asked, "only reduction loops are factored", quoted(loop) + " is pure",
                 "Name a variable of its RDom, or one that comes from it");
    }
    if (!loops.insert(loop).second)
      user_error(asked, "each loop is named once", quoted(loop) + " is named twice",
                 "Drop one of them");
    check_new_loop(place, var, loop, asked);
    if (!variables.insert(var).second || std::ranges::find(f.args, var) != f.args.end()) {
      user_error(asked, "the new variables differ from each other and from the Func's",
                 quoted(var) + " already exists", "Use a new Var");
    }
  }
  const AssociativityProof proof = prove_associative(f, place.definition());
  if (!proof.op) {
    user_error(asked, "only an associative update has partial results that can be combined",
               proof.why_not,
               "Write it as f(x) = op(f(x), e) with an associative op, or keep its loops");
  }
  if (!proof.op->commutative && !are_outermost(schedule, preserved)) {
    user_error(asked, "partial results over inner loops change the order of the reduction",
               proof.why_not_commutative,
               "Factor the outermost reduction loops: reorder is legal only if it commutes");
  }
  Leaves leaves = leaves_of(place.definition(), schedule, asked);
  const FuncPtr result =
      Factoring(place.f, place.stage, preserved, wanted.empty() ? f.name + "_intm" : wanted,
                *proof.op, std::move(leaves))
          .run();
  log_directive(place, FactorOut{result->name, preserved});
  return result;
}

}  // namespace retrograde::graph
