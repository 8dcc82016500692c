// keep_accumulators -- what a reduction adds to stays in registers while its loops run.
// In:  Loops; names unique.
// Out: Loops; names unique; the same operations on every element, in the same order.
//
//   for (r, 0, n) {                           realize kept [0, 8] {
//     unrolled for (c, 0, 8) {                  unrolled for (c, 0, 8) { kept(c) = f(x, c) }
//       f(x, c) = f(x, c) + a(x, r) * b(r, c)   for (r, 0, n) {
//     }                                    =>     unrolled for (c, 0, 8) {
//   }                                               kept(c) = kept(c) + a(x, r) * b(r, c)
//                                                 }
//                                               }
//                                               unrolled for (c, 0, 8) { f(x, c) = kept(c) }
//                                             }
//
// What gives the elements their first values right before is made to fill kept, and f is not touched
// until the end:
//
//   for (c, 0, 8) { f(x, c) = bias(c) }       realize kept [0, 8] {
//   for (r, 0, n) { ... }                =>     unrolled for (c, 0, 8) { kept(c) = bias(c) }
//                                               for (r, 0, n) { ... }
//
// Why: the storage of f may be as large as an image, with strides known at run time only, and LLVM
//      cannot tell that other elements are not these. An array of constant size with constant
//      indices becomes registers.
//
// Method: outermost loop first. A serial loop is followed inwards, through serial loops, lets and
//         conditions, to vectorized and unrolled loops of constant extents over pure variables
//         around one Provide, whose point is the same in all iterations of the serial loops and
//         which reads its Func at this point alone. Conditions that hold for all iterations of the
//         serial loops or for none, as those of tails do, also stand around the copies; others
//         only around the update, so that a point may be written that was not: by what it holds.
//         No other task writes it, since all parallel loops around are over pure variables. First
//         values come from a nest of loops that are those of the update one by one, under the same
//         conditions: then both have the same elements.
// Not done: more elements than registers hold; Funcs all of which fit registers as they are.
// Source: scalar replacement (Callahan, Carr and Kennedy, PLDI 1990).
// Tests: test/golden/lower/keep_accumulators/, codegen_idioms_test.
#include "lower/loops/keep_accumulators.h"

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <unordered_set>
#include <vector>

#include "ir/build.h"
#include "ir/equal.h"
#include "ir/markers.h"
#include "ir/visit.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

constexpr int64_t register_file = 2048;  // bytes: 32 registers of 64

bool is_lane_loop(const For& loop) {
  return loop.runs == ForType::Vectorized || loop.runs == ForType::Unrolled;
}

// The way from a serial loop to the one Provide in it.
struct KeptUpdate {
  std::vector<const For*> lanes;  // outermost first
  std::vector<Expr> conditions;   // that are the same for all iterations; lets are substituted
  const Provide* provide = nullptr;
  std::vector<Expr> point;  // of the Provide; lets are substituted

  // The value of a Func at the point.
  const Call* as_own(const Expr& e) const {
    const auto* call = e.as<Call>();
    return call && call->call_type == CallType::Func && call->name == provide->name ? call
                                                                                    : nullptr;
  }
};

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

  // Every iteration reads and writes the same points of the Func, and no other.
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
  std::vector<Expr> around_;  // what is computed on the way
};

// A nest of loops that gives the elements of an update their first values.
class Start {
 public:
  // `around`: lets in which the update stands, and the nest does not.
  static std::optional<Start> of(const KeptUpdate& update, const Substitution& around,
                                 const Stmt& nest, const std::function<bool(const For&)>& is_pure) {
    Start start;
    const bool found = start.descend(nest, update, is_pure) && start.pair_loops(update, around) &&
                       start.is_at(update, around) && start.has_conditions_of(update, around);
    return found ? std::optional(std::move(start)) : std::nullopt;
  }

