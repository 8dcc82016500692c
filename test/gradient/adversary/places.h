// Integer expressions in the coordinates of a point: where a program reads or writes.
#pragma once

#include <vector>

#include "frontend/data/buffer.h"
#include "frontend/data/param.h"
#include "gradient/adversary/choices.h"

namespace retrograde::gradient {

class Places {
 public:
  Places(Choices& choices, const Buffer<int>& data, const Param<int>& count)
      : choices_(choices), data_(data), count_(count) {}

  // Near `u`, made of it and of the other coordinates in `all`.
  Expr near(const Expr& u, const std::vector<Expr>& all);
  // The same inside of [0, n).
  Expr inside(const Expr& u, const std::vector<Expr>& all, const Expr& n);
  // A place in [0, n) that `data` decides.
  Expr by_data(const Expr& u, const Expr& n);
  // Of the coordinates only.
  Expr condition(const std::vector<Expr>& all);

 private:
  Expr other(const std::vector<Expr>& all);
  Expr affine(const Expr& u, const std::vector<Expr>& all);
  Expr piecewise(const Expr& u, const std::vector<Expr>& all);
  Expr odd(const Expr& u, const std::vector<Expr>& all);

  Choices& choices_;
  const Buffer<int>& data_;
  const Param<int>& count_;
};

}  // namespace retrograde::gradient
