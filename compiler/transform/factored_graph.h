// factored_graph.h -- a graph in which parts of some definitions are Funcs of their own: the copies that read these,
// beside the user's Funcs, which stay as they are.
#pragma once

#include <cstdint>
#include <string>
#include <unordered_map>
#include <vector>

#include "graph/copy_graph.h"
#include "graph/function.h"

namespace retrograde::transform {

// Whether terms of float sums may be added in another order, which changes how the sum is rounded.
enum class SumOrder : uint8_t { Kept, Free };

struct FactoredGraph {
  std::vector<FuncPtr> outputs;
  // Copies of the Funcs with parts that became Funcs, and of all that read these, by the original. The others are
  // shared with the original graph, which stays as it is.
  FuncCopies copies;
  std::vector<FuncPtr> factors;    // the Funcs that are such parts
  std::vector<std::string> notes;  // what each of them keeps, in words
};

// `first`, and then `second`, which was made from its outputs.
FactoredGraph in_turn(const FactoredGraph& first, FactoredGraph second);

// Calls of Funcs, by the expression that each replaces.
using FactorReads = std::unordered_map<const ExprNode*, Expr>;

// Whether the Func is the user's, without rules or directives that a change of its definition could break.
bool is_users(const FuncContents& f);

// Makes the copies, producers first.
class GraphFactoring {
 public:
  explicit GraphFactoring(const std::vector<FuncPtr>& outputs);

  const std::vector<FuncPtr>& order() const { return order_; }
  bool is_copied(const FuncContents& f) const { return result_.copies.contains(&f); }
  bool reads_copies(const FuncContents& f) const;
  // Copies f with these stages; `reads` replaces parts of their expressions.
  void copy(const FuncPtr& f, const std::vector<Definition>& stages, const FactorReads& reads = {});
  // Reads copies instead of what was copied.
  Expr redirected(const Expr& e, const FactorReads& reads = {}) const;
  const FuncPtr& copy_of(const FuncContents& f) const { return result_.copies.at(&f); }
  void add_factor(const FuncPtr& factor, const std::string& note);
  FactoredGraph finish();

 private:
  const std::vector<FuncPtr> outputs_;
  const std::vector<FuncPtr> order_;
  FactoredGraph result_;
};

// The stages of a Func, the pure definition first.
std::vector<Definition> stages_of(const FuncContents& f);

}  // namespace retrograde::transform
