// update_component.h -- splits an update of several values into components of mutually dependent
// values. Each component is a function of the old values x and of unknowns g that do not depend on
// them.
//
//   f(x) = (f(x)[0] + a(x) - b(x), max(f(x)[1], c(x)))   =>   {x0 + g0}, {max(x0, g0)}
#pragma once

#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "ir/expr.h"
#include "ir/node_memo.h"

namespace retrograde::analysis {

bool is_bitwise(const Expr& e);

// Gathers the operands free of x in each sum and product, and replaces every maximal subexpression
// free of x by a variable: x + a - b becomes x + g.
class Abstraction {
 public:
  explicit Abstraction(const std::vector<std::string>& xs) : xs_(xs.begin(), xs.end()) {}

  Expr operator()(const Expr& e);

  std::vector<std::pair<std::string, Expr>> unknowns;  // name -> the expression that it replaces

 private:
  std::unordered_set<std::string> xs_;
  NodeMemo<Expr> done_;
  NodeMemo<bool> depends_;

  bool depends(const Expr& e);
  Expr unknown(const Expr& e);
  Expr abstract(const Expr& e);
  void collect_terms(const Expr& e, bool negative, Expr& fixed, Expr& varying);
  Expr sum(const Expr& e);
  void collect_factors(const Expr& e, Expr& fixed, Expr& varying);
  Expr product(const Expr& e);
};

// The connected components of the relation "new value i reads old value j".
std::vector<std::vector<int>> components_of(const std::vector<Expr>& values,
                                            const std::vector<std::string>& xs);

// One component, with its variables renamed to x0.., y0.., g0..
struct Component {
  std::vector<Expr> update;  // over xs and gs
  std::vector<std::string> xs, ys;
  std::vector<std::pair<std::string, Expr>> gs;
  bool bitwise = false;
  size_t size() const { return update.size(); }
  Type type(size_t i) const { return update[i].type(); }
};

}  // namespace retrograde::analysis
