#include "lower/checks/argument_checks.h"

#include <HalideRuntime.h>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/checks/buffer_constraints.h"
#include "lower/checks/run_time_check.h"
#include "lower/checks/schedule_checks.h"
#include "lower/nests/root_statement.h"
#include "lower/runtime_call.h"
#include "retrograde_runtime.h"
#include "simplify/simplify.h"

namespace retrograde::lower {
namespace {

Expr handle_of(const std::string& buffer) { return variable(buffer + ".buffer", Handle()); }

std::string fact(const std::string& buffer, const char* what, int d) {
  return buffer + "." + what + "." + std::to_string(d);
}

constexpr const char *check_shape = "retrograde_check_shape",
                     *check_region = "retrograde_check_region";

class Checks {
 public:
  Checks(const RootStatement& root, const std::vector<LoweredArgument>& args,
         const Program& program, bool has_device)
      : root_(root),
        args_(args),
        program_(program),
        has_device_(has_device),
        actual_(names_of_actual_facts()) {}

  Stmt build() {
    std::vector<Stmt> shape_checks;
    for (const LoweredArgument& arg : args_) {
      if (arg.is_buffer()) add_shape_checks(arg, shape_checks);
    }
    Stmt body = make_block({emit_query_or_run()});
    body = make_lets(root_.bounds, body);
    std::vector<Stmt> fact_checks;
    for (const LoweredArgument& arg : args_) {
      if (arg.is_buffer()) {
        add_extent_facts(arg, fact_checks);
      } else {
        add_scalar_checks(arg, fact_checks);
      }
    }
    fact_checks.push_back(body);
    body = make_lets(buffer_facts(), make_block(fact_checks));
    shape_checks.push_back(body);
    return make_block(shape_checks);
  }

 private:
  const RootStatement& root_;
  const std::vector<LoweredArgument>& args_;
  const Program& program_;
  const bool has_device_;
  const Substitution actual_;

  // Where a fact was promised, the code below uses the promise, and a check compares it with the ".actual" fact.
  Lets buffer_facts() const {
    Lets facts, promises;
    for (const LoweredArgument& arg : args_) {
      if (!arg.is_buffer()) continue;
      for (int d = 0; d < arg.dimensions; d++) {
        BufferConstraint promised = promise_of(arg, d);
        add_fact(arg, "min", Op::buffer_min, d, promised.min, facts, promises);
        add_fact(arg, "extent", Op::buffer_extent, d, promised.extent, facts, promises);
        add_fact(arg, "stride", Op::buffer_stride, d, promised.stride, facts, promises);
      }
    }
    facts.insert(facts.end(), promises.begin(), promises.end());
    return facts;
  }

  static void add_fact(const LoweredArgument& arg, const char* what, Op op, int d,
                       const Expr& promised, Lets& facts, Lets& promises) {
    std::string name = fact(arg.name, what, d);
    Expr actual = call_op(op, Int(32), {handle_of(arg.name), d});
    facts.emplace_back(promised.defined() ? name + ".actual" : name, actual);
    if (promised.defined()) promises.emplace_back(name, promised);
  }

  // The promise in terms of actual facts. It may mention promised facts, even its own, as "a multiple of 8" does.
  BufferConstraint promise_of(const LoweredArgument& arg, int d) const {
    BufferConstraint promised = constraint_of(arg, d);
    for (Expr* side : {&promised.min, &promised.extent, &promised.stride}) {
      if (side->defined()) *side = substitute(*side, actual_);
    }
    return promised;
  }

  Substitution names_of_actual_facts() const {
    Substitution names;
    for (const LoweredArgument& arg : args_) {
      for (int d = 0; arg.is_buffer() && d < arg.dimensions; d++) {
        const BufferConstraint promised = constraint_of(arg, d);
        // A constant promise stands for the constant, also for a stride that actually differs (see
        // add_constraint_check).
        const auto add = [&](const char* what, const Expr& promise) {
          if (!promise.defined()) return;
          names[fact(arg.name, what, d)] =
              is_const(promise) ? promise : variable(fact(arg.name, what, d) + ".actual");
        };
        add("min", promised.min);
        add("extent", promised.extent);
        add("stride", promised.stride);
      }
    }
    return names;
  }

