// image_param.cpp -- image parameters, and promises about the shapes of buffers.
#include "frontend/data/image_param.h"

#include <algorithm>

#include "frontend/language/func.h"
#include "graph/definitions/define.h"
#include "graph/definitions/definition_rules.h"
#include "graph/directives/wrappers.h"
#include "ir/buffer_metadata.h"
#include "ir/literal.h"
#include "ir/print.h"
#include "ir/visit.h"

namespace retrograde {

namespace {

std::shared_ptr<graph::ParameterContents> make_parameter(Type type, int dimensions,
                                                         const std::string& name) {
  const std::string asked = "make the ImageParam " + quoted(name);
  if (!type.is_scalar() || type.bits() == 0) {
    user_error(asked, "its elements are numbers or pointers", "the type is " + to_string(type),
               "Give a type of scalars");
  }
  if (dimensions < 0)
    user_error(asked, "dimensions are not negative", text("they are ", dimensions),
               "Give 0 or more");
  auto result = std::make_shared<graph::ParameterContents>();
  result->name = name;
  result->type = type;
  result->is_buffer = true;
  result->dimensions = dimensions;
  result->constraints.resize(dimensions);
  return result;
}

Expr as_size(const Expr& e, const std::string& asked) {
  if (!e.defined()) return e;
  if (!e.type().is_int_or_uint() || !e.type().is_scalar()) {
    user_error(asked, "sizes and strides are integers", text(e, " has type ", to_string(e.type())),
               "Convert it: cast<int>(...)");
  }
  return ir::int32_literal(e, asked);
}

Expr metadata_of(const std::shared_ptr<graph::ParameterContents>& buffer, ir::Metadata what,
                 int d) {
  return ir::variable(ir::metadata_name(buffer->name, what, static_cast<size_t>(d)), Int(32),
                      ir::SymbolRef(buffer));
}

}  // namespace

Dimension::Dimension(std::shared_ptr<graph::ParameterContents> parameter, int d)
    : parameter_(std::move(parameter)), d_(d) {
  if (d_ >= 0 && d_ < parameter_->dimensions) return;
  user_error(text("use dimension ", d_, " of ", quoted(parameter_->name)),
             "a dimension is numbered from 0",
             text("it has ", parameter_->dimensions, " dimensions"), "Give a number below that");
}

Expr Dimension::min() const { return metadata_of(parameter_, ir::Metadata::Min, d_); }
Expr Dimension::extent() const { return metadata_of(parameter_, ir::Metadata::Extent, d_); }
Expr Dimension::stride() const { return metadata_of(parameter_, ir::Metadata::Stride, d_); }

void Dimension::set(Expr graph::BufferConstraint::*field, Expr value, const char* which) {
  const std::string asked =
      text("set the ", which, " of dimension ", d_, " of ", quoted(parameter_->name));
  value = as_size(value, asked);
  if (value.defined()) graph::check_over_parameters(value, "a promise", asked);
  auto constant = value.defined() ? ir::as_const_int(value) : std::nullopt;
  if (constant && *constant < 0 && field == &graph::BufferConstraint::extent) {
    user_error(asked, "an extent is not negative", text("it is ", *constant), "Give 0 or more");
  }
  // A promise may mention the parameter that it is about. That reference is weak, so the parameter does not own
  // itself.
  if (value.defined()) {
    value = ir::rewrite(
        value, [&](const Expr& e, const std::function<Expr(const Expr&)>& recurse) -> Expr {
          const ir::Variable* v = e.as<ir::Variable>();
          if (!v || v->symbol.raw() != parameter_.get()) return ir::map_children(e, recurse);
          return ir::variable(v->name, v->type, ir::SymbolRef::weak(parameter_));
        });
  }
  constraint().*field = std::move(value);
  parameter_->version++;
}

Dimension& Dimension::set_min(Expr min) {
  set(&graph::BufferConstraint::min, std::move(min), "min");
  return *this;
}

Dimension& Dimension::set_extent(Expr extent) {
  set(&graph::BufferConstraint::extent, std::move(extent), "extent");
  return *this;
}

Dimension& Dimension::set_stride(Expr stride) {
  constraint().any_stride = !stride.defined();
  set(&graph::BufferConstraint::stride, std::move(stride), "stride");
  return *this;
}

Dimension& Dimension::set_bounds(Expr min, Expr extent) {
  return set_min(std::move(min)).set_extent(std::move(extent));
}

Dimension& Dimension::set_estimate(Expr min, Expr extent) {
  set(&graph::BufferConstraint::min_estimate, std::move(min), "estimate of the min");
  set(&graph::BufferConstraint::extent_estimate, std::move(extent), "estimate of the extent");
  return *this;
}

graph::ParameterContents& OutputImageParam::checked() const {
  if (!parameter_) {
    user_error("use an ImageParam", "it needs a type and dimensions",
               "it was constructed without them",
               "Construct it: ImageParam in(Float(32), 2, \"in\")");
  }
  return *parameter_;
}

Dimension OutputImageParam::dim(int i) const {
  checked();
  return Dimension(parameter_, i);
}

void frontend::check_estimates(const std::string& name, int dimensions, const Region& estimates) {
  if (static_cast<int>(estimates.size()) == dimensions) return;
  user_error(
      "set estimates of " + quoted(name), "there is one for each dimension",
      text("it has ", dimensions, " dimensions and was given ", estimates.size(), " estimates"),
      "Give that many");
}

OutputImageParam& OutputImageParam::set_estimates(const Region& estimates) {
  frontend::check_estimates(name(), dimensions(), estimates);
  for (int d = 0; d < dimensions(); d++) dim(d).set_estimate(estimates[d].min, estimates[d].extent);
  return *this;
}

OutputImageParam& OutputImageParam::set_host_alignment(int bytes) {
  const int element = checked().type.bytes();
  const bool power = bytes > 0 && (bytes & (bytes - 1)) == 0;
  if (!power || bytes < element) {
    user_error("promise the alignment of " + quoted(name()),
               text("it is a power of two of at least ", element, " bytes"), text("it is ", bytes),
               "Give 16, 32 or 64");
  }
  checked().host_alignment = bytes;
  checked().version++;
  return *this;
}

ImageParam& ImageParam::promise_finite() {
  checked().is_finite = true;
  checked().version++;
  return *this;
}

int OutputImageParam::host_alignment() const {
  return std::max(checked().host_alignment, checked().type.bytes());
}

OutputImageParam& OutputImageParam::store_in(MemoryType memory) {
  if (memory != MemoryType::Auto && memory != MemoryType::Heap) {
    unsupported("store the buffer " + quoted(name()) + " in another memory",
                "argument buffers lie in the memory of the CPU", "that memory belongs to a device",
                "Leave it out");
  }
  return *this;
}

ImageParam::ImageParam(Type type, int dimensions) : ImageParam(type, dimensions, "") {}

ImageParam::ImageParam(Type type, int dimensions, const std::string& name)
    : OutputImageParam(make_parameter(
          type, dimensions,
          name.empty() ? ir::unique_name("p") : graph::claim_parameter_name(name))) {}

void frontend::check_image(const graph::ParameterContents& parameter, const Buffer<>& buffer) {
  const std::string asked = "set the ImageParam " + quoted(parameter.name);
  if (buffer.type() != parameter.type) {
    user_error(asked, "the buffer's elements are of the parameter's type",
               text("it takes ", to_string(parameter.type), " and ", quoted(buffer.name()),
                    " holds ", to_string(buffer.type())),
               "Give a buffer of that type");
  }
  if (buffer.dimensions() != parameter.dimensions) {
    user_error(asked, "the buffer has as many dimensions as the parameter",
               text("it takes ", parameter.dimensions, " and ", quoted(buffer.name()), " has ",
                    buffer.dimensions()),
               "Give a buffer of that many dimensions");
  }
}

void ImageParam::set(const Buffer<>& buffer) {
  graph::ParameterContents& parameter = checked();
  if (!buffer.defined()) return reset();
  frontend::check_image(parameter, buffer);
  parameter.buffer_owner = buffer.contents();
  parameter.buffer = buffer.contents()->buffer.raw_buffer();
}

Buffer<> ImageParam::get() const {
  auto contents = std::static_pointer_cast<frontend::BufferContents>(checked().buffer_owner);
  return contents ? Buffer<>(contents) : Buffer<>();
}

void ImageParam::reset() {
  checked().buffer_owner.reset();
  checked().buffer = nullptr;
}

Expr ImageParam::access(const std::vector<Expr>& args) const {
  const graph::ParameterContents& parameter = checked();
  std::vector<Expr> at = frontend::access_coordinates(args, parameter.dimensions,
                                                      "the ImageParam " + quoted(parameter.name));
  return ir::call_image(parameter.name, parameter.type, std::move(at), ir::SymbolRef(parameter_));
}

ImageParam::operator Func() const {
  checked();
  return Func(graph::func_of_image(parameter_));
}

Func ImageParam::in(const Func& f) { return Func(*this).in(f); }
Func ImageParam::in(const std::vector<Func>& fs) { return Func(*this).in(fs); }
Func ImageParam::in() { return Func(*this).in(); }

void ImageParam::trace_loads() {
  checked().trace.loads = true;
  checked().version++;
}

ImageParam& ImageParam::add_trace_tag(const std::string& tag) {
  checked().trace.tags.push_back(tag);
  checked().version++;
  return *this;
}

}  // namespace retrograde
