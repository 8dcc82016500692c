// operation_count.h -- counts the operations, memory traffic and storage of Funcs from their definitions.
//
// The measure is that of the cheap-gradient principle (Griewank and Walther, Evaluating Derivatives, 2nd edition,
// section 4.1): moves to and from memory, additions, multiplications and nonlinear functions, each times its number of
// executions.
//
// Counted is the floating-point work of every stage over the region that the outputs need: each distinct subexpression
// of a stage once, both branches of a select, and all points of a reduction domain whatever its predicate is. Whether a
// Func is stored or recomputed at each read follows its schedule (stored_funcs.h for Funcs without directives). Costly
// factors of sums are Funcs of their own, as when a gradient is compiled (invariant_factors.h). A stored element counts once: recomputation at the borders of tiles is not seen. Integer work serves indices and
// borders and is not counted. For Tuples that are recomputed at each read, work that the values share counts once for
// each value.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/interval.h"
#include "graph/function.h"

namespace retrograde::autodiff {

// The operations of one iteration of a stage.
struct Operations {
  double moves = 0;  // elements loaded and stored
  double adds = 0;   // + and -, and equally cheap operations: comparisons, select, casts, rounding
  double mults = 0;  // * and /
  double nonlinear = 0;  // sqrt, exp, sin and the like
  double total() const { return moves + adds + mults + nonlinear; }
  Operations& operator+=(const Operations& other);
};

// A number that may depend on extents known at run time only: a constant plus a sum of factor * product of extents.
class Count {
 public:
  Count(double constant = 0) : constant_(constant) {}
  // The product of max - min + 1 over the box; unknown if an end is undefined.
  static Count points(const Box& box);
  Count& operator+=(const Count& other);
  friend Count operator*(const Count& count, double factor);
  // The value; nullopt if it depends on extents or is unknown.
  std::optional<double> value() const;
  // "96", "96 + 4 * (w*h)", "unknown".
  std::string text() const;

 private:
  double constant_ = 0;
  bool unknown_ = false;
  std::map<std::string, double> terms_;  // by the printed product
};

struct StageOperations {
  Operations each;   // one iteration, including values that are recomputed at its reads
  Count iterations;  // 0 for a Func that is not stored
};

struct FuncOperations {
  FuncPtr func;
  Box region;
  bool stored = false;
  std::vector<StageOperations> stages;  // for loops that follow a table: one entry for each action
  Count evaluations;       // of the definition: elements if stored, else reads by consumers
  Count bytes;             // stored in memory
  bool is_extern = false;  // computed by a C function; its operations are unknown
  Count operations() const;
};

struct OperationCount {
  std::vector<FuncOperations> funcs;  // producers first
  Count moves() const;
  Count adds() const;
  Count mults() const;
  Count nonlinear() const;
  Count operations() const;  // all four
  Count bytes() const;       // of all stored Funcs, outputs included
  const FuncOperations* find(const FuncContents* f) const;

 private:
  Count sum(double Operations::*part) const;
};

// A Func and its wanted region: an interval for each dimension.
struct WantedFunc {
  FuncPtr func;
  Box region;
};

// The operations to compute `outputs` together, as one pipeline.
OperationCount count_operations(const std::vector<WantedFunc>& outputs);

}  // namespace retrograde::autodiff
