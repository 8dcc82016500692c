#include "autodiff/report/zero_reasons.h"

#include <set>
#include <utility>

#include "autodiff/rules/derivative_rules.h"
#include "ir/build.h"
#include "ir/print.h"

namespace retrograde::autodiff {

namespace {

constexpr size_t many_reasons = 4;

const Symbol* read_by(const Expr& e) {
  if (const auto* call = e.as<Call>()) return call->symbol.raw();
  const auto* v = e.as<Variable>();
  return v ? v->symbol.raw() : nullptr;
}

// Why the derivative of `e` by its operands is 0; empty if it need not be.
std::string barrier(const Expr& e) {
  if (e.as<Cast>() && !e.type().is_float()) return "in a cast to " + to_string(e.type());
  if (e.type().is_bool()) return "in a condition";
  const auto* call = e.as<Call>();
  if (!call) return "";
  if (call->call_type != CallType::Operator) return text("in an index of ", quoted(call->name));
  const RuleClass cls = derivative_rule(call->op).cls;
  const bool blocks = cls == RuleClass::Constant || cls == RuleClass::Blocked;
  return blocks ? text("in ", op_info(call->op).name, ", whose derivative is 0") : "";
}

// Finds the operations with derivative 0 between reads of the input and the value of an expression.
class Barriers {
 public:
  explicit Barriers(const Symbol* input) : input_(input) {}

  // `before`: a barrier found above `e`; empty: none.
  void look(const Expr& e, const std::string& before) {
    if (!seen_.insert({e.get(), before}).second) return;
    if (read_by(e) == input_) found_.insert(before);
    const std::string here = before.empty() ? barrier(e) : before;
    for_each_child(e, [&](const Expr& child) { look(child, here); });
  }
  const std::set<std::string>& found() const { return found_; }

 private:
  const Symbol* input_;
  std::set<std::pair<const ExprNode*, std::string>> seen_;
  std::set<std::string> found_;
};

std::set<std::string> barriers_in(const Symbol* input, const FuncContents& f) {
  Barriers barriers(input);
  for (int s = 0; s < f.stage_count(); ++s) {
    const Definition& d = f.stage(s);
    for (const Expr& value : d.values) barriers.look(value, "");
    for (const Expr& arg : d.args) barriers.look(arg, "in an index that it writes to");
    if (d.predicate.defined()) barriers.look(d.predicate, "in a condition");
    for (const ReductionVariable& r : d.rvars) {
      barriers.look(r.min, "in the bounds of a loop");
      barriers.look(r.extent, "in the bounds of a loop");
    }
  }
  return barriers.found();
}

}  // namespace

std::vector<std::string> zero_reasons(const Symbol* input, const std::vector<FuncPtr>& order,
                                      FunctionRef<bool(const FuncContents&)> has_adjoint) {
  std::vector<std::string> reasons;
  for (const FuncPtr& f : order) {
    if (f.get() == input) continue;
    for (const std::string& barrier : barriers_in(input, *f)) {
      if (reasons.size() == many_reasons) return reasons;
      if (!barrier.empty()) {
        reasons.push_back(text(quoted(f->name), " reads it ", barrier));
      } else if (!has_adjoint(*f)) {
        reasons.push_back(text(quoted(f->name), " reads it, and its own gradient is zero"));
      } else {
        reasons.push_back(text(quoted(f->name), " reads it where the derivative is 0"));
      }
    }
  }
  return reasons;
}

}  // namespace retrograde::autodiff
