#include "autodiff/updates/tape_layout.h"

#include "diagnostics/error.h"
#include "frontend/language/var.h"
#include "graph/definitions/define.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

bool has_operators(const Expr& e) {
  return any_node(e, [](const Call&) { return true; });
}

}  // namespace

TapeLayout::TapeLayout(const UpdateContext& context)
    : c_(context),
      box_(context.query.regions.of(context.f)),
      slot_(variable(unique_name("slot"))),
      elements_(make_one(Int(32))),
      scope_(scope_of(context.domain.vars)) {
  for (size_t d = 0; d < c_.pure.size(); ++d) {
    extents_.emplace_back();
    strides_.emplace_back();
    if (c_.pure[d]) continue;
    if (!box_.at(d).is_bounded()) {
      unsupported(c_.asked(),
                  "an update that runs backward needs to know the elements it may reach",
                  text("the region of ", quoted(c_.f->name), " has no bounds in dimension ", d),
                  "Clamp the index");
    }
    extents_.back() = extent_of(box_[d]);
    strides_.back() = elements_;
    check_numbers(c_, least_product(extents_), "the elements that an update may reach");
    elements_ = simplify(elements_ * extents_.back());
  }
}

std::vector<Expr> TapeLayout::with_pure(const Expr& slot) const {
  std::vector<Expr> point;
  for (size_t d = 0; d < c_.pure.size(); ++d) {
    if (c_.pure[d]) point.push_back(c_.point[d]);
  }
  point.push_back(slot);
  return point;
}

bool TapeLayout::is_always_inside(const Expr& index, size_t d) const {
  return can_prove_inside(bounds_of(index, scope_), box_[d]);
}

Expr TapeLayout::slot_of(const std::vector<Expr>& args) const {
  Expr slot = make_zero(Int(32));
  for (size_t d = 0; d < args.size(); ++d) {
    if (c_.pure[d]) continue;
    Expr index = cast_to(Int(32), args[d]);
    // Some operators have bounds here, where all loops are known, but not inside of some of the loops.
    if (has_operators(index) || !is_always_inside(index, d))
      index = clamp(index, box_[d].min, box_[d].max);
    slot = slot + (index - box_[d].min) * strides_[d];
  }
  return simplify(slot);
}

Expr TapeLayout::is_inside(const std::vector<Expr>& args) const {
  std::vector<Expr> terms;
  for (size_t d = 0; d < args.size(); ++d) {
    if (c_.pure[d] || is_always_inside(args[d], d)) continue;
    terms.push_back(args[d] >= box_[d].min && args[d] <= box_[d].max);
  }
  return conjunction(terms);
}

std::vector<Expr> TapeLayout::element(const Expr& any_number) const {
  Expr number = clamp(any_number, make_zero(Int(32)), elements_ - 1);
  return numbered(c_.pure.size(), [&](size_t d) {
    return c_.pure[d] ? c_.point[d] : simplify(number / strides_[d] % extents_[d] + box_[d].min);
  });
}

AdjointWork work_of(const std::vector<SlotWrite>& writes, const FuncPtr& func,
                    std::vector<Expr> loops, ExprMap map) {
  AdjointWork work{{}, std::move(loops)};
  const auto add = [&](const Expr& e) {
    work.values.push_back(redirect_calls(map(e), func, func, true));
  };
  for (const SlotWrite& w : writes) {
    add(w.place);
    for (const Expr& v : w.values) add(v);
  }
  return work;
}

}  // namespace retrograde::autodiff
