#include "tuning/operation_work.h"

#include <algorithm>
#include <cmath>

#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::tuning {

double vectors_of(Type type, int vector_bytes) {
  return std::max(1.0, std::ceil(static_cast<double>(type.bytes()) * type.lanes() / vector_bytes));
}

namespace {

bool is_scalar_integer(Type type) { return type.lanes() == 1 && !type.is_float(); }

// Of the wider of operand and result: comparisons give bits of masks.
double wide_vectors(const Expr& e, int vector_bytes) {
  double result = vectors_of(e.type(), vector_bytes);
  for_each_child(e, [&](const Expr& child) {
    result = std::max(result, vectors_of(child.type(), vector_bytes));
  });
  return result;
}

Work operations(const Expr& e, double count, int vector_bytes) {
  Work work;
  if (is_scalar_integer(e.type()) && !e.type().is_bool())
    work.scalars = count;
  else
    work.operations = count * wide_vectors(e, vector_bytes);
  return work;
}

Work division(const Expr& e, const Expr& by, int vector_bytes) {
  Work work;
  const Type type = e.type();
  const double vectors = vectors_of(type, vector_bytes);
  if (type.is_float()) {
    (type.bits() == 64 ? work.double_divisions : work.divisions) = vectors;
  } else if (as_scalar(by)) {  // by shifts and products
    (type.lanes() == 1 ? work.scalars : work.operations) = 3 * vectors;
  } else {
    work.scalar_divisions = type.lanes();
  }
  return work;
}

// In vectors of float32; of double they hold half as many and take twice as long.
void add_function(Work& work, Op op, Type type, double vectors) {
  const double times = vectors * (type.bits() == 64 ? 2 : 1);
  switch (op) {
    case Op::sqrt:
      (type.bits() == 64 ? work.double_roots : work.roots) += vectors;
      return;
    case Op::exp:
      work.exps += times;
      return;
    case Op::log:
      work.logs += times;
      return;
    case Op::pow:
      work.pows += times;
      return;
    case Op::sin:
    case Op::cos:
      work.sines += times;
      return;
    default:
      break;
  }
  // Others as long as exp, by the sums that they are taken for; fast forms are inlined.
  const double adds = op_info(op).work.function_adds;
  if (exact_form(op) != op || op == Op::fast_inverse || op == Op::fast_inverse_sqrt)
    work.operations += adds * times;
  else
    work.exps += times * adds / op_info(Op::exp).work.function_adds;
}

Work call_work(const Expr& e, const Call& call, int vector_bytes) {
  Work work;
  if (call.call_type == CallType::Extern) {
    work.scalars = 50 * call.type.lanes();
    return work;
  }
  if (call.call_type != CallType::Operator || call.is_marker()) return work;
  const OpInfo& info = op_info(call.op);
  if (info.cls == OpClass::Internal) {
    if (call.is_op(Op::runtime_call, Op::error)) work.scalars = 20;
    return work;
  }
  const double vectors = wide_vectors(e, vector_bytes);
  work = operations(e, std::max(1, info.work.adds + info.work.mults), vector_bytes);
  if (info.work.functions > 0) {
    work = Work();
    add_function(work, call.op, call.type, vectors);
  }
  return work;
}

Work product(const Expr& e, int vector_bytes) {
  // Of 32 and 64 bits, integers take two and three operations.
  const Type type = e.type();
  const bool is_long = !type.is_float() && type.lanes() > 1 && type.bits() >= 32;
  return operations(e, is_long ? type.bits() / 32 + 1 : 1, vector_bytes);
}

Work cast(const Expr& e, const Expr& from, int vector_bytes) {
  Work work = operations(e, 1, vector_bytes);
  const double in = vectors_of(from.type(), vector_bytes);
  const double out = vectors_of(e.type(), vector_bytes);
  if (from.type().bits() != e.type().bits() && e.type().lanes() > 1)
    work.shuffles += std::max(in, out) / 2;
  return work;
}

}  // namespace

bool is_contracted(const Expr& sum, const Expr& operand) {
  return (sum.kind() == Kind::Add || sum.kind() == Kind::Sub) && operand.kind() == Kind::Mul &&
         sum.type().is_float();
}

Work operation_work(const Expr& e, int vector_bytes) {
  return match(
      e,
      [&](const Binary& n) {
        if (e.kind() == Kind::Div || e.kind() == Kind::Mod) return division(e, n.b, vector_bytes);
        if (e.kind() == Kind::Mul) return product(e, vector_bytes);
        return operations(e, 1, vector_bytes);
      },
      [&](const Select&) { return operations(e, 1, vector_bytes); },
      [&](const Not&) { return operations(e, 0.5, vector_bytes); },
      [&](const Cast& n) { return cast(e, n.value, vector_bytes); },
      [&](const Call& n) { return call_work(e, n, vector_bytes); },
      [&](const Shuffle& n) {
        Work work;
        if (n.type.lanes() > 1) work.shuffles = wide_vectors(e, vector_bytes);
        return work;
      },
      [&](const VectorReduce& n) {
        Work work;
        const double vectors = vectors_of(n.value.type(), vector_bytes);
        const double halvings = std::log2(n.value.type().lanes() / std::max(1, n.type.lanes()));
        work.operations = vectors + halvings;
        work.shuffles = halvings;
        return work;
      },
      [](const ExprNode&) { return Work(); });
}

Work access_work(Type type, const Lanes& lanes, bool is_store, bool is_masked, int vector_bytes) {
  Work work;
  double& moves = is_store ? work.stores : work.loads;
  double& single = is_store ? work.scatter_lanes : work.gather_lanes;
  const double vectors = vectors_of(type, vector_bytes), step = std::abs(lanes.step);
  if (type.lanes() == 1 || (lanes.is_uniform() && !is_store)) {
    moves = 1;
  } else if (lanes.any || step > 4) {
    single = type.lanes();
  } else if (step == 1 && !lanes.bent) {
    // Runs that lie apart are put together.
    const double runs = static_cast<double>(type.lanes()) / std::max(1, lanes.inner);
    moves = std::max(vectors, runs);
    if (moves > vectors) work.shuffles = moves;
    if (lanes.step < 0) work.shuffles = vectors;
  } else if (lanes.bent && !is_store) {
    moves = 2 * vectors;
    work.shuffles = vectors;
    work.operations = 2 * vectors;
  } else {
    moves = std::max(1.0, step) * vectors;
    work.shuffles = (is_store ? 2 : 1) * std::max(1.0, step) * vectors;
  }
  if (is_masked) work.operations += vectors;
  return work;
}

}  // namespace retrograde::tuning
