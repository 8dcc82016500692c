// Hulls and intersections, and the public interface of the bounds engine.
#include "analysis/interval.h"

#include "analysis/bounds_engine.h"
#include "analysis/linear.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"

namespace retrograde::analysis {

namespace {

Expr both(const Expr& a, const Expr& b, Expr (*pick)(const Expr&, const Expr&)) {
  return a.defined() && b.defined() ? pick(a, b) : Expr();
}
Expr either(const Expr& a, const Expr& b, Expr (*pick)(const Expr&, const Expr&)) {
  if (!a.defined() || !b.defined()) return a.defined() ? a : b;
  return pick(a, b);
}

}  // namespace

Interval hull(const Interval& a, const Interval& b) {
  return {both(a.min, b.min, canonical_min), both(a.max, b.max, canonical_max)};
}

Interval intersection(const Interval& a, const Interval& b) {
  return {either(a.min, b.min, canonical_max), either(a.max, b.max, canonical_min)};
}

Box hull(const Box& a, const Box& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  RETROGRADE_ASSERT(a.size() == b.size(), "hull of boxes with ", a.size(), " and ", b.size(),
                    " dimensions");
  Box result(a.size());
  for (size_t d = 0; d < a.size(); ++d) result[d] = hull(a[d], b[d]);
  return result;
}

Interval bounds_of(const Expr& e, const Scope<Interval>& variables, const ValueBounds* values) {
  return BoundsEngine(variables, values).bounds(e);
}

namespace {

// Visits every node once per engine: a node under a condition is visited again only with the engine
// of that condition.
class FootprintCollector {
 public:
  explicit FootprintCollector(std::map<std::string, Footprint>& found) : found_(found) {}

  void visit(const Expr& e, BoundsEngine& engine) {
    if (!visited_.emplace(e.get(), &engine).second) return;
    if (const Let* let = e.as<Let>()) {
      visit(let->value, engine);
      engine.bind(*let);
      return visit(let->body, engine);
    }
    if (const Call* branch = as_op(e, Op::if_then_else)) return visit_branches(*branch, engine);
    const Call* call = e.as<Call>();
    if (call && (call->call_type == CallType::Func || call->call_type == CallType::Image))
      add(*call, engine);
    for_each_child(e, [&](const Expr& child) { visit(child, engine); });
  }

 private:
  void visit_branches(const Call& call, BoundsEngine& engine) {
    visit(call.args[0], engine);
    BoundsEngine::Truth decided = engine.truth(call.args[0]);
    if (decided != BoundsEngine::Truth::False)
      visit(call.args[1], engine.under(call.args[0], true));
    if (decided != BoundsEngine::Truth::True)
      visit(call.args[2], engine.under(call.args[0], false));
  }

  void add(const Call& call, BoundsEngine& engine) {
    Box box = mapped(call.args, [&](const Expr& arg) { return engine.bounds(arg); });
    Footprint& footprint = found_[call.name];
    footprint.box = hull(footprint.box, box);
    footprint.is_image = call.call_type == CallType::Image;
    if (!footprint.symbol.defined()) footprint.symbol = call.symbol;
  }

  struct PairHash {
    size_t operator()(const std::pair<const ExprNode*, BoundsEngine*>& p) const {
      return std::hash<const void*>()(p.first) * 31 + std::hash<const void*>()(p.second);
    }
  };
  std::map<std::string, Footprint>& found_;
  std::unordered_set<std::pair<const ExprNode*, BoundsEngine*>, PairHash> visited_;
};

}  // namespace

std::map<std::string, Footprint> footprints(const Expr& e, const Scope<Interval>& variables,
                                            const ValueBounds* values) {
  std::map<std::string, Footprint> found;
  BoundsEngine engine(variables, values);
  FootprintCollector(found).visit(e, engine);
  return found;
}

void merge_footprints(std::map<std::string, Footprint>& into,
                      const std::map<std::string, Footprint>& from) {
  for (const auto& [name, footprint] : from) {
    auto [it, is_new] = into.emplace(name, footprint);
    if (!is_new) it->second.box = hull(it->second.box, footprint.box);
  }
}

}  // namespace retrograde::analysis
