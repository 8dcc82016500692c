// carry_elements -- keep the elements that a scan reads of its last iterations in registers.
// In:  FlatStorage, before unrolling; names unique.
// Out: FlatStorage; names unique; the same stores in the same order.
//
//   for (r, 1, n) {                              allocate carried[8] {
//     unrolled for (c, 0, 8) {                     unrolled for (c, 0, 8) { carried[c] = f[c*m] }
//       f[c*m + r] = g[c*m + r] +                  for (r, 1, n) {
//                    f[c*m + r - 1] * 0.5f  =>       unrolled for (c, 0, 8) {
//     }                                                let new = g[c*m + r] + carried[c] * 0.5f
//   }                                                  f[c*m + r] = new
//                                                      carried[c] = new
//                                                    }
//                                                  }
//                                                }
//
// Why: a scan waits for the element before. Through memory that takes as long as two multiplications, and a vector of
//      elements that were stored one by one cannot be loaded before all stores are done. LLVM carries elements of one
//      chain itself, but cannot prove that the stores of other chains are elsewhere.
//
// Method: a serial loop over lets and invariant conditions, then over vectorized and unrolled loops of constant
//         extents, around a single Store. Its index moves by a constant in each iteration. A load of the same buffer
//         whose index is that of 1 ... most_carried iterations ago is carried. The loops over lanes are over pure
//         variables, so that their iterations store to different elements; one may be over a reduction variable whose
//         steps are longer than all iterations of the loop. If the first iterations may not read what lies before the
//         loop, because a load is in an arm of a select, they are a loop of their own that reads memory.
// Not done: chains alone in a loop, which LLVM carries; iterations further away than most_carried.
// Source: scalar replacement (Callahan, Carr and Kennedy, PLDI 1990).
// Tests: test/golden/lower/carry_elements/, test/autoschedule/row_scans_test.cpp.
#include "lower/loops/carry_elements.h"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>
#include <unordered_set>

#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/loops/kept_update.h"
#include "lower/nests/copy_statement.h"
#include "lower/statement_rewriter.h"

namespace retrograde::lower {

namespace {

constexpr int64_t most_carried = 4;           // iterations
constexpr int64_t most_carried_bytes = 1024;  // of 32 registers of 64 bytes, half

// A scan in a serial loop.
struct Scan {
  const For* loop = nullptr;
  std::vector<const For*> lanes;  // outermost first
  std::vector<Expr> conditions;   // on lanes; lets are expanded
  const Store* store = nullptr;
  Expr index;                               // of the store; lets are expanded
  std::map<const ExprNode*, int64_t> back;  // carried loads: by how many iterations
  int64_t most_back = 0;
  bool reads_all = true;  // each iteration makes the loads of all distances, whatever the values

  // Iterations that load from memory, so that those after them need no element from before the loop.
  int64_t head() const { return reads_all ? 0 : most_back; }
  int64_t chains() const {
    int64_t result = 1;
    for (const For* lane : lanes) result *= *as_const_int(lane->extent);
    return result;
  }
};

class ScanFinder {
 public:
  explicit ScanFinder(const std::function<bool(const For&)>& is_pure) : is_pure_(is_pure) {}

  std::optional<Scan> scan_in(const For& loop) {
    if (loop.runs != ForType::Serial) return std::nullopt;
    scan_.loop = &loop;
    const bool found =
        descend(loop.body) && !scan_.lanes.empty() && moves_on() && find_loads() &&
        scan_.chains() * scan_.most_back * scan_.store->value.type().bytes() <= most_carried_bytes;
    return found ? std::optional(std::move(scan_)) : std::nullopt;
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
          const Expr condition = substitute(n.condition, lets_);
          scan_.conditions.push_back(condition);
          return !n.when_false.defined() && !uses_variable(condition, scan_.loop->name) &&
                 descend(n.when_true);
        },
        [&](const Store& n) {
          scan_.store = &n;
          return !n.predicate.defined() && n.index.type().is_scalar() && n.value.type().is_scalar();
        },
        [](const StmtNode&) { return false; });
  }

  bool enter(const For& loop) {
    scan_.lanes.push_back(&loop);
    if (!is_pure_(loop)) proven_.push_back(&loop);
    return is_lane_loop(loop) && is_const(loop.min) && as_const_int(loop.extent).value_or(0) > 0;
  }

  // Whether each iteration stores a constant distance further.
  bool moves_on() {
    scan_.index = substitute(scan_.store->index, lets_);
    const auto form = analysis::decompose(scan_.index, {scan_.loop->name});
    if (!form || form->coefficients.size() != 1) return false;
    step_ = form->coefficients[0].second;
    const auto loads_own = [&](const Expr& e) {
      return any_node(e, [&](const Load& load) { return load.name == scan_.store->name; });
    };
    return step_ != 0 && std::none_of(around_.begin(), around_.end(), loads_own) &&
           !loads_own(scan_.store->index) && lanes_are_apart();
  }

  // Whether lanes store to different elements in all iterations. Of those over a reduction variable there may be one, which
  // moves further than all iterations of the loop.
  bool lanes_are_apart() const {
    if (proven_.empty()) return true;
    const auto iterations = as_const_int(scan_.loop->extent);
    const auto form = analysis::decompose(scan_.index, {proven_[0]->name});
    return proven_.size() == 1 && iterations && form && form->coefficients.size() == 1 &&
           std::abs(form->coefficients[0].second) >= std::abs(step_) * *iterations;
  }

