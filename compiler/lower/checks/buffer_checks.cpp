#include "lower/checks/buffer_checks.h"

#include <HalideRuntime.h>

#include "lower/checks/run_time_check.h"
#include "lower/runtime_call.h"
#include "retrograde_runtime.h"
#include "simplify/simplify.h"

namespace retrograde::lower {
namespace {

constexpr const char *check_shape = "retrograde_check_shape",
                     *check_region = "retrograde_check_region";

// Calls a check of the runtime, which reports an error and returns its code, or 0.
Stmt call_check(const char* function, std::vector<Expr> args) {
  return checked_call("code", call_runtime(function, std::move(args)));
}

// States what a runtime call has already checked: the simplifier uses it, and no code is generated.
Stmt known_fact(const Expr& condition) {
  return make_assert(condition, call_op(Op::undef, Int(32), {}));
}

bool is_output(const LoweredArgument& arg) {
  return arg.kind == LoweredArgument::Kind::OutputBuffer;
}

int32_t region_rules(const LoweredArgument& arg, bool has_device) {
  return (is_output(arg) ? retrograde_region_is_written : 0) |
         (is_dense(arg) ? retrograde_region_is_dense : 0) |
         (has_device ? retrograde_region_on_device : 0);
}

Stmt box_check(const LoweredArgument& arg, const Interval& used, int d, const Expr& inside) {
  const char* verb = is_output(arg) ? "written" : "read";
  const Expr min = fact(arg, Metadata::Min, d), extent = fact(arg, Metadata::Extent, d);
  return run_time_check(
      inside, retrograde_error_access_out_of_bounds,
      text("cannot run: every access must lie inside its buffer; ", quoted(arg.name), " is ", verb,
           " over ["),
      used.min, Expr(", "), used.max, text("] in dimension ", d, ", but the buffer covers ["), min,
      Expr(", "), min + extent - 1,
      Expr("]. Pass a larger buffer, clamp the access, or use a boundary condition."));
}

}  // namespace

void add_shape_check(const LoweredArgument& arg, std::vector<Stmt>& checks) {
  checks.push_back(call_check(
      check_shape, {buffer_handle(arg), Expr(arg.name),
                    Expr(static_cast<int32_t>(type_word(arg.type))), Expr(arg.dimensions)}));
}

void add_extent_facts(const LoweredArgument& arg, std::vector<Stmt>& checks) {
  for (int d = 0; d < arg.dimensions; d++) {
    const Expr extent = call_op(Op::buffer_extent, Int(32), {buffer_handle(arg), d});
    checks.push_back(known_fact(extent >= 0));
  }
}

void add_region_checks(const LoweredArgument& arg, const Box& used, bool has_device,
                       std::vector<Stmt>& checks) {
  std::vector<Expr> sides;
  std::vector<Stmt> facts, promise_checks;
  int32_t dimensions = 0;  // bit set of the dimensions to check
  for (size_t d = 0; d < used.size(); d++) {
    const int dimension = static_cast<int>(d);
    const Expr min = fact(arg, Metadata::Min, dimension),
               extent = fact(arg, Metadata::Extent, dimension);
    const Expr inside = simplify(min <= used[d].min && used[d].max <= min + extent - 1);
    if (is_const_true(inside)) continue;
    const BufferConstraint promised = constraint_of(arg, dimension);
    if (promised.min.defined() || promised.extent.defined() || d >= 31) {
      promise_checks.push_back(box_check(arg, used[d], dimension, inside));
      continue;
    }
    dimensions |= 1 << d;
    sides.push_back(cast(Int(32), used[d].min));
    sides.push_back(cast(Int(32), used[d].max));
    facts.push_back(known_fact(inside));
  }
  checks.push_back(call_check(
      check_region, {buffer_handle(arg), Expr(arg.name), Expr(region_rules(arg, has_device)),
                     Expr(promised_alignment(arg)), Expr(dimensions), pack(std::move(sides))}));
  checks.insert(checks.end(), facts.begin(), facts.end());
  checks.insert(checks.end(), promise_checks.begin(), promise_checks.end());
}

bool is_check_by_runtime(const Stmt& s) {
  const auto* let = s.as<LetStmt>();
  const auto* call = let ? as_op(let->value, Op::runtime_call) : nullptr;
  if (!call || !let->body.as<Assert>()) return false;
  const std::string& function = call->args[0].as<StringImm>()->value;
  return function == check_shape || function == check_region;
}

}  // namespace retrograde::lower
