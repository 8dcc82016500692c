// graph.h -- the algorithm IR: a program as Funcs, with its text, its rules and its equality.
//
// Text is read line by line; the first word of a line says what it is, indentation says nothing.
//
//   image uint8 input(2)
//     dim(0, 0, _, 1)                    min, extent, stride; _ where nothing is said
//   param float32 gain
//     value 1.5f
//   func blur(x, y) float32              several types: a Tuple
//     made adjoint of blur               by whom, unless by the user
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
//       loop(`r$0.y`, 0, 5)            points(k, 0, 2): of this many points at once
//       where `r$0.y` < x
//       value blur(x, `r$0.y`) + 1f
//     schedule
//       compute_at(loop(out, x, 0))
//   output blur
//
// Expressions are those of ir/print.h. Data of Buffers, functions of custom rules and lines of
// source files are no part of the text.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "graph/function.h"

namespace retrograde::graph {

struct Graph {
  std::vector<FuncPtr> outputs;
  std::vector<FuncPtr> funcs;  // all that compiling the outputs looks at, wrappers included
  std::vector<std::shared_ptr<ParameterContents>> parameters;
};

Graph graph_of(const std::vector<FuncPtr>& outputs);

std::string to_text(const Graph& graph);
// The Funcs are new; what is called like a Func, an image or a parameter of the text is that one.
// Requires: line …: … must stand here; it names its outputs; every Func and image that is read is of
// the graph.
Graph parse_graph(const std::string& text);

// What tells two graphs apart: the first place in their texts, and what stands there in each; empty
// when they are equal. Names count, identities do not.
std::string difference(const Graph& a, const Graph& b);

// Phase::Algorithm of ir/validate.h: throws InternalError that names the pass and the rule. Every
// call finds its Func with as many arguments and the type of its value; every variable is of its
// definition, its reduction domain or a parameter; predicates are of type bool; what a schedule
// names is there.
void validate(const Graph& graph, const std::string& after_pass);

}  // namespace retrograde::graph
