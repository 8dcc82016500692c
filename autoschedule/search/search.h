// search.h -- from a whole plan to a better one: moves, Func by Func, as long as the predicted time falls.
//
//   start               9.1 ms      place f at g/y:8   8.7 ms      tile f x:32     8.2 ms
//                              =>   inline f           9.4 ms  =>  vectorise f x   8.6 ms
//                                   ...                            ...
//
// A beam search: Funcs are visited consumers first, so that a producer knows the loops in which it may run, and twice, so
// that a consumer also knows its producers. At each Func the best plans go on by its moves, several after another. With
// width 1 it is a descent that may climb once. The work is bounded by a count of prices, never by a clock: one program
// has one result on every machine with these figures. Plans that cost the same keep their order. At last, bodies are made
// smaller where that costs nearly no time: code that is twice as long takes about twice as long to compile.
// Method: B. Lowerre, The Harpy Speech Recognition System, 1976 (beam search); the order of decisions as in Adams et al.,
// Learning to Optimize Halide with Tree Search and Random Programs, SIGGRAPH 2019, section 3.
#pragma once

#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "autoschedule/cost/cost.h"
#include "autoschedule/moves/move.h"

namespace retrograde::planning {

struct SearchOptions {
  int width = 1;  // plans that go on from each step
  // Bytes alive at once. A plan above this limit may only be left for one with fewer bytes, and is no result, except for
  // the start.
  double most_bytes = std::numeric_limits<double>::infinity();
  std::vector<bool> kept = {};     // by Func: no move changes how it runs
  std::vector<bool> at_root = {};  // by Func: it stays at root
  std::vector<bool> in_rows = {};  // by Func: it runs along its rows, without tiles
  std::set<std::string> without;   // names of moves that are not made
  // A change must gain these parts of the time of the stages that change and of the whole time; less of that in programs of
  // more than 100 Funcs. The defaults are about the error of the cost, for a start that is known to be fast.
  double least_gain = 0.1, least_gain_of_all = 0.01;
};

// Whether no Func leaves the place that it is to have, and no move of another Func changed one that is to be kept. Loops
// that places refer to may get other numbers.
bool keeps_funcs(const Plan& before, const Plan& after, const SearchOptions& options);

struct SearchStep {
  FuncId func = -1;
  std::string move;
  double seconds = 0;  // of the plan after it
};

struct FoundPlan {
  Plan plan;
  Cost cost;
  std::vector<SearchStep> steps;  // from the start
};

struct SearchResult {
  FoundPlan start;
  std::vector<FoundPlan>
      found;  // the best first: the fastest, unless it has much more code; the start unless others are better
  int64_t priced = 0;  // different plans
};

// The first of those found is never predicted to be slower than the start, if that has not too many bytes, nor than that
// of a narrower search, unless it has less code.
SearchResult search(const Plan& start, const Context& context, CostModel& cost,
                    const SearchOptions& options);
// Adds what a search from another start of the same program found; the start stays.
void merge(SearchResult& result, SearchResult other);

}  // namespace retrograde::planning
