#include "autodiff/update.h"

#include <algorithm>
#include <set>

#include "autodiff/derivative_rules.h"
#include "autodiff/reverse_sweep.h"
#include "autodiff/selection.h"
#include "autodiff/update_relations.h"
#include "autodiff/versions.h"
#include "diagnostics/error.h"
#include "frontend/define.h"
#include "frontend/var.h"
#include "ir/build.h"
#include "ir/print.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

const Call* as_call_of(const Expr& e, const FuncContents* f) {
  const auto* call = e.as<Call>();
  return call && call->call_type == CallType::Func && call->symbol.raw() == f ? call : nullptr;
}

bool calls(const Expr& e, const FuncContents* f) {
  bool found = false;
  if (!e.defined()) return false;
  walk(e, [&](const Expr& node) {
    found |= as_call_of(node, f) != nullptr;
    return !found;
  });
  return found;
}

bool same_args(const std::vector<Expr>& a, const std::vector<Expr>& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(),
                    [](const Expr& x, const Expr& y) { return equal(x, y); });
}

std::string point_text(const std::string& name, const std::vector<Expr>& args) {
  std::string out = quoted(name) + "(";
  for (size_t i = 0; i < args.size(); ++i) out += (i ? ", " : "") + print(args[i]);
  return out + ")";
}

class UpdateDifferentiation {
 public:
  explicit UpdateDifferentiation(const UpdateQuery& q)
      : q_(q),
        f_(q.f.get()),
        definition_(q.f->stage(q.stage)),
        domain_(q.regions.domain(*q.f, q.stage)) {
    for (const Expr& v : definition_.values) values_.push_back(without_lets(v));
    for (const Expr& a : definition_.args) write_.push_back(without_lets(a));
    for (size_t d = 0; d < f_->args.size(); ++d)
      pure_.push_back(is_pure_position(*f_, definition_, d));
    for (const std::string& arg : f_->args) point_.push_back(variable(arg));
    result_.current = q.adjoint;
  }

  UpdateAdjoint run() {
    check_places();
    if (accumulates()) return std::move(result_);
    if (selects()) return std::move(result_);
    recurrence();
    return std::move(result_);
  }

 private:
  std::string asked() const {
    return "differentiate the update " + point_text(f_->name, write_) + " = " + short_values();
  }
  std::string short_values() const {
    std::string out;
    for (const Expr& v : definition_.values) out += (out.empty() ? "" : ", ") + print(v);
    return out.size() > 200 ? out.substr(0, 200) + "..." : out;
  }

  // Where it writes and whether it writes must not depend on what it computes.
  void check_places() const {
    bool place =
        std::any_of(write_.begin(), write_.end(), [&](const Expr& e) { return calls(e, f_); });
    if (!place && !calls(domain_.predicate, f_)) return;
    user_error(asked(),
               "where an update writes may not depend on the values of the Func that it updates",
               text(quoted(f_->name), " is read on the left-hand side or in the predicate"),
               "Compute the place in a Func of its own");
  }

  // ---- accumulation ----

  // The part of `e` that is added to the call `self`, when e is self + part: E of the header;
  // undefined when it is not.
  Expr added_to(const Expr& e, int k) const {
    if (!calls(e, f_)) return {};
    if (const Call* call = as_call_of(e, f_)) {
      return call->value_index == k && same_args(call->args, write_) ? make_zero(e.type()) : Expr();
    }
    return match(
        e, [&](const Add& n) { return combined(n.a, n.b, k, Kind::Add); },
        [&](const Sub& n) -> Expr {
          if (calls(n.b, f_)) return {};
          Expr rest = added_to(n.a, k);
          return rest.defined() ? rest - n.b : Expr();
        },
        [&](const Select& n) -> Expr {
          if (calls(n.condition, f_)) return {};
          Expr t = added_to(n.true_value, k), f = added_to(n.false_value, k);
          return t.defined() && f.defined() ? make_select(n.condition, t, f) : Expr();
        },
        [&](const Call& n) -> Expr {
          bool marker = n.call_type == CallType::Operator && op_info(n.op).cls == OpClass::Marker;
          return marker && n.op != Op::stop_gradient ? added_to(n.args[0], k) : Expr();
        },
        [&](const ExprNode&) { return Expr(); });
  }
  Expr combined(const Expr& a, const Expr& b, int k, Kind) const {
    if (calls(a, f_) && calls(b, f_)) return {};
    Expr rest = added_to(calls(a, f_) ? a : b, k);
    return rest.defined() ? rest + (calls(a, f_) ? b : a) : Expr();
  }

