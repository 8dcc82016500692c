#include "graph/definitions/reduction_leaves.h"

#include "diagnostics/error.h"

namespace retrograde::graph {

namespace {

class LeafFinder {
 public:
  LeafFinder(const Definition& update, const StageLoops& schedule, std::string asked)
      : asked_(std::move(asked)) {
    for (const ReductionVariable& rvar : update.rvars) {
      leaves_.all.push_back({rvar.var, unique_name("leaf"), rvar.min, rvar.extent});
      leaves_.values[rvar.var] = leaves_.all.back().value();
    }
    for (const Split& split : schedule.splits) apply(split);
  }
  Leaves take() { return std::move(leaves_); }

 private:
  const std::string asked_;
  Leaves leaves_;

  Leaf* find(const std::string& loop) {
    return first_where(leaves_.all, [&](const Leaf& leaf) { return leaf.loop == loop; });
  }

  void apply(const Split& split) {
    if (split.kind == Split::Kind::Fuse) return fuse(split);
    Leaf* leaf = find(split.old_var);
    if (!leaf) {
      leaves_.others.push_back(split);
    } else if (split.kind == Split::Kind::Rename) {
      leaf->loop = split.outer;
    } else {
      split_leaf(*leaf, split);
    }
  }

  // old == min + outer * factor + inner
  void split_leaf(Leaf& leaf, const Split& split) {
    const Expr factor = split.factor;
    Leaf outer{split.outer, unique_name("leaf"), 0, (leaf.extent + factor - 1) / factor};
    Leaf inner{split.inner, unique_name("leaf"), 0, factor};
    const Expr offset = outer.value() * factor + inner.value();
    const auto extent = as_const_int(leaf.extent), step = as_const_int(factor);
    const bool divides = extent && step && *extent % *step == 0;
    // The condition has both ends: if the outer variable becomes pure, its schedule may overrun
    // either one.
    if (!divides) leaves_.tails.push_back(offset >= 0 && offset < leaf.extent);
    // The tail's condition holds wherever the variable is used.
    const Expr inside =
        divides ? offset : call_op(Op::promise_clamped, Int(32), {offset, 0, leaf.extent - 1});
    replace(leaf.name, leaf.min + inside);
    leaf = std::move(inner);
    leaves_.all.push_back(std::move(outer));
  }

  void fuse(const Split& split) {
    const Leaf* inner = find(split.inner);
    const Leaf* outer = find(split.outer);
    if (!inner && !outer) return leaves_.others.push_back(split);
    if (!inner || !outer) {
      user_error(asked_, "reduction variables are fused only with each other",
                 text(quoted(split.inner), " and ", quoted(split.outer),
                      " were fused, and one of them is a pure variable"),
                 "Call rfactor before that fuse");
    }
    Leaf fused{split.old_var, unique_name("leaf"), 0, inner->extent * outer->extent};
    const std::string inner_loop = inner->loop, outer_loop = outer->loop;
    const Expr low = inner->min + fused.value() % inner->extent;
    const Expr high = outer->min + fused.value() / inner->extent;
    replace(inner->name, low);
    replace(outer->name, high);
    std::erase_if(leaves_.all, [&](const Leaf& leaf) {
      return leaf.loop == inner_loop || leaf.loop == outer_loop;
    });
    leaves_.all.push_back(std::move(fused));
  }

  void replace(const std::string& name, const Expr& value) {
    for (auto& entry : leaves_.values) entry.second = substitute(entry.second, name, value);
    for (Expr& tail : leaves_.tails) tail = substitute(tail, name, value);
  }
};

}  // namespace

Leaves leaves_of(const Definition& update, const StageLoops& schedule, const std::string& asked) {
  return LeafFinder(update, schedule, asked).take();
}

}  // namespace retrograde::graph
