#include "lower/nests/strict_indices.h"

#include <functional>

#include "analysis/interval.h"
#include "analysis/nonnegative.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::ir {

namespace {

bool reads_element(const Expr& e) {
  const auto* call = e.as<Call>();
  return call && (call->call_type == CallType::Func || call->call_type == CallType::Image);
}

// A float sum and a float product that it may be contracted with; elements that e reads are values.
bool may_contract(const Expr& e) {
  bool sum = false, product = false;
  walk(e, [&](const Expr& part) {
    if (reads_element(part)) return false;
    const auto* call = part.as<Call>();
    const bool is_lerp = call && call->is_op(Op::lerp);
    if (part.type().is_float()) {
      sum |= part.kind() == Kind::Add || part.kind() == Kind::Sub || is_lerp;
      product |= part.kind() == Kind::Mul || is_lerp || (call && call->is_op(Op::strong_mul));
    }
    return !(sum && product);
  });
  return sum && product;
}

bool may_be_negative_as_nan(const Expr& value, Type type) {
  return type.is_int() && is_nonnegative_or_nan(value) &&
         !bounds_of(value, Scope<Interval>()).has_lower_bound();
}

// Of a coordinate, down to the elements that it reads.
class StrictCoordinate : public Rewriter {
 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override {
    if (reads_element(e)) return e;
    const auto* cast = e.as<Cast>();
    if (!cast || !cast->type.is_int_or_uint() || !cast->value.type().is_float()) return children(e);
    const Expr& value = cast->value;
    const Expr place = may_contract(value)
                           ? cast_to(cast->type, call_op(Op::strict_float, value.type(), {value}))
                           : children(e);
    return may_be_negative_as_nan(value, cast->type) ? max(place, make_zero(cast->type)) : place;
  }
};

class StrictIndices : public Rewriter {
 public:
  Expr coordinate(const Expr& e) { return strict_((*this)(e)); }

 protected:
  using Rewriter::rewrite;
  Expr rewrite(const Expr& e) override {
    const Expr inner = children(e);
    if (!reads_element(inner)) return inner;
    return map_children(inner, [&](const Expr& arg) { return strict_(arg); });
  }

 private:
  StrictCoordinate strict_;
};

}  // namespace

void make_indices_strict(Program& program) {
  StrictIndices strict;
  for (LoopedFunc& f : program.funcs) {
    for (Definition& stage : f.stages) {
      stage = map_exprs(stage, std::ref(strict));
      for (Expr& coordinate : stage.args) coordinate = strict.coordinate(coordinate);
    }
  }
}

}  // namespace retrograde::ir
