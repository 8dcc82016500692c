// nest.h -- questions about the loops of one stage.
#pragma once

#include <string>
#include <vector>

#include "autoschedule/plan/plan.h"

namespace retrograde::planning {

// The names of the stage's iterators in the order of their numbers.
std::vector<std::string> iterators_of(const graph::FuncContents& f, int stage);
// The same, kept by the program.
const std::vector<std::string>& iterators_of(const Program& program, StageId stage);
// One serial loop for each iterator, in the order of the definition.
Nest loops_of_definition(const graph::FuncContents& f, int stage);

// The parts of an iterator, among loops and fused loops, by decreasing step.
std::vector<Part> parts_of(const Nest& nest, int iterator);
// The part of the iterator with the next larger or smaller step; null when there is none.
const Part* next_larger(const Nest& nest, int iterator, int64_t step);
const Part* next_smaller(const std::vector<Part>& parts, int64_t step);

// The same loops without fusions and loops that run once: each fused loop is both of its loops, the outer one first.
Nest unfused(const Nest& nest, int iterators);

// Whether a loop of the same iterator with a larger step is inside of this one: the loop runs over remainders.
bool is_phase(const Nest& nest, size_t depth);

// Whether the loops of others decide where the Func runs or is stored.
inline bool is_bound(const FuncPlan& plan) {
  const auto& [compute, store, hoist] = plan.placement;
  bool shares = false;
  for (const Nest& nest : plan.nests) shares = shares || nest.shared_with;
  return shares || compute.kind == Level::Kind::At || store.kind != Level::Kind::Undecided ||
         hoist.kind != Level::Kind::Undecided;
}

// The same nest with fusions in the order in which the loops mention them, outermost first and the parts of a fusion
// before it. Nests that differ only in this order become equal.
Nest with_ordered_fusions(const Nest& nest, int iterators);

// The order in which to split an iterator at the steps of all its parts but the last: indices into parts_of. A step in
// blocks follows the next smaller one; others follow the next larger one. The larger of two is first otherwise.
std::vector<size_t> split_order(const std::vector<Part>& parts);

}  // namespace retrograde::planning
