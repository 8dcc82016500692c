// program_text.h -- the text of a program between two passes of lowering, which tools/opt and the golden tests read.
//
//   target x86-64-linux-avx2        optional
//   func f(x) float32 ...           the text of a graph (graph/graph.h): the Funcs with their schedules
//   output f
//   statement                       optional: the text of a statement (ir/print.h) over these Funcs follows
//   realize ...
#pragma once

#include <string>

#include "graph/graph.h"
#include "ir/target.h"

namespace retrograde::opt {

using namespace autodiff;

struct ProgramText {
  Target target;
  Graph graph;
  Stmt statement;  // undefined if the text has none
};

// `target` is that of texts without a target line. UserError at a line that cannot be read.
ProgramText parse_program(const std::string& text, const Target& target);

// The text after the pass, which may be one from graph to graph or one of lowering (lower/lower.h). UserError for other
// names, and if a pass of lowering needs a statement that the text lacks.
std::string text_after(const std::string& pass, const ProgramText& program);

}  // namespace retrograde::opt
