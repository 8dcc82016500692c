// Loads at a ramp that bounds hold inside of an image, as the borders of loops have them:
//
//   in[max(min(ramp(x, 1, 32), broadcast(w - 1)), broadcast(0)) + broadcast(row)]
//
// From lane to lane the index stays or goes up by one, so that all lanes lie within as many elements
// as there are lanes. Where the machine has a shuffle by numbers, that is
//
//   first = index of lane 0, last = index of lane 31
//   spread = in[ramp(first, 1, 32)] if (ramp(first, 1, 32) <= last)
//   result[i] = spread[index[i] - first]
//
// and elsewhere a dense load if last - first is 31, as it is but at the border itself. Lanes whose
// predicate is off count for neither end.
#include <llvm/IR/IntrinsicsX86.h>

#include "codegen/function_generator.h"
#include "ir/build.h"

namespace retrograde::codegen {

using namespace ir;

// The shuffle of a whole register of such elements by numbers of their width, if the machine has it.
static llvm::Intrinsic::ID shuffle_by_numbers(const Machine& machine, int bits, int lanes) {
  switch (bits * lanes) {
    case 128:
      if (bits == 8 && machine.has_avx512_bytes())
        return llvm::Intrinsic::x86_avx512_permvar_qi_128;
      if (bits == 16 && machine.has_avx512_words())
        return llvm::Intrinsic::x86_avx512_permvar_hi_128;
      break;
    case 256:
      if (bits == 8 && machine.has_avx512_bytes())
        return llvm::Intrinsic::x86_avx512_permvar_qi_256;
      if (bits == 16 && machine.has_avx512_words())
        return llvm::Intrinsic::x86_avx512_permvar_hi_256;
      if (bits == 32 && machine.has_avx2()) return llvm::Intrinsic::x86_avx2_permd;
      break;
    case 512:
      if (bits == 8 && machine.has_avx512_bytes())
        return llvm::Intrinsic::x86_avx512_permvar_qi_512;
      if (bits == 16 && machine.has_avx512_words())
        return llvm::Intrinsic::x86_avx512_permvar_hi_512;
      if (bits == 32 && machine.has_avx512()) return llvm::Intrinsic::x86_avx512_permvar_si_512;
      if (bits == 64 && machine.has_avx512()) return llvm::Intrinsic::x86_avx512_permvar_di_512;
      break;
    default:
      break;
  }
  return llvm::Intrinsic::not_intrinsic;
}

// Whether a coordinate goes up from lane to lane, by at most one each time; nothing where it may do
// anything else. `room`: nodes that may be looked at.
std::optional<bool> FunctionGenerator::climbs(const Expr& e, int& room) const {
  if (--room < 0) return std::nullopt;
  if (const auto* name = e.as<Variable>()) {
    const auto known = frame_.coordinates.find(name->name);
    return known == frame_.coordinates.end() ? std::nullopt : climbs(known->second.index, room);
  }
  if (const auto* ramp = e.as<Ramp>()) {
    const bool is_dense = ramp->base.type().is_scalar() && is_one(ramp->stride);
    return is_dense ? std::optional(true) : std::nullopt;
  }
  if (const auto* splat = e.as<Broadcast>())
    return splat->value.type().is_scalar() ? std::optional(false) : std::nullopt;
  const auto* n = e.as<Binary>();
  const auto a = n ? climbs(n->a, room) : std::nullopt, b = a ? climbs(n->b, room) : std::nullopt;
  if (!b) return std::nullopt;
  const bool either = *a || *b;
  switch (e.kind()) {
    case Kind::Min:
    case Kind::Max:
      return either;
    case Kind::Add:
      return *a && *b ? std::nullopt : std::optional(either);
    case Kind::Sub:
      return *b ? std::nullopt : a;
    case Kind::Mul:
      return either ? std::nullopt : std::optional(false);
    default:
      return std::nullopt;
  }
}

// The value of one lane of what climbs() knows.
Value* FunctionGenerator::at_lane(const Expr& e, Value* lane) {
  if (const auto* name = e.as<Variable>())
    return at_lane(frame_.coordinates.at(name->name).index, lane);
  if (const auto* ramp = e.as<Ramp>()) return b_.CreateAdd(value(ramp->base), lane);
  if (const auto* splat = e.as<Broadcast>()) return value(splat->value);
  const auto* n = e.as<Binary>();
  return binary(e_, e.kind(), Int(32), at_lane(n->a, lane), at_lane(n->b, lane));
}

// The coordinate less what is the same in all lanes: loops that change only that keep the rest.
Expr FunctionGenerator::climbing_part(const Expr& e) const {
  if (const auto* name = e.as<Variable>())
    return climbing_part(frame_.coordinates.at(name->name).index);
  if (e.kind() != Kind::Add && e.kind() != Kind::Sub) return e;
  const auto* n = e.as<Binary>();
  int room = most_coordinate_nodes;
  return climbing_part(*climbs(n->a, room) ? n->a : n->b);
}

// Null where the index is no such ramp, or the machine does as well by a gather.
Value* FunctionGenerator::load_held(const Storage& from, Type type, const Expr& index,
                                    Value* predicate) {
  int room = most_coordinate_nodes;
  if (index.type().element_of() != Int(32) || !climbs(index, room).value_or(false)) return nullptr;
  const int lanes = type.lanes(), bits = 8 * type.bytes();
  const int piece = std::min(lanes, e_.machine.vector_bits / bits);
  if (lanes % piece == 0 && shuffle_by_numbers(e_.machine, bits, piece)) {
    std::vector<Value*> parts;
    for (int start = 0; start < lanes; start += piece) {
      Value* mask = predicate ? slice(e_, predicate, start, piece) : nullptr;
      parts.push_back(load_spread(from, type.with_lanes(piece), index, start, mask));
    }
    return concat(e_, parts);
  }
  if (e_.machine.gathers(type)) return nullptr;
  return load_dense_or_gather(from, type, index, predicate);
}

// Lanes `start` and following, of a type that fills a register.
Value* FunctionGenerator::load_spread(const Storage& from, Type type, const Expr& index, int start,
                                      Value* predicate) {
  const int lanes = type.lanes();
  const Expr climbing = climbing_part(index);
  Value* base = at_lane(climbing, b_.getInt32(static_cast<uint32_t>(start)));
  llvm::Type* number = b_.getIntNTy(static_cast<unsigned>(8 * type.bytes()));
  const auto step_at = [&](Value* lane) {
    Value* at = b_.CreateAdd(b_.getInt32(static_cast<uint32_t>(start)), lane);
    Value* step = b_.CreateSub(at_lane(climbing, at), base);
    return splat(e_, b_.CreateIntCast(step, number, true), lanes);
  };
  const Ends ends = ends_of(predicate, lanes);
  Value* element = iota(e_, number, lanes);
  Value* mask = b_.CreateICmpSLE(element, step_at(ends.last));
  if (predicate) {
    mask = b_.CreateAnd(mask, b_.CreateICmpSGE(element, step_at(ends.first)));
    mask = b_.CreateAnd(mask, splat(e_, b_.CreateOrReduce(predicate), lanes));
  }
  Value* first = at_lane(index, b_.getInt32(static_cast<uint32_t>(start)));
  Value* spread =
      to_memory(type, load_dense(from, type, b_.CreateSExt(first, b_.getInt64Ty()), mask));
  Value* steps = b_.CreateSub(slice(e_, value(climbing), start, lanes), splat(e_, base, lanes));
  llvm::Type* numbers = with_lanes(number, lanes);
  Value* shuffled = b_.CreateIntrinsic(
      shuffle_by_numbers(e_.machine, 8 * type.bytes(), lanes), {},
      {b_.CreateBitCast(spread, numbers), b_.CreateIntCast(steps, numbers, true)});
  if (predicate)
    shuffled = b_.CreateSelect(predicate, shuffled, llvm::Constant::getNullValue(numbers));
  return from_memory(type, b_.CreateBitCast(shuffled, spread->getType()));
}

// The first and the last lane that is on. Where none is, they are lanes all the same.
FunctionGenerator::Ends FunctionGenerator::ends_of(Value* predicate, int lanes) {
  if (!predicate) return {b_.getInt32(0), b_.getInt32(static_cast<uint32_t>(lanes - 1))};
  const auto width = static_cast<unsigned>(lanes);
  Value* on = b_.CreateBitCast(predicate, b_.getIntNTy(width));
  const auto zeros = [&](llvm::Intrinsic::ID count, const llvm::APInt& at_least) {
    Value* some = b_.CreateOr(on, llvm::ConstantInt::get(b_.getContext(), at_least));
    Value* number = b_.CreateBinaryIntrinsic(count, some, b_.getTrue());
    return b_.CreateIntCast(number, b_.getInt32Ty(), false);
  };
  Value* after = zeros(llvm::Intrinsic::ctlz, llvm::APInt(width, 1));
  return {zeros(llvm::Intrinsic::cttz, llvm::APInt::getSignMask(width)),
          b_.CreateSub(b_.getInt32(width - 1), after)};
}

Value* FunctionGenerator::load_dense_or_gather(const Storage& from, Type type, const Expr& index,
                                               Value* predicate) {
  const int lanes = type.lanes();
  Value* indices = value(index);
  Value *first = at_lane(index, b_.getInt32(0)),
        *last = at_lane(index, b_.getInt32(static_cast<uint32_t>(lanes - 1)));
  Value* steps = b_.CreateSub(last, first);
  return chosen(
      b_.CreateICmpEQ(steps, int_constant(steps, lanes - 1)),
      [&] { return load_dense(from, type, b_.CreateSExt(first, b_.getInt64Ty()), predicate); },
      [&] { return gather_compactly(from, type, indices, predicate); });
}

}  // namespace retrograde::codegen
