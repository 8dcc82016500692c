// frame.h -- a stage that is ready to run, and the values of its nodes at the current point.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "graph/function.h"
#include "testing/interpreter/points.h"
#include "testing/tracked_value.h"

namespace retrograde::oracle {

// Shared nodes have one value. A Func calls itself only through its own storage, so one frame for each stage suffices.
struct Frame {
  struct Slot {
    Value value;
    uint64_t epoch = 0;  // time of the computation
  };
  graph::Definition definition;                    // without lets
  std::vector<bool> is_pure_arg;                   // args[d] is the pure variable d itself
  std::unordered_map<std::string, size_t> places;  // positions of its variables in the point
  std::unordered_map<const ir::ExprNode*, Slot> slots;
  uint64_t epoch = 0;  // advances with the point
  Point point;         // pure args, then rvars
};

Frame frame_of(const graph::FuncContents& func, int stage);

}  // namespace retrograde::oracle