  // Calls a check of the runtime, which reports an error and returns its code, or 0.
  static Stmt call_check(const char* function, std::vector<Expr> args) {
    return checked_call("code", call_runtime(function, std::move(args)));
  }

  static void add_shape_checks(const LoweredArgument& arg, std::vector<Stmt>& checks) {
    checks.push_back(call_check(
        check_shape, {handle_of(arg.name), Expr(arg.name),
                      Expr(static_cast<int32_t>(type_word(arg.type))), Expr(arg.dimensions)}));
  }

  // States what a runtime call has already checked: the simplifier uses it, and no code is generated.
  static Stmt known_fact(const Expr& condition) {
    return make_assert(condition, call_op(Op::undef, Int(32), {}));
  }

  static void add_extent_facts(const LoweredArgument& arg, std::vector<Stmt>& checks) {
    for (int d = 0; d < arg.dimensions; d++) {
      const Expr extent = call_op(Op::buffer_extent, Int(32), {handle_of(arg.name), d});
      checks.push_back(known_fact(extent >= 0));
    }
  }

  static void add_scalar_checks(const LoweredArgument& arg, std::vector<Stmt>& checks) {
    auto param = std::dynamic_pointer_cast<ParameterContents>(arg.symbol.lock());
    if (!param) return;
    Expr value = variable(arg.name, arg.type);
    if (param->min_value.defined()) {
      checks.push_back(run_time_check(value >= param->min_value, retrograde_error_param_too_small,
                                      text("cannot run: the parameter ", quoted(arg.name), " is "),
                                      value, Expr(", below its minimum "), param->min_value,
                                      Expr(". Pass a value in its range.")));
    }
    if (param->max_value.defined()) {
      checks.push_back(run_time_check(value <= param->max_value, retrograde_error_param_too_large,
                                      text("cannot run: the parameter ", quoted(arg.name), " is "),
                                      value, Expr(", above its maximum "), param->max_value,
                                      Expr(". Pass a value in its range.")));
    }
  }

  // The box that a buffer must contain; sides are undefined if nothing of it is used.
  Box required_box(const LoweredArgument& arg) const {
    return value_or(root_.regions, arg.name, Box{});
  }

  void check_bounded(const LoweredArgument& arg, const Box& box) const {
    for (size_t d = 0; d < box.size(); d++) {
      if (box[d].is_bounded()) continue;
      user_error(text("read ", quoted(arg.name)),
                 "the region that a pipeline reads of its input must be bounded",
                 text("dimension ", d, " is read without ",
                      box[d].has_lower_bound() ? "an upper" : "a lower", " bound"),
                 "Clamp the index that depends on data, as in clamp(index, 0, extent - 1), or "
                 "promise its range with unsafe_promise_clamped");
    }
  }

  Stmt emit_query_or_run() const {
    Expr any_query = const_false();
    std::vector<Stmt> answers, run;
    for (const LoweredArgument& arg : args_) {
      if (!arg.is_buffer()) continue;
      Box box = required_box(arg);
      check_bounded(arg, box);
      Expr is_query = call_op(Op::buffer_is_query, Bool(), {handle_of(arg.name)});
      any_query = any_query || is_query;
      answers.push_back(make_if(is_query, answer(arg, box)));
      add_promise_checks(arg, box, run);
      add_constraint_checks(arg, run);
    }
    return_if_outputs_are_empty(run);
    for (const LoweredArgument& arg : args_) {
      if (arg.is_buffer()) add_region_checks(arg, required_box(arg), run);
    }
    add_requirements(run);
    for (Stmt& sizes : schedule_checks(program_)) run.push_back(std::move(sizes));
    run.push_back(root_.loops);
    return make_if(any_query, make_block(answers), make_block(run));
  }

  // Returns if every output is empty. The regions of inputs do not matter then: loops that do not run may appear to
  // read any box, for example clamp(x, 0, extent - 1) reads 0.
  void return_if_outputs_are_empty(std::vector<Stmt>& checks) const {
    Expr has_output = const_false();
    for (const LoweredArgument& arg : args_) {
      if (arg.kind != LoweredArgument::Kind::OutputBuffer) continue;
      Expr has_elements = const_true();
      for (int d = 0; d < arg.dimensions; d++)
        has_elements = has_elements && variable(fact(arg.name, "extent", d)) > 0;
      has_output = has_output || has_elements;
    }
    has_output = simplify(has_output);
    if (!is_const_true(has_output)) checks.push_back(make_assert(has_output, 0));
  }

