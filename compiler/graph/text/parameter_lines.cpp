#include "graph/text/parameter_lines.h"

#include "ir/build.h"
#include "ir/parse.h"

namespace retrograde::graph {

namespace {

std::string string_of(const Line& line) {
  const Expr e = parse_expr(line.rest);
  const StringImm* value = e.as<StringImm>();
  if (!value) fail(line, "a text in quotes");
  return value->value;
}

bool reads_trace(const Line& line, TraceSchedule& trace) {
  if (line.word == "trace_loads") {
    trace.loads = true;
  } else if (line.word == "trace_stores") {
    trace.stores = true;
  } else if (line.word == "trace_realizations") {
    trace.realizations = true;
  } else if (line.word == "trace_tag") {
    trace.tags.push_back(string_of(line));
  } else {
    return false;
  }
  return true;
}

}  // namespace

bool reads_parameter(const Line& line, const Declarations& declared, ParameterContents& p) {
  if (line.word == "value") {
    p.value = as_scalar(declared.expr(line, nullptr));
  } else if (line.word == "at_least") {
    p.min_value = declared.expr(line, nullptr);
  } else if (line.word == "at_most") {
    p.max_value = declared.expr(line, nullptr);
  } else if (line.word == "estimate") {
    p.estimate = declared.expr(line, nullptr);
  } else if (line.word == "finite") {
    p.is_finite = true;
  } else if (line.word != "reader") {
    return reads_constraint(line, declared, p) || reads_trace(line, p.trace);
  }
  return true;
}

bool reads_constraint(const Line& line, const Declarations& declared, ParameterContents& p) {
  if (line.word != "dim" && line.word != "estimates" && line.word != "any_stride" &&
      line.word != "aligned")
    return false;
  const std::vector<Expr> args = declared.arguments(line);
  const int first = integer_argument(line, args, 0);
  if (line.word == "aligned") {
    p.host_alignment = first;
    return true;
  }
  if (first < 0 || first >= static_cast<int>(p.constraints.size()))
    fail(line, "a dimension of the buffer");
  BufferConstraint& c = p.constraints[static_cast<size_t>(first)];
  if (line.word == "any_stride") {
    c.any_stride = true;
  } else if (line.word == "dim" && args.size() == 4) {
    c.min = args[1], c.extent = args[2], c.stride = args[3];
  } else if (line.word == "estimates" && args.size() == 3) {
    c.min_estimate = args[1], c.extent_estimate = args[2];
  } else {
    fail(line, "min, extent and stride, or _");
  }
  return true;
}

}  // namespace retrograde::graph
