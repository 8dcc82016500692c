#include "loaded_program.h"

#include <HalideRuntime.h>

#include <algorithm>
#include <map>
#include <sstream>

#include "autoschedule/graph_rewrites.h"
#include "autoschedule/stored_funcs.h"
#include "graph/definitions/parameter_contents.h"
#include "graph/directives/wrappers.h"
#include "ir/text.h"
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
  if (autoschedule::is_differentiated(result.outputs))
    result.outputs = autoschedule::with_graph_rewrites(result.outputs, /*on_gpu=*/false);
  bind_inputs(result.outputs, values);
  return result;
}

}  // namespace bench::plans
