#include "transform/strided_terms.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

#include "analysis/linear.h"
#include "graph/definitions/define.h"
#include "graph/definitions/own_reads.h"
#include "graph/directives/directive.h"
#include "graph/directives/give_directive.h"
#include "graph/names.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"
#include "transform/size_estimate.h"

namespace retrograde::transform {

namespace {

constexpr int64_t longest_stride = 64;
// Elements of the sum for each of the sum of zeros.
constexpr double least_share = 16, many_elements = 1024;

// The condition  operand % modulus == remainder,  where the operand is sign * r + rest for one loop r of the reduction.
struct Stride {
  std::string loop;
  int64_t min = 0, extent = 0;  // of the loop
  int64_t sign = 1, modulus = 1, remainder = 0;
  Sum operand;

  int64_t terms() const { return (extent + modulus - 1) / modulus; }  // at most
  bool divides() const { return extent % modulus == 0; }
  // The first r - min at which the condition holds is this, modulo the modulus. It has no loop of the reduction.
  Sum first() const {
    const Sum rest = plus(operand, linear_sum(variable(loop)), -sign);
    Sum result = times(rest, -sign);
    result.add_constant(sign * remainder - min);
    return result;
  }
};

// A term of a sum: `chosen` where all strides' conditions hold, else `left_out`.
struct StridedTerm {
  std::vector<Stride> strides;
  Expr chosen, left_out;
};

// Appends the conjuncts of the condition, or of its negation.
void add_conditions(const Expr& e, bool holds, std::vector<Expr>& all) {
  const auto* both = e.as<Binary>();
  if (const auto* negated = e.as<Not>()) {
    add_conditions(negated->a, !holds, all);
  } else if (both && e.kind() == (holds ? Kind::And : Kind::Or)) {
    add_conditions(both->a, holds, all);
    add_conditions(both->b, holds, all);
  } else if (both && !holds && e.kind() == Kind::NE) {
    all.push_back(binary(Kind::EQ, both->a, both->b));
  } else {
    all.push_back(holds ? e : !e);
  }
}

class StrideFinder {
 public:
  explicit StrideFinder(const Definition& update) : update_(update) {}

  // Splits a term into the two values of the first select that has such conditions.
  std::optional<StridedTerm> find(const Expr& e) const {
    if (const auto* choice = e.as<Select>()) {
      if (is_zero(choice->when_false)) return chosen_by(*choice, true);
      if (is_zero(choice->when_true)) return chosen_by(*choice, false);
      return std::nullopt;
    }
    if (const auto* product = e.as<Mul>()) {
      if (auto found = find(product->a))
        return StridedTerm{found->strides, found->chosen * product->b,
                           found->left_out * product->b};
      if (auto found = find(product->b))
        return StridedTerm{found->strides, product->a * found->chosen,
                           product->a * found->left_out};
    }
    return std::nullopt;
  }

 private:
  std::optional<StridedTerm> chosen_by(const Select& choice, bool holds) const {
    StridedTerm result;
    std::vector<Expr> conditions, others;
    add_conditions(choice.condition, holds, conditions);
    for (const Expr& condition : conditions) {
      auto stride = stride_in(condition);
      const bool is_new = stride && std::ranges::none_of(result.strides, [&](const Stride& other) {
                            return other.loop == stride->loop;
                          });
      if (is_new)
        result.strides.push_back(*std::move(stride));
      else
        others.push_back(condition);
    }
    if (result.strides.empty()) return std::nullopt;
    result.chosen = holds ? choice.when_true : choice.when_false;
    result.left_out = holds ? choice.when_false : choice.when_true;
    if (!others.empty())
      result.chosen = make_select(conjunction(others), result.chosen, result.left_out);
    return result;
  }

  std::optional<Stride> stride_in(const Expr& condition) const {
    const auto* equation = condition.as<EQ>();
    if (!equation) return std::nullopt;
    const bool is_first = equation->a.as<Mod>() != nullptr;
    const auto* remainder = (is_first ? equation->a : equation->b).as<Mod>();
    const auto value = as_const_int(is_first ? equation->b : equation->a);
    const auto modulus = remainder ? as_const_int(remainder->b) : std::nullopt;
    if (!value || !modulus || remainder->type != Int(32)) return std::nullopt;
    if (*modulus < 2 || *modulus > longest_stride || *value < 0 || *value >= *modulus)
      return std::nullopt;
    return stride_of(linear_form(remainder->a), *modulus, *value);
  }

  std::optional<Stride> stride_of(const Sum& operand, int64_t modulus, int64_t remainder) const {
    Stride result;
    for (const ReductionVariable& r : update_.rvars) {
      for (const Term& term : operand.terms) {
        if (!uses_variable(term.atom, r.var)) continue;
        const bool is_loop = term.atom.as<Variable>() && std::abs(term.factor) == 1;
        if (!is_loop || !result.loop.empty()) return std::nullopt;
        const auto min = as_const_int(simplify(r.min)), extent = as_const_int(simplify(r.extent));
        if (!min || !extent || *extent < 2) return std::nullopt;
        result = {r.var, *min, *extent, term.factor, modulus, remainder, operand};
      }
    }
    // Past the end of the loop, indices that grow with the loop could leave what is read.
    const bool is_inside = result.divides() || result.sign < 0;
    return operand.valid && !result.loop.empty() && is_inside ? std::optional(result)
                                                              : std::nullopt;
  }

