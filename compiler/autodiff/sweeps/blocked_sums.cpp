#include "autodiff/sweeps/blocked_sums.h"

#include <algorithm>

#include "autodiff/sweeps/accumulation.h"
#include "graph/define.h"
#include "graph/names.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::ir {

namespace {

// Fewer terms are not worth a block.
constexpr int64_t least_terms = 8;
// Iterations from which on rounding their number up to whole blocks costs little.
constexpr int64_t least_to_round = 8 * block_terms;

// So many neighbouring iterations of a loop, at most `most`: a divisor of the extent where one is
// near.
int64_t cut_of(int64_t extent, int64_t most) {
  for (int64_t size = most; size * 2 > most; --size) {
    if (extent % size == 0) return size;
  }
  return most;
}

class Cutter {
 public:
  Cutter(const std::vector<ReductionVariable>& rvars) {
    int64_t room = block_terms;
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
    freeze(inner_, inside_);
    freeze(outer_, outside_);
  }

  bool is_worth_while() const { return !outer_.empty() && terms_ >= least_terms; }
  const std::vector<ReductionVariable>& inner() const { return inner_; }
  const std::vector<ReductionVariable>& outer() const { return outer_; }
  const std::vector<Expr>& conditions() const { return conditions_; }
  const std::vector<Expr>& numbers() const { return numbers_; }  // of blocks: Vars of the block's
  const Substitution& place() const { return place_; }
  std::vector<Expr> places_outside() const {
    std::vector<Expr> places;
    for (const ReductionVariable& r : outer_)
      places.push_back(variable(r.var, Int(32), SymbolRef(outside_)));
    return places;
  }

 private:
  using Domain = std::shared_ptr<ReductionDomainContents>;

  static void freeze(const std::vector<ReductionVariable>& rvars, const Domain& domain) {
    domain->vars = rvars;
    domain->frozen = true;
  }
  Expr add_inside(const std::string& name, const Expr& min, const Expr& extent) {
    inner_.push_back({unique_name(name), min, extent});
    return variable(inner_.back().var, Int(32), SymbolRef(inside_));
  }
  Expr add_outside(const std::string& name, const Expr& min, const Expr& extent) {
    outer_.push_back({unique_name(name), min, extent});
    const std::string loop = without_numbers(name);
    numbers_.push_back(variable(unique_name(loop.substr(loop.rfind('.') + 1) + "_block")));
    return numbers_.back();
  }

  void keep_inside(const ReductionVariable& r, int64_t extent) {
    place_[r.var] = add_inside(r.var, r.min, r.extent);
    terms_ *= extent;
  }
  void keep_outside(const ReductionVariable& r) {
    place_[r.var] = add_outside(r.var, r.min, r.extent);
  }
  // Beyond the end the place is clamped: what is read there must exist.
  void cut(const ReductionVariable& r, int64_t extent, int64_t size) {
    const Expr all = make_const(Int(32), extent), each = make_const(Int(32), size);
    const Expr number =
        add_outside(r.var, make_zero(Int(32)), make_const(Int(32), (extent + size - 1) / size));
    Expr at = number * each + add_inside(r.var, make_zero(Int(32)), each);
    if (extent % size != 0) {
      conditions_.push_back(likely(at < all));
      at = binary(Kind::Min, likely(at), all - 1);
    }
    place_[r.var] = r.min + at;
    terms_ *= size;
  }

  const Domain inside_ = std::make_shared<ReductionDomainContents>();
  const Domain outside_ = std::make_shared<ReductionDomainContents>();
  std::vector<ReductionVariable> inner_, outer_;
  std::vector<Expr> numbers_, conditions_;
  Substitution place_;
  int64_t terms_ = 1;
};

}  // namespace

Expr in_whole_blocks(const Expr& extent) {
  const auto known = as_const_int(extent);
  if (!known || *known < least_to_round) return extent;
  return make_const(Int(32), (*known + block_terms - 1) / block_terms * block_terms);
}

std::optional<SumOfBlocks> sum_in_blocks(const std::string& name, const std::string& of,
                                         const std::vector<Expr>& point,
                                         const std::vector<ReductionVariable>& rvars,
                                         const std::vector<Expr>& terms, const Expr& predicate) {
  const Cutter cut(rvars);
  if (!cut.is_worth_while()) return {};
  SumOfBlocks result{make_func(Role::Accumulator), cut.outer(), {}};
  const FuncPtr& block = result.block;
  block->made->of = of;
  block->made->blocks = static_cast<int>(cut.numbers().size());
  block->name = claim_name(name + "_block");
  std::vector<Expr> args = point, zeros, values;
  args.insert(args.end(), cut.numbers().begin(), cut.numbers().end());
  for (const Expr& term : terms)
    zeros.push_back(make_zero(term.defined() ? term.type() : Float(32)));
  define_pure(block, args, zeros);
  for (size_t k = 0; k < terms.size(); ++k) {
    const Expr self = call_value(block, args, static_cast<int>(k));
    values.push_back(terms[k].defined() ? self + substitute(terms[k], cut.place()) : self);
  }
  std::vector<Expr> conditions = cut.conditions();
  if (predicate.defined()) conditions.push_back(substitute(predicate, cut.place()));
  append_update(block, args, values, cut.inner(), conjunction(conditions));
  std::vector<Expr> place = point;
  const std::vector<Expr> numbers = cut.places_outside();
  place.insert(place.end(), numbers.begin(), numbers.end());
  for (size_t k = 0; k < terms.size(); ++k)
    result.values.push_back(terms[k].defined() ? call_value(block, place, static_cast<int>(k))
                                               : Expr());
  return result;
}

}  // namespace retrograde::ir
