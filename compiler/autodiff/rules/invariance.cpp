#include "autodiff/rules/invariance.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "autodiff/custom_derivative.h"
#include "autodiff/sweeps/custom_rules.h"
#include "autodiff/sweeps/local_derivative.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/markers.h"
#include "simplify/simplify.h"

namespace retrograde::autodiff {

namespace {

struct Response {
  enum class Kind : uint8_t {
    Fixed,
    Shifted,
    Scaled,
    Zero,      // the constant 0: Scaled with any degree
    Infinite,  // an infinite constant: Shifted and Scaled with any degree
    Unknown,
  };
  Kind kind = Kind::Fixed;
  double degree = 0;  // nonzero for Shifted and Scaled
  std::vector<Expr>
      place;  // the element of the Func, over the consumer's variables, without likely()
  bool is(Kind k) const { return kind == k; }
};
using How = Response::Kind;

const Response fixed{}, unknown{How::Unknown, 0, {}};

Response with_degree(const Response& r, How kind, double degree) {
  return degree == 0 ? fixed : Response{kind, degree, r.place};
}
Response times(const Response& r, double factor) {
  return r.degree == 0 ? r : with_degree(r, r.kind, r.degree * factor);
}

bool same_place(const std::vector<Expr>& a, const std::vector<Expr>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Expr& x, const Expr& y) {
    return equal(x, y) || equal(simplify(x), simplify(y));
  });
}
bool same(const Response& a, const Response& b) {
  return a.kind == b.kind && a.degree == b.degree && same_place(a.place, b.place);
}

// The response of a + sign * b for shifts, of a * b^sign for scales.
Response combined(How kind, const Response& a, const Response& b, double sign) {
  const auto fits = [&](const Response& r) { return r.is(kind) || r.is(How::Fixed); };
  if (!fits(a) || !fits(b)) return unknown;
  if (b.is(How::Fixed)) return a;
  if (a.is(How::Fixed)) return times(b, sign);
  return same_place(a.place, b.place) ? with_degree(a, kind, a.degree + sign * b.degree) : unknown;
}

// The response of a value that is either of the two.
Response joined(const Response& a, const Response& b) {
  const auto is_scaled = [](const Response& r) {
    return r.is(How::Scaled) || r.is(How::Fixed) || r.is(How::Zero);
  };
  if (a.is(How::Infinite)) return b;
  if (b.is(How::Infinite)) return a;
  if (a.is(How::Zero) && is_scaled(b)) return b;
  if (b.is(How::Zero) && is_scaled(a)) return a;
  return same(a, b) ? a : unknown;
}

Response sum(const Response& a, const Response& b, double sign) {
  if (b.is(How::Zero)) return a;
  if (a.is(How::Zero)) return b.is(How::Shifted) ? times(b, sign) : b;
  if (a.is(How::Infinite) || b.is(How::Infinite)) return joined(a, b);
  return a.is(How::Scaled) ? joined(a, b) : combined(How::Shifted, a, b, sign);
}

Response product(const Response& a, const Response& b, double sign) {
  if (a.is(How::Unknown) || b.is(How::Unknown)) return unknown;
  for (How kind : {How::Zero, How::Infinite}) {
    if (a.is(kind)) return a;
    if (b.is(kind)) return sign > 0 ? b : unknown;
  }
  return combined(How::Scaled, a, b, sign);
}

// The response of pow(v, exponent).
Response power(const Response& v, double exponent) {
  if (v.is(How::Zero)) return exponent > 0 ? v : unknown;
  return v.is(How::Fixed) || v.is(How::Scaled) ? times(v, exponent) : unknown;
}

Response exponential(const Response& v, double log_of_base) {
  if (v.is(How::Zero)) return fixed;
  return v.is(How::Shifted) ? with_degree(v, How::Scaled, v.degree * log_of_base)
         : v.is(How::Fixed) ? v
                            : unknown;
}
Response logarithm(const Response& v) {
  return v.is(How::Scaled)  ? with_degree(v, How::Shifted, v.degree)
         : v.is(How::Fixed) ? v
                            : unknown;
}

Response of_constant(double value) {
  if (value == 0) return {How::Zero, 0, {}};
  return std::isinf(value) ? Response{How::Infinite, 0, {}} : fixed;
}

bool is_constant_kind(const Response& r) {
  return r.is(How::Fixed) || r.is(How::Zero) || r.is(How::Infinite);
}

Response of_pow(const std::vector<Expr>& args, const std::vector<Response>& a) {
  if (auto exponent = as_const_float(args[1])) return power(a[0], *exponent);
  auto base = as_const_float(args[0]);
  return base && *base > 0 ? exponential(a[1], std::log(*base)) : unknown;
}

