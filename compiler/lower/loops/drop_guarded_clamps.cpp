// drop_guarded_clamps -- what a condition says already is not said again where it holds.
// In:  Loops or FlatStorage, before unrolling and vectorization; names unique.
// Out: the same phase; the same stores in the same order.
//
//   if (x - r >= 0 && x - r < n) {                      if (x - r >= 0 && x - r < n) {
//     out[x] = out[x] + in[max(min(x - r, n - 1), 0)]  =>  out[x] = out[x] + in[x - r]
//   }                                                   }
//
// Gathers that differentiation makes look like this: they may be asked for what lies outside of the
// domain that they came from, and bounds inference takes no notice of conditions, so that their
// places are clamped. In borders the condition stays, and over lanes a clamped place would be a
// gather, where now it is a dense load under a mask.
//
// Method: conjuncts of a condition become sums that are at least 0. A min or max whose operands
//         differ by such a sum and a constant of the right sign is one of them. Lets inside of
//         loops are opened; those outside are the same on both sides.
// Not done: conditions that read memory, which may change; facts that follow from several
//           conjuncts together; arms of a select, both of which are evaluated over lanes.
// Source: folklore. Tests: test/golden/lower/drop_guarded_clamps/,
// test/property/loop_passes_test.cpp.
#include "lower/statement_passes.h"

#include <algorithm>
#include <vector>

#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"

namespace retrograde::lower {

namespace {

// Lets with more nodes than this, once those in them are opened, stay closed.
constexpr int most_nodes = 60;

bool is_small(const Expr& e) {
  int count = 0;
  walk(e, [&](const Expr&) { return ++count <= most_nodes; });
  return count <= most_nodes;
}

class ClampDropper : public Rewriter {
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
    if (!s.as<For>()) return children(s);
    ++loops_;
    Stmt result = children(s);
    --loops_;
    return result;
  }

 private:
  Expr opened_value(const std::string& name, const Expr& value) {
    const Expr result = (*this)(value);
    open(name, result);
    return result;
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
    if (loops_ == 0 || !is_small(condition)) return;
    std::vector<Expr> conjuncts;
    add_conjuncts(opened(without_lets(condition)), conjuncts);
    for (const Expr& e : conjuncts) {
      auto form = nonnegative_where(e);
      if (form && !reads_memory(e, MemoryReads::Calls)) facts_.push_back(*form);
    }
  }

  void open(const std::string& name, const Expr& value) {
    if (loops_ == 0 || !has_linear_form(value.type()) || !is_small(value)) return;
    const Expr whole = opened(without_lets(value));
    if (is_small(whole)) lets_[name] = whole;
  }
  Expr opened(const Expr& e) const { return lets_.empty() ? e : substitute(e, lets_); }

  // The operand that min or max is, where a fact says so.
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
    return std::any_of(facts_.begin(), facts_.end(), [&](const Sum& fact) {
      if (fact.type != form.type) return false;
      const Sum rest = plus(form, fact, -1);
      return rest.valid && rest.is_constant() && rest.constant >= 0;
    });
  }

  std::vector<Sum> facts_;  // sums that are at least 0
  Substitution lets_;
  int loops_ = 0;
};

}  // namespace

Stmt drop_guarded_clamps(const Stmt& s) { return ClampDropper()(s); }

}  // namespace retrograde::lower