  bool accumulates() {
    std::vector<Expr> added;
    for (size_t k = 0; k < values_.size(); ++k) {
      added.push_back(added_to(values_[k], static_cast<int>(k)));
      if (!added.back().defined() && f_->types[k].is_float()) return false;
      // Integers carry no adjoint, but must not steer the floating values; they cannot: those are
      // free of f.
    }
    result_.values = added;
    result_.domains = {domain_};
    return true;
  }

  // ---- selection ----

  bool selects() {
    auto selection = find_selection(q_.f, q_.stage);
    if (!selection) return false;
    result_.versions = {};
    Expr mine = iteration_number(definition_.rvars);
    FuncPtr winner = selection->winner;
    int index = selection->index_value;
    for (size_t k = 0; k < values_.size(); ++k) {
      const Expr& taken = selection->taken[k];
      Expr is_winner = call_value(winner, write_, index) == mine;
      result_.values.push_back(
          taken.defined() ? make_select(is_winner, taken, make_zero(taken.type())) : Expr());
    }
    result_.domains = {domain_};
    std::vector<Expr> initial;
    Expr untouched = call_value(winner, point_, index) < 0;
    for (size_t k = 0; k < values_.size(); ++k) {
      Expr a = current_at(point_, static_cast<int>(k));
      initial.push_back(
          selection->taken[k].defined() ? make_select(untouched, a, make_zero(a.type())) : a);
    }
    result_.previous = make_adjoint(q_.target, previous_name(), {}, initial);
    explain(Explanation::Kind::Version,
            text("update ", q_.stage - 1, " selects: ", quoted(winner->name),
                 " computes again which iteration wrote each element last"));
    return true;
  }

  // ---- recurrence and overwriting ----

  struct SelfRead {
    Expr call;
    UpdateRelations::Read relation;
    bool carries_adjoint = false;  // reached by the sweep
    bool is_needed = false;        // a partial needs its value
  };

  void recurrence() {
    UpdateRelations relations(domain_, write_, pure_);
    if (!relations.write_is_affine()) {
      user_error(asked(), "an update that overwrites must write at places known before it runs",
                 "an index on its left-hand side depends on data",
                 text("Accumulate with +=, or write ", quoted(f_->name), " in a pure definition"));
    }
    if (!relations.write_is_injective()) return rewritten_elements(relations);
    std::vector<SelfRead> reads = self_reads(relations);
    bool has_recurrence = false;
    SweepResult sweep = sweep_all();
    mark(reads, sweep);
    check_values(reads, relations);
    for (const SelfRead& r : reads) has_recurrence |= r.carries_adjoint && !r.relation.never_new;
    if (has_recurrence && !relations.predicate_is_affine()) refuse_predicate();
    if (has_recurrence) {
      own_current();
      sweep = sweep_all();
      add_recurrence(relations, reads, sweep);
    }
    make_previous(relations, reads, sweep);
    result_.values = values_;
    result_.domains = {domain_};
  }

  [[noreturn]] void refuse_predicate() const {
    unsupported(asked(), "which iteration wrote a value must be known before the update runs",
                text("the predicate ", print(domain_.predicate), " depends on data"),
                "Move the condition into a select on the right-hand side");
  }

  // Elements that several iterations write.
  void rewritten_elements(const UpdateRelations& relations) {
    bool reads_self =
        std::any_of(values_.begin(), values_.end(), [&](const Expr& e) { return calls(e, f_); });
    if (!reads_self && relations.predicate_is_affine()) {
      IterationDomain last = domain_;
      Expr condition = relations.last_writers();
      last.predicate = last.predicate.defined() ? last.predicate && condition : condition;
      result_.values = values_;
      result_.domains = {last};
      start_previous(relations.written(point_), {});
      return;
    }
    if (!reads_self) refuse_predicate();
    if (!q_.store_overwritten) refuse_overwritten(first_self_call());
    keep_all_versions();
  }

  Expr first_self_call() const {
    Expr found;
    for (const Expr& v : values_) {
      walk(v, [&](const Expr& e) {
        if (as_call_of(e, f_) && !found.defined()) found = e;
        return true;
      });
    }
    return found;
  }

  [[noreturn]] void refuse_overwritten(const Expr& read) const {
    const auto* call = read.as<Call>();
    user_error(
        asked(),
        "a partial derivative may need only values that are still there when the Func is complete",
        text("it needs ", point_text(f_->name, call->args),
             " as it was before an update overwrote it"),
        text("Give ", quoted(f_->name),
             " one more dimension that keeps the versions, or pass "
             "AdjointOptions{.overwritten = Overwritten::Store} to let the compiler keep them"));
  }