  void add_requirements(std::vector<Stmt>& checks) const {
    for (const LoopedFunc& f : program_.funcs) {
      if (!f.is_output) continue;
      for (const Requirement& r : f.func->requirements) {
        std::vector<Expr> parts{Expr(int32_t{retrograde_error_requirement_failed})};
        parts.insert(parts.end(), r.message.begin(), r.message.end());
        checks.push_back(make_assert(r.condition, call_op(Op::error, Int(32), std::move(parts))));
      }
    }
  }

  // Answers a bounds query with the required region, except where the user promised the shape. A promise that mentions
  // the buffer itself refers to the required region. Strides are those of a dense buffer.
  Stmt answer(const LoweredArgument& arg, const Box& box) const {
    Substitution needed;
    for (size_t d = 0; d < box.size(); d++) {
      const int dimension = static_cast<int>(d);
      needed[fact(arg.name, "min", dimension)] = box[d].min;
      needed[fact(arg.name, "extent", dimension)] = simplify(box[d].max - box[d].min + 1);
    }
    const auto said = [&](const Expr& promise) {
      return substitute(substitute(promise, needed), actual_);
    };
    std::vector<Expr> sides;
    Expr stride = 1;
    for (size_t d = 0; d < box.size(); d++) {
      const int dimension = static_cast<int>(d);
      const BufferConstraint promised = constraint_of(arg, dimension);
      const Expr min = promised.min.defined() ? said(promised.min) : box[d].min;
      const Expr extent =
          promised.extent.defined() ? said(promised.extent) : simplify(box[d].max - min + 1);
      needed[fact(arg.name, "stride", dimension)] = stride;
      if (promised.stride.defined()) stride = said(promised.stride);
      needed[fact(arg.name, "stride", dimension)] = stride;
      for (const Expr& side : {min, extent, stride}) sides.push_back(cast(Int(32), side));
      stride = stride * extent;
    }
    if (sides.empty()) return make_evaluate(0);
    return make_evaluate(call_runtime(
        "retrograde_answer_query",
        {handle_of(arg.name), Expr(static_cast<int32_t>(box.size())), pack(std::move(sides))}));
  }

  // Checks that a promised region contains the used one, which can be done before looking at the buffer.
  void add_promise_checks(const LoweredArgument& arg, const Box& box,
                          std::vector<Stmt>& checks) const {
    auto param = std::dynamic_pointer_cast<ParameterContents>(arg.symbol.lock());
    if (param && param->is_literal) return;
    for (size_t d = 0; d < box.size(); d++) {
      const BufferConstraint promised = promise_of(arg, static_cast<int>(d));
      if (!promised.min.defined() && !promised.extent.defined()) continue;
      const Expr min = promised.min.defined() ? promised.min : box[d].min;
      Expr holds = min <= box[d].min;
      if (promised.extent.defined()) holds = holds && box[d].max < min + promised.extent;
      holds = simplify(holds);
      if (is_const_true(holds)) continue;
      checks.push_back(run_time_check(
          holds, retrograde_error_constraints_make_required_region_smaller,
          text("cannot run: a promised region must contain the region that is used; ",
               quoted(arg.name), " is used over ["),
          box[d].min, Expr(", "), box[d].max,
          text("] in dimension ", d,
               ", but its min is promised"
               " to be "),
          min, Expr(" and its extent "),
          promised.extent.defined() ? promised.extent : Expr("whatever it is"),
          Expr(". Promise a larger region, or lift the promise.")));
    }
  }

