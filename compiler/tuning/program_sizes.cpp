#include "tuning/program_sizes.h"

#include <HalideRuntime.h>

#include <cstdlib>

#include "diagnostics/error.h"
#include "graph/definitions/parameter_contents.h"
#include "ir/build.h"
#include "simplify/simplify.h"
#include "transform/size_estimate.h"

namespace retrograde::tuning {

double BufferShape::bytes() const {
  double last = 1;
  for (const Dim& dim : dims)
    last += static_cast<double>(std::llabs(dim.stride)) * static_cast<double>(dim.extent - 1);
  return last * element_bytes;
}

BufferShape shape_of(const halide_buffer_t& buffer) {
  BufferShape shape;
  shape.element_bytes = buffer.type.bytes();
  for (int d = 0; d < buffer.dimensions; d++)
    shape.dims.push_back({buffer.dim[d].min, buffer.dim[d].extent, buffer.dim[d].stride});
  return shape;
}

namespace {

// Of a dimension of which nothing is known.
int64_t guessed_extent(size_t dimension) { return dimension < 2 ? 1024 : 4; }

// Elements one after the other.
void make_dense(BufferShape& shape) {
  int64_t stride = 1;
  for (BufferShape::Dim& dim : shape.dims) {
    dim.stride = stride;
    stride *= dim.extent;
  }
}

std::optional<int64_t> constant_of(const Expr& e) {
  return e.defined() ? as_const_int(simplification::simplify(e)) : std::nullopt;
}

BufferShape input_shape(const ParameterContents& image, const BufferShape& output) {
  if (image.buffer) return shape_of(*image.buffer);
  BufferShape shape;
  shape.element_bytes = image.type.bytes();
  shape.dims.resize(static_cast<size_t>(image.dimensions));
  for (size_t d = 0; d < shape.dims.size(); d++) {
    const BufferConstraint known =
        d < image.constraints.size() ? image.constraints[d] : BufferConstraint();
    const int64_t guess = d < output.dims.size() ? output.dims[d].extent : guessed_extent(d);
    const auto either = [](const Expr& a, const Expr& b) {
      return constant_of(a) ? constant_of(a) : constant_of(b);
    };
    shape.dims[d].min = either(known.min, known.min_estimate).value_or(0);
    shape.dims[d].extent = either(known.extent, known.extent_estimate).value_or(guess);
  }
  make_dense(shape);
  return shape;
}

double scalar_value(const ParameterContents& scalar) {
  if (scalar.value) return scalar.value->as_double();
  const auto estimate = scalar.estimate.defined()
                            ? as_scalar(simplification::simplify(scalar.estimate))
                            : std::nullopt;
  return estimate ? estimate->as_double() : 0;
}

void check_sizes_given(const std::vector<FuncPtr>& outputs,
                       const std::vector<std::vector<int>>& sizes) {
  const auto fits = [](const FuncPtr& f, const std::vector<int>& of) {
    return static_cast<int>(of.size()) == f->dimensions();
  };
  bool fitting = sizes.size() <= 1 || sizes.size() == outputs.size();
  for (size_t i = 0; i < outputs.size() && fitting && !sizes.empty(); i++)
    fitting = fits(outputs[i], sizes[sizes.size() == 1 ? 0 : i]);
  if (fitting) return;
  user_error("predict the time of " +
                 listed(outputs, [](const FuncPtr& f) { return retrograde::quoted(f->name); }),
             "sizes are given once for all outputs, or for each, one for each dimension",
             text(sizes.size(), " lists of sizes were given for ", outputs.size(), " outputs"),
             "Give sizes as realize takes them, or none and set estimates");
}

}  // namespace

std::vector<BufferShape> output_shapes(const std::vector<FuncPtr>& outputs,
                                       const std::vector<std::vector<int>>& sizes) {
  check_sizes_given(outputs, sizes);
  const transform::SizeEstimate estimate(outputs);
  std::vector<BufferShape> shapes;
  for (size_t i = 0; i < outputs.size(); i++) {
    const FuncContents& f = *outputs[i];
    for (const Type& type : f.types) {
      BufferShape shape;
      shape.element_bytes = type.bytes();
      for (size_t d = 0; d < f.args.size(); d++) {
        const int64_t known = estimate.extent(f, d).value_or(guessed_extent(d));
        const int64_t extent = sizes.empty() ? known : sizes[sizes.size() == 1 ? 0 : i][d];
        shape.dims.push_back({0, std::max<int64_t>(extent, 0), 1});
      }
      make_dense(shape);
      shapes.push_back(std::move(shape));
    }
  }
  return shapes;
}

ProgramSizes program_sizes(const LoweredFunction& function,
                           const std::vector<BufferShape>& outputs) {
  ProgramSizes result;
  size_t next = 0;
  for (const LoweredArgument& arg : function.args) {
    if (arg.kind == LoweredArgument::Kind::OutputBuffer) {
      result.buffers[arg.name] = outputs.at(next++);
      continue;
    }
    const auto parameter = std::dynamic_pointer_cast<ParameterContents>(arg.symbol.lock());
    if (arg.is_buffer()) {
      const BufferShape like = outputs.empty() ? BufferShape() : outputs.front();
      result.buffers[arg.name] = input_shape(parameter ? *parameter : ParameterContents(), like);
    } else {
      result.scalars[arg.name] = parameter ? scalar_value(*parameter) : 0;
    }
  }
  return result;
}

}  // namespace retrograde::tuning
