#include "autodiff/report/absent_gradients.h"

#include "autodiff/report/zero_reasons.h"
#include "autodiff/sweeps/custom_rules.h"
#include "autodiff/sweeps/input_shape.h"
#include "diagnostics/error.h"

namespace retrograde::autodiff {

namespace {

class AbsentGradients {
 public:
  AbsentGradients(const Primal& primal, const std::unordered_set<const Symbol*>& covered,
                  SynthesisResult& result, SynthesisAccount& account)
      : primal_(primal), covered_(covered), result_(result), account_(account) {}

  // Gives a zero, with its reason, to each requested symbol without contributions.
  void find_absent() {
    for (const FuncPtr& f : primal_.order) {
      if (covered_.contains(f.get()) ||
          result_.after_stage.contains({f.get(), f->stage_count() - 1}) ||
          !is_wanted_zero(f.get(), f->name, is_floating(f->types), f->types[0]))
        continue;
      AdjointFunc zero = make_adjoint(primal_.target_of(f.get()), f->name + "_adj", {});
      for (int s = 0; s < f->stage_count(); ++s) result_.after_stage[{f.get(), s}] = zero.func;
    }
    for (const auto& p : parameters_of(primal_.outputs)) {
      if (result_.parameters.contains(p.get()) ||
          !is_wanted_zero(p.get(), p->name, p->type.is_float(), p->type))
        continue;
      result_.parameters[p.get()] =
          make_adjoint(primal_.target_of(p.get()), p->name + "_adj", {}).func;
    }
  }
  // Gives a zero to each requested symbol that the output does not depend on.
  void find_strangers() {
    std::unordered_set<const Symbol*> reached;
    for (const FuncPtr& f : primal_.order) reached.insert(f.get());
    for (const auto& p : parameters_of(primal_.outputs)) reached.insert(p.get());
    std::map<std::string, const Symbol*> strangers;  // by name, for a deterministic order
    for (const Symbol* symbol : primal_.options.requested) {
      if (symbol && !reached.contains(symbol)) strangers[shape_of(symbol).name] = symbol;
    }
    for (const auto& [name, symbol] : strangers) {
      const InputShape shape = shape_of(symbol);
      account_.add(Explanation::Kind::Zero, shape.name, "the output does not depend on it");
      if (!shape.is_floating()) continue;
      const auto* f = dynamic_cast<const FuncContents*>(symbol);
      if (!f) result_.parameters[symbol] = zero_derivative(*symbol, "_adj");
      for (int s = 0; f && s < f->stage_count(); ++s)
        result_.after_stage[{f, s}] = zero_derivative(*symbol, "_adj");
    }
  }

 private:
  std::string without_path(const Symbol* symbol) const {
    std::string result = "the output does not depend on its value along a differentiable path";
    const char* separator = ": ";
    for (const std::string& reason :
         zero_reasons(symbol, primal_.order, [&](const FuncContents& f) {
           return result_.after_stage.contains({&f, f.stage_count() - 1}) && !zero_.contains(&f);
         })) {
      result += separator + reason;
      separator = "; ";
    }
    return result;
  }
  // Whether its gradient is a zero that a user may look up.
  bool is_wanted_zero(const Symbol* symbol, const std::string& name, bool floating, Type type) {
    if (!floating) {
      account_.add(Explanation::Kind::Zero, name,
                   "its type is " + to_string(type) + ": integers have no derivative");
    } else if (primal_.active.cancels(symbol)) {
      account_.add(
          Explanation::Kind::Zero, name,
          "the output is the same for all of its values: it only shifts or scales a softmax, a "
          "log-sum-exp or a norm, which cancels");
      return true;
    } else if (auto left = primal_.options.left_out.find(symbol);
               left != primal_.options.left_out.end()) {
      account_.add(Explanation::Kind::NotRequested, name, "left out: " + left->second);
    } else if (!primal_.active.contains(symbol)) {
      account_.add(Explanation::Kind::NotRequested, name,
                   "no requested gradient needs its adjoint");
    } else {
      account_.add(Explanation::Kind::Zero, name, without_path(symbol));
      zero_.insert(symbol);
      return true;
    }
    return false;
  }

  const Primal& primal_;
  const std::unordered_set<const Symbol*>& covered_;
  SynthesisResult& result_;
  SynthesisAccount& account_;
  std::unordered_set<const Symbol*> zero_;  // without a differentiable path to the output
};

}  // namespace

void explain_absent(const Primal& primal, const std::unordered_set<const Symbol*>& covered,
                    SynthesisResult& result, SynthesisAccount& account) {
  AbsentGradients gradients(primal, covered, result, account);
  gradients.find_absent();
  gradients.find_strangers();
}

}  // namespace retrograde::autodiff