Response of_operator(const Call& call, const std::vector<Response>& a) {
  switch (exact_form(call.op)) {
    case Op::exp:
      return exponential(a[0], 1);
    case Op::log:
      return logarithm(a[0]);
    case Op::sqrt:
      return power(a[0], 0.5);
    case Op::fast_inverse:
      return power(a[0], -1);
    case Op::fast_inverse_sqrt:
      return power(a[0], -0.5);
    case Op::pow:
      return of_pow(call.args, a);
    case Op::abs:
      return power(a[0], 1);
    case Op::hypot:
      return joined(power(a[0], 1), power(a[1], 1));
    case Op::fma:
      return sum(product(a[0], a[1], 1), a[2], 1);
    case Op::if_then_else:
      return joined(a[1], a[2]);
    case Op::strong_mul:
      return product(a[0], a[1], 1);
    case Op::strong_div:
      return product(a[0], a[1], -1);
    case Op::stop_gradient:
      return fixed;
    case Op::strict_float:
    case Op::likely:
    case Op::likely_if_innermost:
      return a[0];
    default:
      return std::ranges::all_of(a, is_constant_kind) ? fixed : unknown;
  }
}

Response of_binary(const Binary& e, const Response& a, const Response& b) {
  switch (e.kind) {
    case Kind::Add:
      return sum(a, b, 1);
    case Kind::Sub:
      return sum(a, b, -1);
    case Kind::Mul:
      if (auto c = as_const_float(e.b); c && a.is(How::Shifted)) return times(a, *c);
      if (auto c = as_const_float(e.a); c && b.is(How::Shifted)) return times(b, *c);
      return product(a, b, 1);
    case Kind::Div:
      if (auto c = as_const_float(e.b); c && a.is(How::Shifted)) return times(a, 1 / *c);
      return product(a, b, -1);
    case Kind::Min:
    case Kind::Max:
      return joined(a, b);
    default:
      return is_constant_kind(a) && is_constant_kind(b) ? fixed : unknown;
  }
}

// Simplifies the element's indices under the condition. Gathers of adjoints clamp the indices that they read; where the
// condition holds, the clamp goes away.
Response where(const Expr& condition, const Response& r) {
  Response result = r;
  const Expr assumption = result.place.empty() ? condition : simplify(without_likely(condition));
  for (Expr& index : result.place) {
    const Expr choice = simplify(make_select(assumption, index, index + 1));
    const auto* select = choice.as<Select>();
    if (select && equal(select->condition, assumption)) index = select->when_true;
  }
  return result;
}

// The response of a constant, or of a node given the responses `of` its children.
Response response_of_node(const Expr& e, FunctionRef<const Response&(const Expr&)> of) {
  if (auto value = as_const_float(e)) return of_constant(*value);
  if (const auto* binary = e.as<Binary>()) return of_binary(*binary, of(binary->a), of(binary->b));
  if (const auto* choice = e.as<Select>())
    return joined(where(choice->condition, of(choice->when_true)), of(choice->when_false));
  if (const auto* cast = e.as<Cast>()) return of(cast->value);
  std::vector<Response> operands;
  for_each_child(e, [&](const Expr& child) { operands.push_back(of(child)); });
  const auto* call = e.as<Call>();
  if (call && call->call_type == CallType::Operator) return of_operator(*call, operands);
  return std::ranges::all_of(operands, is_constant_kind) ? fixed : unknown;
}

// The responses of all Funcs when one of them is shifted or scaled.
class Propagation {
 public:
  Propagation(const std::vector<FuncPtr>& order,
              const std::vector<std::vector<std::shared_ptr<Symbol>>>& reads,
              const std::vector<FuncPtr>& outputs)
      : order_(order), reads_(reads), outputs_(outputs) {}

  bool outputs_ignore(size_t source, How kind) {
    responses_.clear();
    responses_[order_[source].get()] = {{kind, 1, variables_of(order_[source]->args)}};
    for (size_t i = source + 1; i < order_.size(); ++i) {
      if (responds(i) && !add(order_[i])) return false;
    }
    return std::ranges::none_of(
        outputs_, [&](const FuncPtr& output) { return responses_.contains(output.get()); });
  }

 private:
  bool responds(size_t i) const {
    return std::ranges::any_of(reads_[i], [&](const std::shared_ptr<Symbol>& symbol) {
      return responses_.contains(symbol.get());
    });
  }

  // Returns false if a response is unknown.
  bool add(const FuncPtr& f) {
    if (f->custom_derivatives || f->is_extern()) return false;
    std::vector<Response>& own = responses_[f.get()];
    own.assign(f->types.size(), {How::Infinite, 0, {}});
    for (bool changes = true; changes;) {
      const std::vector<Response> before = own;
      for (int s = 0; s < f->stage_count(); ++s) {
        if (!join_stage(*f, s, own)) return false;
      }
      changes = !std::equal(own.begin(), own.end(), before.begin(), same);
    }
    if (std::ranges::all_of(own, is_constant_kind)) responses_.erase(f.get());
    return true;
  }

