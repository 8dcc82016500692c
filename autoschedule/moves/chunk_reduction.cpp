// chunk_reduction -- a step of the outermost loop of a reduction stands outside of all other loops, so that what its
// iterations read stays in a cache while all elements take these terms.
//
//   parallel y, x:16, r.z, r.x, vector x     =>     r.z:8, parallel y, x:16, r.z, r.x, vector x
//
// Legal: L1, L2: each element takes its terms in the same order, since the outermost loop of the reduction alone is split.
// Parallel loops stay outermost: where the first loop is parallel, the step stands inside of it.
// Sizes are those at which the operands of a chunk fit in the second or the last cache, rounded down to powers of two.
#include <algorithm>
#include <bit>

#include "autoschedule/moves/edit.h"

namespace retrograde::planning::moves {

namespace {

// Bytes that the stage reads, while it runs so many points of one iterator and all of the others.
double bytes_read(const Context& context, StageId stage, Cover cover, int iterator,
                  int64_t points) {
  cover[static_cast<size_t>(iterator)] = points;
  double sum = 0;
  for (const Access& read : context.accesses.stage(stage).reads) {
    if (read.of == stage.func) continue;
    double bytes = bytes_of_element(context, read);
    for (const int64_t extent : extents(read, cover, context.sizes))
      bytes *= static_cast<double>(extent);
    sum += bytes;
  }
  return sum;
}

// The largest power of two whose operands fit; 1 if none does.
int64_t largest_chunk(const Context& context, StageId stage, const Cover& extents, int iterator,
                      double bytes, int64_t points) {
  auto chunk = static_cast<int64_t>(std::bit_floor(static_cast<uint64_t>(points)));
  while (chunk > 1 && bytes_read(context, stage, extents, iterator, chunk) > bytes) chunk /= 2;
  return chunk;
}

std::vector<Nest> chunked(const StageLoops& loops) {
  const auto& [plan, context, stage, nest, extents] = loops;
  const auto loop = std::ranges::find_if(nest.loops, [&](const Loop& l) {
    return is_reduction(loops.context, loops.stage, l.iterator);
  });
  size_t at = shared_loops(plan, stage);
  while (at < nest.loops.size() && nest.loops[at].kind == ForType::Parallel) ++at;
  const auto depth = static_cast<size_t>(loop - nest.loops.begin());
  if (loop == nest.loops.end() || depth <= at || loop->kind != ForType::Serial) return {};
  const int64_t points = trips(extents, nest, depth) * loop->step;
  std::vector<Nest> nests;
  for (const size_t level : {Machine::near_cache, Machine::last_cache}) {
    const double bytes = context.machine.levels[level].bytes;
    const int64_t chunk = largest_chunk(context, stage, extents, loop->iterator, bytes, points);
    if (chunk <= loop->step || 2 * chunk > points) continue;
    Nest chunks = nest;
    insert_step(chunks, loop->iterator, chunk, at);
    if (!has_same_order(nest, chunks, extents)) nests.push_back(std::move(chunks));
  }
  return nests;
}

}  // namespace

std::vector<Plan> chunk_reduction(const Plan& plan, FuncId func, const Context& context) {
  return with_nests(plan, func, context, chunked);
}

}  // namespace retrograde::planning::moves