  // The same for an array of the elements, whose coordinates are the update's lanes, the last first.
  Stmt filling(const Stmt& nest, const std::string& array, const KeptUpdate& update) const {
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

 private:
  bool descend(const Stmt& s, const KeptUpdate& update,
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

  // Along each dimension as many loops as the update has, of the same extents.
  bool pair_loops(const KeptUpdate& update, const Substitution& around) {
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

  // As the update writes it.
  Expr renamed(const Expr& e) const {
    return without_likely(substitute(substitute(e, lets_), names_));
  }

  bool is_at(const KeptUpdate& update, const Substitution& around) const {
    return std::ranges::equal(
        provide_->args, update.point, [&](const Expr& own, const Expr& other) {
          return equal(renamed(own), without_likely(substitute(other, around)));
        });
  }

  bool has_conditions_of(const KeptUpdate& update, const Substitution& around) const {
    const auto own = mapped(conditions_, [&](const Expr& e) { return renamed(e); });
    const auto others = mapped(
        update.conditions, [&](const Expr& e) { return without_likely(substitute(e, around)); });
    const auto are_among = [](const std::vector<Expr>& some, const std::vector<Expr>& all) {
      return std::ranges::all_of(some, [&](const Expr& e) {
        return std::ranges::any_of(all, [&](const Expr& other) { return equal(e, other); });
      });
    };
    return are_among(own, others) && are_among(others, own);
  }

  const Provide* provide_ = nullptr;
  std::vector<const For*> loops_;  // outermost first
  std::vector<Expr> conditions_;
  Substitution lets_, names_;  // names: of the update's lanes, by the loops here
  std::map<const For*, const For*> of_lane_;
};

// The elements that an update adds to, as an array of its own.
class Kept : public Rewriter {
 public:
  Kept(KeptUpdate update, std::string name) : update_(std::move(update)), name_(std::move(name)) {
    for (size_t i = update_.lanes.size(); i-- > 0;)
      args_.push_back(variable(update_.lanes[i]->name));
  }

  // Before the loops, and after them.
  Stmt fetch() const {
    return in_lanes(make_provide(name_, values_of(update_.provide->name, update_.point), args_));
  }
  Stmt give_back() const {
    return in_lanes(make_provide(update_.provide->name, values_of(name_, args_), update_.point));
  }

  Stmt around(const Stmt& body) const {
    std::vector<Type> types;
    std::vector<Range> bounds;
    for (const Expr& value : update_.provide->values) types.push_back(value.type());
    for (size_t i = update_.lanes.size(); i-- > 0;)
      bounds.push_back({update_.lanes[i]->min, update_.lanes[i]->extent});
    return make_realize(name_, types, MemoryType::Stack, bounds, body);
  }

 protected:
  Expr rewrite(const Expr& e) override {
    const Call* own = update_.as_own(e);
    return own ? call_func(name_, e.type(), args_, own->component, {}) : children(e);
  }
  Stmt rewrite(const Stmt& s) override {
    if (s.get() != update_.provide) return children(s);
    return make_provide(name_, mapped(update_.provide->values, *this), args_);
  }

 private:
  std::vector<Expr> values_of(const std::string& func, const std::vector<Expr>& args) const {
    std::vector<Expr> values;
    for (const Expr& value : update_.provide->values)
      values.push_back(call_func(func, value.type(), args, static_cast<int>(values.size()), {}));
    return values;
  }

  Stmt in_lanes(Stmt body) const {
    if (!update_.conditions.empty()) body = make_if(conjunction(update_.conditions), body);
    for (size_t i = update_.lanes.size(); i-- > 0;) {
      const For& lane = *update_.lanes[i];
      body = make_for(lane.name, lane.min, lane.extent, lane.runs, body, lane.partition);
    }
    return body;
  }

  KeptUpdate update_;
  std::string name_;
  std::vector<Expr> args_;
};

class KeepAccumulators : public StatementRewriter {
 public:
  KeepAccumulators(const Stmt& s, const std::function<bool(const For&)>& is_pure)
      : is_pure_(is_pure), fresh_(s) {}

 protected:
  Stmt rewrite(const Stmt& s) override {
    if (const auto* realize = s.as<Realize>()) return in_storage(*realize, s);
    if (const auto* block = s.as<Block>()) return in_order(*block);
    const auto* loop = s.as<For>();
    if (!loop) return children(s);
    if (auto update = update_in(*loop)) return kept(s, std::move(*update), {});
    const bool outside = shares_;
    shares_ |= runs_at_once(loop->runs) && !is_pure_(*loop);
    Stmt result = children(s);
    shares_ = outside;
    return result;
  }

 private:
  // In registers already, when its accesses have constant indices.
  Stmt in_storage(const Realize& realize, const Stmt& s) {
    int64_t bytes = 0;
    for (const Type& type : realize.types) bytes += type.bytes();
    for (const Range& r : realize.bounds) {
      const int64_t extent = as_const_int(r.extent).value_or(register_file + 1);
      bytes =
          std::min(bytes, register_file + 1) * std::clamp<int64_t>(extent, 0, register_file + 1);
    }
    if (bytes <= register_file) small_.insert(realize.name);
    return children(s);
  }

  std::optional<KeptUpdate> update_in(const For& loop) const {
    if (loop.runs != ForType::Serial || shares_) return std::nullopt;
    auto update = UpdateFinder(is_pure_).update_in(loop);
    return update && !small_.contains(update->provide->name) ? std::move(update) : std::nullopt;
  }

  Stmt in_order(const Block& block) {
    std::vector<Stmt> result;
    for (size_t i = 0; i < block.stmts.size(); ++i) {
      const bool has_next = i + 1 < block.stmts.size();
      const Stmt both = has_next ? started(block.stmts[i], block.stmts[i + 1], {}) : Stmt();
      result.push_back(both.defined() ? both : (*this)(block.stmts[i]));
      i += both.defined() ? 1 : 0;
    }
    return make_block(result);
  }

  // The loop of an update, in lets, whose elements the nest before it starts; undefined: they are not.
  Stmt started(const Stmt& nest, const Stmt& next, Substitution lets) {
    if (const auto* let = next.as<LetStmt>()) {
      lets[let->name] = substitute(let->value, lets);
      const Stmt body = started(nest, let->body, std::move(lets));
      return body.defined() ? make_let(let->name, let->value, body) : Stmt();
    }
    const auto* loop = next.as<For>();
    auto update = loop && nest.as<For>() ? update_in(*loop) : std::nullopt;
    const auto start = update ? Start::of(*update, lets, nest, is_pure_) : std::nullopt;
    if (!start) return {};
    return kept(next, std::move(*update), [&](const std::string& array, const KeptUpdate& of) {
      return start->filling(nest, array, of);
    });
  }

  using Filling = std::function<Stmt(const std::string& array, const KeptUpdate& update)>;
  // `filling` gives the elements their first values; without one they are those of the Func.
  Stmt kept(const Stmt& loop, KeptUpdate update, const Filling& filling) {
    const std::string name = fresh_(update.provide->name + ".kept");
    const Stmt start = filling ? filling(name, update) : Stmt();
    Kept array(std::move(update), name);
    return array.around(make_block({start.defined() ? start : copy_statement(array.fetch(), fresh_),
                                    array(loop), copy_statement(array.give_back(), fresh_)}));
  }

  const std::function<bool(const For&)>& is_pure_;
  FreshNames fresh_;
  bool shares_ = false;  // a parallel loop around may have iterations that meet in an element
  std::unordered_set<std::string> small_;
};

}  // namespace

Stmt keep_accumulators(const Stmt& s, const std::function<bool(const For&)>& is_pure) {
  return s.defined() ? KeepAccumulators(s, is_pure)(s) : s;
}

}  // namespace retrograde::lower
