// graph_lines.h -- splits the text of a graph into lines and words.
#pragma once

#include <string>
#include <vector>

#include "ir/type.h"

namespace retrograde::graph {

struct Line {
  int number = 0;
  std::string word, rest, content;  // "func", "blur(x, y) float32"
};

std::vector<Line> lines_of(const std::string& text);  // the lines that are not empty

// UserError at the line: `expected` should be here.
[[noreturn]] void fail(const Line& line, const std::string& expected);

// Removes the back quotes of quote_name.
std::string unquoted(const Line& line, const std::string& word);
std::vector<Type> types_of(const Line& line, const std::string& list);  // "float32, int8"

}  // namespace retrograde::graph
