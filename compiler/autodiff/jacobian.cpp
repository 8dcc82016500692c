#include "autodiff/jacobian.h"

#include "autodiff/matrices/compressed.h"
#include "autodiff/matrices/flat_input.h"
#include "autodiff/rules/derivative_rules.h"
#include "autodiff/sweeps/input_shape.h"
#include "autodiff/sweeps/regions.h"
#include "autodiff/tangents.h"
#include "diagnostics/error.h"
#include "ir/build.h"
#include "ir/visit.h"
#include "simplify/simplify.h"

namespace retrograde {

namespace autodiff {

struct JacobianResult {
  std::string asked, explanation;
  bool by_rows = false;
  Colours colours;
  size_t coloured_dimensions = 0;  // dimensions of the Func that is coloured
  Func compressed, dense, band;    // band: undefined if the offsets are unbounded
  Region band_offsets;
};

}  // namespace autodiff

namespace {

using namespace autodiff;

// Zeros of the shape of an input or output: a seed that is replaced later.
Func placeholder(const std::string& name, int dimensions, Type type) {
  Func f(name);
  f(variables("x", static_cast<size_t>(dimensions))) =
      make_zero(type.is_float() ? type : Float(32));
  return f;
}

InputShape checked_input(const std::string& asked, const AdjointInput& input) {
  InputShape shape = shape_of(input.symbol().get());
  if (shape.types.empty()) {
    user_error(asked, "what to differentiate by must be defined",
               shape.name.empty() ? "it has no memory and no type"
                                  : quoted(shape.name) + " has no definition",
               "Define it first");
  }
  check_is_floating(asked, shape.types, quoted(shape.name) + " has type",
                    "Convert it to float in a Func, and differentiate by that");
  return shape;
}

// The flat elements of the input that exist and that a region of the output depends on.
Box box_of_input(const Func& output, const Box& region, const AdjointInput& input,
                 const InputShape& shape) {
  Regions regions(topological_order({output.function()}), region);
  Box box = regions.of(input.symbol().get());
  box.resize(static_cast<size_t>(shape.dimensions));
  auto p = std::dynamic_pointer_cast<ParameterContents>(input.symbol());
  if (!p || !p->is_literal || !p->buffer) return flat(box, shape);
  for (size_t d = 0; d < box.size(); ++d) {
    const halide_dimension_t& dim = p->buffer->dim[d];
    Interval own{make_const(Int(32), dim.min), make_const(Int(32), dim.min + dim.extent - 1)};
    box[d] = intersection(box[d], own);
  }
  return flat(box, shape);
}

// ---- the two compressions, up to colours ----

struct Candidate {
  std::unique_ptr<Compressed> compressed;
  bool by_rows = false;
};

Candidate by_columns(const Func& output, const AdjointInput& input, const InputShape& shape,
                     const Box& rows, const Box& columns) {
  Func seed = placeholder(shape.name + "_seed", flat(shape).dimensions, flat(shape).types[0]);
  Func tangent = propagate_tangents(output, {{input, direction(seed, shape)}})(output);
  return {Compressed::make({.output = tangent.function(),
                            .seed = seed.function(),
                            .rows = rows,
                            .columns = columns}),
          false};
}

Candidate by_rows(const Func& output, const AdjointInput& input, const InputShape& shape,
                  const Box& rows, const Box& columns, const Region& bounds,
                  Overwritten overwritten, int64_t most) {
  Func seed = placeholder(output.name() + "_seed", output.dimensions(), output.types()[0]);
  Func adjoint =
      propagate_adjoints(output, seed, bounds, {.overwritten = overwritten, .wrt = {input}})
          .of(input);
  return {Compressed::make({.output = flat(adjoint, shape).function(),
                            .seed = seed.function(),
                            .rows = columns,
                            .columns = rows,
                            .most_colours = most}),
          true};
}

// The candidate with fewer colours; if one is not possible, the other.
Candidate best(const Func& output, const AdjointInput& input, const InputShape& shape,
               const Box& rows, const Box& columns, const Region& bounds,
               const JacobianOptions& options) {
  Candidate result;
  if (options.compression == Compression::Rows)
    return by_rows(output, input, shape, rows, columns, bounds, options.overwritten, 0);
  bool try_rows = options.compression == Compression::Auto && output.outputs() == 1;
  std::exception_ptr refused;
  try {
    result = by_columns(output, input, shape, rows, columns);
  } catch (const Unsupported&) {
    if (!try_rows) throw;
    refused = std::current_exception();
  }
  if (!try_rows || (result.compressed && result.compressed->colours().count() == 1)) return result;
  try {
    int64_t most = result.compressed ? result.compressed->colours().count() - 1 : 0;
    Candidate other =
        by_rows(output, input, shape, rows, columns, bounds, options.overwritten, most);
    if (other.compressed) return other;
  } catch (const Error&) {  // rows are no candidate if reverse mode is not supported
    if (refused) std::rethrow_exception(refused);
  }
  if (!result.compressed && refused) std::rethrow_exception(refused);
  return result;
}

// ---- from products to entries ----

struct Entries {
  const Candidate& candidate;
  Func all;  // undefined: the matrix is zero
  std::vector<Type> types;

