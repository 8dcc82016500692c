// drop_guarded_clamps -- remove a min or max that a surrounding condition decides.
// In:  Loops or FlatStorage, before unrolling and vectorization; names unique.
// Out: the same phase; the same stores in the same order.
//
//   if (x - r >= 0 && x - r < n) {                      if (x - r >= 0 && x - r < n) {
//     out[x] = out[x] + in[max(min(x - r, n - 1), 0)]  =>  out[x] = out[x] + in[x - r]
//   }                                                   }
//
// Gathers that differentiation generates look like this. They may be required outside of their domain, and bounds
// inference ignores conditions, so their indices are clamped. The clamp is redundant under the condition. Over vector
// lanes the clamped index would be a gather; without the clamp it is a dense masked load.
//
// Method: each conjunct of a condition becomes a sum that is at least 0. A min or max is decided if its operands differ
//         by such a sum and a constant of the right sign. Lets inside of loops are expanded; those outside are the
//         same on both sides.
// Not done: conditions that read memory, which may change; facts that follow only from several conjuncts together; arms
//           of a select, both of which are evaluated over lanes.
// Source: folklore. Tests: test/golden/lower/drop_guarded_clamps/,
// test/property/loop_passes_test.cpp.
//
// skip_empty_tiles -- skip the producers of tiles that contain no points.
// In:  Loops or FlatStorage, before loops are partitioned; names unique.
// Out: the same phase; the same stores to what outlives an iteration, in the same order.
//
//   for (yi, 0, 8) {                              for (yi, 0, 8) {
//     let f.min = min(32*xo, n - 1)                 if (n - 32*xo - 1 >= 0) {
//     produce f from f.min on                 =>      let f.min = 32*xo
//     for (xi, 0, 32) {                               produce f from f.min on
//       if (32*xo + xi < n) { ... f ... }             for (xi, 0, 32) { ... }
//     }                                             }
//   }                                             }
//
// Under a split with a guard, the region of a producer is clamped only for tiles beyond the end. Without the clamp
// its minimum is a multiple of the tile size, so that data packed in tiles is read contiguously.
//
// Method: a condition that must hold for an iteration to have any effect (needed_conditions.h) is put around the
//         iteration if it decides a clamp, by the same proof as above.
// Not done: loops around vectors and kernels.
// Tests: test/golden/lower/skip_empty_tiles/.
#include "lower/statement_passes.h"

#include <algorithm>
#include <vector>

#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/markers.h"
#include "ir/memory_reads.h"
#include "ir/node_count.h"
#include "ir/visit.h"
#include "lower/loops/needed_conditions.h"
#include "lower/loops/steady_state.h"

namespace retrograde::lower {

namespace {

// Lets with more nodes than this after expansion are not expanded further.
constexpr int most_nodes = 60;

bool is_small(const Expr& e) { return has_at_most_nodes(e, most_nodes); }

// The conditions that facts are derived from.
enum class FactSource { Conditions, NeededConditions };

class ClampDropper : public Rewriter {
 public:
  explicit ClampDropper(FactSource source) : source_(source) {}

 protected:
  Expr rewrite(const Expr& e) override {
    if (const auto* let = e.as<Let>())
      return map_children(e, [&](const Expr& part) {
        return part.same_as(let->value) ? opened_value(let->name, part) : (*this)(part);
      });
    const Expr copy = children(e);
    const bool is_extreme = copy.kind() == Kind::Min || copy.kind() == Kind::Max;
    return is_extreme && !facts_.empty() ? decided(*copy.as<Binary>(), copy) : copy;
  }

  Stmt rewrite(const Stmt& s) override {
    if (const auto* branch = s.as<IfThenElse>()) return rewrite_branch(*branch);
    if (const auto* let = s.as<LetStmt>())
      return map_children(
          s, [&](const Expr& value) { return opened_value(let->name, value); }, *this);
    const auto* loop = s.as<For>();
    return loop ? rewrite_loop(s, *loop) : children(s);
  }

 private:
  Expr opened_value(const std::string& name, const Expr& value) {
    const Expr result = (*this)(value);
    open(name, result);
    return result;
  }

