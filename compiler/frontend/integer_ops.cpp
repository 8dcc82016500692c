#include "frontend/integer_ops.h"

namespace retrograde {

Expr user_context_value() {
  return ir::call_op(ir::Op::runtime_call, Handle(), {Expr("retrograde_user_context")});
}

Expr concat_bits(const std::vector<Expr>& parts) {
  const std::string asked = "concatenate bits";
  if (parts.empty()) user_error(asked, "there is at least one part", "none was given");
  int total = 0;
  for (const Expr& part : parts) {
    if (!part.defined()) user_error(asked, "every part is a defined expression");
    if (part.type() != parts[0].type()) {
      user_error(asked, "all parts have one type",
                 to_string(parts[0].type()) + " and " + to_string(part.type()) + " were given",
                 "Cast them");
    }
    total += part.type().bits();
  }
  if (total != 8 && total != 16 && total != 32 && total != 64) {
    user_error(asked, "the result has 8, 16, 32 or 64 bits", text("it would have ", total),
               "Give another number of parts");
  }
  const Type whole = UInt(total), part_bits = parts[0].type().with_code(TypeCode::UInt);
  Expr result;
  for (size_t i = 0; i < parts.size(); i++) {
    const Expr bits = cast(whole, reinterpret(part_bits, parts[i]));
    const Expr placed = bits << cast(whole, static_cast<int>(i) * part_bits.bits());
    result = result.defined() ? result | placed : placed;
  }
  return result;
}

}  // namespace retrograde
