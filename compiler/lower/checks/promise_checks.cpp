#include "lower/checks/promise_checks.h"

#include "lower/checks/run_time_check.h"
#include "retrograde_runtime.h"
#include "simplify/simplify.h"

namespace retrograde::lower {
namespace {

// Whether the stride is irrelevant because there is at most one element. Array libraries set such strides arbitrarily.
Expr has_one_element_at_most(const LoweredArgument& arg, int d) {
  return fact(arg, Metadata::Extent, d) <= 1;
}

void add_constraint_check(const LoweredArgument& arg, Metadata what, int d, const Expr& promised,
                          std::vector<Stmt>& checks) {
  if (!promised.defined()) return;
  const Expr actual = actual_fact(arg, what, d);
  Expr holds = actual == promised;
  if (what == Metadata::Stride) holds = holds || has_one_element_at_most(arg, d);
  checks.push_back(run_time_check(holds, retrograde_error_constraint_violated,
                                  text("cannot run: the ", to_string(what), " of dimension ", d,
                                       " of ", quoted(arg.name), " was promised to be "),
                                  promised, Expr(", but it is "), actual,
                                  text(". Pass such a buffer, or lift the promise with dim(", d,
                                       ").set_", to_string(what), "(Expr()).")));
}

// An output may be used outside of its bounds because its own update reads an element there, as a recurrence does that
// starts too early.
std::string advice_on_own_reads(const LoweredArgument& arg) {
  if (arg.kind != LoweredArgument::Kind::OutputBuffer) return "";
  return " If an update reads elements of " + quoted(arg.name) +
         " beside those that it writes, as f(r - 1) does, start its RDom where these lie inside, "
         "or "
         "let another Func read " +
         quoted(arg.name) + " and make that the output.";
}

}  // namespace

void add_promise_checks(const LoweredArgument& arg, const Box& used, const ShapeFacts& facts,
                        std::vector<Stmt>& checks) {
  auto param = std::dynamic_pointer_cast<ParameterContents>(arg.symbol.lock());
  if (param && param->is_literal) return;
  for (size_t d = 0; d < used.size(); d++) {
    const BufferConstraint promised = facts.promise_of(arg, static_cast<int>(d));
    if (!promised.min.defined() && !promised.extent.defined()) continue;
    const Expr min = promised.min.defined() ? promised.min : used[d].min;
    Expr holds = min <= used[d].min;
    if (promised.extent.defined()) holds = holds && used[d].max < min + promised.extent;
    holds = simplify(holds);
    if (is_const_true(holds)) continue;
    checks.push_back(run_time_check(
        holds, retrograde_error_constraints_make_required_region_smaller,
        text("cannot run: a promised region must contain the region that is used; ",
             quoted(arg.name), " is used over ["),
        used[d].min, Expr(", "), used[d].max,
        text("] in dimension ", d, ", but its min is promised to be "), min,
        Expr(" and its extent "),
        promised.extent.defined() ? promised.extent : Expr("whatever it is"),
        Expr(". Promise a larger region, or lift the promise." + advice_on_own_reads(arg))));
  }
}

void add_constraint_checks(const LoweredArgument& arg, const ShapeFacts& facts,
                           std::vector<Stmt>& checks) {
  for (int d = 0; d < arg.dimensions; d++) {
    BufferConstraint promised = facts.promise_of(arg, d);
    add_constraint_check(arg, Metadata::Min, d, promised.min, checks);
    add_constraint_check(arg, Metadata::Extent, d, promised.extent, checks);
    if (d > 0 || !is_dense(arg))
      add_constraint_check(arg, Metadata::Stride, d, promised.stride, checks);
  }
}

}  // namespace retrograde::lower