  bool join_stage(const FuncContents& f, int s, std::vector<Response>& own) {
    for (size_t k = 0; k < own.size(); ++k) {
      own[k] = joined(own[k], at_element(f, s, of(without_lets(f.stage(s).values[k]))));
      if (own[k].is(How::Unknown)) return false;
    }
    return true;
  }

  // The response of a stage's value in terms of the element written. The place must be a function of pure variables
  // that stand at their own positions.
  static Response at_element(const FuncContents& f, int s, const Response& written) {
    const Definition& stage = f.stage(s);
    for (const Expr& index : written.place) {
      for (const ReductionVariable& r : stage.rvars) {
        if (uses_variable(index, r.var)) return unknown;
      }
      for (size_t d = 0; d < f.args.size(); ++d) {
        const auto* v = stage.args.empty() ? nullptr : stage.args[d].as<Variable>();
        const bool is_own = s == 0 || (v && v->name == f.args[d]);
        if (!is_own && uses_variable(index, f.args[d])) return unknown;
      }
    }
    return written;
  }

  Response of_leaf(const Expr& leaf) const {
    const auto* call = leaf.as<Call>();
    if (!call || call->call_type != CallType::Func) return fixed;
    auto found = responses_.find(call->symbol.raw());
    if (found == responses_.end()) return fixed;
    Response result = found->second[static_cast<size_t>(call->component)];
    const auto& f = dynamic_cast<const FuncContents&>(*call->symbol.raw());
    Substitution arguments;
    for (size_t d = 0; d < f.args.size(); ++d) arguments[f.args[d]] = call->args[d];
    for (Expr& index : result.place) index = without_likely(substitute(index, arguments));
    return result;
  }

  Response of(const Expr& e) const {
    std::unordered_map<const ExprNode*, Response> known;
    const auto of_child = [&](const Expr& child) -> const Response& {
      return known.at(child.get());
    };
    for (const Expr& node : post_order({e})) {
      known[node.get()] = !node.type().is_float() ? fixed
                          : is_leaf(node)         ? of_leaf(node)
                                                  : response_of_node(node, of_child);
    }
    return known.at(e.get());
  }

  const std::vector<FuncPtr>& order_;
  const std::vector<std::vector<std::shared_ptr<Symbol>>>& reads_;
  const std::vector<FuncPtr>& outputs_;
  std::unordered_map<const Symbol*, std::vector<Response>> responses_;
};

// ---- candidates: Funcs that are subtracted or divided by ----

struct Suspects {
  std::unordered_set<const Symbol*> subtracted, divisors;
};

void note_suspects(const Definition& stage, size_t dimensions, Suspects& result) {
  const auto note = [&](const Expr& operand, std::unordered_set<const Symbol*>& where) {
    const auto* call = operand.as<Call>();
    if (call && call->call_type == CallType::Func && call->args.size() < dimensions)
      where.insert(call->symbol.raw());
  };
  walk(
      stage, [&](const Sub& difference) { note(difference.b, result.subtracted); },
      [&](const Div& quotient) { note(quotient.b, result.divisors); });
}

Suspects suspects_among(const std::vector<FuncPtr>& order) {
  Suspects result;
  for (const FuncPtr& f : order) {
    if (f->is_extern()) continue;
    for (int s = 0; s < f->stage_count(); ++s)
      note_suspects(f->stage(s), f->args.size() + f->stage(s).rvars.size(), result);
  }
  return result;
}

}  // namespace

std::unordered_set<const Symbol*> cancelling_funcs(const std::vector<FuncPtr>& order,
                                                   const std::vector<FuncPtr>& outputs) {
  std::unordered_set<const Symbol*> result;
  const Suspects suspects = suspects_among(order);
  if (suspects.subtracted.empty() && suspects.divisors.empty()) return result;
  const auto reads = mapped(order, [&](const FuncPtr& f) { return read_by(*f); });
  Propagation propagation(order, reads, outputs);
  for (size_t i = 0; i < order.size(); ++i) {
    const Symbol* f = order[i].get();
    if (order[i]->types.size() != 1 || !order[i]->types[0].is_float()) continue;
    if ((suspects.subtracted.contains(f) && propagation.outputs_ignore(i, How::Shifted)) ||
        (suspects.divisors.contains(f) && propagation.outputs_ignore(i, How::Scaled)))
      result.insert(f);
  }
  return result;
}

}  // namespace retrograde::autodiff