  bool find_loads() {
    std::unordered_set<int64_t> distances;
    find_loads(scan_.store->value, distances, false);
    for (const int64_t distance : distances) scan_.most_back = std::max(scan_.most_back, distance);
    scan_.reads_all &= static_cast<int64_t>(distances.size()) == scan_.most_back;
    return scan_.most_back > 0;
  }

  void find_loads(const Expr& e, std::unordered_set<int64_t>& distances, bool is_choice) {
    if (!seen_.insert(e.get()).second) return;
    if (const auto* load = e.as<Load>()) {
      const auto distance = distance_of(*load);
      if (!distance) return;
      distances.insert(*distance);
      scan_.back[load] = *distance;
      scan_.reads_all &= !is_choice;
      return;
    }
    is_choice |= e.as<Select>() || as_op(e, Op::if_then_else);
    for_each_child(e, [&](const Expr& child) { find_loads(child, distances, is_choice); });
  }

  // How many iterations ago the element was stored; nullopt: unknown, or too many.
  std::optional<int64_t> distance_of(const Load& load) const {
    const bool is_own = load.name == scan_.store->name && !load.predicate.defined() &&
                        load.index.type().is_scalar();
    const auto elements =
        is_own ? analysis::constant_difference(scan_.index, substitute(load.index, lets_))
               : std::nullopt;
    if (!elements || *elements % step_ != 0) return std::nullopt;
    const int64_t distance = *elements / step_;
    return distance >= 1 && distance <= most_carried ? std::optional(distance) : std::nullopt;
  }

  const std::function<bool(const For&)>& is_pure_;
  Scan scan_;
  int64_t step_ = 0;  // elements
  Substitution lets_;
  std::vector<Expr> around_;  // lets and conditions
  std::vector<const For*>
      proven_;  // lanes that are not pure: whether they are apart is to be proven
  std::unordered_set<const ExprNode*> seen_;
};

// Replaces the loads of a scan by those of an array of registers: [distance - 1][lane].
class Carried : public Rewriter {
 public:
  Carried(const Scan& scan, std::string name, std::string value)
      : scan_(scan), name_(std::move(name)), value_(std::move(value)) {
    for (const For* lane : scan_.lanes) {
      const auto extent = static_cast<int>(*as_const_int(lane->extent));
      lane_ = lane_.defined() ? lane_ * extent : Expr(0);
      lane_ = lane_ + (variable(lane->name) - lane->min);
    }
  }

  Stmt around(const Stmt& loop, FreshNames& fresh) {
    const auto head = static_cast<int>(scan_.head());
    const For& all = *scan_.loop;
    const Stmt filled =
        make_if(all.extent > head, copy_statement(in_lanes(copies_before()), fresh));
    Stmt first, rest = (*this)(loop);
    if (head > 0) {
      const auto part = [&](const Expr& min, const Expr& extent, const Stmt& body) {
        return make_for(all.name, min, extent, all.runs, body, all.partition);
      };
      first = copy_statement(part(all.min, min(all.extent, head), all.body), fresh);
      rest = part(all.min + head, max(all.extent - head, 0), rest.as<For>()->body);
    }
    const Expr elements =
        make_const(Int(64), static_cast<int64_t>(scan_.chains() * scan_.most_back));
    return make_block({first, make_allocate(name_, type(), MemoryType::Stack, elements,
                                            make_block({filled, rest}))});
  }

 protected:
  Expr rewrite(const Expr& e) override {
    const auto found = scan_.back.find(e.get());
    return found == scan_.back.end() ? children(e) : element(found->second);
  }
  Stmt rewrite(const Stmt& s) override {
    if (s.get() != scan_.store) return children(s);
    const Expr value = variable(value_, type());
    std::vector<Stmt> stores{
        make_store(scan_.store->name, value, scan_.store->index, {}, scan_.store->symbol)};
    for (int64_t distance = scan_.most_back; distance > 1; --distance)
      stores.push_back(make_store(name_, element(distance - 1), place(distance)));
    stores.push_back(make_store(name_, value, place(1)));
    return make_let(value_, (*this)(scan_.store->value), make_block(stores));
  }

 private:
  Type type() const { return scan_.store->value.type(); }
  Expr place(int64_t distance) const {
    return lane_ + static_cast<int>((distance - 1) * scan_.chains());
  }
  Expr element(int64_t distance) const { return make_load(type(), name_, place(distance)); }

  // The elements that the first iteration with carried elements reads.
  Stmt copies_before() const {
    std::vector<Stmt> stores;
    for (int64_t distance = 1; distance <= scan_.most_back; ++distance) {
      const Expr before = scan_.loop->min + static_cast<int>(scan_.head() - distance);
      const Expr index = substitute(scan_.index, {{scan_.loop->name, before}});
      stores.push_back(
          make_store(name_, make_load(type(), scan_.store->name, index, {}, scan_.store->symbol),
                     place(distance)));
    }
    return make_block(stores);
  }

  Stmt in_lanes(Stmt body) const {
    return lower::in_lanes(scan_.lanes, scan_.conditions, std::move(body));
  }

  const Scan& scan_;
  const std::string name_, value_;
  Expr lane_;  // its number
};

}  // namespace

Stmt carry_elements(const Stmt& s, const std::function<bool(const For&)>& is_pure) {
  if (!s.defined()) return s;
  FreshNames fresh(s);
  return rewrite_statements(s, [&](const Stmt& part, auto& all) {
    const auto* loop = part.template as<For>();
    const auto scan = loop ? ScanFinder(is_pure).scan_in(*loop) : std::nullopt;
    if (!scan) return all.children(part);
    return Carried(*scan, fresh(scan->store->name + ".carried"), fresh(scan->store->name + ".new"))
        .around(part, fresh);
  });
}

}  // namespace retrograde::lower
