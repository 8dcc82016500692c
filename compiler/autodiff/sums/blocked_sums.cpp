#include "autodiff/sums/blocked_sums.h"

#include <algorithm>

#include "autodiff/sums/generated_definitions.h"
#include "graph/definitions/define.h"
#include "graph/names.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

// The number of terms of a block. Each lane has blocks of its own.
constexpr int64_t short_block = 16, long_block = 32;
// Sums of at least this many long blocks use long blocks.
constexpr int64_t enough_blocks = 16;
// A block with fewer terms does not pay.
constexpr int64_t least_terms = 8;
// For loops of at least this many blocks, rounding up to whole blocks costs little.
constexpr int64_t least_to_round = 8;

// The size of a block in a sum of `terms` terms; INT64_MAX means unknown.
int64_t terms_of_block(int64_t terms) {
  return terms / long_block >= enough_blocks ? long_block : short_block;
}

int64_t number_of_terms(const std::vector<ReductionVariable>& rvars) {
  int64_t terms = 1;
  for (const ReductionVariable& r : rvars) {
    const auto extent = as_const_int(simplify(r.extent));
    if (!extent || __builtin_mul_overflow(terms, *extent, &terms)) return INT64_MAX;
  }
  return terms;
}

// The number of consecutive iterations of a loop that form a block, at most `most`; a divisor of the extent if there is
// one above most / 2.
int64_t cut_of(int64_t extent, int64_t most) {
  for (int64_t size = most; size * 2 > most; --size) {
    if (extent % size == 0) return size;
  }
  return most;
}

class Cutter {
 public:
  Cutter(const std::vector<ReductionVariable>& rvars) {
    int64_t room = terms_of_block(number_of_terms(rvars));
    for (const ReductionVariable& r : rvars) {
      const auto extent = as_const_int(simplify(r.extent));
      if (extent && *extent <= room) {
        keep_inside(r, *extent);
        room /= std::max<int64_t>(*extent, 1);
      } else if (extent && room >= 2) {
        cut(r, *extent, cut_of(*extent, room));
        room = 1;
      } else {  // a loop of unknown extent may be shorter than a block
        keep_outside(r);
      }
    }
  }

  bool is_worth_while() const { return !outer().empty() && terms_ >= least_terms; }
  const std::vector<ReductionVariable>& inner() const { return inside_->vars; }
  const std::vector<ReductionVariable>& outer() const { return outside_->vars; }
  const std::vector<Expr>& conditions() const { return conditions_; }
  const std::vector<Expr>& numbers() const {
    return numbers_;
  }  // block numbers: Vars of the block's Func
  const Substitution& place() const { return place_; }
  std::vector<Expr> places_outside() const {
    return mapped(outer(), [&](const auto& r) { return loop_variable(outside_, r.var); });
  }

 private:
  Expr add_outside(const std::string& name, const Expr& min, const Expr& extent) {
    add_loop(outside_, name, min, extent);
    const std::string loop = without_numbers(name);
    numbers_.push_back(variable(unique_name(loop.substr(loop.rfind('.') + 1) + "_block")));
    return numbers_.back();
  }

  void keep_inside(const ReductionVariable& r, int64_t extent) {
    place_[r.var] = add_loop(inside_, r.var, r.min, r.extent);
    terms_ *= extent;
  }
  void keep_outside(const ReductionVariable& r) {
    place_[r.var] = add_outside(r.var, r.min, r.extent);
  }
  // Splits the loop into blocks. Indices beyond the end are clamped, because the elements that are read must exist.
  void cut(const ReductionVariable& r, int64_t extent, int64_t size) {
    const Expr all = make_const(Int(32), extent), each = make_const(Int(32), size);
    const Expr number =
        add_outside(r.var, make_zero(Int(32)), make_const(Int(32), (extent + size - 1) / size));
    Expr at = number * each + add_loop(inside_, r.var, make_zero(Int(32)), each);
    if (extent % size != 0) {
      conditions_.push_back(likely(at < all));
      at = binary(Kind::Min, likely(at), all - 1);
    }
    place_[r.var] = r.min + at;
    terms_ *= size;
  }

  const DomainPtr inside_ = make_domain(), outside_ = make_domain();
  std::vector<Expr> numbers_, conditions_;
  Substitution place_;
  int64_t terms_ = 1;
};

