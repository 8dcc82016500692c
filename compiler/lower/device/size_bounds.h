// size_bounds.h -- bounds sizes inside a kernel by values known before its launch, so that memory for all blocks
// and iterations can be allocated in advance.
#pragma once

#include "analysis/interval.h"
#include "ir/visit.h"
#include "lower/device/kernel.h"
#include "simplify/facts.h"

namespace retrograde::lower {

class SizeBounds {
 public:
  explicit SizeBounds(const Kernel& kernel);
  // Declare the lets and loops around the size.
  void define(const LetStmt& let) { lets_[let.name] = let.value; }
  void enter(const For& loop);
  void leave(const For& loop);
  // An upper bound of the size over variables known outside of the kernel; undefined if there is none.
  Expr most(const Expr& size);

 private:
  void bind(const std::string& name, const Expr& min, const Expr& max);

  Substitution lets_;
  analysis::Scope<Interval> variables_;
  simplification::Facts facts_;
};

}  // namespace retrograde::lower
