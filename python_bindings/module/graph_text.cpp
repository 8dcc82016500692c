// graph_text.cpp -- converts a pipeline to text and back, to pickle operators of PyTorch for other processes
// (retrograde/torch/_pickling.py).
#include <cstring>

#include "bind_all.h"
#include "binding.h"
#include "diagnostics/error.h"
#include "frontend/data/image_param.h"
#include "frontend/data/param.h"
#include "frontend/run/pipeline.h"
#include "graph/graph.h"
#include "graph/names.h"

namespace retrograde::python {

namespace {

using Parameter = std::shared_ptr<graph::ParameterContents>;

void check_is_text(const graph::Graph& described) {
  for (const graph::FuncPtr& f : described.funcs) {
    const char* const more = f->custom_derivatives  ? "derivatives of a user's own"
                             : f->extern_definition ? "a C function"
                                                    : nullptr;
    if (!more) continue;
    unsupported("describe the pipeline of " + quoted(f->name),
                "a description holds definitions and schedules, and no functions",
                quoted(f->name) + " has " + more,
                "Give operator() a function of a module that defines the pipeline, instead of the "
                "pipeline: then "
                "another process calls that");
  }
}

// A Buffer that a pipeline uses, as a tuple: name, type, (min, extent) of each dimension, elements.
py::tuple described(const graph::ParameterContents& literal) {
  const auto contents = std::static_pointer_cast<frontend::BufferContents>(literal.buffer_owner);
  const Buffer<> dense = Buffer<>(contents).copy_to_planar();
  py::list sides;
  for (int d = 0; d < dense.dimensions(); d++)
    sides.append(py::make_tuple(dense.min(d), dense.extent(d)));
  return py::make_tuple(
      literal.name, to_string(dense.type()), sides,
      py::bytes(reinterpret_cast<const char*>(dense.data()), dense.size_in_bytes()));
}

// The text of a pipeline, and the Buffers that it uses.
py::tuple describe_pipeline(const Pipeline& pipeline) {
  std::vector<graph::FuncPtr> outputs;
  for (const Func& f : pipeline.outputs()) outputs.push_back(f.function());
  const graph::Graph found = graph::graph_of(outputs);
  check_is_text(found);
  py::list buffers;
  for (const Parameter& parameter : found.parameters) {
    if (parameter->is_literal) buffers.append(described(*parameter));
  }
  return py::make_tuple(graph::to_text(found), buffers);
}

Buffer<> buffer_described(const py::tuple& one) {
  std::vector<int> mins, extents;
  for (const py::handle side : one[2]) {
    const auto [min, extent] = side.cast<std::pair<int, int>>();
    mins.push_back(min);
    extents.push_back(extent);
  }
  Buffer<> buffer(one[1].cast<Type>(), extents, one[0].cast<std::string>());
  buffer.set_min(mins);
  const auto bytes = one[3].cast<std::string>();
  if (bytes.size() != buffer.size_in_bytes())
    throw py::value_error("a Buffer of a description has as many bytes as its elements");
  std::memcpy(buffer.data(), bytes.data(), bytes.size());
  return buffer;
}

void give(graph::ParameterContents& literal, const Buffer<>& buffer) {
  literal.buffer_owner = buffer.contents();
  literal.buffer = buffer.contents()->buffer.raw_buffer();
}

py::object parameter_object(const Parameter& parameter) {
  return parameter->is_buffer ? py::cast(ImageParam(parameter)) : py::cast(Param<>(parameter));
}

// The outputs and the parameters by name. Names that the compiler generates later differ from those of the text.
py::tuple pipeline_described(const std::string& text, const py::list& buffers) {
  const graph::Graph parsed = graph::parse_graph(text);
  py::list outputs;
  py::dict parameters;
  for (const graph::FuncPtr& f : parsed.funcs) graph::claim_name(f->name);
  for (const graph::FuncPtr& f : parsed.outputs) outputs.append(Func(f));
  for (const Parameter& parameter : parsed.parameters) {
    graph::claim_name(parameter->name);
    if (!parameter->is_literal) {
      parameters[py::str(parameter->name)] = parameter_object(parameter);
      continue;
    }
    for (const py::handle one : buffers) {
      const auto found = one.cast<py::tuple>();
      if (found[0].cast<std::string>() == parameter->name)
        give(*parameter, buffer_described(found));
    }
    if (!parameter->buffer)
      throw py::value_error("a description has every Buffer that its text names");
  }
  return py::make_tuple(outputs, parameters);
}

}  // namespace

void bind_graph_text(py::module_& m) {
  m.def("_describe_pipeline", &describe_pipeline, py::arg("pipeline"));
  m.def("_pipeline_described", &pipeline_described, py::arg("text"), py::arg("buffers"));
}

}  // namespace retrograde::python
