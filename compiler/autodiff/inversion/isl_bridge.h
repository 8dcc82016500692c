// isl_bridge.h -- converts expressions to isl objects and back.
//
// A space is a tuple of named integer dimensions (loop variables) and parameters. Subexpressions that isl cannot
// represent and that contain no dimension become parameters: they are the same for every point of the set.
#pragma once

#include <isl/cpp.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "autodiff/inversion/isl_budget.h"
#include "ir/equal.h"
#include "ir/expr.h"
#include "ir/node_memo.h"

namespace retrograde::autodiff {

struct IslContext {
  explicit IslContext(unsigned long max_operations = isl_operations);
  ~IslContext();
  IslContext(const IslContext&) = delete;
  IslContext& operator=(const IslContext&) = delete;
  isl_ctx* ctx;
};

// Throws the last error of isl. isl's C functions report a failure, mostly an exceeded budget, through a return value
// that can be mistaken for an answer, or by stopping half-way through a loop over pieces.
void throw_if_failed(isl_ctx* ctx);

// Returns the result of `search` with a budget of `operations`; nullopt if it is exceeded. Afterwards the context's own
// budget starts again from 0.
template <class Search>
auto found_within(isl_ctx* ctx, unsigned long operations, const Search& search) {
  throw_if_failed(ctx);
  const unsigned long most = isl_ctx_get_max_operations(ctx);
  isl_ctx_reset_operations(ctx);
  isl_ctx_set_max_operations(ctx, std::min(operations, most));
  std::optional<decltype(search())> result;
  try {
    result = search();
    throw_if_failed(ctx);
  } catch (const isl::exception&) {
    result.reset();
    isl_ctx_reset_error(ctx);
  }
  isl_ctx_reset_operations(ctx);
  isl_ctx_set_max_operations(ctx, most);
  return result;
}

// The same set with fewer pieces: pieces that form one are merged. isl 0.25 dereferences the null pointers that a
// failure within coalesce leaves. So no budget applies here, and equalities are detected first, which removes pieces of
// sets and maps that contain rational but no integer points.
template <class Pieces>
Pieces coalesced(const Pieces& pieces) {
  isl_ctx* const ctx = pieces.ctx().get();
  throw_if_failed(ctx);
  const unsigned long most = isl_ctx_get_max_operations(ctx);
  isl_ctx_set_max_operations(ctx, 0);
  Pieces result = pieces;
  if constexpr (!std::is_same_v<Pieces, isl::pw_aff>) result = result.detect_equalities();
  result = result.coalesce();
  isl_ctx_set_max_operations(ctx, most);
  return result;
}

class IslBridge {
 public:
  // `dims` are in tuple order.
  IslBridge(IslContext& context, std::vector<std::string> dims);

  // The same parameters over another tuple. Parameters that are added later are not shared.
  IslBridge with_dims(std::vector<std::string> dims) const;

  isl::set universe() const { return universe_; }
  isl_ctx* ctx() const { return ctx_; }
  int rank() const { return static_cast<int>(dims_.size()); }

  // Returns nullopt if `e` is not quasi-affine, and adds the cause to `obstacles()`.
  std::optional<isl::pw_aff> affine(const Expr& e);
  std::optional<isl::set> condition(const Expr& e);
  // `e` as one parameter, unless it is affine in a single piece: bounds of loops should not split sets.
  isl::pw_aff bound(const Expr& e);
  isl::pw_aff dim(int position) const;
  // For each dimension, the set in which it is in its range.
  std::vector<isl::set> ranges_of(const std::vector<LoopVariable>& dims);

  // Declares that a subexpression over the dimensions has a fixed value, so that it becomes a parameter.
  void make_parameter(const Expr& e) {
    fixed_.insert(e);
    known_.clear();
  }
  const std::set<Expr, StructuralLess>& obstacles() const { return obstacles_; }
  void clear_obstacles() {
    obstacles_.clear();
    known_.clear();  // so that expressions without an affine form are reported again
  }

  // Converts back to expressions. `names` has an expression for each dimension of the set, or of the pw_aff's domain.
  Expr to_expr(const isl::pw_aff& e, const std::vector<Expr>& names) const;
  Expr to_expr(const isl::set& s, const std::vector<Expr>& names) const;  // true for the universe
  // Converts a pw_aff without dimensions, whose expression has parameters only.
  Expr to_expr(const isl::pw_aff& e) const { return to_expr(e, {}); }
  const std::map<std::string, Expr>& parameters() const { return parameters_; }

 private:
  friend class IslToExpr;
  isl::pw_aff constant(int64_t value) const;
  isl::pw_aff parameter(const Expr& e);
  bool mentions_dim(const Expr& e) const;
  std::optional<isl::pw_aff> affine_form(const Expr& e);
  std::optional<isl::pw_aff> obstacle(const Expr& e);
  std::optional<isl::pw_aff> binary(const Binary& b, const Expr& e);
  std::optional<isl::pw_aff> absolute(const Cast& c);
  std::optional<isl::pw_aff> bits(const Call& c, const Expr& e);
  std::optional<isl::set> comparison(const Binary& b, const Expr& e);
  std::optional<isl::set> opaque(const Expr& e);

  isl_ctx* ctx_;
  std::vector<std::string> dims_;
  isl::set universe_;
  std::map<Expr, std::string, StructuralLess> parameter_names_;
  std::map<std::string, Expr> parameters_;
  std::set<Expr, StructuralLess> fixed_, obstacles_;
  NodeMemo<std::optional<isl::pw_aff>> known_;  // by node: expressions share nodes
};

}  // namespace retrograde::autodiff
