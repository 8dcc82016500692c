#include "autodiff/sweeps/tangent_synthesis.h"

#include <algorithm>

#include "autodiff/rules/value_range.h"
#include "autodiff/sums/generated_definitions.h"
#include "autodiff/sweeps/custom_rules.h"
#include "autodiff/sweeps/forward_sweep.h"
#include "diagnostics/error.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "ir/build.h"
#include "ir/memory_reads.h"

namespace retrograde::autodiff {

namespace {

// One definition linearised. It reads the Func's own tangent as `own`.
struct StageTangent {
  std::vector<Expr> values;  // for each value; undefined: zero
  bool moves = false;        // a value has a tangent that is not identically zero
  AdjointTraits traits;
};

// Builds the tangent of one Func.
class FuncTangent {
 public:
  FuncTangent(const FuncPtr& f, FunctionRef<Expr(const Expr&)> tangent_of,
              const ValueRanges& ranges)
      : f_(f), tangent_of_(tangent_of), ranges_(ranges) {}

  // Returns null if the tangent is identically zero. If `dual` is set, the tangent reads it.
  FuncPtr build() {
    if (!moves()) return nullptr;
    tangent_ = make_func(Role::Tangent, f_->name + "_tan", f_->name);
    if (!linearise_all(tangent_, 0)) return build_dual();
    for (int s = 0; s < f_->stage_count(); ++s) define(tangent_, s, {}, stages_[s].values);
    return tangent_;
  }

  FuncPtr dual() const { return dual_; }
  const std::set<std::string>& notes() const { return notes_; }

 private:
  size_t count() const { return f_->types.size(); }

  // Whether any stage moves if the Func's own tangent is taken as zero. If none does, the tangent is zero.
  bool moves() {
    bool result = false;
    for (int s = 0; s < f_->stage_count(); ++s) result |= linearise_stage(s, nullptr, 0).moves;
    return result;
  }

  // Repeats linearisation until the traits are stable: tangents pass through the stages repeatedly, so a trait of one
  // stage applies to all.
  bool linearise_all(const FuncPtr& own, size_t offset) {
    AdjointTraits& traits = own->made->traits;
    AdjointTraits before;
    bool alone = false;
    do {
      before = traits;
      alone = linearise(own, offset);
      for (const StageTangent& stage : stages_) traits.add(stage.traits);
    } while (traits != before && f_->stage_count() > 1);
    return alone;
  }

  // Linearises all stages, reading the Func's own tangents at `offset` of `own`. Returns false if the tangents need the
  // Func's values.
  bool linearise(const FuncPtr& own, size_t offset) {
    stages_.clear();
    bool alone = true;
    for (int s = 0; s < f_->stage_count(); ++s) {
      stages_.push_back(linearise_stage(s, own, offset));
      for (const Expr& e : stages_.back().values) alone &= !calls(e, f_.get());
      for (const Expr& e : f_->stage(s).args) alone &= !calls(e, f_.get());
      alone &= !calls(f_->stage(s).predicate, f_.get());
    }
    return alone;
  }

  StageTangent linearise_stage(int s, const FuncPtr& own, size_t offset) {
    auto tangent_of = [&](const Expr& leaf) {
      const auto* call = leaf.as<Call>();
      if (!call || call->symbol.raw() != f_.get()) return tangent_of_(leaf);
      if (!own) return Expr();
      auto index = static_cast<size_t>(call->component);
      return call_func(own->name, adjoint_type(f_->types[index]), call->args,
                       static_cast<int>(offset + index), SymbolRef(own));
    };
    ForwardResult swept = sweep(s, mapped(f_->stage(s).values, without_lets), tangent_of);
    StageTangent result{swept.tangents, swept.moves, swept.traits};
    notes_.insert(swept.notes.begin(), swept.notes.end());
    return result;
  }

  ForwardResult sweep(int s, const std::vector<Expr>& values,
                      FunctionRef<Expr(const Expr&)> tangent_of) const {
    try {
      return sweep_forward(values, tangent_of, ranges_);
    } catch (const Unsupported& e) {  // the sweep does not know the stage
      Message m = e.message();
      m.asked += " in " + quoted(stage_name(*f_, s));
      throw Unsupported(m);
    }
  }

  FuncPtr build_dual() {
    dual_ = make_func(Role::Tangent, f_->name + "_dual", f_->name);
    linearise_all(dual_, count());
    tangent_->made->traits = dual_->made->traits;
    for (int s = 0; s < f_->stage_count(); ++s)
      define(dual_, s, f_->stage(s).values, stages_[s].values);
    const std::vector<Expr> args = variables_of(f_->args), all = values_of(dual_, args);
    define_pure(tangent_, args, {all.end() - static_cast<std::ptrdiff_t>(count()), all.end()});
    return tangent_;
  }

  // Defines stage s of `to`: the primal values, if any, then the tangents.
  void define(const FuncPtr& to, int s, std::vector<Expr> values,
              const std::vector<Expr>& tangents) const {
    const Definition& definition = f_->stage(s);
    for (size_t k = 0; k < count(); ++k) {
      Type type = adjoint_type(f_->types[k]);
      values.push_back(tangents[k].defined() ? cast_to(type, tangents[k]) : make_zero(type));
    }
    auto redirected = [&](const Expr& e) {
      return e.defined() ? redirect_calls(e, f_, to, false) : e;
    };
    for (Expr& e : values) e = redirected(e);
    if (s == 0) return define_pure(to, variables_of(f_->args), values);
    append_update(to, mapped(definition.args, redirected), values, definition.rvars,
                  redirected(definition.predicate));
  }