  Stmt rewrite_loop(const Stmt& s, const For& loop) {
    ++loops_;
    const bool has_lanes = loop.runs == ForType::Vectorized || is_gpu(loop.runs);
    in_lanes_ += has_lanes;
    const size_t known = facts_.size();
    const bool adds_conditions = source_ == FactSource::NeededConditions && in_lanes_ == 0;
    if (adds_conditions && is_serial(loop) && !has_kernel(loop.body)) add_needed(loop);
    const bool is_new = facts_.size() > known;
    if (is_new) forget();
    Stmt body = (*this)(loop.body);
    std::vector<Expr> used;
    for (size_t i = known; i < facts_.size(); i++) {
      if (facts_[i].used) used.push_back(facts_[i].condition);
    }
    facts_.resize(known);
    if (is_new) forget();
    if (!used.empty()) body = make_if(conjunction(used), body);
    in_lanes_ -= has_lanes;
    --loops_;
    return map_children(
        s, [&](const Expr& e) { return (*this)(e); }, [&](const Stmt&) { return body; });
  }

  // All threads of a block must reach barriers together, so kernels get no conditions around them.
  static bool has_kernel(const Stmt& s) {
    return any_node(s, [](const For& loop) { return is_gpu(loop.runs); });
  }

  void add_needed(const For& loop) {
    for (const Sum& sum : needed_conditions(loop)) {
      const Expr value = to_expr(sum), whole = opened(value);
      if (!is_small(whole)) continue;
      facts_.push_back({linear_form(whole), binary(Kind::GE, value, make_zero(sum.type))});
    }
  }

  Stmt rewrite_branch(const IfThenElse& branch) {
    const Expr condition = (*this)(branch.condition);
    const size_t known = facts_.size();
    add_facts(condition);
    forget();
    const Stmt when_true = (*this)(branch.when_true);
    facts_.resize(known);
    forget();
    return with_parts(branch, condition, when_true, (*this)(branch.when_false));
  }

  void add_facts(const Expr& condition) {
    if (loops_ == 0 || source_ != FactSource::Conditions || !is_small(condition)) return;
    std::vector<Expr> conjuncts;
    add_conjuncts(opened(without_lets(condition)), conjuncts);
    for (const Expr& e : conjuncts) {
      auto form = nonnegative_where(e);
      if (form && !reads_memory(e, MemoryReads::Calls)) facts_.push_back({*form});
    }
  }

  void open(const std::string& name, const Expr& value) {
    if (loops_ == 0 || !has_linear_form(value.type()) || !is_small(value)) return;
    const Expr whole = opened(without_lets(value));
    if (is_small(whole)) lets_[name] = whole;
  }
  Expr opened(const Expr& e) const { return substitute(plain(e), lets_); }
  // Removes promises if facts are needed conditions: where the program has any effect, its promises hold.
  Expr plain(const Expr& e) const {
    return source_ == FactSource::NeededConditions ? without_promises(without_likely(e)) : e;
  }

  // The operand that equals the min or max, if a fact decides it; otherwise e.
  Expr decided(const Binary& n, const Expr& e) const {
    if (!has_linear_form(n.type) || !is_small(e)) return e;
    const Sum difference =
        plus(linear_form(opened(without_lets(n.a))), linear_form(opened(without_lets(n.b))), -1);
    const bool is_min = n.kind == Kind::Min;
    if (is_nonnegative(difference)) return is_min ? n.b : n.a;
    if (is_nonnegative(times(difference, -1))) return is_min ? n.a : n.b;
    return e;
  }
  bool is_nonnegative(const Sum& form) const {
    const auto fact = std::ranges::find_if(facts_, [&](const Fact& fact) {
      if (fact.form.type != form.type) return false;
      const Sum rest = plus(form, fact.form, -1);
      return rest.valid && rest.is_constant() && rest.constant >= 0;
    });
    if (fact == facts_.end()) return false;
    fact->used = true;
    return true;
  }

  struct Fact {
    Sum form;             // is at least 0
    Expr condition = {};  // to be added around the loop if the fact is used
    mutable bool used = false;
  };
  const FactSource source_;
  std::vector<Fact> facts_;
  Substitution lets_;
  int loops_ = 0, in_lanes_ = 0;
};

}  // namespace

Stmt drop_guarded_clamps(const Stmt& s) { return ClampDropper(FactSource::Conditions)(s); }
Stmt skip_empty_tiles(const Stmt& s) { return ClampDropper(FactSource::NeededConditions)(s); }

}  // namespace retrograde::lower
