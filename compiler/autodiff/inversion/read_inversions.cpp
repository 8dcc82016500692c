#include "autodiff/inversion/read_inversions.h"

#include <algorithm>

#include "autodiff/borders/passed_reads.h"
#include "ir/build.h"
#include "ir/memory_reads.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde::autodiff {

namespace {

bool chooses(const Expr& index) {
  return any_node(index,
                  [&](const Expr& e) { return e.as<Min>() || e.as<Max>() || e.as<Select>(); });
}

bool divides(const Expr& index) {
  return any_node(index, [&](const Expr& e) { return e.as<Div>() || e.as<Mod>(); });
}

// Iterations for each element; loops of unknown extent count as long ones.
double iterations_of(const Inversion& inversion) {
  constexpr double unknown = 1e6;
  double total = 0;
  for (const Gather& g : inversion.gathers) {
    double iterations = 1;
    for (const ReductionVariable& r : g.rdom ? g.rdom->vars : std::vector<ReductionVariable>())
      iterations *= as_const_int(r.extent) ? static_cast<double>(*as_const_int(r.extent)) : unknown;
    total += iterations;
  }
  return total;
}

// Where an expression may be nonzero, and its value there.
struct Nonzero {
  Expr where, value;
};

// By a select; undefined if it is none.
Nonzero nonzero_arm(const Expr& e) {
  const auto* selection = e.as<Select>();
  if (!selection) return {};
  if (is_zero(selection->when_true)) return {!selection->condition, selection->when_false};
  if (is_zero(selection->when_false)) return {selection->condition, selection->when_true};
  return {};
}

// By a factor that is read of a Func with zeros between its elements. Factors are searched to this depth, because
// products may share theirs.
constexpr int depth_of_factors = 6;
Nonzero without_spread(const Expr& product, int depth = depth_of_factors) {
  if (depth == 0) return {};
  if (product.as<Mul>() || as_op(product, Op::strong_mul)) {
    Expr where;
    const Expr value = map_children(product, [&](const Expr& factor) {
      const Nonzero found = where.defined() ? Nonzero() : without_spread(factor, depth - 1);
      if (found.where.defined()) where = found.where;
      return found.where.defined() ? found.value : factor;
    });
    return {where, value};
  }
  const auto* call = product.as<Call>();
  const FuncPtr f = call && call->call_type == CallType::Func ? func_of(*call) : nullptr;
  if (!f || !is_look_up(*f)) return {};
  const Nonzero arm = nonzero_arm(value_of_read(*f, *call));
  const bool is_spread = arm.where.defined() &&
                         any_node(arm.where, [](const Expr& e) { return e.kind() == Kind::Mod; });
  return is_spread ? arm : Nonzero();
}

// A key of all inputs of the inversion.
std::string text_of(const AccessQuery& query) {
  std::string text;
  const auto add = [&](const Expr& e) { text += (e.defined() ? ir::print(e) : "_") + ","; };
  const auto add_all = [&](const std::vector<LoopVariable>& vars) {
    for (const LoopVariable& v : vars) {
      text += v.name + (v.is_reduction ? ":" : "=");
      add(v.min);
      add(v.max);
    }
    text += ";";
  };
  add_all(query.domain.vars);
  add(query.domain.predicate);
  for (const Expr& index : query.indices) add(index);
  for (const std::string& arg : query.target_args) text += arg + ",";
  add_all(query.region);
  return text;
}

bool has_domains(const Inversion& inversion) {
  return std::ranges::any_of(inversion.gathers, [](const Gather& g) { return g.rdom != nullptr; });
}

}  // namespace

InvertedRead ReadInversions::of(const FuncContents& f, const Symbol& symbol,
                                const AccessQuery& query, const Expr& adjoint) {
  const Nonzero arm = nonzero_arm(adjoint);
  if (std::ranges::any_of(query.indices, chooses)) {
    const Inversion* one = where(arm.where, f, symbol, query);
    return {one ? *one : find(f, symbol, query), adjoint};
  }
  const Inversion& everywhere = find(f, symbol, query);
  const bool divides_by_stride = std::ranges::any_of(query.indices, divides);
  const Nonzero few = arm.where.defined() && divides_by_stride ? arm : without_spread(adjoint);
  const Inversion* fewer = where(few.where, f, symbol, query);
  if (fewer && iterations_of(*fewer) < iterations_of(everywhere)) return {*fewer, few.value};
  return {everywhere, adjoint};
}

// The inversion where a condition holds, if that is a single gather; else null.
const Inversion* ReadInversions::where(const Expr& condition, const FuncContents& f,
                                       const Symbol& symbol, AccessQuery query) {
  if (!condition.defined() || calls(condition, &f)) return nullptr;
  Expr& predicate = query.domain.predicate;
  predicate = predicate.defined() ? predicate && condition : condition;
  const Inversion& inversion = find(f, symbol, query);
  return inversion.note.empty() && inversion.gathers.size() == 1 ? &inversion : nullptr;
}

const Inversion& ReadInversions::find(const FuncContents& f, const Symbol& symbol,
                                      const AccessQuery& query) {
  std::string key = std::to_string(reinterpret_cast<uintptr_t>(&symbol));
  for (const Expr& e : query.indices) key += "," + ir::print(e);
  if (query.domain.predicate.defined()) key += "|" + ir::print(query.domain.predicate);
  for (const LoopVariable& v : query.domain.vars) key += ";" + v.name;
  key += f.name;
  auto [it, is_new] = found_.try_emplace(key);
  if (!is_new) return it->second;
  const std::string text = text_of(query);
  if (const auto known = without_domains_.find(text); known != without_domains_.end())
    return it->second = known->second;
  it->second = invert_or_scatter(query, operations_);
  if (!has_domains(it->second)) without_domains_[text] = it->second;
  if (it->second.gave_up) operations_ = std::max(operations_ / 2, least_operations);
  return it->second;
}

}  // namespace retrograde::autodiff
