#include "checks/arrays.h"

#include <algorithm>
#include <cmath>

#include "diagnostics/error.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "graph/copy_graph.h"
#include "graph/directives/give_directive.h"
#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::checks {

double dot(const Values& a, const Values& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

double weighted_sum(const std::vector<Values>& values, const std::vector<Values>& weights) {
  double sum = 0;
  for (size_t k = 0; k < weights.size(); ++k) {
    if (!weights[k].empty()) sum += dot(values[k], weights[k]);
  }
  return sum;
}

double typical(const Values& a, const Values& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * a[i] * b[i] * b[i];
  return std::sqrt(sum);
}

double largest(const Values& a) {
  double result = 0;
  for (double v : a) {
    if (std::isfinite(v)) result = std::max(result, std::abs(v));
  }
  return result;
}

double relative_error(double a, double b, double scale) {
  if (a == b) return 0;
  scale = std::max({std::abs(a), std::abs(b), scale});
  return std::abs(a - b) / scale;
}

void worsen(double& worst, double error) {
  if (!std::isnan(worst) && !(error <= worst)) worst = error;
}

size_t count(const Shape& shape) {
  size_t n = 1;
  for (int e : shape.extents) n *= static_cast<size_t>(e);
  return n;
}

std::vector<std::shared_ptr<ParameterContents>> floating_inputs(const Func& output) {
  return filtered(parameters_of({output.function()}),
                  [](const auto& p) { return p->type.is_float(); });
}

Shape shape_of_bound(const ParameterContents& p) {
  Shape shape;
  for (int d = 0; p.buffer && d < p.dimensions; ++d) {
    shape.mins.push_back(Buffer<>(*p.buffer).dim(d).min());
    shape.extents.push_back(Buffer<>(*p.buffer).dim(d).extent());
  }
  return shape;
}

Shape shape_of_output(const Func& output, const std::vector<int>& mins,
                      const std::vector<int>& sizes, const std::string& asked,
                      const std::string& function) {
  const size_t dims = static_cast<size_t>(output.dimensions());
  if (sizes.size() != dims || !(mins.empty() || mins.size() == dims)) {
    user_error(
        asked, "the output needs a size in each of its dimensions, and a min in each or none",
        text("it has ", dims, " dimensions, ", sizes.size(), " sizes and ", mins.size(), " mins"),
        "Give one a dimension: " + function + "(output, {width, height})");
  }
  return {mins.empty() ? std::vector<int>(dims, 0) : mins, sizes};
}

analysis::Box box_of(const Shape& shape) {
  analysis::Box box;
  for (size_t d = 0; d < shape.mins.size(); ++d)
    box.push_back({Expr(shape.mins[d]), Expr(shape.mins[d] + shape.extents[d] - 1)});
  return box;
}

Region region_of(const Shape& shape) {
  return ir::numbered(shape.mins.size(), [&](size_t d) {
    return Range{shape.mins[d], shape.extents[d]};
  });
}

std::optional<Shape> constant_shape(const analysis::Box& box) {
  constexpr double most_elements = 1e7;
  Shape shape;
  double elements = 1;
  for (const ir::Interval& i : box) {
    if (!i.is_bounded()) return std::nullopt;
    auto min = ir::as_const_int(simplification::simplify(i.min)),
         max = ir::as_const_int(simplification::simplify(i.max));
    if (!min || !max || *max < *min) return std::nullopt;
    shape.mins.push_back(static_cast<int>(*min));
    shape.extents.push_back(static_cast<int>(*max - *min + 1));
    elements *= shape.extents.back();
  }
  if (elements > most_elements) return std::nullopt;
  return shape;
}

Buffer<> new_buffer(Type type, const Shape& shape) {
  Buffer<> result(type, shape.extents);
  if (!shape.mins.empty()) result.set_min(shape.mins);
  return result;
}

namespace {

// Calls visit(Buffer<T>) with the element type of a floating buffer. Returns false for other types.
template <class Visit>
bool with_floats(const Buffer<>& buffer, Visit visit) {
  if (buffer.type() == Float(64)) return visit(Buffer<double>(buffer)), true;
  if (buffer.type() == Float(32)) return visit(Buffer<float>(buffer)), true;
  if (buffer.type() == Float(16)) return visit(Buffer<float16_t>(buffer)), true;
  if (buffer.type() == BFloat(16)) return visit(Buffer<bfloat16_t>(buffer)), true;
  return false;
}

}  // namespace

Values values_of(const Buffer<>& buffer) {
  Values result;
  const bool is_float = with_floats(buffer, [&](auto b) {
    using T = typename decltype(b)::ElemType;
    b.get()->for_each_value([&](T v) { result.push_back(static_cast<double>(v)); });
  });
  RETROGRADE_ASSERT(is_float, "values of ", to_string(buffer.type()), " are not looked at");
  return result;
}

void fill(Buffer<>& buffer, const Values& values) {
  size_t i = 0;
  with_floats(buffer, [&](auto b) {
    using T = typename decltype(b)::ElemType;
    b.get()->for_each_value([&](T& v) { v = static_cast<T>(values[i++]); });
  });
}

bool is_checkable(Type type) { return type.is_float() && type.lanes() == 1; }

double held_by(Type type, double v) {
  return ir::Scalar::of_float(type.bits() < 32 ? type : Float(32), v).as_double();
}

Values realize(Func& f, const Shape& shape) { return realize_values(f, shape)[0]; }

std::vector<Values> realize_values(Func& f, const Shape& shape) {
  std::vector<Buffer<>> out = ir::mapped(f.types(), [&](Type t) { return new_buffer(t, shape); });
  f.realize(Realization(out));
  return ir::mapped(
      out, [&](const Buffer<>& b) { return is_checkable(b.type()) ? values_of(b) : Values(); });
}

Func scheduled_for(const Func& f, const Shape& shape) {
  for (const FuncPtr& each : topological_order({f.function()})) {
    if (has_directives(*each) || each->is_extern()) return f;
  }
  Func copy(graph::copy_graph({f.function()}).outputs[0]);
  const std::vector<Var> args = copy.args();
  for (size_t d = 0; d < args.size(); ++d)
    copy.set_estimate(args[d], shape.mins[d], shape.extents[d]);
  Pipeline(copy).auto_schedule(get_jit_target_from_environment());
  return copy;
}

void Batch::add(const Func& f, const Shape& shape) {
  for (const Entry& e : entries_) {
    if (e.func.function() != f.function()) continue;
    if (e.shape.mins != shape.mins || e.shape.extents != shape.extents) together_ = false;
    entries_.push_back({f, shape, e.position});
    return;
  }
  entries_.push_back({f, shape, values_});
  outputs_.push_back(f);
  shapes_.push_back(shape);
  values_ += f.types().size();
  elements_ += static_cast<double>(count(shape) * f.types().size());
}

bool Batch::realize_together(std::vector<std::vector<Values>>& to) {
  constexpr double most_elements = 3e7;
  if (elements_ > most_elements) return false;
  if (!pipeline_.defined()) pipeline_ = Pipeline(outputs_);
  std::vector<Buffer<>> out;
  for (size_t i = 0; i < outputs_.size(); ++i) {
    for (Type t : outputs_[i].types()) out.push_back(new_buffer(t, shapes_[i]));
  }
  try {
    pipeline_.realize(Realization(out));
  } catch (const UserError&) {
    return false;
  }
  for (const Entry& e : entries_) {
    to.emplace_back();
    for (size_t v = 0; v < e.func.types().size(); ++v) {
      const Buffer<>& b = out[e.position + v];
      to.back().push_back(is_checkable(b.type()) ? values_of(b) : Values());
    }
  }
  return true;
}

std::vector<std::vector<Values>> Batch::realize() {
  std::vector<std::vector<Values>> result;
  if (entries_.empty()) return result;
  together_ = together_ && realize_together(result);
  if (together_) return result;
  for (Entry& e : entries_) result.push_back(realize_values(e.func, e.shape));
  return result;
}

std::vector<int> place_of(size_t i, const Shape& shape) {
  std::vector<int> result;
  for (size_t d = 0; d < shape.extents.size(); ++d) {
    const size_t extent = static_cast<size_t>(shape.extents[d]);
    result.push_back(shape.mins[d] + static_cast<int>(i % extent));
    i /= extent;
  }
  return result;
}

void Input::set_wide(const Values& to) {
  if (own->is_buffer) return fill(buffer, to);
  frontend::set_scalar(*wide, ir::Scalar::of_float(Float(64), to[0]));
}

void Input::set_own(const Values& to) {
  if (!own->is_buffer) return frontend::set_scalar(*own, ir::Scalar::of_float(own->type, to[0]));
  Buffer<> bound(*own->buffer);
  fill(bound, to);
}

Input bind_wide(const std::shared_ptr<ParameterContents>& own,
                const std::shared_ptr<ParameterContents>& wide, const std::string& asked) {
  Input input{own, wide, shape_of_bound(*own), {}, {}};
  if (own->is_buffer ? own->buffer == nullptr : !own->value) {
    call_error(asked, "every input must be bound", retrograde::quoted(own->name) + " is not",
               "Set it before the check");
  }
  if (own->is_buffer) {
    input.values = values_of(Buffer<>(*own->buffer));
    input.buffer = new_buffer(Float(64), input.shape);
    ImageParam(wide).set(input.buffer);
  } else {
    input.values = {own->value->as_double()};
  }
  input.set_wide(input.values);
  return input;
}

}  // namespace retrograde::checks