// A term without its outermost factors that no loop inside of a block moves.
class Factored {
 public:
  Factored(Expr term, const std::vector<ReductionVariable>& inside)
      : term_(std::move(term)), inside_(inside) {
    while (take_factor()) {
    }
  }

  const Expr& term() const { return term_; }
  // The sum of a block with the factors, in terms of other variables.
  Expr with_factors(Expr sum, const Substitution& place) const {
    for (auto f = factors_.rbegin(); f != factors_.rend(); ++f) {
      const Expr by = substitute(f->by, place);
      const auto pair = f->is_first ? std::pair(by, sum) : std::pair(sum, by);
      sum = f->op ? call_op(*f->op, {pair.first, pair.second})
                  : binary(f->kind, pair.first, pair.second);
    }
    return sum;
  }

 private:
  struct Factor {
    std::optional<Op> op;  // none: `kind`
    Kind kind = Kind::Mul;
    Expr by;
    bool is_first = false;  // of the two operands
  };
  Expr term_;
  const std::vector<ReductionVariable>& inside_;
  std::vector<Factor> factors_;  // the outermost first

  bool is_moved(const Expr& e) const {
    return std::ranges::any_of(inside_,
                               [&](const ReductionVariable& r) { return uses_variable(e, r.var); });
  }
  bool take(const Expr& rest, Factor factor) {
    if (is_moved(factor.by) || !is_moved(rest)) return false;
    term_ = rest;
    factors_.push_back(std::move(factor));
    return true;
  }
  // Where a condition leaves a block without terms, a factor may be anything, so it is strong or a constant.
  bool take_factor() {
    const Expr whole = term_;  // keeps the operands
    if (const auto* call = whole.as<Call>()) {
      if (call->is_op(Op::strong_div))
        return take(call->args[0], {Op::strong_div, {}, call->args[1]});
      if (!call->is_op(Op::strong_mul)) return false;
      return take(call->args[0], {Op::strong_mul, {}, call->args[1]}) ||
             take(call->args[1], {Op::strong_mul, {}, call->args[0], true});
    }
    if (whole.kind() != Kind::Mul && whole.kind() != Kind::Div) return false;
    const auto* n = whole.as<Binary>();
    return is_const(n->b) && !is_zero(n->b) && take(n->a, {{}, n->kind, n->b});
  }
};

}  // namespace

Expr in_whole_blocks(const Expr& extent) {
  const auto known = as_const_int(extent);
  if (!known) return extent;
  const int64_t block = terms_of_block(*known), blocks = (*known + block - 1) / block;
  return *known < least_to_round * block ? extent : make_const(Int(32), blocks * block);
}

std::optional<SumOfBlocks> sum_in_blocks(const std::string& name, const std::string& of,
                                         const std::vector<Expr>& point,
                                         const std::vector<ReductionVariable>& rvars,
                                         const std::vector<Expr>& terms, const Expr& predicate) {
  const Cutter cut(rvars);
  if (!cut.is_worth_while()) return {};
  const FuncPtr block = make_func(Role::Accumulator, name + "_block", of);
  block->made->blocks = static_cast<int>(cut.numbers().size());
  std::vector<Expr> args = point, place = point;
  append(args, cut.numbers());
  append(place, cut.places_outside());
  define_pure(block, args, mapped(terms, [](const Expr& term) {
                return make_zero(term.defined() ? term.type() : Float(32));
              }));
  const auto here = [&](const Expr& e) { return e.defined() ? substitute(e, cut.place()) : e; };
  std::vector<Expr> conditions = cut.conditions();
  if (predicate.defined()) conditions.push_back(here(predicate));
  SumOfBlocks result{block, cut.outer(), values_of(block, place)};
  Substitution outside;
  for (size_t i = 0; i < cut.numbers().size(); ++i)
    outside[cut.numbers()[i].as<Variable>()->name] = place[point.size() + i];
  std::vector<Expr> summed(terms.size());
  for (size_t k = 0; k < terms.size(); ++k) {
    const bool is_summed = terms[k].defined();
    const Factored factored(is_summed ? here(terms[k]) : make_zero(Float(32)), cut.inner());
    if (is_summed) summed[k] = factored.term();
    result.values[k] = is_summed ? factored.with_factors(result.values[k], outside) : Expr();
  }
  append_sums(block, args, summed, cut.inner(), conjunction(conditions));
  return result;
}

}  // namespace retrograde::autodiff
