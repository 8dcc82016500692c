// operation_count.h -- how much Funcs compute, move and keep, counted from their definitions.
//
// The measure is the one in which the cheap-gradient principle is stated (Griewank and Walther,
// Evaluating Derivatives, 2nd edition, section 4.1): moves to and from memory, additions,
// multiplications and nonlinear functions, each with the number of times it runs.
//
// What is counted: floating-point work of every stage over the region that the outputs need, each
// distinct sub-expression of a stage once, both arms of a select, all points of a reduction domain
// whatever its predicate says. A Func is stored or computed again at each read as its schedule says
// (stored_funcs.h where nobody scheduled), and a stored element is computed once: what
// tiles compute twice is not seen. Integers are places and borders: not counted. With Tuples that
// are computed again at each read, the work that their values share counts once a value.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "analysis/interval.h"
#include "graph/function.h"

namespace retrograde::autodiff {

// In one iteration of a stage.
struct Operations {
  double moves = 0;      // elements loaded and stored
  double adds = 0;       // + and -, and what costs as little: comparisons, select, casts, rounding
  double mults = 0;      // * and /
  double nonlinear = 0;  // sqrt, exp, sin and the like
  double total() const { return moves + adds + mults + nonlinear; }
  Operations& operator+=(const Operations& other);
};

// A number that may depend on extents known at run time only: a constant and a sum of factor *
// product of extents.
class Count {
 public:
  Count(double constant = 0) : constant_(constant) {}
  // The product of max - min + 1 over the box; unknown where an end is missing.
  static Count points(const Box& box);
  Count& operator+=(const Count& other);
  friend Count operator*(const Count& count, double factor);
  // Nothing when it depends on extents, or is unknown.
  std::optional<double> value() const;
  // "96", "96 + 4 * (w*h)", "unknown".
  std::string text() const;

 private:
  double constant_ = 0;
  bool unknown_ = false;
  std::map<std::string, double> terms_;  // by the printed product
};

struct StageOperations {
  Operations each;   // with what is computed again at its reads
  Count iterations;  // 0 for a Func that is not stored
};

struct FuncOperations {
  FuncPtr func;
  Box region;
  bool stored = false;
  std::vector<StageOperations> stages;  // or, of loops that follow a table, parts of them
  Count evaluations;       // of the definition: elements when stored, reads by others when not
  Count bytes;             // kept in memory
  bool is_extern = false;  // computed elsewhere: nothing is known
  Count operations() const;
};

struct OperationCount {
  std::vector<FuncOperations> funcs;  // producers first
  Count moves() const;
  Count adds() const;
  Count mults() const;
  Count nonlinear() const;
  Count operations() const;  // all four
  Count bytes() const;       // of what is stored, outputs included
  const FuncOperations* find(const FuncContents* f) const;

 private:
  Count sum(double Operations::*part) const;
};

// A Func, and the part of it that is wanted: an interval for each dimension.
struct WantedFunc {
  FuncPtr func;
  Box region;
};

// What it takes to compute `outputs` together, as one pipeline.
OperationCount count_operations(const std::vector<WantedFunc>& outputs);

}  // namespace retrograde::autodiff
