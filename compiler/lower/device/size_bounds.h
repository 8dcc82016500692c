// size_bounds.h -- the most that a size in a kernel can be, whatever the block and the iteration: what is
// allocated before the kernel starts is of that size.
#pragma once

#include "analysis/interval.h"
#include "ir/visit.h"
#include "lower/device/kernel.h"
#include "simplify/facts.h"

namespace retrograde::lower {

class SizeBounds {
 public:
  explicit SizeBounds(const Kernel& kernel);
  // What is around the size.
  void define(const LetStmt& let) { lets_[let.name] = let.value; }
  void enter(const For& loop);
  void leave(const For& loop);
  // Over variables that are known outside of the kernel. Undefined where nothing bounds it.
  Expr most(const Expr& size);

 private:
  void bind(const std::string& name, const Expr& min, const Expr& max);

  Substitution lets_;
  analysis::Scope<Interval> variables_;
  simplification::Facts facts_;
};

}  // namespace retrograde::lower