  void keep_all_versions() {
    FuncPtr before = clone_prefix(q_.f, q_.stage);
    auto versions = keep_versions(q_.f, q_.stage, before, q_.regions.of(f_));
    if (!versions) {
      unsupported(asked(),
                  "versions are kept of updates that read and write at their pure variables only",
                  text("it reads ", print(first_self_call())),
                  text("Give ", quoted(f_->name), " one more dimension that keeps the versions"));
    }
    Expr last = iteration_count(definition_.rvars);
    std::vector<Expr> at = write_;
    at.push_back(last);
    std::vector<Expr> initial;
    for (size_t k = 0; k < values_.size(); ++k) {
      result_.values.push_back(call_value(versions->func, at, static_cast<int>(k)));
      initial.push_back(make_zero(q_.target.types[k]));
    }
    IterationDomain once = domain_;
    once.predicate = Expr();
    std::erase_if(once.vars, [](const LoopVariable& v) { return v.is_reduction; });
    result_.domains = {once};
    result_.previous = make_adjoint(q_.target, previous_name(), {}, initial);
    result_.versions = {versions->func, before};
    result_.version_regions = {versions->region, q_.regions.of(f_)};
    explain(Explanation::Kind::Version,
            text("update ", q_.stage - 1, " overwrites values that its partials need: ",
                 quoted(versions->func->name), " keeps them all"));
  }

  std::vector<SelfRead> self_reads(UpdateRelations& relations) const {
    std::vector<SelfRead> reads;
    std::set<Expr, StructuralLess> seen;
    for (const Expr& v : values_) {
      walk(v, [&](const Expr& e) {
        const Call* call = as_call_of(e, f_);
        if (!call || !seen.insert(e).second) return true;
        auto relation = relations.read(call->args);
        if (!relation) {
          unsupported(asked(), "an update reads its own Func at places known before it runs",
                      text("the place of ", point_text(f_->name, call->args), " depends on data"),
                      "Read another Func there, or make the index affine");
        }
        reads.push_back({e, *relation});
        return true;
      });
    }
    return reads;
  }

  SweepResult sweep_all() const {
    std::vector<Expr> seeds;
    for (size_t k = 0; k < values_.size(); ++k) {
      seeds.push_back(f_->types[k].is_float() ? current_at(write_, static_cast<int>(k)) : Expr());
    }
    return sweep_reverse(values_, seeds, [&](const Expr& leaf) {
      return as_call_of(leaf, f_) || q_.is_wanted(leaf);
    });
  }

  void mark(std::vector<SelfRead>& reads, const SweepResult& sweep) const {
    std::set<Expr, StructuralLess> carrying, needed;
    for (const LeafAdjoint& leaf : sweep.leaves) {
      if (as_call_of(leaf.leaf, f_)) carrying.insert(leaf.leaf);
      walk(leaf.adjoint, [&](const Expr& e) {
        if (as_call_of(e, f_)) needed.insert(e);
        return true;
      });
    }
    for (SelfRead& r : reads) {
      r.carries_adjoint = carrying.contains(r.call);
      r.is_needed = needed.contains(r.call);
    }
  }

  // A needed value must be the final one, or a kept version.
  void check_values(const std::vector<SelfRead>& reads, const UpdateRelations& relations) {
    for (const SelfRead& r : reads) {
      if (!r.is_needed) continue;
      bool later = false;
      for (int s = q_.stage + 1; s < f_->stage_count(); ++s) {
        IterationDomain domain = q_.regions.domain(*q_.f, s);
        later |= relations.may_write(r.relation, domain, f_->stage(s).args);
      }
      if (!later && !r.relation.overwritten) continue;
      if (!q_.store_overwritten) refuse_overwritten(r.call);
      const auto* call = r.call.as<Call>();
      Expr after = later ? call_value(prefix(q_.stage + 1), call->args, call->value_index)
                         : call_value(q_.f, call->args, call->value_index);
      Expr before = call_value(prefix(q_.stage), call->args, call->value_index);
      Expr value = r.relation.never_new ? before
                   : r.relation.always_new
                       ? after
                       : make_select(r.relation.sees_new_condition, after, before);
      result_.self_values[r.call] = value;
      explain(Explanation::Kind::Version,
              text("update ", q_.stage - 1, ": the value of ", point_text(f_->name, call->args),
                   " is kept in a copy"));
    }
  }
  const FuncPtr& prefix(int stages) {
    FuncPtr& copy = prefixes_[stages];
    if (!copy) copy = clone_prefix(q_.f, stages);
    return copy;
  }

