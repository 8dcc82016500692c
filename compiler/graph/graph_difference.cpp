#include "diagnostics/error.h"
#include "graph/graph.h"
#include "graph/text/graph_lines.h"

namespace retrograde::graph {

std::string difference(const Graph& a, const Graph& b) {
  const std::vector<Line> as = lines_of(to_text(a)), bs = lines_of(to_text(b));
  std::string entity, part;  // the entity and part that contain the line
  for (size_t i = 0; i < as.size() || i < bs.size(); ++i) {
    const std::string in_a = i < as.size() ? as[i].content : "nothing";
    const std::string in_b = i < bs.size() ? bs[i].content : "nothing";
    if (in_a != in_b) return text(entity, part, ": ", in_a, " and ", in_b);
    const std::string& word = as[i].word;
    if (word == "define" || word == "update" || word == "schedule") part = ", " + word;
    if (word != "func" && word != "output" && word != "image" && word != "buffer" &&
        word != "param")
      continue;
    entity = in_a;
    part.clear();
  }
  return "";
}

}  // namespace retrograde::graph
