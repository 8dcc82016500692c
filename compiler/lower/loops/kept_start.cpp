#include "lower/loops/kept_start.h"

#include <algorithm>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/markers.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

std::optional<KeptStart> KeptStart::of(const KeptUpdate& update, const Substitution& around,
                                       const Stmt& nest,
                                       const std::function<bool(const For&)>& is_pure) {
  KeptStart start;
  const bool found = start.descend(nest, update, is_pure) && start.pair_loops(update, around) &&
                     start.is_at(update, around) && start.has_conditions_of(update, around);
  return found ? std::optional(std::move(start)) : std::nullopt;
}

Stmt KeptStart::filling(const Stmt& nest, const std::string& array,
                        const KeptUpdate& update) const {
  std::vector<Expr> args;
  for (size_t i = update.lanes.size(); i-- > 0;)
    args.push_back(variable(of_lane_.at(update.lanes[i])->name));
  return rewrite_statements(nest, [&](const Stmt& s, auto& all) {
    if (s.get() == provide_) return make_provide(array, provide_->values, args);
    const auto* loop = s.template as<For>();
    if (!loop || loop->runs != ForType::Serial) return all.children(s);
    return make_for(loop->name, loop->min, loop->extent, ForType::Unrolled, all(loop->body),
                    loop->partition);
  });
}

bool KeptStart::descend(const Stmt& s, const KeptUpdate& update,
                        const std::function<bool(const For&)>& is_pure) {
  const auto reads_own = [&](const Expr& e) {
    return any_node(e, [&](const Expr& part) { return update.as_own(part) != nullptr; });
  };
  const auto inside = [&](const Stmt& body) { return descend(body, update, is_pure); };
  return match(
      s,
      [&](const For& n) {
        loops_.push_back(&n);
        return (is_lane_loop(n) || n.runs == ForType::Serial) && is_pure(n) && inside(n.body);
      },
      [&](const LetStmt& n) {
        lets_[n.name] = substitute(n.value, lets_);
        return !reads_own(n.value) && inside(n.body);
      },
      [&](const IfThenElse& n) {
        add_conjuncts(n.condition, conditions_);
        return !n.when_false.defined() && !reads_own(n.condition) && inside(n.when_true);
      },
      [&](const Provide& n) {
        provide_ = &n;
        return n.name == update.provide->name && !n.predicate.defined() &&
               std::ranges::none_of(n.values, reads_own);
      },
      [](const StmtNode&) { return false; });
}

bool KeptStart::pair_loops(const KeptUpdate& update, const Substitution& around) {
  for (size_t d = 0; d < update.point.size(); ++d) {
    const Expr here = substitute(provide_->args[d], lets_);
    const Expr there = substitute(update.point[d], around);
    std::vector<const For*> own, lanes;
    for (const For* loop : loops_)
      if (uses_variable(here, loop->name)) own.push_back(loop);
    for (const For* lane : update.lanes)
      if (uses_variable(there, lane->name)) lanes.push_back(lane);
    if (own.size() != lanes.size()) return false;
    for (size_t i = 0; i < own.size(); ++i) {
      if (!equal(own[i]->min, lanes[i]->min) || !equal(own[i]->extent, lanes[i]->extent) ||
          !of_lane_.emplace(lanes[i], own[i]).second)
        return false;
      names_[own[i]->name] = variable(lanes[i]->name);
    }
  }
  return of_lane_.size() == update.lanes.size() && of_lane_.size() == loops_.size();
}

Expr KeptStart::renamed(const Expr& e) const {
  return without_likely(substitute(substitute(e, lets_), names_));
}

bool KeptStart::is_at(const KeptUpdate& update, const Substitution& around) const {
  return std::ranges::equal(provide_->args, update.point, [&](const Expr& own, const Expr& other) {
    return equal(renamed(own), without_likely(substitute(other, around)));
  });
}

bool KeptStart::has_conditions_of(const KeptUpdate& update, const Substitution& around) const {
  const auto own = mapped(conditions_, [&](const Expr& e) { return renamed(e); });
  const auto others = mapped(update.conditions,
                             [&](const Expr& e) { return without_likely(substitute(e, around)); });
  const auto are_among = [](const std::vector<Expr>& some, const std::vector<Expr>& all) {
    return std::ranges::all_of(some, [&](const Expr& e) {
      return std::ranges::any_of(all, [&](const Expr& other) { return equal(e, other); });
    });
  };
  return are_among(own, others) && are_among(others, own);
}

}  // namespace retrograde::lower
