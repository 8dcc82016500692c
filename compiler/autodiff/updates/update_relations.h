// update_relations.h -- index sets of an update: the elements that it writes, those that it reads of its own Func, and
// the order of both.
#pragma once

#include <optional>
#include <vector>

#include "autodiff/inversion/access_inversion.h"
#include "autodiff/inversion/isl_bridge.h"

namespace retrograde::autodiff {

// A loop of the reverse recurrence over elements; loops are listed innermost first. It carries if its direction
// matters: elements depend on elements of its other iterations. The others ascend.
struct ReverseLoop {
  int dim;
  bool descending;
  bool carries = true;
};

class UpdateRelations {
 public:
  // `write`: the left-hand side. `pure`: whether each of its dimensions is a pure variable.
  UpdateRelations(const IterationDomain& domain, const std::vector<Expr>& write,
                  const std::vector<bool>& pure);

  bool write_is_affine() const { return write_.has_value(); }
  bool predicate_is_affine() const { return predicate_is_affine_; }
  bool write_is_injective() const;
  // The condition, over `names`, that an element is written. Exact if the predicate is affine.
  Expr written(const std::vector<Expr>& names) const;
  // The condition that no later iteration overwrites the element.
  Expr last_writers() const;

  // The relation of a read at `indices`; nullopt if they are not affine.
  struct Read {
    isl::map map;       // iteration -> element
    isl::set sees_new;  // iterations that read a value which an earlier iteration wrote
    bool always_new, never_new;
    bool overwritten;  // the iteration of the read, or a later one, writes the element
    Expr sees_new_condition;
  };
  std::optional<Read> read(const std::vector<Expr>& indices);
  // Whether every iteration reads a value that an earlier one wrote, except where `condition` holds.
  bool sees_new_unless(const Read& read, const Expr& condition);
  // Whether another stage, with this domain and left-hand side, may write one of the elements read.
  bool may_write(const Read& read, const IterationDomain& other,
                 const std::vector<Expr>& other_write) const;

  // An order of elements in which the element of each consumer precedes the elements that it read; nullopt if none is
  // found.
  std::optional<std::vector<ReverseLoop>> reverse_order(const std::vector<Read>& reads) const;

 private:
  std::optional<isl::map> access(IslBridge& bridge, const std::vector<Expr>& indices) const;
  isl::set domain_set(IslBridge& bridge, const IterationDomain& domain, bool& exact) const;
  isl::map earlier() const;  // {i -> j : j runs before i}
  std::vector<ReverseLoop> first_guess() const;
  bool is_valid_order(const std::vector<ReverseLoop>& loops, const std::vector<Read>& reads) const;
  void find_carrying(std::vector<ReverseLoop>& loops, const std::vector<Read>& reads) const;

  IslContext context_;
  const IterationDomain& domain_expr_;
  std::vector<Expr> write_indices_;
  std::vector<bool> pure_;
  IslBridge bridge_;
  isl::set domain_;
  std::optional<isl::map> write_;  // restricted to the domain
  bool predicate_is_affine_ = true;
};

}  // namespace retrograde::autodiff
