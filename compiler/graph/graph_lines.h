// graph_lines.h -- the text of a graph as lines, and words in them.
#pragma once

#include <string>
#include <vector>

#include "ir/type.h"

namespace retrograde::graph {

struct Line {
  int number = 0;
  std::string word, rest, whole;  // "func", "blur(x, y) float32"
};

std::vector<Line> lines_of(const std::string& text);  // those that say something

// UserError: something else was expected here.
[[noreturn]] void fail(const Line& line, const std::string& expected);

// A name as quote_name writes it, without its back quotes.
std::string unquoted(const Line& line, const std::string& word);
std::vector<Type> types_of(const Line& line, const std::string& list);  // "float32, int8"

}  // namespace retrograde::graph
