// graph.h -- the algorithm IR: a program as a graph of Funcs, with its text, validation and
// equality.
//
// Text is read line by line. The first word of a line tells its kind; indentation has no meaning.
//
//   image uint8 input(2)
//     dim(0, 0, _, 1)                    min, extent, stride; _ where unconstrained
//   param float32 gain
//     value 1.5f
//   func blur(x, y) float32              several types: a Tuple
//     made adjoint of blur               provenance, if the compiler created it
//     define
//       value image input(x, y) * gain        typed by their declarations
//       split(x, xo, xi, 8, Auto)        the schedule, as in directive.h
//       run(xi, Vectorized)
//       specialize gain == 1f
//         run(xi, Unrolled)
//       end
//     update
//       place x
//       place `r$0.y`
//       loop(`r$0.y`, 0, 5)              points(k, 0, 2): two points updated together
//       where `r$0.y` < x
//       value blur(x, `r$0.y`) + 1f
//     schedule
//       compute_at(loop(out, x, 0))
//   output blur
//
// Expressions are those of ir/print.h. The text omits data of Buffers, functions of custom
// derivative rules and source lines.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

struct Graph {
  std::vector<FuncPtr> outputs;
  std::vector<FuncPtr> funcs;  // every Func that compiling the outputs reads, wrappers included
  std::vector<std::shared_ptr<ParameterContents>> parameters;
};

Graph graph_of(const std::vector<FuncPtr>& outputs);

std::string to_text(const Graph& graph);
// Creates new Funcs. Names in expressions refer to the Funcs, images and parameters of the text.
// Requires: line …: … must stand here; it names its outputs; every Func and image that is read
// belongs to the graph.
Graph parse_graph(const std::string& text);

// Describes the first difference between the texts of two graphs; empty when they are equal. Names
// count, identities do not.
std::string difference(const Graph& a, const Graph& b);

// Phase::Algorithm of ir/validate.h: throws InternalError that names the pass and the rule. Checks
// that
// - every call refers to an existing Func, with its number of arguments and the type of its value
// - every variable belongs to its definition, its reduction domain or a parameter
// - predicates are of type bool
// - all names in a schedule exist
void validate(const Graph& graph, const std::string& after_pass);

}  // namespace retrograde::graph