  const Definition& update_;
};

// Whether a read of the Func is a choice by a remainder, which is inlined to look into it.
bool chooses_by_remainder(const FuncContents& f) {
  if (!f.is_pure() || f.is_extern() || f.made || f.types.size() != 1 || has_directives(f))
    return false;
  const auto* choice = f.pure->values[0].as<Select>();
  return choice && (is_zero(choice->when_true) || is_zero(choice->when_false)) &&
         any_node(choice->condition, [](const Mod& n) { return n.type == Int(32); });
}

Expr with_choices_inlined(const Expr& term) {
  return map_func_calls(term, [](const Call& call, const std::vector<Expr>& args) -> Expr {
    const FuncPtr callee = func_of(call);
    if (!chooses_by_remainder(*callee)) return {};
    Substitution places;
    for (size_t d = 0; d < args.size(); ++d) places[callee->args[d]] = args[d];
    return substitute(callee->pure->values[0], places);
  });
}

// The term that the only update of f adds to each element; undefined: it does something else.
Expr term_of(const FuncContents& f) {
  if (f.made || f.is_extern() || f.updates.size() != 1 || f.types.size() != 1 || has_directives(f))
    return {};
  const Definition& update = f.updates[0];
  const auto* sum = update.values[0].as<Add>();
  const bool is_plain = !update.rvars.empty() && !update.predicate.defined() &&
                        !point_number(update) && same_args(update.args, f.pure->args);
  if (!sum || !is_plain) return {};
  const bool is_first = is_old_value(sum->a, f, update);
  if (!is_first && !is_old_value(sum->b, f, update)) return {};
  const Expr term = is_first ? sum->b : sum->a;
  return any_node(term, [&](const Call& call) { return is_call_of(call, &f); }) ? Expr() : term;
}

std::optional<StridedTerm> strided_term(const FuncContents& f) {
  const Expr term = term_of(f);
  return term.defined() ? StrideFinder(f.updates[0]).find(with_choices_inlined(term))
                        : std::nullopt;
}

// Dimensions of f that the left-out terms depend on.
std::vector<size_t> dimensions_of(const Expr& left_out, const FuncContents& f) {
  std::vector<size_t> result;
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (uses_variable(left_out, f.args[d])) result.push_back(d);
  }
  return result;
}

bool has_few_zeros(const StridedTerm& term, const FuncContents& f, const SizeEstimate& sizes) {
  const std::vector<size_t> moved = dimensions_of(term.left_out, f);
  double share = 1;
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (std::ranges::count(moved, d) > 0) continue;
    share *= static_cast<double>(sizes.extent(f, d).value_or(static_cast<int64_t>(many_elements)));
  }
  for (const Stride& stride : term.strides) share /= static_cast<double>(stride.modulus);
  return std::ranges::count(moved, size_t{0}) == 0 && share >= least_share;
}

// A name that none of the variables has.
std::string new_variable(std::string name, const std::vector<Expr>& taken) {
  const auto is_taken = [&](const Expr& e) { return e.as<Variable>()->name == name; };
  while (std::ranges::any_of(taken, is_taken)) name += "_";
  return name;
}

class TermDropper {
 public:
  TermDropper(FuncPtr f, StridedTerm term)
      : f_(std::move(f)), term_(std::move(term)), domain_(make_domain()) {}

  void run() {
    add_loops();
    Definition update;
    const Definition& old = f_->updates[0];
    const auto* sum = old.values[0].as<Add>();
    const Expr chosen = placed(term_.chosen);
    const bool is_first = is_old_value(sum->a, *f_, old);
    update.args = old.args;
    update.values = {is_first ? sum->a + chosen : chosen + sum->b};
    update.rvars = domain_->vars;
    if (!conditions_.empty()) update.predicate = conjunction(conditions_);
    update.schedule.dims = first_loops(*f_, update);
    const Expr zeros = left_out();
    if (zeros.defined()) f_->pure->values[0] = f_->pure->values[0] + zeros;
    f_->updates[0] = std::move(update);
    ++f_->version;
  }

 private:
  // One loop for each of the old ones, in their order.
  void add_loops() {
    for (const ReductionVariable& r : f_->updates[0].rvars) {
      const std::string name = without_numbers(r.var);
      const auto stride = std::ranges::find(term_.strides, r.var, &Stride::loop);
      if (stride == term_.strides.end()) {
        places_[r.var] = add_loop(domain_, name, r.min, r.extent);
        continue;
      }
      const Expr number = add_loop(domain_, name, constant(0), constant(stride->terms()));
      const Expr offset = phase(*stride) + number * constant(stride->modulus);
      numbers_[r.var] = number;
      places_[r.var] = offset + constant(stride->min);
      if (stride->divides()) continue;
      conditions_.push_back(offset < constant(stride->extent));
      places_[r.var] = min(places_[r.var], constant(stride->min + stride->extent - 1));
    }
  }

