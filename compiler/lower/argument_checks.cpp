#include "lower/argument_checks.h"

#include <HalideRuntime.h>

#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "lower/schedule_checks.h"
#include "retrograde_runtime.h"
#include "simplify/simplify.h"

namespace retrograde::ir {
namespace {

Expr handle_of(const std::string& buffer) { return variable(buffer + ".buffer", Handle()); }

std::string fact(const std::string& buffer, const char* what, int d) {
  return buffer + "." + what + "." + std::to_string(d);
}

template <class... Parts>
Stmt check(Expr holds, int code, Parts&&... message) {
  return make_assert(
      std::move(holds),
      call_op(Op::error, Int(32), {Expr(int32_t{code}), Expr(std::forward<Parts>(message))...}));
}

class Checks {
 public:
  Checks(const LoopNests& nests, const std::vector<LoweredArgument>& args, const Program& program)
      : nests_(nests), args_(args), program_(program), actual_(names_of_actual_facts()) {}

  Stmt build() {
    std::vector<Stmt> shape_checks;
    for (const LoweredArgument& arg : args_) {
      if (arg.is_buffer()) add_shape_checks(arg, shape_checks);
    }
    Stmt body = make_block({query_or_run()});
    body = bind(nests_.bounds, body);
    std::vector<Stmt> fact_checks;
    for (const LoweredArgument& arg : args_) {
      if (arg.is_buffer()) {
        add_extent_checks(arg, fact_checks);
      } else {
        add_scalar_checks(arg, fact_checks);
      }
    }
    fact_checks.push_back(body);
    body = bind(buffer_facts(), make_block(fact_checks));
    shape_checks.push_back(body);
    return make_block(shape_checks);
  }

 private:
  const LoopNests& nests_;
  const std::vector<LoweredArgument>& args_;
  const Program& program_;
  const Substitution actual_;
  using Bindings = std::vector<std::pair<std::string, Expr>>;

  static Stmt bind(const Bindings& bindings, Stmt body) {
    for (auto it = bindings.rbegin(); it != bindings.rend(); ++it)
      body = make_let(it->first, it->second, body);
    return body;
  }

  // Where a fact was promised, the code below uses the promise, and the check compares it with the
  // ".actual" fact.
  Bindings buffer_facts() const {
    Bindings facts, promises;
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
                       const Expr& promised, Bindings& facts, Bindings& promises) {
    std::string name = fact(arg.name, what, d);
    Expr actual = call_op(op, Int(32), {handle_of(arg.name), d});
    facts.emplace_back(promised.defined() ? name + ".actual" : name, actual);
    if (promised.defined()) promises.emplace_back(name, promised);
  }

  // What the user promised; of a buffer that is named in the program: what it is. Dimension 0 is
  // dense unless the user says otherwise.
  static BufferConstraint constraint_of(const LoweredArgument& arg, int d) {
    auto param = std::dynamic_pointer_cast<ParameterContents>(arg.symbol.lock());
    BufferConstraint promised;
    if (param && d < static_cast<int>(param->constraints.size())) promised = param->constraints[d];
    if (d == 0 && !promised.stride.defined() && !promised.any_stride) promised.stride = 1;
    if (param && param->is_literal && param->buffer) {
      const halide_dimension_t& dim = param->buffer->dim[d];
      promised.min = dim.min;
      promised.extent = dim.extent;
      promised.stride = dim.stride;
    }
    return promised;
  }

