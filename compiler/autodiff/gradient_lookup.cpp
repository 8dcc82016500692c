#include "autodiff/gradient_lookup.h"

#include "autodiff/sweeps/custom_rules.h"
#include "diagnostics/error.h"

namespace retrograde {

namespace {

bool is_about(const Explanation& fact, const std::string& name) {
  using Kind = Explanation::Kind;
  return fact.subject == name && (fact.kind == Kind::Zero || fact.kind == Kind::NotRequested ||
                                  fact.kind == Kind::Custom || fact.kind == Kind::Version);
}

// The facts about a name. `is_zero`: they only state that its gradient is zero.
struct Facts {
  bool is_zero = true;
  std::string text;
};
Facts facts_about(const std::string& name, const std::vector<Explanation>& all) {
  Facts facts;
  for (const Explanation& fact : all) {
    if (!is_about(fact, name)) continue;
    facts.is_zero = facts.is_zero && fact.kind == Explanation::Kind::Zero;
    facts.text += (facts.text.empty() ? "" : "; ") + fact.detail;
  }
  return facts;
}

}  // namespace

graph::FuncPtr ZeroGradients::find(const std::shared_ptr<const ir::Symbol>& symbol,
                                   const std::string& name, const std::vector<Explanation>& facts) {
  const std::lock_guard lock(mutex_);
  graph::FuncPtr& zero = zeros_[symbol];
  if (zero) return zero;
  const Facts known = facts_about(name, facts);
  if (!known.is_zero) {
    user_error("find the gradient by " + quoted(name),
               "a gradient is looked up that was built, or is zero", known.text,
               "Name it in AdjointOptions::wrt; explain() says what was built");
  }
  if (known.text.empty()) {
    explanations_.push_back({Explanation::Kind::Zero, name, "the output does not depend on it"});
  }
  return zero = autodiff::zero_derivative(*symbol, "_adj");
}

std::vector<Explanation> ZeroGradients::explanations() const {
  const std::lock_guard lock(mutex_);
  return explanations_;
}

namespace autodiff {

std::shared_ptr<const ParameterContents> image_read_by(const FuncContents& f) {
  if (!f.is_pure() || f.is_extern() || f.types.size() != 1) return nullptr;
  const auto* call = f.pure->values[0].as<Call>();
  if (!call) return nullptr;
  const auto image = std::dynamic_pointer_cast<const ParameterContents>(call->symbol.lock());
  if (!image || call->args.size() != f.args.size()) return nullptr;
  for (size_t d = 0; d < f.args.size(); ++d) {
    const auto* v = call->args[d].as<Variable>();
    if (!v || v->name != f.args[d]) return nullptr;
  }
  return image;
}

}  // namespace autodiff
}  // namespace retrograde
