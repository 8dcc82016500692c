#include "graph/text/graph_lines.h"

#include <sstream>

#include "diagnostics/error.h"
#include "ir/parse.h"
#include "ir/text.h"

namespace retrograde::graph {

std::vector<Line> lines_of(const std::string& text) {
  std::vector<Line> lines;
  std::istringstream in(text);
  std::string raw;
  for (int number = 1; std::getline(in, raw); ++number) {
    const size_t begin = raw.find_first_not_of(" \t");
    if (begin == std::string::npos) continue;
    const std::string content = raw.substr(begin);
    const size_t end = content.find_first_of(" (");
    std::string rest = end == std::string::npos ? "" : content.substr(end);
    rest.erase(0, rest.find_first_not_of(' ') == std::string::npos ? rest.size()
                                                                   : rest.find_first_not_of(' '));
    lines.push_back({number, content.substr(0, end), std::move(rest), content});
  }
  return lines;
}

void fail(const Line& line, const std::string& expected) {
  user_error("read the text of a graph",
             text("line ", line.number, ": ", expected, " must stand here"),
             "it says " + quoted(line.content), "Write it as graph.h shows");
}

std::string unquoted(const Line& line, const std::string& word) {
  const Variable* v = nullptr;
  const Expr e = word.empty() ? Expr() : parse_expr(word);
  if (e.defined()) v = e.as<Variable>();
  if (!v) fail(line, "a name");
  return v->name;
}

std::vector<Type> types_of(const Line& line, const std::string& list) {
  std::vector<Type> types;
  std::istringstream in(list);
  for (std::string word; std::getline(in, word, ',');) {
    word.erase(0, word.find_first_not_of(' '));
    Type type;
    if (!read_type(word, type)) fail(line, "a type");
    types.push_back(type);
  }
  return types;
}

}  // namespace retrograde::graph
