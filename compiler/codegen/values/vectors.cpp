// Vectors with any number of lanes: slices, concatenations, shuffles, reductions.
#include <algorithm>

#include "codegen/emitter.h"
#include "diagnostics/error.h"

namespace retrograde::codegen {
namespace {

std::vector<int> sequence(int start, int count, int stride = 1) {
  std::vector<int> result(static_cast<size_t>(count));
  for (int i = 0; i < count; i++) result[static_cast<size_t>(i)] = start + i * stride;
  return result;
}

bool is_power_of_two(int n) { return n > 0 && (n & (n - 1)) == 0; }

// Turns a scalar into a vector of one lane; vectors are returned unchanged.
Value* as_vector(Emitter& e, Value* value) {
  if (value->getType()->isVectorTy()) return value;
  auto* type = llvm::FixedVectorType::get(value->getType(), 1);
  return e.b.CreateInsertElement(llvm::PoisonValue::get(type), value, uint64_t{0});
}

// Turns a vector of one lane into a scalar; other vectors are returned unchanged.
Value* as_scalar_if_single(Emitter& e, Value* value) {
  const auto* type = llvm::dyn_cast<llvm::FixedVectorType>(value->getType());
  return type && type->getNumElements() == 1 ? e.b.CreateExtractElement(value, uint64_t{0}) : value;
}

}  // namespace

Value* splat(Emitter& e, Value* scalar, int lanes) {
  return lanes == 1 ? scalar : e.b.CreateVectorSplat(static_cast<unsigned>(lanes), scalar);
}

Value* any_lane(Emitter& e, Value* mask) {
  const auto* vector = llvm::dyn_cast<llvm::FixedVectorType>(mask->getType());
  if (!vector) return mask;
  Value* bits = e.b.CreateBitCast(mask, e.b.getIntNTy(vector->getNumElements()));
  return e.b.CreateIsNotNull(bits);
}

Value* iota(Emitter& e, llvm::Type* scalar, int lanes) {
  const std::vector<llvm::Constant*> values = ir::numbered(lanes, [&](int i) {
    return scalar->isFloatingPointTy() ? llvm::ConstantFP::get(scalar, i)
                                       : llvm::ConstantInt::get(scalar, static_cast<uint64_t>(i));
  });
  (void)e;
  return lanes == 1 ? values[0] : llvm::ConstantVector::get(values);
}

Value* shuffle(Emitter& e, Value* a, Value* b, const std::vector<int>& indices) {
  return as_scalar_if_single(e, e.b.CreateShuffleVector(as_vector(e, a), as_vector(e, b), indices));
}

Value* slice(Emitter& e, Value* vector, int start, int lanes) {
  const int has = lanes_of(vector);
  if (start == 0 && lanes == has) return vector;
  if (lanes == 1) return lane(e, vector, start);
  std::vector<int> indices = sequence(start, lanes);
  for (int& index : indices) {
    if (index >= has) index = -1;
  }
  return e.b.CreateShuffleVector(as_vector(e, vector), indices);
}

Value* concat(Emitter& e, std::vector<Value*> parts) {
  RETROGRADE_ASSERT(!parts.empty(), "concatenation of nothing");
  // Pairwise, so that n parts take n - 1 shuffles whose lengths add up to n log n.
  while (parts.size() > 1) {
    std::vector<Value*> joined;
    for (size_t i = 0; i + 1 < parts.size(); i += 2) {
      const int left = lanes_of(parts[i]), right = lanes_of(parts[i + 1]),
                wide = std::max(left, right);
      std::vector<int> indices = sequence(0, left);
      for (int k = 0; k < right; k++) indices.push_back(wide + k);
      Value* a = left < wide ? slice(e, parts[i], 0, wide) : parts[i];
      Value* b = right < wide ? slice(e, parts[i + 1], 0, wide) : parts[i + 1];
      joined.push_back(shuffle(e, a, b, indices));
    }
    if (parts.size() % 2) joined.push_back(parts.back());
    parts = std::move(joined);
  }
  return parts[0];
}

Value* pick_lanes(Emitter& e, const std::vector<Value*>& vectors, const std::vector<int>& indices) {
  const int lanes = lanes_of(vectors[0]);
  std::vector<int> used;
  for (int index : indices) {
    if (std::ranges::find(used, index / lanes) == used.end()) used.push_back(index / lanes);
  }
  const auto vector = [&](size_t i) { return vectors[static_cast<size_t>(used[i])]; };
  Value* second = used.size() > 1 ? vector(1) : vector(0);
  std::vector<int> picks(indices.size(), -1);
  for (size_t i = 0; i < indices.size(); i++) {
    if (indices[i] / lanes == used[0]) picks[i] = indices[i] % lanes;
    if (used.size() > 1 && indices[i] / lanes == used[1]) picks[i] = lanes + indices[i] % lanes;
  }
  Value* result = shuffle(e, vector(0), second, picks);
  for (size_t source = 2; source < used.size(); source++) {
    for (size_t i = 0; i < indices.size(); i++) {
      const bool is_here = indices[i] / lanes == used[source];
      picks[i] = is_here ? lanes + indices[i] % lanes : static_cast<int>(i);
    }
    result = shuffle(e, result, vector(source), picks);
  }
  return result;
}

namespace {

constexpr int chunk_bits = 128;  // x86's unpack instructions work within chunks of this size

// Interleaves two vectors within each chunk, taking either the lower or the upper halves of the chunks.
Value* unpack(Emitter& e, Value* a, Value* b, int chunk, bool upper) {
  const int lanes = lanes_of(a);
  const auto indices = ir::numbered(lanes, [&](int i) {
    const int source = i / chunk * chunk + (upper ? chunk / 2 : 0) + i % chunk / 2;
    return i % 2 ? lanes + source : source;
  });
  return shuffle(e, a, b, indices);
}

// `rows` has a power of two of vectors, at most as many as a chunk has lanes. Result k of n holds, in each chunk, lanes
// from k * chunk / n on of that chunk of all rows, interleaved.
std::vector<Value*> interleave_chunks(Emitter& e, const std::vector<Value*>& rows, int chunk) {
  if (rows.size() == 1) return rows;
  std::vector<Value*> even, odd, result;
  for (size_t i = 0; i < rows.size(); i++) (i % 2 ? odd : even).push_back(rows[i]);
  even = interleave_chunks(e, even, chunk), odd = interleave_chunks(e, odd, chunk);
  for (size_t i = 0; i < even.size(); i++) {
    for (bool upper : {false, true}) result.push_back(unpack(e, even[i], odd[i], chunk, upper));
  }
  return result;
}

// Transposes the matrix whose rows are the vectors and whose elements are chunks. Each step halves the vectors: the
// even chunks of all vectors come before the odd ones.
std::vector<Value*> transpose_chunks(Emitter& e, std::vector<Value*> vectors, int chunk) {
  const int lanes = lanes_of(vectors[0]);
  for (int step = chunk; step < lanes && vectors.size() > 1; step *= 2) {
    std::vector<Value*> halves[2];
    for (int odd : {0, 1}) {
      std::vector<int> indices;
      for (int i = 0; i < lanes; i++) indices.push_back((i / chunk * 2 + odd) * chunk + i % chunk);
      for (size_t i = 0; i < vectors.size(); i += 2)
        halves[odd].push_back(shuffle(e, vectors[i], vectors[i + 1], indices));
    }
    halves[0].insert(halves[0].end(), halves[1].begin(), halves[1].end());
    vectors = std::move(halves[0]);
  }
  return vectors;
}

// Whether to transpose first within chunks and then by whole chunks. There must be at least as many rows as lanes, both
// powers of two. Each step then has an instruction without an index table, which lanes that cross chunks would need.
bool is_transposed_by_chunks(int rows, int lanes, int chunk) {
  return chunk > 1 && is_power_of_two(rows) && is_power_of_two(lanes) && lanes >= chunk &&
         rows >= lanes;
}

Value* interleave_by_chunks(Emitter& e, const std::vector<Value*>& rows, int chunk) {
  std::vector<std::vector<Value*>>
      groups;  // by the first row: columns k, k + chunk, ... of a group
  for (size_t i = 0; i < rows.size(); i += static_cast<size_t>(chunk))
    groups.push_back(interleave_chunks(e, {rows.begin() + i, rows.begin() + i + chunk}, chunk));
  std::vector<std::vector<Value*>> columns;  // by k: columns k, then k + chunk, ... whole
  for (int k = 0; k < chunk; k++) {
    std::vector<Value*> column;
    for (const auto& group : groups) column.push_back(group[static_cast<size_t>(k)]);
    columns.push_back(transpose_chunks(e, column, chunk));
  }
  const size_t pieces = groups.size() * static_cast<size_t>(chunk) / lanes_of(rows[0]);
  std::vector<Value*> result;
  for (size_t i = 0; i < groups.size(); i += pieces) {
    for (const auto& column : columns)
      result.insert(result.end(), column.begin() + i, column.begin() + i + pieces);
  }
  return concat(e, result);
}

}  // namespace

// Splits into halves while their number is even: unpack instructions take pairs, and no instruction takes more.
Value* interleave(Emitter& e, const std::vector<Value*>& vectors) {
  const int count = static_cast<int>(vectors.size()), lanes = lanes_of(vectors[0]);
  if (count == 1) return vectors[0];
  const int chunk =
      chunk_bits / std::max(1, static_cast<int>(vectors[0]->getType()->getScalarSizeInBits()));
  if (is_transposed_by_chunks(count, lanes, chunk)) return interleave_by_chunks(e, vectors, chunk);
  std::vector<int> indices;
  for (int i = 0; i < count * lanes; i++) indices.push_back(i % count * lanes + i / count);
  if (count == 2) return shuffle(e, vectors[0], vectors[1], indices);
  if (count % 2 == 0) {
    std::vector<Value*> even, odd;
    for (size_t i = 0; i < vectors.size(); i++) (i % 2 ? odd : even).push_back(vectors[i]);
    return interleave(e, {interleave(e, even), interleave(e, odd)});
  }
  Value* all = concat(e, vectors);
  return shuffle(e, all, all, indices);
}

Value* repeat(Emitter& e, Value* vector, int times) {
  if (!vector->getType()->isVectorTy()) return splat(e, vector, times);
  std::vector<int> indices;
  for (int k = 0; k < times; k++) {
    for (int i = 0; i < lanes_of(vector); i++) indices.push_back(i);
  }
  return e.b.CreateShuffleVector(vector, indices);
}

Value* reverse(Emitter& e, Value* vector) {
  const int n = lanes_of(vector);
  return n == 1 ? vector : e.b.CreateShuffleVector(vector, sequence(n - 1, n, -1));
}

Value* lane(Emitter& e, Value* vector, int index) {
  if (!vector->getType()->isVectorTy()) return vector;
  return e.b.CreateExtractElement(vector, static_cast<uint64_t>(index));
}

Value* from_lanes(Emitter& e, const std::vector<Value*>& scalars) {
  if (scalars.size() == 1) return scalars[0];
  auto* type =
      llvm::FixedVectorType::get(scalars[0]->getType(), static_cast<unsigned>(scalars.size()));
  Value* result = llvm::PoisonValue::get(type);
  for (size_t i = 0; i < scalars.size(); i++)
    result = e.b.CreateInsertElement(result, scalars[i], i);
  return result;
}

// While a group has an even size, its lanes combine in pairs: halves of the vector if one group results, even and odd
// lanes if several. The remaining odd size combines lane by lane.
Value* reduce_groups(Emitter& e, Value* vector, int lanes, const Combine& combine) {
  int total = lanes_of(vector);
  RETROGRADE_ASSERT(lanes >= 1 && total % lanes == 0, "reduction of ", total, " lanes to ", lanes);
  while (total > lanes && (total / lanes) % 2 == 0) {
    const int half = total / 2;
    vector = lanes == 1 ? combine(slice(e, vector, 0, half), slice(e, vector, half, half))
                        : combine(shuffle(e, vector, vector, sequence(0, half, 2)),
                                  shuffle(e, vector, vector, sequence(1, half, 2)));
    total = half;
  }
  const int group = total / lanes;
  if (group == 1) return vector;
  Value* result = shuffle(e, vector, vector, sequence(0, lanes, group));
  for (int i = 1; i < group; i++) {
    result = combine(result, shuffle(e, vector, vector, sequence(i, lanes, group)));
  }
  return result;
}

}  // namespace retrograde::codegen
