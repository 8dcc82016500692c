#include "autoschedule/plan/nest.h"

#include <algorithm>
#include <functional>

#include "diagnostics/error.h"
#include "ir/build.h"

namespace retrograde::planning {

std::vector<std::string> iterators_of(const graph::FuncContents& f, int stage) {
  std::vector<Dim> loops = graph::first_loops(f, f.stage(stage));
  std::ranges::stable_partition(loops, [](const Dim& loop) { return !loop.is_reduction; });
  return mapped(loops, [](const Dim& loop) { return loop.var; });
}

const std::vector<std::string>& iterators_of(const Program& program, StageId stage) {
  return program.iterators[static_cast<size_t>(stage.func)][static_cast<size_t>(stage.stage)];
}

Nest loops_of_definition(const graph::FuncContents& f, int stage) {
  const std::vector<std::string> iterators = iterators_of(f, stage);
  const std::vector<Dim> loops = graph::first_loops(f, f.stage(stage));
  Nest nest;
  for (auto loop = loops.rbegin(); loop != loops.rend(); ++loop) {
    const auto found = std::ranges::find(iterators, loop->var);
    nest.loops.emplace_back().iterator = static_cast<int16_t>(found - iterators.begin());
  }
  return nest;
}

namespace {

template <class Visit>
void for_each_part(const Nest& nest, int iterator, Visit visit) {
  const auto look_at = [&](const Part& part) {
    if (part.iterator == iterator) visit(part);
  };
  for (const Loop& loop : nest.loops) look_at(loop);
  for (const Fusion& fusion : nest.fusions) {
    look_at(fusion.inner);
    look_at(fusion.outer);
  }
}

}  // namespace

std::vector<Part> parts_of(const Nest& nest, int iterator) {
  std::vector<Part> parts;
  for_each_part(nest, iterator, [&](const Part& part) { parts.push_back(part); });
  std::ranges::stable_sort(parts, std::greater(), &Part::step);
  return parts;
}

const Part* next_larger(const Nest& nest, int iterator, int64_t step) {
  const Part* found = nullptr;
  for_each_part(nest, iterator, [&](const Part& part) {
    if (part.step > step && (!found || part.step < found->step)) found = &part;
  });
  return found;
}

const Part* next_smaller(const std::vector<Part>& parts, int64_t step) {
  const auto found =
      std::ranges::find_if(parts, [&](const Part& part) { return part.step < step; });
  return found == parts.end() ? nullptr : &*found;
}

bool is_phase(const Nest& nest, size_t depth) {
  const Loop& loop = nest.loops[depth];
  return std::any_of(
      nest.loops.begin() + static_cast<std::ptrdiff_t>(depth) + 1, nest.loops.end(),
      [&](const Loop& inner) { return inner.iterator == loop.iterator && inner.step > loop.step; });
}

Nest with_ordered_fusions(const Nest& nest, int iterators) {
  Nest result = nest;
  result.fusions.clear();
  std::vector<int> numbers(nest.fusions.size(), -1);
  std::function<void(Part&)> renumber = [&](Part& part) {
    if (part.iterator < iterators) return;
    int& number = numbers[static_cast<size_t>(part.iterator - iterators)];
    if (number < 0) {
      Fusion fusion = nest.fusions[static_cast<size_t>(part.iterator - iterators)];
      renumber(fusion.inner);
      renumber(fusion.outer);
      number = iterators + static_cast<int>(result.fusions.size());
      result.fusions.push_back(fusion);
    }
    part.iterator = static_cast<int16_t>(number);
  };
  for (Loop& loop : result.loops) renumber(loop);
  return result;
}

std::vector<size_t> split_order(const std::vector<Part>& parts) {
  const size_t count = parts.empty() ? 0 : parts.size() - 1;
  std::vector<size_t> order;
  std::vector<bool> done(count, false);
  const auto is_ready = [&](size_t i) {
    const bool after_smaller = i + 1 < count && parts[i].in_blocks;
    const bool after_larger = i > 0 && !parts[i - 1].in_blocks;
    return !done[i] && (!after_smaller || done[i + 1]) && (!after_larger || done[i - 1]);
  };
  while (order.size() < count) {
    size_t next = 0;
    while (!is_ready(next)) ++next;
    done[next] = true;
    order.push_back(next);
  }
  return order;
}

Nest unfused(const Nest& nest, int iterators) {
  Nest result = nest;
  std::erase_if(result.loops, [](const Loop& loop) { return loop.iterator == once; });
  result.fusions.clear();
  for (size_t d = 0; d < result.loops.size();) {
    const Loop fused = result.loops[d];
    if (fused.iterator < iterators) {
      ++d;
      continue;
    }
    const Fusion& both = nest.fusions[static_cast<size_t>(fused.iterator - iterators)];
    Loop outer = fused, inner = fused;
    static_cast<Part&>(outer) = both.outer;
    static_cast<Part&>(inner) = both.inner;
    const auto at = result.loops.begin() + static_cast<std::ptrdiff_t>(d);
    *at = outer;
    result.loops.insert(at + 1, inner);
  }
  return result;
}

}  // namespace retrograde::planning
