// One stage of a Func, flattened for repeated evaluation: every node of its expression DAG is one
// step, shared nodes are one step, variables are resolved. At a point each step is evaluated at
// most once, and only when it is needed: an arm of a select that is not chosen is never evaluated,
// so it may read outside of its producer's domain.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "graph/function.h"
#include "testing/tracked_value.h"

namespace retrograde::oracle {

struct Step {
  enum class Code : uint8_t {
    Constant,
    Coordinate,  // index: which variable of the stage's point
    Parameter,   // a scalar parameter
    BufferFact,  // "in.min.0"
    Cast,
    Reinterpret,
    Binary,
    Not,
    Select,
    Operator,
    Random,
    Require,
    Print,  // children[index] is the value
    Undef,
    FuncCall,
    ImageCall,
    ExternCall,
    Text,  // a string, part of a message
  };
  Code code = Code::Constant;
  ir::Kind kind = ir::Kind::Add;
  ir::Op op = ir::Op::none;
  int index = 0;
  Type type;                  // after widening
  Type declared;              // before
  std::vector<int> children;  // steps
  Value constant;
  const ir::Symbol* symbol = nullptr;  // Parameter, BufferFact, FuncCall, ImageCall
  std::string name;
};

struct StageProgram {
  std::vector<Step> steps;
  std::vector<int> args, values;  // roots
  int predicate = -1;
  struct Bounds {
    int min, extent;  // roots
  };
  std::vector<Bounds> rvars;      // innermost first
  std::vector<bool> is_pure_arg;  // args[d] is the pure variable d itself
};

// Variables of a stage's point: the Func's pure args, then its rvars. `widen`: float types become
// float64.
StageProgram flatten_stage(const ir::FuncContents& func, int stage, bool widen);

}  // namespace retrograde::oracle