  // Checks the memory, the density and the region of the buffer by a runtime call; an empty box is compared by its
  // numbers. If the region is promised, the promise must contain it instead.
  void add_region_checks(const LoweredArgument& arg, const Box& box,
                         std::vector<Stmt>& checks) const {
    std::vector<Expr> sides;
    std::vector<Stmt> facts, of_promises;
    int32_t dimensions = 0;  // bit set of the dimensions to check
    for (size_t d = 0; d < box.size(); d++) {
      const int dimension = static_cast<int>(d);
      const Expr min = variable(fact(arg.name, "min", dimension)),
                 extent = variable(fact(arg.name, "extent", dimension));
      const Expr inside = simplify(min <= box[d].min && box[d].max <= min + extent - 1);
      if (is_const_true(inside)) continue;
      const BufferConstraint promised = constraint_of(arg, dimension);
      if (promised.min.defined() || promised.extent.defined() || d >= 31) {
        of_promises.push_back(box_check(arg, box[d], dimension, inside));
        continue;
      }
      dimensions |= 1 << d;
      sides.push_back(cast(Int(32), box[d].min));
      sides.push_back(cast(Int(32), box[d].max));
      facts.push_back(known_fact(inside));
    }
    checks.push_back(call_check(
        check_region, {handle_of(arg.name), Expr(arg.name), Expr(region_rules(arg)),
                       Expr(promised_alignment(arg)), Expr(dimensions), pack(std::move(sides))}));
    checks.insert(checks.end(), facts.begin(), facts.end());
    checks.insert(checks.end(), of_promises.begin(), of_promises.end());
  }

  int32_t region_rules(const LoweredArgument& arg) const {
    const bool is_output = arg.kind == LoweredArgument::Kind::OutputBuffer;
    return (is_output ? retrograde_region_is_written : 0) |
           (is_dense(arg) ? retrograde_region_is_dense : 0) |
           (has_device_ ? retrograde_region_on_device : 0);
  }
  static Stmt box_check(const LoweredArgument& arg, const Interval& used, int d,
                        const Expr& inside) {
    const char* verb = arg.kind == LoweredArgument::Kind::OutputBuffer ? "written" : "read";
    const Expr min = variable(fact(arg.name, "min", d)),
               extent = variable(fact(arg.name, "extent", d));
    return run_time_check(
        inside, retrograde_error_access_out_of_bounds,
        text("cannot run: every access must lie inside its buffer; ", quoted(arg.name), " is ",
             verb, " over ["),
        used.min, Expr(", "), used.max, text("] in dimension ", d, ", but the buffer covers ["),
        min, Expr(", "), min + extent - 1,
        Expr("]. Pass a larger buffer, clamp the access, or use a boundary condition."));
  }

  void add_constraint_checks(const LoweredArgument& arg, std::vector<Stmt>& checks) const {
    for (int d = 0; d < arg.dimensions; d++) {
      BufferConstraint promised = promise_of(arg, d);
      add_constraint_check(arg, "min", d, promised.min, checks);
      add_constraint_check(arg, "extent", d, promised.extent, checks);
      if (d > 0 || !is_dense(arg)) add_constraint_check(arg, "stride", d, promised.stride, checks);
    }
  }

  static Expr actual_fact(const LoweredArgument& arg, const char* what, int d) {
    return variable(fact(arg.name, what, d) + ".actual");
  }

  // Whether the stride is irrelevant because there is at most one element. Array libraries set such strides
  // arbitrarily.
  Expr has_one_element_at_most(const LoweredArgument& arg, int d) const {
    return variable(fact(arg.name, "extent", d)) <= 1;
  }

  void add_constraint_check(const LoweredArgument& arg, const char* what, int d,
                            const Expr& promised, std::vector<Stmt>& checks) const {
    if (!promised.defined()) return;
    const Expr actual = actual_fact(arg, what, d);
    Expr holds = actual == promised;
    if (what == std::string("stride")) holds = holds || has_one_element_at_most(arg, d);
    checks.push_back(run_time_check(holds, retrograde_error_constraint_violated,
                                    text("cannot run: the ", what, " of dimension ", d, " of ",
                                         quoted(arg.name), " was promised to be "),
                                    promised, Expr(", but it is "), actual,
                                    text(". Pass such a buffer, or lift the promise with dim(", d,
                                         ").set_", what, "(Expr()).")));
  }
};

}  // namespace

bool is_check_by_runtime(const Stmt& s) {
  const auto* let = s.as<LetStmt>();
  const auto* call = let ? as_op(let->value, Op::runtime_call) : nullptr;
  if (!call || !let->body.as<Assert>()) return false;
  const std::string& function = call->args[0].as<StringImm>()->value;
  return function == check_shape || function == check_region;
}

Stmt add_argument_checks(const Stmt& s, const std::vector<LoweredArgument>& args,
                         const Program& program, bool has_device) {
  return Checks(split_root(s), args, program, has_device).build();
}

}  // namespace retrograde::lower