  static Expr constant(int64_t value) { return make_const(Int(32), value); }
  static Expr quotient(const Stride& stride) {
    return simplify(to_expr(stride.first()) / constant(stride.modulus));
  }
  static Expr phase(const Stride& stride) {
    return simplify(to_expr(stride.first()) % constant(stride.modulus));
  }

  // In terms of the new loops.
  Expr placed(const Expr& e) const {
    const Expr result = rewrite(e, [&](const Expr& node, const auto& recurse) -> Expr {
      const auto* division = node.as<Binary>();
      const bool divides = node.kind() == Kind::Div || node.kind() == Kind::Mod;
      if (divides && node.type() == Int(32)) {
        const Expr operand = without_strided_loops(division->a);
        if (operand.defined()) return binary(node.kind(), operand, recurse(division->b));
      }
      const auto* v = node.as<Variable>();
      const Expr* place = v ? find_or_null(places_, v->name) : nullptr;
      return place ? *place : Expr();
    });
    return rewrite(result, [](const Expr& node, const auto&) -> Expr {
      return node.type() == Int(32) ? simplify(node) : Expr();
    });
  }

  // An operand of a division with multiples of the strides in place of their loops; undefined: it has none of these.
  Expr without_strided_loops(const Expr& e) const {
    Sum form = linear_form(e);
    bool has_loop = false;
    for (const Stride& stride : term_.strides) {
      const int64_t factor = form.valid ? form.factor_of(stride.loop) : 0;
      if (factor == 0) continue;
      has_loop = true;
      // operand == remainder + sign * modulus * (number - quotient)
      form = plus(form, stride.operand, -factor * stride.sign);
      form.add_constant(factor * stride.sign * stride.remainder);
      form = plus(form, linear_sum(numbers_.at(stride.loop)), factor * stride.modulus);
      form = plus(form, linear_form(quotient(stride)), -factor * stride.modulus);
    }
    const Expr result = has_loop && form.valid ? to_expr(form) : Expr();
    return result.defined() ? substitute(result, places_) : result;
  }

  // The sum of the left-out terms of an element; undefined: nothing.
  Expr left_out() const {
    const Type type = f_->types[0];
    if (!type.is_float()) return {};
    if (is_const(term_.left_out)) return term_.left_out;
    const FuncPtr zeros = std::make_shared<FuncContents>();
    zeros->name = claim_name(f_->name + "_left_out");
    zeros->declared_at = f_->declared_at;
    std::vector<Expr> args, place;
    for (const size_t d : dimensions_of(term_.left_out, *f_)) {
      args.push_back(variable(f_->args[d]));
      place.push_back(args.back());
    }
    const DomainPtr all = make_domain();
    Substitution loops;
    for (const ReductionVariable& r : f_->updates[0].rvars)
      loops[r.var] = add_loop(all, without_numbers(r.var), r.min, r.extent);
    std::vector<Expr> holds;
    for (const Stride& stride : term_.strides) {
      args.push_back(variable(new_variable("phase", args)));
      place.push_back(phase(stride));
      holds.push_back((loops.at(stride.loop) - constant(stride.min)) % constant(stride.modulus) ==
                      args.back());
    }
    const Expr nothing = make_const(type, -0.0);
    define_pure(zeros, args, {nothing});
    const Expr sum = call_func(zeros->name, type, args, 0, SymbolRef(zeros));
    const Expr term = substitute(term_.left_out, loops);
    define_update(zeros, args, {sum + select(conjunction(holds), nothing, term)}, all);
    zeros->frozen = true;
    return call_func(zeros->name, type, place, 0, SymbolRef(zeros));
  }

  const FuncPtr f_;
  const StridedTerm term_;
  const DomainPtr domain_;
  Substitution places_;           // of the old loops
  Substitution numbers_;          // of the terms, by the old loop
  std::vector<Expr> conditions_;  // on loops that may end before their last iteration
};

// Whether other Funcs are computed or stored in loops of f.
bool hosts_others(const FuncContents& f, const std::vector<FuncPtr>& order) {
  return std::ranges::any_of(order, [&](const FuncPtr& other) {
    const auto is_in = [&](const graph::LoopLevel& level) {
      return level.kind == graph::LoopLevel::Kind::At && level.func == f.name;
    };
    return is_in(other->schedule.compute_level) || is_in(other->schedule.store_level);
  });
}

}  // namespace

bool has_strided_terms(const std::vector<FuncPtr>& outputs) {
  return std::ranges::any_of(topological_order(outputs),
                             [](const FuncPtr& f) { return strided_term(*f).has_value(); });
}

void leave_out_zero_terms(const std::vector<FuncPtr>& outputs) {
  if (!has_strided_terms(outputs)) return;
  const std::vector<FuncPtr> order = topological_order(outputs);
  const SizeEstimate sizes(outputs);
  for (const FuncPtr& f : order) {
    const auto term = strided_term(*f);
    if (term && has_few_zeros(*term, *f, sizes) && !hosts_others(*f, order))
      TermDropper(f, *term).run();
  }
}

}  // namespace retrograde::transform
