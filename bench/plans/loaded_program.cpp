#include "loaded_program.h"

#include <HalideRuntime.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "driver/plan_schedule.h"
#include "frontend/run/call.h"
#include "graph/definitions/parameter_contents.h"
#include "graph/directives/wrappers.h"
#include "ir/text.h"
#include "lower/lower.h"
#include "transform/graph_rewrites.h"
#include "tuning/compiled_once.h"
#include "tuning/measure_schedule.h"

namespace bench::plans {

using namespace retrograde;

namespace {

std::map<std::string, std::vector<double>> read_values(const std::string& text) {
  std::map<std::string, std::vector<double>> result;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    for (double value = 0; words >> value;) result[name].push_back(value);
  }
  return result;
}

template <typename T>
void write_as(const halide_buffer_t& buffer, const std::vector<double>& values) {
  std::ranges::transform(values, reinterpret_cast<T*>(buffer.host),
                         [](double value) { return static_cast<T>(value); });
}

// Images that were made up are dense.
void write(const halide_buffer_t& buffer, const Type& type, const std::vector<double>& values) {
  size_t count = 1;
  for (int d = 0; d < buffer.dimensions; ++d) count *= static_cast<size_t>(buffer.dim[d].extent);
  if (count != values.size()) return;
  if (type == Float(32)) write_as<float>(buffer, values);
  if (type == Float(64)) write_as<double>(buffer, values);
  if (type == Int(32)) write_as<int32_t>(buffer, values);
  if (type == UInt(8)) write_as<uint8_t>(buffer, values);
}

ir::Scalar scalar_of(const Type& type, double value) {
  if (type.is_float()) return ir::Scalar::of_float(type, value);
  if (type.is_int()) return ir::Scalar::of_int(type, static_cast<int64_t>(value));
  return ir::Scalar::of_uint(type, static_cast<uint64_t>(value));
}

bool has_size(const graph::ParameterContents& image) {
  const auto is_known = [](const graph::BufferConstraint& c) {
    return c.extent.defined() || c.extent_estimate.defined();
  };
  return !image.constraints.empty() && std::ranges::all_of(image.constraints, is_known);
}

// Scalars that nobody bound have their estimates, or are zero.
void bind_scalars(const std::vector<FuncPtr>& outputs) {
  for (const auto& p : graph::parameters_of(outputs)) {
    if (p->is_buffer || p->value) continue;
    const auto estimate = p->estimate.defined() ? ir::as_scalar(p->estimate) : std::nullopt;
    p->value = scalar_of(p->type, estimate ? estimate->as_double() : 0);
  }
}

// Estimates of images of which nothing is known: the region that the outputs need.
void estimate_images(const std::vector<FuncPtr>& outputs) {
  const auto parameters = graph::parameters_of(outputs);
  const auto is_unknown = [](const auto& p) { return p->is_buffer && !p->buffer && !has_size(*p); };
  if (std::ranges::none_of(parameters, is_unknown)) return;
  const Target target = get_jit_target_from_environment();
  const auto scheduled = driver::schedule_by_plan(outputs, driver::request_for(target, {}),
                                                  driver::Scheduling::Everything)
                             .outputs;
  lower::LowerOptions options;
  options.target = target;
  const tuning::CompiledOnce code(
      lower::lower("asked", scheduled, lower::infer_arguments(scheduled), options), target, {});
  std::vector<Buffer<>> buffers = tuning::sample_outputs(scheduled);
  std::vector<halide_buffer_t*> raw;
  for (Buffer<>& buffer : buffers) raw.push_back(buffer.raw_buffer());
  const std::string asked = "find the sizes of inputs";
  frontend::Arguments arguments(code, raw, /*is_query=*/true, asked, ParamMap::empty_map());
  frontend::call(code, {}, arguments.argv(), asked, nullptr);
  for (auto& query : arguments.queries()) {
    if (!is_unknown(query.parameter)) continue;
    auto& constraints = query.parameter->constraints;
    constraints.resize(static_cast<size_t>(query.parameter->dimensions));
    for (size_t d = 0; d < constraints.size(); ++d) {
      const auto dim = query.buffer.dim(static_cast<int>(d));
      if (dim.extent() <= 0) continue;
      constraints[d].min_estimate = dim.min();
      constraints[d].extent_estimate = dim.extent();
    }
  }
}

void bind_inputs(const std::vector<FuncPtr>& outputs, const std::string& text) {
  const auto values = read_values(text);
  const auto parameters = graph::parameters_of(outputs);
  const auto for_each_known = [&](const auto& bind) {
    for (const auto& p : parameters) {
      if (const auto known = values.find(ir::quote_name(p->name)); known != values.end())
        bind(*p, known->second);
    }
  };
  for_each_known([](auto& p, const auto& known) {
    if (!p.is_buffer && known.size() == 1) p.value = scalar_of(p.type, known[0]);
  });
  bind_scalars(outputs);
  estimate_images(outputs);
  tuning::bind_sample_inputs(outputs);
  for_each_known([](auto& p, const auto& known) {
    if (p.is_buffer) write(*p.buffer, p.type, known);
  });
}

}  // namespace

LoadedProgram load_program(const std::string& text, const std::string& values) {
  LoadedProgram result{graph::parse_graph(text), {}};
  graph::validate(result.graph, "parse_graph");
  result.outputs = graph::apply_wrappers(result.graph.outputs);
  if (transform::is_differentiated(result.outputs))
    result.outputs = transform::with_graph_rewrites(result.outputs, /*on_gpu=*/false);
  bind_inputs(result.outputs, values);
  return result;
}

}  // namespace bench::plans
