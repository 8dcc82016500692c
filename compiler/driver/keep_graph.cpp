#include "driver/keep_graph.h"

#include <HalideRuntime.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <map>
#include <sstream>

#include "diagnostics/error.h"
#include "diagnostics/text_hash.h"
#include "graph/definitions/parameter_contents.h"
#include "graph/directives/give_directive.h"
#include "graph/graph.h"
#include "ir/text.h"

namespace retrograde::driver {

namespace {

constexpr size_t most_values = 5000;  // of an image that is kept

std::string header_of(const graph::ParameterContents& p) {
  return (p.is_literal ? "buffer " : "image ") + to_string(p.type) + " " + ir::quote_name(p.name) +
         "(" + std::to_string(p.dimensions) + ")";
}

// By the line that begins an image, what its buffer says. Text of the graph has no data.
std::map<std::string, std::string> sizes_of_bound(const graph::Graph& graph) {
  std::map<std::string, std::string> result;
  for (const auto& p : graph.parameters) {
    if (!p->is_buffer || !p->buffer) continue;
    std::string lines;
    for (int d = 0; d < p->buffer->dimensions; d++)
      lines += text("  estimates(", d, ", ", p->buffer->dim[d].min, ", ", p->buffer->dim[d].extent,
                    ")\n");
    result[header_of(*p)] = lines;
  }
  return result;
}

std::string text_with_sizes(const std::vector<FuncPtr>& outputs) {
  const graph::Graph graph = graph::graph_of(outputs);
  const auto sizes = sizes_of_bound(graph);
  std::istringstream lines(graph::to_text(graph));
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    result += line + "\n";
    if (const auto found = sizes.find(line); found != sizes.end()) result += found->second;
  }
  return result;
}

template <typename T>
std::string values_as(const halide_buffer_t& buffer, size_t count) {
  std::ostringstream out;
  out << std::setprecision(17);
  const T* values = reinterpret_cast<const T*>(buffer.host);
  for (size_t i = 0; i < count; i++) out << " " << +values[i];
  return out.str();
}

// The values of a dense buffer; empty for others, large ones, and types without a literal.
std::string values_of(const halide_buffer_t& buffer, const Type& type) {
  size_t count = 1;
  for (int d = 0; d < buffer.dimensions; d++) {
    if (buffer.dim[d].stride != static_cast<int64_t>(count)) return "";
    count *= static_cast<size_t>(buffer.dim[d].extent);
  }
  if (!buffer.host || count > most_values) return "";
  if (type == Float(32)) return values_as<float>(buffer, count);
  if (type == Float(64)) return values_as<double>(buffer, count);
  if (type == Int(32)) return values_as<int32_t>(buffer, count);
  if (type == UInt(8)) return values_as<uint8_t>(buffer, count);
  return "";
}

// A line for each scalar and each small image that is bound: its name and its values. Transformations, tables and
// weights decide what a program reads, and how long it takes; large images can be made up.
std::string values_text(const std::vector<FuncPtr>& outputs) {
  std::string result;
  for (const auto& p : graph::parameters_of(outputs)) {
    std::string values;
    if (p->is_buffer && p->buffer) {
      values = values_of(*p->buffer, p->type);
    } else if (p->value) {
      values = text(" ", std::setprecision(17), p->value->as_double());
    }
    if (!values.empty()) result += ir::quote_name(p->name) + values + "\n";
  }
  return result;
}

std::string file_name(const std::string& name, const std::string& contents) {
  std::string plain = name;
  for (char& c : plain) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  std::ostringstream out;
  out << plain << "-" << std::hex << std::setw(16) << std::setfill('0') << text_hash(contents)
      << ".graph";
  return out.str();
}

}  // namespace

void keep_graph(const std::string& name, const std::vector<FuncPtr>& outputs) {
  const char* folder = std::getenv("RETROGRADE_GRAPHS");
  if (!folder || !*folder) return;
  const auto is_left = [](const FuncPtr& f) { return !f->is_extern() && !has_directives(*f); };
  if (std::ranges::none_of(topological_order(outputs), is_left)) return;
  const std::string contents = text_with_sizes(outputs);
  const std::string path = std::string(folder) + "/" + file_name(name, contents);
  std::ofstream(path) << contents;
  if (const std::string values = values_text(outputs); !values.empty())
    std::ofstream(path + ".values") << values;
}

}  // namespace retrograde::driver
