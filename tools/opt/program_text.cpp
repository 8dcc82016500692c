#include "program_text.h"

#include <algorithm>

#include "diagnostics/error.h"
#include "graph_passes.h"
#include "ir/parse.h"
#include "lower/lower.h"

namespace retrograde::opt {

namespace {

const std::string target_word = "target ", statement_line = "\nstatement\n";

// Removes and returns the first line, without `word`.
std::string take_line_after(const std::string& word, std::string& text) {
  const size_t end = text.find('\n');
  const std::string line = text.substr(word.size(), end - word.size());
  text.erase(0, end == std::string::npos ? end : end + 1);
  return line;
}

// A pass of lowering; those after build_loop_nests need a statement.
void check_pass(const std::string& pass, const Stmt& statement) {
  const std::vector<std::string> names = lower::pass_names();
  const auto found = std::ranges::find(names, pass);
  const std::string asked = text("run the pass ", quoted(pass), " on a graph");
  if (found == names.end())
    user_error(asked,
               "it must be one from graph to graph, as --list marks them, or one of lowering",
               "--list-pipeline does not name it");
  if (statement.defined() || found <= std::ranges::find(names, "build_loop_nests")) return;
  user_error(asked, "passes after build_loop_nests start from a statement", "the text has none",
             "Add a line \"statement\" and the statement");
}

}  // namespace

ProgramText parse_program(const std::string& source, const Target& target) {
  std::string text = source;
  ProgramText program{target, {}, {}};
  if (text.starts_with(target_word)) program.target = Target(take_line_after(target_word, text));
  if (const size_t at = text.find(statement_line); at != std::string::npos) {
    program.statement = ir::parse_stmt(text.substr(at + statement_line.size()));
    text.erase(at + 1);
  }
  program.graph = parse_graph(text);
  validate(program.graph, "parse_graph");
  return program;
}

std::string text_after(const std::string& pass, const ProgramText& program) {
  const std::vector<FuncPtr>& outputs = program.graph.outputs;
  const GraphPass* graph_pass = find_graph_pass(pass);
  if (!graph_pass) {
    check_pass(pass, program.statement);
    return lower::run_pass_alone(pass, outputs, program.statement, program.target);
  }
  const Graph after = graph_of(graph_pass->run(outputs));
  validate(after, pass);
  return to_text(after);
}

}  // namespace retrograde::opt
