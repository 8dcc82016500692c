#include "analysis/nonnegative.h"

#include <unordered_map>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

class Signs {
 public:
  bool nonnegative(const Expr& e) {
    if (const auto found = known_.find(e.get()); found != known_.end()) return found->second;
    const bool result = decide(e);
    return known_[e.get()] = result;
  }

 private:
  std::unordered_map<const ExprNode*, bool> known_;

  bool decide(const Expr& e) {
    if (e.type().is_uint()) return true;
    if (const auto value = as_const_float(e)) return *value >= 0;
    if (const auto value = as_const_int(e)) return *value >= 0;
    if (const auto* cast = e.as<Cast>()) return nonnegative(cast->value);
    if (const auto* choice = e.as<Select>())
      return nonnegative(choice->true_value) && nonnegative(choice->false_value);
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
    switch (call.op) {
      case Op::abs:
        return call.type.is_float();
      case Op::sqrt:
      case Op::exp:
        return true;
      case Op::floor:
      case Op::ceil:
      case Op::round:
      case Op::trunc:
      case Op::likely:
      case Op::strict_float:
        return nonnegative(call.args[0]);
      default:
        return false;
    }
  }
};

}  // namespace

bool is_nonnegative_or_nan(const Expr& e) { return Signs().nonnegative(e); }

}  // namespace retrograde::ir
