#include "analysis/nonnegative.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/node_memo.h"
#include "ir/scalar.h"
#include "ir/visit.h"

namespace retrograde::analysis {

namespace {

class Signs {
 public:
  bool nonnegative(const Expr& e) {
    return known_.get(e, [&] { return decide(e); });
  }

 private:
  NodeMemo<bool> known_;

  bool decide(const Expr& e) {
    if (e.type().is_uint()) return true;
    if (const auto value = as_const_float(e)) return *value >= 0;
    if (const auto value = as_const_int(e)) return *value >= 0;
    if (const auto* cast = e.as<Cast>()) return nonnegative(cast->value);
    if (const auto* choice = e.as<Select>())
      return nonnegative(choice->when_true) && nonnegative(choice->when_false);
    if (const auto* call = e.as<Call>()) return decide_call(*call);
    const auto* op = e.as<Binary>();
    return op && e.type().is_float() && decide_binary(e.kind(), *op);
  }

  // Rounding never crosses zero; 0 * infinity and infinity - infinity are NaN.
  bool decide_binary(Kind kind, const Binary& op) {
    const auto both = [&] { return nonnegative(op.a) && nonnegative(op.b); };
    switch (kind) {
      case Kind::Add:
      case Kind::Div:
        return both();
      case Kind::Mul:
        return equal(op.a, op.b) || both();
      case Kind::Min:
        return both();
      default:
        return false;
    }
  }

  bool decide_call(const Call& call) {
    if (call.call_type != CallType::Operator) return false;
    if (op_info(call.op).values.low >= 0) return true;
    const int passed = passed_operand(call.op);
    return (passed >= 0 || keeps_sign(call.op)) &&
           nonnegative(call.args[static_cast<size_t>(std::max(passed, 0))]);
  }

  // Increasing, with a nonnegative value at 0.
  static bool keeps_sign(Op op) {
    return op_info(op).bounds == BoundsRule::AtEnds &&
           eval_operator(op, {Scalar::of_float(Float(64), 0)}, Float(64))->f >= 0;
  }
};

}  // namespace

bool is_nonnegative_or_nan(const Expr& e) { return Signs().nonnegative(e); }

}  // namespace retrograde::analysis
