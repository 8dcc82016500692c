#include "lower/loops/kept_update.h"

#include <algorithm>
#include <string>
#include <unordered_set>
#include <utility>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/visit.h"

namespace retrograde::lower {

namespace {

class UpdateFinder {
 public:
  explicit UpdateFinder(const std::function<bool(const For&)>& is_pure) : is_pure_(is_pure) {}

  std::optional<KeptUpdate> update_in(const For& loop) {
    const bool found = enter(loop) && descend(loop.body) && !update_.lanes.empty() && is_small() &&
                       stays_in_place();
    return found ? std::optional(std::move(update_)) : std::nullopt;
  }

 private:
  bool descend(const Stmt& s) {
    return match(
        s, [&](const For& n) { return enter(n) && descend(n.body); },
        [&](const LetStmt& n) {
          around_.push_back(n.value);
          lets_[n.name] = substitute(n.value, lets_);
          return descend(n.body);
        },
        [&](const IfThenElse& n) {
          around_.push_back(n.condition);
          std::vector<Expr> conjuncts;
          add_conjuncts(n.condition, conjuncts);
          for (const Expr& conjunct : conjuncts) {
            const Expr condition = substitute(conjunct, lets_);
            if (!varies(condition)) update_.conditions.push_back(condition);
          }
          return !n.when_false.defined() && descend(n.when_true);
        },
        [&](const Provide& n) {
          update_.provide = &n;
          return !n.predicate.defined();
        },
        [](const StmtNode&) { return false; });
  }

  bool enter(const For& loop) {
    if (is_lane_loop(loop)) {
      update_.lanes.push_back(&loop);
      return is_const(loop.min) && as_const_int(loop.extent) && is_pure_(loop);
    }
    around_.push_back(loop.extent);
    varying_.insert(loop.name);
    return loop.runs == ForType::Serial && update_.lanes.empty();
  }

  bool is_small() const {
    int64_t bytes = 0;
    for (const Expr& value : update_.provide->values) bytes += value.type().bytes();
    for (const For* lane : update_.lanes) bytes *= *as_const_int(lane->extent);
    return bytes <= register_file;
  }

  // Whether every iteration reads and writes the same points of the Func, and no others.
  bool stays_in_place() {
    const std::vector<Expr>& args = update_.provide->args;
    for (const Expr& arg : args) {
      update_.point.push_back(substitute(arg, lets_));
      if (varies(update_.point.back())) return false;
    }
    const auto is_own = [&](const Expr& e) { return update_.as_own(e) != nullptr; };
    const auto reads_own = [&](const Expr& e) { return any_node(e, is_own); };
    const auto is_elsewhere = [&](const Expr& e) {
      const Call* own = update_.as_own(e);
      return own && !std::equal(args.begin(), args.end(), own->args.begin(), own->args.end(),
                                [](const Expr& a, const Expr& b) { return equal(a, b); });
    };
    const std::vector<Expr>& values = update_.provide->values;
    return std::none_of(around_.begin(), around_.end(), reads_own) &&
           std::none_of(args.begin(), args.end(), reads_own) &&
           std::any_of(values.begin(), values.end(), reads_own) &&
           std::none_of(values.begin(), values.end(),
                        [&](const Expr& value) { return any_node(value, is_elsewhere); });
  }

  bool varies(const Expr& e) const { return uses_any_variable(e, varying_); }

  const std::function<bool(const For&)>& is_pure_;
  KeptUpdate update_;
  std::unordered_set<std::string> varying_;  // serial loops
  Substitution lets_;
  std::vector<Expr> around_;  // expressions evaluated by the loops, lets and conditions on the way
};

}  // namespace

Stmt in_lanes(const std::vector<const For*>& lanes, const std::vector<Expr>& conditions,
              Stmt body) {
  if (!conditions.empty()) body = make_if(conjunction(conditions), body);
  for (size_t i = lanes.size(); i-- > 0;) {
    const For& lane = *lanes[i];
    body = make_for(lane.name, lane.min, lane.extent, lane.runs, body, lane.partition);
  }
  return body;
}

std::optional<KeptUpdate> kept_update(const For& loop,
                                      const std::function<bool(const For&)>& is_pure) {
  return UpdateFinder(is_pure).update_in(loop);
}

}  // namespace retrograde::lower
