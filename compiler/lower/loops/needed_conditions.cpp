#include "lower/loops/needed_conditions.h"

#include <algorithm>
#include <optional>
#include <string>
#include <unordered_set>

#include "analysis/linear.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/markers.h"
#include "ir/memory_reads.h"
#include "ir/visit.h"
#include "lower/loops/only_fills.h"

namespace retrograde::lower {
namespace {

using Sums = std::vector<Sum>;
constexpr size_t most_sums = 16, most_terms = 12;

std::optional<int64_t> difference(const Sum& a, const Sum& b) {
  if (a.type != b.type) return std::nullopt;
  const Sum sum = plus(a, b, -1);
  return sum.valid && sum.is_constant() ? std::optional<int64_t>(sum.constant) : std::nullopt;
}

// Adds the sum and the sums that it bounds from below: a max is at least each of its operands, a min at most.
void add(const Sum& sum, Sums& sums) {
  const bool is_too_large = !sum.valid || sum.terms.size() > most_terms || sums.size() >= most_sums;
  if (is_too_large ||
      std::ranges::any_of(sums, [&](const Sum& s) { return difference(sum, s) == 0; }))
    return;
  sums.push_back(sum);
  for (const auto& [atom, factor] : sum.terms) {
    if (atom.kind() != (factor < 0 ? Kind::Max : Kind::Min)) continue;
    const auto* extreme = atom.as<Binary>();
    const Sum rest = plus(sum, linear_sum(atom), -factor);
    add(plus(rest, linear_form(extreme->a), factor), sums);
    add(plus(rest, linear_form(extreme->b), factor), sums);
    break;
  }
}

// Sums that both lists imply: if two sums differ by a constant, the larger one.
Sums common(const Sums& a, const Sums& b) {
  Sums result;
  for (const Sum& one : a) {
    for (const Sum& other : b) {
      const auto more = difference(one, other);
      if (!more) continue;
      result.push_back(*more > 0 ? one : other);
      break;
    }
  }
  return result;
}

class ConditionFinder {
 public:
  Sums find(const Stmt& body) {
    Sums needed = needed_for(body), known;
    if (!fills_) return known;
    for (const Sum& sum : needed) {
      const bool is_known = std::ranges::all_of(
          sum.terms, [&](const auto& term) { return is_known_outside(term.atom); });
      if (is_known && !sum.is_constant()) known.push_back(sum);
    }
    return known;
  }

 private:
  // The conditions that must hold for the statement to do more than fill its own memory.
  Sums needed_for(const Stmt& s) {
    return match(
        s, [&](const LetStmt& n) { return note_let(n), needed_for(n.body); },
        [&](const For& n) { return needed_for_loop(n); },
        [&](const Allocate& n) { return own_.insert(n.name), needed_for(n.body); },
        [&](const ProducerConsumer& n) { return needed_for(n.body); },
        [&](const Block& n) { return needed_for_parts(n); },
        [&](const IfThenElse& n) {
          if (n.when_false.defined())
            return common(needed_for(n.when_true), needed_for(n.when_false));
          Sums needed = needed_for(n.when_true);
          add_condition(open(n.condition), needed);
          return needed;
        },
        [](const StmtNode&) { return Sums(); });
  }

  Sums needed_for_parts(const Block& block) {
    std::optional<Sums> needed;
    for (const Stmt& part : block.stmts) {
      if (only_fills(part, own_)) {
        fills_ = true;
        continue;
      }
      const Sums own = needed_for(part);
      needed = needed ? common(*needed, own) : own;
    }
    return needed.value_or(Sums());
  }

  // At least one iteration must have an effect, so the conditions hold for the most favourable one.
  Sums needed_for_loop(const For& loop) {
    unknown_.insert(loop.name);
    Sums needed = needed_for(loop.body), result;
    const Expr first = open(loop.min), extent = open(loop.extent);
    const Type type = first.type();
    if (!has_linear_form(type)) return result;
    const Expr var = variable(loop.name, type);
    const Sum last = plus(plus(linear_form(first), linear_form(extent)), linear_sum(type, 1), -1);
    for (const Sum& sum : needed) {
      const int64_t factor = sum.factor_of(loop.name);
      if (factor != 0 && sum.type != type) continue;
      const Sum best = factor > 0 ? last : linear_form(first);
      const Sum without = plus(plus(sum, linear_sum(var), -factor), best, factor);
      add(factor == 0 ? sum : without, result);
    }
    add_positive(extent, result);
    return result;
  }

  void add_positive(const Expr& e, Sums& sums) const {
    const auto* n = e.as<Binary>();
    const auto is_no_more_than_0 = [](const Expr& end) {
      const auto number = as_const_int(end);
      return number && *number <= 0;
    };
    if (e.kind() == Kind::Max && is_no_more_than_0(n->b)) return add_positive(n->a, sums);
    if (e.kind() == Kind::Max && is_no_more_than_0(n->a)) return add_positive(n->b, sums);
    if (e.kind() == Kind::Min) return add_positive(n->a, sums), add_positive(n->b, sums);
    add(plus(linear_form(e), linear_sum(e.type(), 1), -1), sums);
  }

  void add_condition(const Expr& condition, Sums& sums) const {
    if (condition.kind() == Kind::And) {
      const auto* both = condition.as<Binary>();
      add_condition(both->a, sums);
      add_condition(both->b, sums);
    } else if (const auto form = nonnegative_where(condition)) {
      add(*form, sums);
    }
  }

  void note_let(const LetStmt& let) {
    const bool is_place = has_linear_form(let.value.type()) || let.value.type().is_bool();
    if (is_place && is_known_outside(let.value)) {
      lets_[let.name] = open(let.value);
    } else {
      unknown_.insert(let.name);
    }
  }

  // Lets that are not known outside are not expanded, so that values do not grow with each let that reads another.
  bool is_known_outside(const Expr& e) const {
    return !reads_memory(e, MemoryReads::Functions) && !uses_any_variable(e, unknown_);
  }
  Expr open(const Expr& e) const {
    return substitute(without_promises(without_likely(without_lets(e))), lets_);
  }

  std::unordered_set<std::string> own_, unknown_;  // allocations inside; names bound inside
  Substitution lets_;
  bool fills_ = false;
};

}  // namespace

std::vector<Sum> needed_conditions(const For& loop) { return ConditionFinder().find(loop.body); }

}  // namespace retrograde::lower