  Expr with_values(const Expr& e) const {
    Expr replaced =
        rewrite(e, [&](const Expr& node, const std::function<Expr(const Expr&)>& recurse) {
          auto it = result_.self_values.find(node);
          return it != result_.self_values.end() ? it->second : map_children(node, recurse);
        });
    return redirect_calls(replaced, q_.f, q_.f, false);
  }

  Expr current_at(const std::vector<Expr>& point, int k) const {
    return call_value(result_.current.func, point, k);
  }

  // The recurrence writes into the adjoint after the stage: a copy, when somebody reads that one
  // already.
  void own_current() {
    if (q_.extendable) return;
    std::vector<Expr> initial;
    for (size_t k = 0; k < values_.size(); ++k)
      initial.push_back(current_at(point_, static_cast<int>(k)));
    result_.current = make_adjoint(
        q_.target, f_->name + "_adj_update" + std::to_string(q_.stage - 1), {}, initial);
  }

  static IterationDomain restricted(IterationDomain domain, const Expr& condition) {
    if (is_const_true(condition)) return domain;
    domain.predicate = domain.predicate.defined() ? domain.predicate && condition : condition;
    return domain;
  }

  // Contributions of self reads: to newer values (`to_new`) or to those before the stage.
  std::vector<Contribution> self_contributions(const std::vector<SelfRead>& reads,
                                               const SweepResult& sweep, bool to_new) {
    std::vector<Contribution> result;
    for (const LeafAdjoint& leaf : sweep.leaves) {
      const Call* call = as_call_of(leaf.leaf, f_);
      if (!call) continue;
      auto read = std::find_if(reads.begin(), reads.end(),
                               [&](const SelfRead& r) { return equal(r.call, leaf.leaf); });
      const UpdateRelations::Read& relation = read->relation;
      if (to_new ? relation.never_new : relation.always_new) continue;
      Expr condition =
          to_new ? relation.sees_new_condition : logical_not(relation.sees_new_condition);
      if (to_new ? relation.always_new : relation.never_new) condition = const_true();
      AccessQuery query{restricted(domain_, condition), call->args, q_.target.args,
                        q_.target.region};
      for (const Gather& g : invert_access(query).gathers) {
        result.push_back(
            {call->value_index, g, substitute(with_values(leaf.adjoint), g.iteration)});
      }
    }
    return result;
  }

  // A(p) += sum over reads of A(W(i)) dV/df, p running against the order in which it was written.
  void add_recurrence(const UpdateRelations& relations, const std::vector<SelfRead>& reads,
                      const SweepResult& sweep) {
    std::vector<UpdateRelations::Read> relevant;
    for (const SelfRead& r : reads) {
      if (r.carries_adjoint && !r.relation.never_new) relevant.push_back(r.relation);
    }
    auto order = relations.reverse_order(relevant);
    if (!order) {
      unsupported(
          asked(),
          "a recurrence needs an order in which it can be run backward, dimension by dimension",
          text("no order of the dimensions of ", quoted(f_->name),
               " visits readers before what they read"),
          "Write the recurrence along one dimension at a time");
    }
    std::vector<Contribution> contributions = self_contributions(reads, sweep, true);
    append_reverse_loop(*order, contributions);
    explain(Explanation::Kind::Version,
            text("update ", q_.stage - 1, " is a recurrence: its adjoint runs backward"));
  }

