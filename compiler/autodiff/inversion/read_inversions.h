// read_inversions.h -- caches the inversions of a program's reads.
//
// Accesses of one stage often share their indices, and an inversion is the expensive part of a contribution.
#pragma once

#include <map>
#include <string>

#include "autodiff/inversion/inversion_cost.h"
#include "graph/function.h"

namespace retrograde::autodiff {

// The inversion of a read, and what the read contributes at each of its points.
struct InvertedRead {
  const Inversion& inversion;
  Expr adjoint;
};

class ReadInversions {
 public:
  // The inversion of a read of `symbol` in a stage of f, which contributes `adjoint` to it. Where a select makes the
  // adjoint 0, the read is ignored if that turns the many pieces of a clamped read into one: select(x < 0 || x > 9, 0,
  // a(clamp(x, 0, 9))); or if fewer points then read each element: select(x % 2 == 0, a(x / 2), 0). The same holds for a
  // factor that is read of a Func with zeros between its elements. The adjoint is then that of the other points.
  InvertedRead of(const FuncContents& f, const Symbol& symbol, const AccessQuery& query,
                  const Expr& adjoint);

 private:
  const Inversion* where(const Expr& condition, const FuncContents& f, const Symbol& symbol,
                         AccessQuery query);
  const Inversion& find(const FuncContents& f, const Symbol& symbol, const AccessQuery& query);
  std::map<std::string, Inversion> found_;
  // Inversions without reduction domains, keyed by all their inputs: the steps of an unrolled loop have equal reads.
  // Inversions with reduction domains are not shared, because each adjoint needs a domain of its own.
  std::map<std::string, Inversion> without_domains_;
  unsigned long operations_ = worthwhile_operations;  // budget of the next search
};

}  // namespace retrograde::autodiff
