// row_readers.h -- stages that read a Func row by row, whichever of their loops moves the row.
//
//   error(x, y, c) = f(x, y, c) - ...                          its y
//   loss() += square(f(r.x, r.y, r.z) - ...)                   its r.y
//   parts(lane, part) += block(lane, part, rho.x, rho.y), which sums f(..., 50 * part + y_block)
//                                                              its part and rho.y, one loop
//
// A private part of a sum is a range of rows: part and row of it make the number of the row.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "autoschedule/size_estimate.h"
#include "graph/function.h"

namespace retrograde::autoschedule {

struct RowReader {
  enum class Kind : uint8_t { Pure, Sum, Parts };
  Kind kind = Kind::Pure;
  FuncPtr func;
  int stage = 0;
  std::string row;   // a loop of the stage
  std::string part;  // of parts: the loop over them
  FuncPtr block;     // of parts: what they add up
};

// All that is not computed inline, with what it reads through what is.
class StageReads {
 public:
  StageReads(const std::vector<FuncPtr>& outputs, const std::vector<FuncPtr>& stored);

  struct Reading {
    FuncPtr func;
    int stage = 0;
    std::vector<std::vector<Expr>> places;  // of the Func asked about
  };
  std::vector<Reading> of(const FuncContents& f) const;
  // The only Func that adds up the blocks; null where there is none.
  FuncPtr adder_of(const FuncPtr& block) const;

 private:
  struct Roots {
    FuncPtr func;
    int stage;
    std::vector<Expr> roots;
  };
  std::vector<Roots> stages_;
};

// The reader as one that goes along dimension `row` of what it reads, in one of the ways above;
// nullopt: it reads other rows, too, or has loops in which rows can't be the outermost.
std::optional<RowReader> row_reader(const StageReads& reads, const StageReads::Reading& reading,
                                    size_t row, const SizeEstimate& sizes);

}  // namespace retrograde::autoschedule