  void append_reverse_loop(const std::vector<ReverseLoop>& order,
                           const std::vector<Contribution>& contributions) {
    auto rdom = std::make_shared<ReductionDomainContents>();
    rdom->frozen = true;
    Substitution place;
    // Terms that sum over a domain of their own: its variables run inside the element.
    std::vector<Expr> first_of_sum;
    const Gather* summed = nullptr;
    for (const Contribution& c : contributions) {
      if (!c.gather.rdom) continue;
      if (summed && summed->rdom != c.gather.rdom) refuse_two_sums();
      summed = &c.gather;
    }
    Expr first = const_true();
    if (summed) {
      for (const ReductionVariable& r : summed->rdom->vars) {
        rdom->vars.push_back({unique_name(r.var), r.min, r.extent});
        Expr v = variable(rdom->vars.back().var, Int(32), SymbolRef(rdom));
        place[r.var] = v;
        first = first && v == r.min;
      }
    }
    std::vector<Expr> lhs = point_;
    for (const ReverseLoop& loop : order) {
      const LoopVariable& range = q_.target.region[static_cast<size_t>(loop.dim)];
      Expr extent = simplify(range.max - range.min + 1);
      rdom->vars.push_back({unique_name("reverse"), make_zero(Int(32)), extent});
      Expr v = variable(rdom->vars.back().var, Int(32), SymbolRef(rdom));
      lhs[static_cast<size_t>(loop.dim)] =
          simplify(loop.descending ? range.max - v : range.min + v);
      place[f_->args[static_cast<size_t>(loop.dim)]] = lhs[static_cast<size_t>(loop.dim)];
    }
    std::vector<Expr> sums(values_.size());
    for (const Contribution& c : contributions) {
      Expr condition = element_condition(c.gather);
      if (c.gather.predicate.defined()) condition = condition && c.gather.predicate;
      condition = substitute(condition, place);
      if (summed && !c.gather.rdom) condition = condition && first;
      Expr term = substitute(c.adjoint, place);
      term = make_select(condition, term, make_zero(term.type()));
      Expr& sum = sums[static_cast<size_t>(c.value_index)];
      sum = sum.defined() ? sum + term : term;
    }
    std::vector<Expr> values;
    for (size_t k = 0; k < values_.size(); ++k) {
      Expr self = current_at(lhs, static_cast<int>(k));
      values.push_back(sums[k].defined() ? self + cast_to(self.type(), sums[k]) : self);
    }
    append_update(result_.current.func, lhs, values, rdom->vars, {});
    result_.current.stages.push_back(Accumulation::Scatter);
  }

  [[noreturn]] void refuse_two_sums() const {
    unsupported(asked(), "one read of a recurrence may sum over many iterations, not several",
                "two of its reads are each read again by many iterations", "Split the update");
  }

  // The element is the one that the gather's fixed indices name.
  Expr element_condition(const Gather& g) const {
    Expr condition = const_true();
    for (size_t d = 0; d < g.lhs.size(); ++d) {
      if (!g.pure[d]) condition = condition && point_[d] == g.lhs[d];
    }
    return condition;
  }

  std::string previous_name() const {
    return f_->name + "_adj_before_update" + std::to_string(q_.stage - 1);
  }

  void make_previous(const UpdateRelations& relations, const std::vector<SelfRead>& reads,
                     const SweepResult& sweep) {
    Expr written =
        relations.predicate_is_affine() ? relations.written(point_) : written_by_inversion();
    start_previous(written, self_contributions(reads, sweep, false));
  }

  // The adjoint before the stage: 0 where the stage writes, plus what the stage read of older
  // values. Values of a Tuple that the stage leaves alone keep their adjoint.
  void start_previous(const Expr& written, std::vector<Contribution> contributions) {
    std::vector<Expr> initial;
    for (size_t k = 0; k < values_.size(); ++k) {
      Expr a = current_at(point_, static_cast<int>(k));
      initial.push_back(make_select(simplify(written), make_zero(a.type()), a));
    }
    result_.previous = make_adjoint(q_.target, previous_name(), contributions, initial);
  }

  // With a predicate on data: the element is written where the predicate holds for the only
  // iteration that may.
  Expr written_by_inversion() const {
    Expr written = const_false();
    for (const Gather& g :
         invert_access({domain_, write_, q_.target.args, q_.target.region}).gathers) {
      Expr condition = element_condition(g);
      if (g.predicate.defined()) condition = condition && g.predicate;
      written = written || condition;
    }
    return written;
  }

  void explain(Explanation::Kind kind, const std::string& detail) {
    result_.explanations.push_back({kind, f_->name, detail});
  }

  const UpdateQuery& q_;
  FuncContents* f_;
  const Definition& definition_;
  IterationDomain domain_;
  std::vector<Expr> values_, write_, point_;
  std::vector<bool> pure_;
  std::map<int, FuncPtr> prefixes_;
  UpdateAdjoint result_;
};

}  // namespace

UpdateAdjoint differentiate_update(const UpdateQuery& query) {
  try {
    return UpdateDifferentiation(query).run();
  } catch (const isl::exception& e) {
    unsupported(
        text("differentiate update ", query.stage - 1, " of ", quoted(query.f->name)),
        "its index sets must be small enough to analyse", text("isl gave up: ", e.what()),
        "Write the update with simpler indices, or over fewer reduction variables at a time");
  }
}

}  // namespace retrograde::ir