  // The promise in terms of what the buffers are: it may speak of facts that are promised, too, its
  // own among them, as "a multiple of 8" does.
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
        const auto add = [&](const char* what, const Expr& promise) {
          if (promise.defined())
            names[fact(arg.name, what, d)] = variable(fact(arg.name, what, d) + ".actual");
        };
        add("min", promised.min);
        add("extent", promised.extent);
        add("stride", promised.stride);
      }
    }
    return names;
  }

  static void add_shape_checks(const LoweredArgument& arg, std::vector<Stmt>& checks) {
    Expr handle = handle_of(arg.name);
    std::string name = quoted(arg.name);
    checks.push_back(check(
        !call_op(Op::buffer_is_null, Bool(), {handle}), retrograde_error_buffer_argument_is_null,
        text("cannot run: the buffer argument ", name,
             " is null. Pass a halide_buffer_t (with a null host to ask for bounds).")));
    const Expr type = call_op(Op::buffer_type, UInt(32), {handle});
    const auto byte = [&](int place) { return cast(Int(32), type / place % 256); };
    checks.push_back(
        check(type == make_uint_const(UInt(32), type_word(arg.type)), retrograde_error_bad_type,
              text("cannot run: the buffer ", name, " must have elements of type ",
                   to_string(arg.type), ", but its elements are of the kind "),
              byte(1), Expr(" (0: int, 1: uint, 2: float, 3: handle, 4: bfloat) with "), byte(256),
              text(" bits. Pass a buffer of ", to_string(arg.type), ".")));
    Expr dimensions = call_op(Op::buffer_dimensions, Int(32), {handle});
    checks.push_back(check(dimensions == arg.dimensions, retrograde_error_bad_dimensions,
                           text("cannot run: the buffer ", name, " must have ", arg.dimensions,
                                " dimensions, but it has "),
                           dimensions,
                           Expr(". Pass a buffer with as many dimensions as the pipeline uses.")));
  }

  // Index arithmetic is 32 bits: a buffer's elements must be addressable in it.
  static void add_extent_checks(const LoweredArgument& arg, std::vector<Stmt>& checks) {
    Expr elements = make_const(Int(64), 1);
    for (int d = 0; d < arg.dimensions; d++) {
      Expr extent = call_op(Op::buffer_extent, Int(32), {handle_of(arg.name), d});
      checks.push_back(check(extent >= 0, retrograde_error_extents_negative,
                             text("cannot run: extents must not be negative; dimension ", d,
                                  " of the buffer ", quoted(arg.name), " has extent "),
                             extent, Expr(". Pass the extent that the data has.")));
      elements = elements * cast(Int(64), extent);
      Expr fits = elements <= make_const(Int(64), int64_t{0x7fffffff});
      checks.push_back(check(fits, retrograde_error_extents_too_large,
                             text("cannot run: a buffer may have at most 2147483647 elements; ",
                                  quoted(arg.name), " has at least "),
                             elements, Expr(". Process it in tiles.")));
    }
  }

  // The data are on the host, where they are promised to be.
  static void add_memory_checks(const LoweredArgument& arg, std::vector<Stmt>& checks) {
    const Expr handle = handle_of(arg.name);
    const Expr host = reinterpret_as(UInt(64), call_op(Op::buffer_host, Handle(), {handle}));
    const Expr zero = make_zero(UInt(64));
    Expr has_elements = const_true();
    for (int d = 0; d < arg.dimensions; d++)
      has_elements = has_elements && call_op(Op::buffer_extent, Int(32), {handle, d}) > 0;
    checks.push_back(check(
        host != zero || !has_elements, retrograde_error_host_is_null,
        text("cannot run: data must be in memory of the host; the host pointer of "
             "the buffer ",
             quoted(arg.name), " is null, and it is on a device. Copy it to the host first.")));
    if (arg.kind == LoweredArgument::Kind::InputBuffer) {
      const Expr is_dirty =
          call_op(Op::runtime_call, Int(32), {Expr("retrograde_buffer_device_dirty"), handle});
      checks.push_back(check(
          is_dirty == 0, retrograde_error_device_dirty_with_no_device_support,
          text("cannot run: data must be in memory of the host; the buffer ", quoted(arg.name),
               " says that the newer copy is on a device. Copy it to the host first.")));
    }
    auto param = std::dynamic_pointer_cast<ParameterContents>(arg.symbol.lock());
    if (!param || param->host_alignment <= arg.type.bytes()) return;
    const Expr alignment = make_uint_const(UInt(64), static_cast<uint64_t>(param->host_alignment));
    checks.push_back(check(host % alignment == zero, retrograde_error_unaligned_host_ptr,
                           text("cannot run: the address of the buffer ", quoted(arg.name),
                                " was promised to be a multiple of ", param->host_alignment,
                                ", but its remainder is "),
                           host % alignment, Expr(". Pass aligned memory, or lift the promise.")));
  }

  // Distances between elements, in elements: extents may be small and strides large.
  static void add_span_checks(const LoweredArgument& arg, std::vector<Stmt>& checks) {
    Expr span = make_const(Int(64), 0);
    for (int d = 0; d < arg.dimensions; d++) {
      const auto wide = [&](Op op) {
        return cast(Int(64), call_op(op, Int(32), {handle_of(arg.name), d}));
      };
      const Expr stride = wide(Op::buffer_stride);
      span = span + max(wide(Op::buffer_extent) - 1, 0) * max(stride, -stride);
      checks.push_back(check(span <= make_const(Int(64), int64_t{0x7fffffff}),
                             retrograde_error_allocation_too_large,
                             text("cannot run: the elements of a buffer lie at most 2147483647 "
                                  "elements apart; those of ",
                                  quoted(arg.name), " lie up to "),
                             span,
                             text(" apart, by its extents and strides up to dimension ", d,
                                  ". Process it in tiles.")));
    }
  }

  static void add_scalar_checks(const LoweredArgument& arg, std::vector<Stmt>& checks) {
    auto param = std::dynamic_pointer_cast<ParameterContents>(arg.symbol.lock());
    if (!param) return;
    Expr value = variable(arg.name, arg.type);
    if (param->min_value.defined()) {
      checks.push_back(check(value >= param->min_value, retrograde_error_param_too_small,
                             text("cannot run: the parameter ", quoted(arg.name), " is "), value,
                             Expr(", below its minimum "), param->min_value,
                             Expr(". Pass a value in its range.")));
    }
    if (param->max_value.defined()) {
      checks.push_back(check(value <= param->max_value, retrograde_error_param_too_large,
                             text("cannot run: the parameter ", quoted(arg.name), " is "), value,
                             Expr(", above its maximum "), param->max_value,
                             Expr(". Pass a value in its range.")));
    }
  }

  // The box that a buffer must contain; undefined sides where nothing of it is used.
  Box required_box(const LoweredArgument& arg) const {
    if (arg.kind == LoweredArgument::Kind::OutputBuffer) {
      for (const LoopedFunc& f : program_.funcs) {
        for (size_t i = 0; i < f.func->types.size(); i++) {
          if (f.is_output && value_buffer_name(*f.func, static_cast<int>(i)) == arg.name)
            return nests_.outputs.at(f.name());
        }
      }
    }
    auto it = nests_.images.find(arg.name);
    return it == nests_.images.end() ? Box{} : it->second.box;
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

  Stmt query_or_run() const {
    Expr any_query = const_false();
    std::vector<Stmt> answers, run;
    for (const LoweredArgument& arg : args_) {
      if (!arg.is_buffer()) continue;
      Box box = required_box(arg);
      check_bounded(arg, box);
      Expr is_query = call_op(Op::buffer_is_query, Bool(), {handle_of(arg.name)});
      any_query = any_query || is_query;
      answers.push_back(make_if(is_query, answer(arg, box)));
      add_memory_checks(arg, run);
      add_span_checks(arg, run);
      add_promise_checks(arg, box, run);
      add_constraint_checks(arg, run);
    }
    return_if_nothing_is_asked(run);
    for (const LoweredArgument& arg : args_) {
      if (arg.is_buffer()) add_box_checks(arg, required_box(arg), run);
    }
    add_requirements(run);
    for (Stmt& sizes : schedule_checks(program_)) run.push_back(std::move(sizes));
    run.push_back(nests_.body);
    return make_if(any_query, make_block(answers), make_block(run));
  }

  // Where every output is empty nothing runs, and what would be read does not matter: the box read by
  // loops that do not run may lie anywhere, that of clamp(x, 0, extent - 1) at 0.
  void return_if_nothing_is_asked(std::vector<Stmt>& checks) const {
    Expr is_asked = const_false();
    for (const LoweredArgument& arg : args_) {
      if (arg.kind != LoweredArgument::Kind::OutputBuffer) continue;
      Expr has_elements = const_true();
      for (int d = 0; d < arg.dimensions; d++)
        has_elements = has_elements && variable(fact(arg.name, "extent", d)) > 0;
      is_asked = is_asked || has_elements;
    }
    is_asked = simplify(is_asked);
    if (!is_const_true(is_asked)) checks.push_back(make_assert(is_asked, 0));
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

  // What is needed, but where the user promised what it is. A promise that speaks of the buffer
  // itself means what is needed of it.
  Stmt answer(const LoweredArgument& arg, const Box& box) const {
    const Expr handle = handle_of(arg.name);
    Substitution needed;
    for (size_t d = 0; d < box.size(); d++) {
      const int dimension = static_cast<int>(d);
      needed[fact(arg.name, "min", dimension)] = box[d].min;
      needed[fact(arg.name, "extent", dimension)] = simplify(box[d].max - box[d].min + 1);
      needed[fact(arg.name, "stride", dimension)] =
          call_op(Op::buffer_stride, Int(32), {handle, dimension});
    }
    const auto said = [&](const Expr& promise) {
      return substitute(substitute(promise, needed), actual_);
    };
    std::vector<Stmt> sets;
    for (size_t d = 0; d < box.size(); d++) {
      const int dimension = static_cast<int>(d);
      const BufferConstraint promised = constraint_of(arg, dimension);
      const Expr min = promised.min.defined() ? said(promised.min) : box[d].min;
      const Expr extent =
          promised.extent.defined() ? said(promised.extent) : simplify(box[d].max - min + 1);
      sets.push_back(
          make_evaluate(call_op(Op::buffer_set_bounds, Int(32), {handle, dimension, min, extent})));
      if (!promised.stride.defined() || (d == 0 && is_one(promised.stride))) continue;
      sets.push_back(make_evaluate(call_op(
          Op::runtime_call, Int(32),
          {Expr("retrograde_buffer_set_stride"), handle, dimension, said(promised.stride)})));
    }
    return sets.empty() ? make_evaluate(0) : make_block(sets);
  }

  // A region that was promised must hold what is used: this is known before any buffer is.
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
      checks.push_back(
          check(holds, retrograde_error_constraints_make_required_region_smaller,
                text("cannot run: what is promised of a buffer must hold what is used of it; ",
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

  // An empty buffer fits an empty box only by the numbers.
  static void add_box_checks(const LoweredArgument& arg, const Box& box,
                             std::vector<Stmt>& checks) {
    const char* verb = arg.kind == LoweredArgument::Kind::OutputBuffer ? "written" : "read";
    for (size_t d = 0; d < box.size(); d++) {
      Expr min = variable(fact(arg.name, "min", d)), extent = variable(fact(arg.name, "extent", d));
      Expr inside = simplify(min <= box[d].min && box[d].max <= min + extent - 1);
      if (is_const_true(inside)) continue;
      checks.push_back(
          check(inside, retrograde_error_access_out_of_bounds,
                text("cannot run: every access must lie inside its buffer; ", quoted(arg.name),
                     " is ", verb, " over ["),
                box[d].min, Expr(", "), box[d].max,
                text("] in dimension ", d, ", but the buffer covers ["), min, Expr(", "),
                min + extent - 1,
                Expr("]. Pass a larger buffer, clamp the access, or use a boundary condition.")));
    }
  }

  void add_constraint_checks(const LoweredArgument& arg, std::vector<Stmt>& checks) const {
    for (int d = 0; d < arg.dimensions; d++) {
      BufferConstraint promised = promise_of(arg, d);
      add_constraint_check(arg, "min", d, promised.min, checks);
      add_constraint_check(arg, "extent", d, promised.extent, checks);
      add_constraint_check(arg, "stride", d, promised.stride, checks);
    }
  }

  static void add_constraint_check(const LoweredArgument& arg, const char* what, int d,
                                   const Expr& promised, std::vector<Stmt>& checks) {
    if (!promised.defined()) return;
    Expr actual = variable(fact(arg.name, what, d) + ".actual");
    checks.push_back(check(actual == promised, retrograde_error_constraint_violated,
                           text("cannot run: the ", what, " of dimension ", d, " of ",
                                quoted(arg.name), " was promised to be "),
                           promised, Expr(", but it is "), actual,
                           text(". Pass such a buffer, or lift the promise with dim(", d, ").set_",
                                what, "(Expr()).")));
  }
};

}  // namespace

Stmt add_argument_checks(const LoopNests& nests, const std::vector<LoweredArgument>& args,
                         const Program& program) {
  return Checks(nests, args, program).build();
}

}  // namespace retrograde::ir
