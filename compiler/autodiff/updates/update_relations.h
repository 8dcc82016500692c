// Index sets of an update: what it writes, what it reads of its own Func, and in which order.
#pragma once

#include <optional>
#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "autodiff/inversion/isl_bridge.h"

namespace retrograde::autodiff {

// Order in which the reverse recurrence visits the elements: location dimensions innermost first.
struct ReverseLoop {
  int dim;
  bool descending;
};

class UpdateRelations {
 public:
  // `write`: left-hand side; `pure`: which of its dimensions are pure variables.
  UpdateRelations(const IterationDomain& domain, const std::vector<Expr>& write,
                  const std::vector<bool>& pure);

  bool write_is_affine() const { return write_.has_value(); }
  bool predicate_is_affine() const { return predicate_is_affine_; }
  bool write_is_injective() const;
  // Elements that are written, over `names`. Exact when the predicate is affine.
  Expr written(const std::vector<Expr>& names) const;
  // Iterations that no later one overwrites.
  Expr last_writers() const;

  // Of a read at `indices` (nullopt: not affine).
  struct Read {
    isl::map map;       // iteration -> element
    isl::set sees_new;  // iterations that read what an earlier iteration wrote
    bool always_new, never_new;
    bool overwritten;  // an iteration at or after the read writes the element
    Expr sees_new_condition;
  };
  std::optional<Read> read(const std::vector<Expr>& indices);
  // Whether every iteration reads what an earlier one wrote, but for those where `condition` holds.
  bool sees_new_unless(const Read& read, const Expr& condition);
  // Whether one of the elements read may be written by another stage, given its domain and
  // left-hand side.
  bool may_write(const Read& read, const IterationDomain& other,
                 const std::vector<Expr>& other_write) const;

  // An order of elements in which every reader's element comes before the elements that it read;
  // nullopt: none found.
  std::optional<std::vector<ReverseLoop>> reverse_order(const std::vector<Read>& reads) const;

 private:
  std::optional<isl::map> access(IslBridge& bridge, const std::vector<Expr>& indices) const;
  isl::set domain_set(IslBridge& bridge, const IterationDomain& domain, bool& exact) const;
  isl::map earlier() const;  // {i -> j : j runs before i}
  std::vector<ReverseLoop> first_guess() const;
  bool is_valid_order(const std::vector<ReverseLoop>& loops, const std::vector<Read>& reads) const;

  IslContext context_;
  const IterationDomain& domain_expr_;
  std::vector<Expr> write_indices_;
  std::vector<bool> pure_;
  IslBridge bridge_;
  isl::set domain_;
  std::optional<isl::map> write_;  // on the domain
  bool predicate_is_affine_ = true;
};

}  // namespace retrograde::autodiff