  // d output(y) / d input(x)
  std::vector<Expr> at(const std::vector<Expr>& y, const std::vector<Expr>& x) const {
    const std::vector<Expr>& row = candidate.by_rows ? x : y;
    const std::vector<Expr>& column = candidate.by_rows ? y : x;
    std::vector<Expr> values;
    for (size_t k = 0; k < types.size(); ++k) {
      Expr zero = make_zero(types[k]);
      if (!all.defined()) {
        values.push_back(zero);
        continue;
      }
      Expr value = candidate.compressed->entry(all.function(), row, column, static_cast<int>(k));
      values.push_back(
          select(candidate.compressed->may_be_nonzero(row, column), cast(types[k], value), zero));
    }
    return values;
  }
};

void define(Func f, const std::vector<Var>& vars, const std::vector<Expr>& values) {
  if (values.size() == 1) {
    f(vars) = values[0];
  } else {
    f(vars) = Tuple(values);
  }
}

void make_band(JacobianResult& result, const Entries& entries, size_t dims,
               const std::string& name) {
  auto offsets = entries.candidate.compressed->offsets();
  if (!offsets) return;
  std::vector<Var> y = variables("y", dims), k = variables("k", dims);
  std::vector<Expr> x;
  for (size_t d = 0; d < dims; ++d) {
    auto [low, high] = (*offsets)[d];
    // For rows, the pattern is that of the transpose.
    if (entries.candidate.by_rows) std::tie(low, high) = std::tuple(-high, -low);
    result.band_offsets.push_back({static_cast<int>(low), static_cast<int>(high - low + 1)});
    x.push_back(Expr(y[d]) + static_cast<int>(low) + k[d]);
  }
  result.band = Func(name + "_band");
  define(result.band, both(y, k), entries.at(expressions(y), x));
}

std::shared_ptr<JacobianResult> result_of(const std::string& asked, const Candidate& candidate,
                                          const std::vector<Type>& types, int output_dims,
                                          int input_dims, const std::string& name) {
  auto result = std::make_shared<JacobianResult>();
  result->asked = asked;
  result->by_rows = candidate.by_rows;
  result->colours = candidate.compressed->colours();
  result->coloured_dimensions = static_cast<size_t>(candidate.by_rows ? output_dims : input_dims);
  FuncPtr all = candidate.compressed->evaluate();
  Entries entries{candidate, all ? Func(all) : Func(std::make_shared<FuncContents>()), types};
  result->compressed = entries.all;
  std::vector<Var> y = variables("y", static_cast<size_t>(output_dims)),
                   x = variables("x", static_cast<size_t>(input_dims));
  result->dense = Func(name + "_dense");
  define(result->dense, both(y, x), entries.at(expressions(y), expressions(x)));
  if (output_dims == input_dims) make_band(*result, entries, static_cast<size_t>(input_dims), name);
  result->explanation =
      all ? text(candidate.by_rows ? "adjoints" : "tangents", " for ", result->colours.count(),
                 " seeds in ", quoted(all->name), ": elements of one colour share no ",
                 candidate.by_rows ? "column" : "row", "\n")
          : "identically zero: no differentiable path leads from the input to the output\n";
  return result;
}

std::vector<Type> derivative_types(const Func& f) { return mapped(f.types(), adjoint_type); }

// ---- second derivatives ----

// The gradient by one input, and its tangent along a seed of another.
struct SecondOrder {
  Func gradient, seed, moved;
  InputShape row_shape, column_shape;  // flat
  Box rows, columns;
};
SecondOrder second_order(const std::string& asked, const Func& loss, const AdjointInput& rows,
                         const AdjointInput& columns, Overwritten overwritten) {
  SecondOrder s;
  s.row_shape = checked_input(asked, rows);
  s.column_shape = checked_input(asked, columns);
  s.gradient = propagate_adjoints(loss, {.overwritten = overwritten, .wrt = {rows}}).of(rows);
  if (!s.gradient.defined()) {
    user_error(asked, "the input is a float that the loss depends on",
               text(quoted(s.row_shape.name), " has no gradient"),
               "Differentiate by something that the loss depends on");
  }
  s.gradient = flat(s.gradient, s.row_shape);
  s.seed = placeholder(s.column_shape.name + "_seed", flat(s.column_shape).dimensions,
                       flat(s.column_shape).types[0]);
  s.moved =
      propagate_tangents(s.gradient, {{columns, direction(s.seed, s.column_shape)}})(s.gradient);
  Box point(static_cast<size_t>(loss.dimensions()), Interval::point(Expr(0)));
  s.rows = box_of_input(loss, point, rows, s.row_shape);
  s.columns = box_of_input(loss, point, columns, s.column_shape);
  s.row_shape = flat(s.row_shape);
  s.column_shape = flat(s.column_shape);
  return s;
}

// Whether the synthesized gradient is a true gradient, so that second derivatives commute. Custom rules and
// stop_gradient break this.
bool is_a_gradient(const Func& loss) {
  bool result = true;
  for (const FuncPtr& f : topological_order({loss.function()})) {
    result &= f->custom_derivatives == nullptr;
    walk(*f, [&](const Call& call) { result &= !call.is_op(Op::stop_gradient); });
  }
  return result;
}

}  // namespace

Jacobian::Jacobian(std::shared_ptr<const JacobianResult> result) : result_(std::move(result)) {}

int Jacobian::colours() const { return static_cast<int>(result_->colours.count()); }
bool Jacobian::by_rows() const { return result_->by_rows; }
Expr Jacobian::colour(const std::vector<Expr>& element) const {
  if (element.size() != result_->coloured_dimensions) {
    user_error(result_->asked, "an element has a coordinate in each dimension",
               text(element.size(), " of ", result_->coloured_dimensions, " are given"),
               "Give one Expr a dimension");
  }
  return result_->colours.of(element);
}
Func Jacobian::compressed() const { return result_->compressed; }
Func Jacobian::dense() const { return result_->dense; }
Func Jacobian::band() const {
  if (!result_->band.defined()) {
    user_error(result_->asked, "a band is made of constant offsets between output and input",
               "output and input differ in dimensions, or the pattern has entries at offsets "
               "without constant bounds",
               "Use dense(), or compressed() and colour()");
  }
  return result_->band;
}
Region Jacobian::band_offsets() const {
  band();
  return result_->band_offsets;
}
std::string Jacobian::explain() const { return result_->explanation; }

Jacobian jacobian(const Func& output, const AdjointInput& input, const Region& output_bounds,
                  const JacobianOptions& options) {
  std::string asked = "make the Jacobian of " + quoted(output.name());
  if (!output.defined() || !is_floating(output.types())) {
    user_error(
        asked, "only floating-point values that are defined have derivatives",
        output.defined() ? "its type is " + to_string(output.types()[0]) : "it has no definition",
        "Define it, with values that are floats");
  }
  if (static_cast<int>(output_bounds.size()) != output.dimensions()) {
    user_error(
        asked, "the output needs bounds in each of its dimensions",
        text("it has ", output.dimensions(), " dimensions and ", output_bounds.size(), " bounds"),
        "Give min and extent of each dimension");
  }
  if (options.compression == Compression::Rows && output.outputs() != 1) {
    unsupported(asked, "rows are compressed of an output of one value",
                text("it has ", output.outputs()), "Use Compression::Columns");
  }
  InputShape shape = checked_input(asked, input);
  Box rows = box_of(output_bounds), columns = box_of_input(output, rows, input, shape);
  Candidate candidate = best(output, input, shape, rows, columns, output_bounds, options);
  RETROGRADE_ASSERT(candidate.compressed, "a Jacobian without colours");
  return Jacobian(result_of(asked, candidate, derivative_types(output), output.dimensions(),
                            flat(shape).dimensions, output.name() + "_by_" + shape.name));
}

Jacobian hessian(const Func& loss, const AdjointInput& wrt, Overwritten overwritten) {
  return hessian(loss, wrt, wrt, overwritten);
}

Jacobian hessian(const Func& loss, const AdjointInput& rows, const AdjointInput& columns,
                 Overwritten overwritten) {
  std::string asked = "make the Hessian of " + quoted(loss.name());
  SecondOrder s = second_order(asked, loss, rows, columns, overwritten);
  bool symmetric = rows.symbol() == columns.symbol() && is_a_gradient(loss);
  Candidate candidate{Compressed::make({.output = s.moved.function(),
                                        .seed = s.seed.function(),
                                        .rows = s.rows,
                                        .columns = s.columns,
                                        .symmetric = symmetric}),
                      false};
  return Jacobian(result_of(asked, candidate, derivative_types(s.gradient), s.row_shape.dimensions,
                            s.column_shape.dimensions, loss.name() + "_hessian"));
}

// diagonal(x) = sum of H(x, x') over x' of the colour of x. Of these x', only x itself has an entry in row x.
HessianDiagonal hessian_diagonal(const Func& loss, const AdjointInput& wrt,
                                 Overwritten overwritten) {
  std::string asked = "make the diagonal of the Hessian of " + quoted(loss.name());
  SecondOrder s = second_order(asked, loss, wrt, wrt, overwritten);
  auto compressed = Compressed::make({.output = s.moved.function(),
                                      .seed = s.seed.function(),
                                      .rows = s.rows,
                                      .columns = s.rows,
                                      .diagonal_only = true});
  HessianDiagonal result;
  result.colours = static_cast<int>(compressed->colours().count());
  FuncPtr all = compressed->evaluate();
  result.compressed = all ? Func(all) : Func(std::make_shared<FuncContents>());
  result.diagonal = Func(loss.name() + "_hessian_diagonal");
  std::vector<Var> x = variables("x", static_cast<size_t>(s.row_shape.dimensions));
  std::vector<Expr> place = expressions(x);
  place.push_back(compressed->colours().of(expressions(x)));
  result.diagonal(x) =
      all ? Expr(result.compressed(place)) : make_zero(derivative_types(s.gradient)[0]);
  return result;
}

}  // namespace retrograde
