// Iterations over elements. In  f(4 x + r), r < 8,  two iterations read each element: 8 / 4; in
// f(r.x, r.y) one does, and in f(x - r, r), where the second index says which; in f(x, r) of a stage
// over x, y and r as many as y has values.
#include "transform/read_estimate.h"

#include <algorithm>
#include <cmath>

#include "analysis/linear.h"
#include "graph/definitions/own_reads.h"
#include "ir/build.h"
#include "ir/lets.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde::transform {

namespace {

// Iterations of a loop, or reads of a reduction, of which nothing is known.
constexpr double several = 8;
constexpr double sums_at_once = 16;  // in registers

struct Loop {
  std::string name;
  double extent = several;
  bool is_long = false;   // a pure dimension, as long as what is read
  bool is_block = false;  // counts the blocks of a sum (graph/definitions/provenance.h)
  bool is_used = false;
  bool is_decided = false;  // by an index: the same for all iterations that read an element
};

std::vector<Loop> loops_of(const FuncContents& f, const Definition& stage) {
  std::vector<Loop> loops;
  for (const ReductionVariable& r : stage.rvars) {
    auto extent = as_const_int(simplify(r.extent));
    loops.push_back({r.var, extent ? std::max(1.0, static_cast<double>(*extent)) : several});
  }
  for (size_t d = 0; d < f.args.size(); ++d) {
    if (!is_pure_position(f, stage, d)) continue;
    const bool is_lane = f.made && f.made->lanes > 0 && d == 0;
    const bool is_block = f.made && d + static_cast<size_t>(f.made->blocks) >= f.args.size();
    loops.push_back({f.args[d], is_lane ? f.made->lanes : several, !is_lane, is_block});
  }
  return loops;
}

// An index, or the terms of one, without markers and without clamps to what does not move.
Expr unclamped(const Expr& e, FunctionRef<bool(const Expr&)> moves) {
  const auto* call = e.as<Call>();
  if (call && call->call_type == CallType::Operator && op_info(call->op).cls == OpClass::Marker)
    return unclamped(call->args[0], moves);
  const auto* product = e.as<Mul>();
  const bool is_multiple = product && (as_const_int(product->a) || as_const_int(product->b));
  if (e.kind() == Kind::Add || e.kind() == Kind::Sub || is_multiple)
    return map_children(e, [&](const Expr& part) { return unclamped(part, moves); });
  if (e.kind() != Kind::Min && e.kind() != Kind::Max) return e;
  const auto* n = e.as<Binary>();
  if (!moves(n->b)) return unclamped(n->a, moves);
  return moves(n->a) ? e : unclamped(n->b, moves);
}

bool uses_loops(const Expr& e, const std::vector<Loop>& loops) {
  return std::any_of(loops.begin(), loops.end(),
                     [&](const Loop& loop) { return uses_variable(e, loop.name); });
}

std::vector<std::string> names_of(const std::vector<Loop>& loops) {
  std::vector<std::string> names;
  for (const Loop& loop : loops) names.push_back(loop.name);
  return names;
}

// The only loop that moves an index; null where several do, or none.
Loop* only_loop(const Expr& any_index, std::vector<Loop>& loops) {
  const Expr index = unclamped(any_index, [&](const Expr& e) { return uses_loops(e, loops); });
  const auto form = decompose(index, names_of(loops));
  Loop* only = nullptr;
  for (size_t i = 0; form && i < loops.size(); ++i) {
    if (form->coefficients[i].second == 0) continue;
    if (only) return nullptr;
    only = &loops[i];
  }
  return only;
}

// In  f(32 x + r - 32 block), the gradient of what was read at  x / 32 + block , blocks repeat the steps of x: each
// element of f is in a cell that has as many readers as there are blocks. Steps of 1 are those of windows, whose readers
// are made from one read (sums_at_once).
double repeats_of_blocks(const LinearDecomposition& form, const std::vector<Loop>& loops) {
  double repeats = 1;
  for (size_t i = 0; i < loops.size(); ++i) {
    const auto step = std::abs(form.coefficients[i].second);
    if (!loops[i].is_block || loops[i].is_decided || step <= 1) continue;
    for (size_t j = 0; j < loops.size(); ++j) {
      const bool is_dimension = loops[j].is_long && !loops[j].is_block && !loops[j].is_decided;
      if (is_dimension && std::abs(form.coefficients[j].second) == step) repeats *= loops[i].extent;
    }
  }
  return repeats;
}

// Iterations for each value of one index; nothing when it is not linear in the loops.
std::optional<double> iterations_a_value(const Expr& any_index, std::vector<Loop>& loops) {
  const Expr index = unclamped(any_index, [&](const Expr& e) { return uses_loops(e, loops); });
  const auto* quotient = index.as<Div>();
  if (auto divisor = quotient ? as_const_int(quotient->b) : std::nullopt; divisor && *divisor > 0) {
    auto found = iterations_a_value(quotient->a, loops);
    return found ? std::optional(*found * static_cast<double>(*divisor)) : std::nullopt;
  }
  auto form = decompose(index, names_of(loops));
  if (!form) return std::nullopt;
  double iterations = 1, reach = 1;
  // Long loops of larger steps go over what the one of the smallest leaves, as the parts of a
  // sum go over its rows.
  std::optional<double> smallest_step;
  for (size_t i = 0; i < loops.size(); ++i) {
    const double step = std::abs(static_cast<double>(form->coefficients[i].second));
    if (step == 0 || loops[i].is_decided) continue;
    loops[i].is_used = true;
    if (loops[i].is_long) {
      smallest_step = std::min(smallest_step.value_or(step), step);
    } else {
      iterations *= loops[i].extent;
      reach += step * (loops[i].extent - 1);
    }
  }
  if (!smallest_step) return std::max(1.0, iterations / reach);
  return iterations * repeats_of_blocks(*form, loops) / *smallest_step;
}

}  // namespace

double reads_an_element(const Call& call, const FuncContents& reader, const Definition& stage) {
  std::vector<Loop> loops = loops_of(reader, stage);
  std::vector<Expr> args;
  for (const Expr& arg : call.args) args.push_back(without_lets(arg));
  // Indices that decide a loop first.
  std::stable_partition(args.begin(), args.end(),
                        [&](const Expr& arg) { return only_loop(arg, loops) != nullptr; });
  double reads = 1;
  for (const Expr& arg : args) {
    auto found = iterations_a_value(arg, loops);
    if (!found) return stage.rvars.empty() ? 1 : several;
    reads *= *found;
    if (Loop* decided = only_loop(arg, loops)) decided->is_decided = true;
  }
  double repeats = 1;
  for (const Loop& loop : loops) {
    if (!loop.is_used) repeats *= loop.extent;
  }
  // A block of a sum is made for several elements at once, in registers, from one read.
  if (reader.made && reader.made->blocks > 0) repeats = std::max(1.0, repeats / sums_at_once);
  return reads * repeats;
}

}  // namespace retrograde::transform
