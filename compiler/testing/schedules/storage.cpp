#include "testing/schedules/storage.h"

#include <utility>

#include "graph/directives/directive.h"

namespace retrograde::fuzz {

using namespace graph;

namespace {

constexpr int ample_storage = 1024;  // more than any dimension needs

std::string random_dimension(Draft& draft, int f) {
  return draft.random.pick(draft.funcs.func(f).args);
}

void reorder_storage(Draft& draft, int f) {
  std::vector<std::string> order = draft.funcs.func(f).args;
  for (size_t i = order.size() - 1; i > 0; --i) {
    std::swap(order[i], order[draft.random.below(static_cast<int>(i) + 1)]);
  }
  draft.add(f, ReorderStorage{order});
}

// Alignment, sizes and order of the dimensions.
void choose_dimensions(Draft& draft, int f, bool memoized, bool stored_outside) {
  Choices& random = draft.random;
  if (!memoized && random.chance(12)) {
    const int alignment = random.pick(std::vector<int>{2, 4, 16, 5});
    draft.add(f, AlignStorage{random_dimension(draft, f), alignment});
  }
  if (!memoized && random.chance(4))
    draft.add(f, BoundStorage{random_dimension(draft, f), ample_storage});
  if (stored_outside && random.chance(20)) {
    const int factor = random.pick(std::vector<int>{64, 128, 256});
    draft.add(f, FoldStorage{random_dimension(draft, f), factor});
  }
  if (random.chance(8)) {
    const int modulus = random.between(2, 5);
    draft.add(f, AlignBounds{random_dimension(draft, f), modulus, random.below(modulus)});
  }
  if (random.chance(5))
    draft.add(f, AlignBounds{random_dimension(draft, f), random.between(2, 5), {}});
  if (draft.funcs.dimensions(f) > 1 && random.chance(15)) reorder_storage(draft, f);
}

Directive promise(Choices& random, const std::string& dimension, int min, int extent) {
  if (random.chance(60)) return BoundDimension{dimension, min, extent};
  if (random.chance(50)) return BoundDimension{dimension, {}, extent};
  for (int modulus = 5; modulus > 1; --modulus) {
    const int remainder = ((min % modulus) + modulus) % modulus;
    if (extent % modulus == 0) return AlignBounds{dimension, modulus, remainder};
  }
  return BoundDimension{dimension, {}, extent};
}

}  // namespace

void choose_storage(Draft& draft, int f, const Placement& placement, bool is_shared) {
  Choices& random = draft.random;
  if (random.chance(10)) draft.add(f, StoreIn{MemoryType::Heap});
  // The contents of images are not part of a memoized Func's key.
  const bool memoized = !placement.stored_outside && random.chance(8) && !is_shared &&
                        !draft.funcs.read_image_parameters();
  if (memoized) draft.add(f, Memoize{});
  // A Func in a ring buffer is also stored outside; it cannot be asynchronous.
  if (!memoized && !placement.in_ring && random.chance(8) && !is_shared) draft.add(f, Async{});
  if (draft.funcs.dimensions(f) > 0)
    choose_dimensions(draft, f, memoized, placement.stored_outside);
}

void choose_output_rules(Draft& draft, int f) {
  const std::vector<oracle::Region> regions = draft.funcs.regions_of(f);
  if (regions.size() > 1 || !draft.random.chance(25)) return;
  const std::vector<std::string>& args = draft.funcs.func(f).args;
  for (size_t d = 0; d < args.size(); ++d)
    draft.add(f, promise(draft.random, args[d], regions[0].mins[d], regions[0].extents[d]));
}

}  // namespace retrograde::fuzz
