// The inversions of a program's reads, each found once: accesses of one stage often share their
// indices, and an inversion is the expensive part of a contribution.
#pragma once

#include <map>
#include <string>

#include "autodiff/inversion/inversion_cost.h"
#include "graph/function.h"

namespace retrograde::autodiff {

class ReadInversions {
 public:
  // Of a read of `symbol` in a stage of f, which contributes `adjoint` to it. Where a selection
  // makes the adjoint 0, the read does not count, if that turns the many pieces of a clamped read
  // into one: select(x < 0 || x > 9, 0, a(clamp(x, 0, 9))).
  const Inversion& of(const FuncContents& f, const Symbol& symbol, const AccessQuery& query,
                      const Expr& adjoint);

 private:
  const Inversion* where_selected(const FuncContents& f, const Symbol& symbol, AccessQuery query,
                                  const Expr& adjoint);
  const Inversion& find(const FuncContents& f, const Symbol& symbol, const AccessQuery& query);
  std::map<std::string, Inversion> found_;
  // By all that they depend on: the steps of a loop that is written out read in the same way. Not
  // those with reduction domains, which are of one adjoint each.
  std::map<std::string, Inversion> without_domains_;
  unsigned long operations_ = worthwhile_operations;  // for the next
};

}  // namespace retrograde::autodiff
