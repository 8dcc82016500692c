// dependences.h -- which iterations of an update access one element of its Func, so that their order matters.
//
//   f(x, t) = g(f(x - 1, t - 1), f(x + 1, t - 1))    distances (1, 1) and (-1, 1): carried along t; in a loop over t,
//                                                    iterations of x are independent
//   s(x) += e(x, r)                                  distance of r: 1 or more; the update commutes
//   h(i(r)) += e(r)                                  the same: any two iterations may meet
//   f(2 r) = f(2 r + 1)                              none: parities differ
//
// Only reduction variables carry dependences: pure ones keep their positions in all references of a Func to itself, so
// their iterations access different elements. Sizes that are not constant are unknown, never estimated.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "autoschedule/access/access_graph.h"
#include "autoschedule/access/integer_system.h"
#include "ir/interval.h"

namespace retrograde::planning {

// Two iterations that access one element, which one of them writes: for each iterator of the stage, its value in the one
// that runs later in the loops of the definition minus that in the earlier one.
struct Dependence {
  std::vector<ir::ConstantRange> distances;
  bool operator==(const Dependence&) const = default;
};

// A loop of a nest, as an order of iterations sees it. A fusion of two loops is both, the outer one first.
struct LoopStep {
  int iterator = 0;
  int64_t step = 1;
  bool is_concurrent = false;  // iterations run at the same time, by threads or in lanes
};

// Whether the loops, outermost first, run the earlier iteration of the definition first.
bool keeps(const Dependence& dependence, const std::vector<LoopStep>& loops);

// The dependences of a stage on itself, from the affine forms of its accesses alone.
class StageDependences {
 public:
  // `with_predicate`: iterations for which the predicate does not hold access nothing.
  StageDependences(const AccessGraph& graph, StageId stage, bool with_predicate = true);

  const std::vector<Dependence>& all() const { return dependences_; }
  // Whether no two iterations that differ in the iterator, and agree in those of `around`, access one element that one of
  // them writes. False: unknown.
  bool are_independent(int iterator, IteratorSet around = 0) const;
  // Whether no two iterations that agree in all other iterators write one element. False: unknown.
  bool writes_once(IteratorSet iterators) const;
  // Whether there are such iterations for certain, if values from memory may be any integers. False: unknown.
  bool are_dependent(int iterator, IteratorSet around = 0) const;

 private:
  void find_dependences(const IntegerSystem& pair);
  // The pair, of iterations that agree in these iterators and differ in the other one, upwards or downwards.
  IntegerSystem differing(const IntegerSystem& pair, int iterator, IteratorSet around,
                          bool upwards) const;

  std::vector<int> levels_;  // the reduction loops, outermost first
  size_t iterators_ = 0;
  // Pairs of iterations that access one element; the first pair is that of the write with itself. The variables from 0
  // on are the distances of the iterators, those of the second iteration minus those of the first, which writes.
  std::vector<IntegerSystem> pairs_;
  std::vector<IntegerSystem> certain_pairs_;  // solutions of these systems exist
  std::vector<Dependence> dependences_;
};

// Which updates a device may make atomic.
enum class Atomics : uint8_t {
  None,
  OfIntegers,  // bits are the same in any order
  OfAll        // bits of floats differ from run to run
};

// The dependences of all stages of a program, found when they are first asked for.
class Dependences {
 public:
  explicit Dependences(const AccessGraph& graph) : graph_(graph) {}  // is referred to

  const StageDependences& of(StageId stage);
  // Whether iterations of the iterator that agree in those of `around`, all of whose loops are outside, may run at the
  // same time, by threads of a processor or in lanes. The rules of directives agree (graph/definitions/race_checks.h).
  bool may_run_at_once(StageId stage, int iterator, IteratorSet around = 0);
  // Whether any order of iterations gives the same result, but for rounding. If they are to run at the same time, the
  // update has to be atomic.
  bool commutes(StageId stage);
  // Whether the stage adds to elements that data or its reduction choose, several times to one of them, in a type and by
  // an operation that these updates may have.
  bool may_be_atomic(StageId stage, Atomics atomics);
  // Whether the loops, outermost first, run all iterations that access one element in the order of the definition, so
  // that no bit changes. Those of concurrent loops may run at once.
  bool keeps_order(StageId stage, const std::vector<LoopStep>& loops);

 private:
  struct Known {
    StageDependences forms;
    std::map<std::pair<int, IteratorSet>, bool> at_once;
    std::map<std::vector<std::string>, bool> orders;  // of reduction variables, innermost first
    std::optional<bool> commutes;
  };
  Known& known(StageId stage);
  bool can_prove_at_once(StageId stage, int iterator, IteratorSet around);
  bool keeps_order_of_variables(StageId stage, const std::vector<LoopStep>& loops);

  const AccessGraph& graph_;
  std::map<StageId, Known> known_;
};

}  // namespace retrograde::planning
