// Loads at a ramp that is clamped to an image's bounds, as border iterations have them:
//
//   in[max(min(ramp(x, 1, 32), broadcast(w - 1)), broadcast(0)) + broadcast(row)]
//
// From lane to lane the index stays or increases by one, so n lanes lie within n consecutive elements. If the machine
// has a permute with variable indices, the load becomes
//
//   first = index of lane 0, last = index of lane 31
//   spread = in[ramp(first, 1, 32)] if (ramp(first, 1, 32) <= last)
//   result[i] = spread[index[i] - first]
//
// Otherwise it is a dense load if last - first is 31, which fails only right at the border, and a gather if not. Lanes
// whose predicate is false count for neither `first` nor `last`.
#include <llvm/IR/IntrinsicsX86.h>

#include "codegen/memory/access.h"
#include "ir/build.h"

namespace retrograde::codegen {

using namespace ir;

namespace {

constexpr int most_coordinate_nodes = 64;  // larger ones are not analysed

// The permute with variable indices for a whole register of such elements, if the machine has one.
llvm::Intrinsic::ID shuffle_by_numbers(const Machine& machine, int bits, int lanes) {
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

// True if the coordinate increases by 0 or 1 from lane to lane, false if it is uniform, nothing if it may do anything
// else. `room`: number of nodes that may still be visited.
std::optional<bool> climbs(const Frame& frame, const Expr& e, int& room) {
  if (--room < 0) return std::nullopt;
  if (const auto* name = e.as<Variable>()) {
    const auto known = frame.coordinates.find(name->name);
    return known == frame.coordinates.end() ? std::nullopt
                                            : climbs(frame, known->second.index, room);
  }
  if (const auto* ramp = e.as<Ramp>()) {
    const bool is_dense = ramp->base.type().is_scalar() && is_one(ramp->stride);
    return is_dense ? std::optional(true) : std::nullopt;
  }
  if (const auto* splat = e.as<Broadcast>())
    return splat->value.type().is_scalar() ? std::optional(false) : std::nullopt;
  const auto* n = e.as<Binary>();
  const auto a = n ? climbs(frame, n->a, room) : std::nullopt,
             b = a ? climbs(frame, n->b, room) : std::nullopt;
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

// The coordinate without its uniform terms. Loops that change only those terms keep the rest invariant.
Expr varying_part(const Frame& frame, const Expr& e) {
  if (const auto* name = e.as<Variable>())
    return varying_part(frame, frame.coordinates.at(name->name).index);
  if (e.kind() != Kind::Add && e.kind() != Kind::Sub) return e;
  const auto* n = e.as<Binary>();
  int room = most_coordinate_nodes;
  return varying_part(frame, *climbs(frame, n->a, room) ? n->a : n->b);
}

// The first and last lane whose predicate is true. If there is none, the values are still valid lanes.
struct LaneEnds {
  Value *first, *last;
};
LaneEnds ends_of(llvm::IRBuilder<>& b, Value* predicate, int lanes) {
  if (!predicate) return {b.getInt32(0), b.getInt32(static_cast<uint32_t>(lanes - 1))};
  const auto width = static_cast<unsigned>(lanes);
  Value* on = b.CreateBitCast(predicate, b.getIntNTy(width));
  const auto zeros = [&](llvm::Intrinsic::ID count, const llvm::APInt& at_least) {
    Value* some = b.CreateOr(on, llvm::ConstantInt::get(b.getContext(), at_least));
    Value* number = b.CreateBinaryIntrinsic(count, some, b.getTrue());
    return b.CreateIntCast(number, b.getInt32Ty(), false);
  };
  Value* after = zeros(llvm::Intrinsic::ctlz, llvm::APInt(width, 1));
  return {zeros(llvm::Intrinsic::cttz, llvm::APInt::getSignMask(width)),
          b.CreateSub(b.getInt32(width - 1), after)};
}

// The value of one lane of a coordinate that climbs() accepts.
Value* at_lane(Values& values, const Expr& e, Value* lane) {
  if (const auto* name = e.as<Variable>())
    return at_lane(values, values.c.frame.coordinates.at(name->name).index, lane);
  if (const auto* ramp = e.as<Ramp>()) return values.c.b.CreateAdd(values.of(ramp->base), lane);
  if (const auto* splat = e.as<Broadcast>()) return values.of(splat->value);
  const auto* n = e.as<Binary>();
  return binary(values.c.e, e.kind(), Int(32), at_lane(values, n->a, lane),
                at_lane(values, n->b, lane));
}

// Loads the lanes from `start` on, in a type that fills a register.
Value* load_and_permute(Values& values, const Storage& from, Type type, const Expr& index,
                        int start, Value* predicate) {
  FunctionContext& c = values.c;
  const int lanes = type.lanes();
  const Expr climbing = varying_part(c.frame, index);
  Value* base = at_lane(values, climbing, c.b.getInt32(static_cast<uint32_t>(start)));
  llvm::Type* number = c.b.getIntNTy(static_cast<unsigned>(8 * type.bytes()));
  const auto step_at = [&](Value* lane) {
    Value* at = c.b.CreateAdd(c.b.getInt32(static_cast<uint32_t>(start)), lane);
    Value* step = c.b.CreateSub(at_lane(values, climbing, at), base);
    return splat(c.e, c.b.CreateIntCast(step, number, true), lanes);
  };
  const LaneEnds ends = ends_of(c.b, predicate, lanes);
  Value* element = iota(c.e, number, lanes);
  Value* mask = c.b.CreateICmpSLE(element, step_at(ends.last));
  if (predicate) {
    mask = c.b.CreateAnd(mask, c.b.CreateICmpSGE(element, step_at(ends.first)));
    mask = c.b.CreateAnd(mask, splat(c.e, any_lane(c.e, predicate), lanes));
  }
  Value* first = at_lane(values, index, c.b.getInt32(static_cast<uint32_t>(start)));
  Value* loaded = to_memory(
      c.e, type, load_dense(c, from, type, c.b.CreateSExt(first, c.b.getInt64Ty()), mask));
  Value* steps =
      c.b.CreateSub(slice(c.e, values.of(climbing), start, lanes), splat(c.e, base, lanes));
  llvm::Type* numbers = with_lanes(number, lanes);
  Value* shuffled = c.b.CreateIntrinsic(
      shuffle_by_numbers(c.e.machine, 8 * type.bytes(), lanes), {},
      {c.b.CreateBitCast(loaded, numbers), c.b.CreateIntCast(steps, numbers, true)});
  if (predicate)
    shuffled = c.b.CreateSelect(predicate, shuffled, llvm::Constant::getNullValue(numbers));
  return from_memory(c.e, type, c.b.CreateBitCast(shuffled, loaded->getType()));
}

Value* load_dense_or_gather(Values& values, const Storage& from, Type type, const Expr& index,
                            Value* predicate) {
  FunctionContext& c = values.c;
  const int lanes = type.lanes();
  Value* indices = values.of(index);
  Value *first = at_lane(values, index, c.b.getInt32(0)),
        *last = at_lane(values, index, c.b.getInt32(static_cast<uint32_t>(lanes - 1)));
  Value* steps = c.b.CreateSub(last, first);
  return c.chosen(
      c.b.CreateICmpEQ(steps, int_constant(steps, lanes - 1)),
      [&] { return load_dense(c, from, type, c.b.CreateSExt(first, c.b.getInt64Ty()), predicate); },
      [&] { return gather_compactly(c, from, type, indices, predicate); });
}

}  // namespace

Value* load_clamped(Values& values, const Storage& from, Type type, const Expr& index,
                    Value* predicate) {
  FunctionContext& c = values.c;
  int room = most_coordinate_nodes;
  if (index.type().element_of() != Int(32) || !climbs(c.frame, index, room).value_or(false))
    return nullptr;
  const int lanes = type.lanes(), bits = 8 * type.bytes();
  const int piece = std::min(lanes, c.e.machine.vector_bits / bits);
  if (lanes % piece == 0 && shuffle_by_numbers(c.e.machine, bits, piece)) {
    std::vector<Value*> parts;
    for (int start = 0; start < lanes; start += piece) {
      Value* mask = predicate ? slice(c.e, predicate, start, piece) : nullptr;
      parts.push_back(load_and_permute(values, from, type.with_lanes(piece), index, start, mask));
    }
    return concat(c.e, parts);
  }
  if (c.e.machine.gathers(type)) return nullptr;
  return load_dense_or_gather(values, from, type, index, predicate);
}

}  // namespace retrograde::codegen