  const FuncPtr& f_;
  FunctionRef<Expr(const Expr&)> tangent_of_;
  const ValueRanges& ranges_;
  std::vector<StageTangent> stages_;
  std::set<std::string> notes_;
  FuncPtr tangent_, dual_;
};

class TangentSynthesis {
 public:
  TangentSynthesis(const FuncPtr& output, const Directions& directions)
      : directions_(directions), ranges_(topological_order({output})) {
    result_.order = topological_order({output});
  }

  TangentResult run() {
    for (const FuncPtr& f : result_.order) differentiate(f);
    return std::move(result_);
  }

 private:
  void differentiate(const FuncPtr& f) {
    FuncPtr own;
    if (f->custom_derivatives) {
      own = differentiate_by_rule(f);
    } else if (f->is_extern()) {
      refuse_active(*f);
    } else {
      own = differentiate_stages(f);
    }
    FuncPtr tangent = with_direction(*f, own);
    if (tangent) {
      result_.tangents[f.get()] = tangent;
    } else if (std::ranges::any_of(f->types, [](Type t) { return t.is_float(); })) {
      explain(Explanation::Kind::Zero, *f,
              "it does not depend on an input that moves along a differentiable path");
    }
  }

  FuncPtr differentiate_by_rule(const FuncPtr& f) {
    auto found_in = [](const auto& tangents, const Symbol* symbol) {
      return value_or(tangents, symbol, {});
    };
    FuncPtr own = run_custom_tangent(
        f,
        [&](const Symbol* symbol) {
          bool is_func = dynamic_cast<const FuncContents*>(symbol) != nullptr;
          return found_in(is_func ? result_.tangents : directions_, symbol);
        },
        [&](const Symbol* symbol) { return directions_.contains(symbol); });
    if (!own) return nullptr;
    result_.funcs.push_back(own);
    explain(Explanation::Kind::Custom, *f, text(quoted(own->name), ", from its custom tangent"));
    return own;
  }

  FuncPtr differentiate_stages(const FuncPtr& f) {
    auto tangent_of = [&](const Expr& leaf) { return tangent_of_leaf(leaf); };
    FuncTangent builder(f, tangent_of, ranges_);
    FuncPtr own = builder.build();
    for (const std::string& note : builder.notes()) explain(Explanation::Kind::Zero, *f, note);
    if (!own) return nullptr;
    if (builder.dual()) {
      result_.funcs.push_back(builder.dual());
      explain(Explanation::Kind::Version, *f,
              text("its updates need values that they overwrite: recomputed, with the tangent, "
                   "in ",
                   quoted(builder.dual()->name)));
    }
    result_.funcs.push_back(own);
    explain(Explanation::Kind::Built, *f, text(quoted(own->name), ", stage by stage"));
    return own;
  }

  Expr tangent_of_leaf(const Expr& leaf) const {
    const auto* call = leaf.as<Call>();
    const auto* v = leaf.as<Variable>();
    const Symbol* symbol = call ? call->symbol.raw() : v->symbol.raw();
    int index = call ? call->component : 0;
    bool is_func = call && call->call_type == CallType::Func;
    const auto& from = is_func ? result_.tangents : directions_;
    auto found = from.find(symbol);
    if (found == from.end()) return {};
    return call_value(found->second, call ? call->args : std::vector<Expr>{}, index);
  }

  FuncPtr with_direction(const FuncContents& f, const FuncPtr& own) {
    auto found = directions_.find(&f);
    if (found == directions_.end()) return own;
    if (!own) return found->second;
    FuncPtr sum = make_func(Role::Tangent, f.name + "_tan_sum", f.name);
    const std::vector<Expr> args = variables_of(f.args);
    std::vector<Expr> values = values_of(own, args), direction = values_of(found->second, args);
    for (size_t k = 0; k < f.types.size(); ++k)
      values[k] = values[k] + cast_to(adjoint_type(f.types[k]), direction[k]);
    define_pure(sum, args, values);
    sum->made->traits = own->made->traits;
    result_.funcs.push_back(sum);
    return sum;
  }

  bool moves(const ExternArgument& a) const {
    switch (a.kind) {
      case ExternArgument::Kind::Func:
        return result_.tangents.contains(a.func.get());
      case ExternArgument::Kind::Buffer:
        return directions_.contains(a.buffer.get());
      case ExternArgument::Kind::Expr:
        break;
    }
    return any_node(a.expr, [&](const Expr& e) {
      return is_leaf(e) && e.type().is_float() && tangent_of_leaf(e).defined();
    });
  }

  void refuse_active(const FuncContents& f) const {
    const auto& args = f.extern_definition->args;
    if (std::ranges::none_of(args, [&](const auto& a) { return moves(a); })) return;
    unsupported(text("propagate tangents through ", quoted(f.name)),
                "derivatives come from definitions",
                text("the C function ", quoted(f.extern_definition->function),
                     " computes it from an input that moves"),
                text("Give the tangent of ", quoted(f.name), " itself as a direction"));
  }

  void explain(Explanation::Kind kind, const FuncContents& f, const std::string& detail) {
    result_.explanations.push_back({kind, f.name, detail});
  }

  const Directions& directions_;
  ValueRanges ranges_;
  TangentResult result_;
};

}  // namespace

FuncPtr zero_tangent(const FuncContents& f) {
  FuncPtr zero = make_func(Role::Tangent, f.name + "_tan", f.name);
  define_pure(zero, variables_of(f.args),
              mapped(f.types, [](Type t) { return make_zero(adjoint_type(t)); }));
  return zero;
}

TangentResult synthesize_tangents(const FuncPtr& output, const Directions& directions) {
  return TangentSynthesis(output, directions).run();
}

}  // namespace retrograde::autodiff
