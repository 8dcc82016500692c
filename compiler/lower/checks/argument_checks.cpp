#include "lower/checks/argument_checks.h"

#include "diagnostics/error.h"
#include "ir/build.h"
#include "lower/checks/bounds_query.h"
#include "lower/checks/buffer_checks.h"
#include "lower/checks/promise_checks.h"
#include "lower/checks/run_time_check.h"
#include "lower/checks/schedule_checks.h"
#include "lower/checks/shape_facts.h"
#include "lower/nests/root_statement.h"
#include "retrograde_runtime.h"
#include "simplify/simplify.h"

namespace retrograde::lower {
namespace {

void add_scalar_checks(const LoweredArgument& arg, std::vector<Stmt>& checks) {
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

void check_read_is_bounded(const LoweredArgument& arg, const Box& box) {
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

void add_requirements(const Program& program, std::vector<Stmt>& checks) {
  for (const LoopedFunc& f : program.funcs) {
    if (!f.is_output) continue;
    for (const Requirement& r : f.func->requirements) {
      std::vector<Expr> parts{Expr(int32_t{retrograde_error_requirement_failed})};
      parts.insert(parts.end(), r.message.begin(), r.message.end());
      checks.push_back(make_assert(r.condition, call_op(Op::error, Int(32), std::move(parts))));
    }
  }
}

// The order of the checks.
class Checks {
 public:
  Checks(const RootStatement& root, const std::vector<LoweredArgument>& args,
         const Program& program, bool has_device)
      : root_(root), args_(args), program_(program), has_device_(has_device), facts_(args) {}

  Stmt build() {
    std::vector<Stmt> shape_checks;
    for (const LoweredArgument& arg : args_) {
      if (arg.is_buffer()) add_shape_check(arg, shape_checks);
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
    body = make_lets(facts_.lets(), make_block(fact_checks));
    shape_checks.push_back(body);
    return make_block(shape_checks);
  }

 private:
  // The box that a buffer must contain; sides are undefined if nothing of it is used.
  Box required_box(const LoweredArgument& arg) const {
    return value_or(root_.regions, arg.name, Box{});
  }

  Stmt emit_query_or_run() const {
    Expr any_query = const_false();
    std::vector<Stmt> answers, run;
    for (const LoweredArgument& arg : args_) {
      if (!arg.is_buffer()) continue;
      Box box = required_box(arg);
      check_read_is_bounded(arg, box);
      Expr is_query = asks_for_bounds(arg);
      any_query = any_query || is_query;
      answers.push_back(make_if(is_query, answer_query(arg, box, facts_)));
      add_promise_checks(arg, box, facts_, run);
      add_constraint_checks(arg, facts_, run);
    }
    return_if_outputs_are_empty(run);
    for (const LoweredArgument& arg : args_) {
      if (arg.is_buffer()) add_region_checks(arg, required_box(arg), has_device_, run);
    }
    add_requirements(program_, run);
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
        has_elements = has_elements && fact(arg, Metadata::Extent, d) > 0;
      has_output = has_output || has_elements;
    }
    has_output = simplify(has_output);
    if (!is_const_true(has_output)) checks.push_back(make_assert(has_output, 0));
  }

  const RootStatement& root_;
  const std::vector<LoweredArgument>& args_;
  const Program& program_;
  const bool has_device_;
  const ShapeFacts facts_;
};

}  // namespace

Stmt add_argument_checks(const Stmt& s, const std::vector<LoweredArgument>& args,
                         const Program& program, bool has_device) {
  return Checks(split_root(s), args, program, has_device).build();
}

}  // namespace retrograde::lower
