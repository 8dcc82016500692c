#include "autodiff/matrices/graph_colouring.h"

#include <algorithm>
#include <numeric>

#include "ir/lists.h"

namespace retrograde::autodiff {

namespace {

// Vertices by decreasing degree, then by number.
std::vector<int> largest_first(const std::vector<size_t>& degrees) {
  std::vector<int> order(degrees.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, [&](int a, int b) {
    return degrees[static_cast<size_t>(a)] > degrees[static_cast<size_t>(b)];
  });
  return order;
}

// The colours forbidden for one vertex; reset for each vertex.
class Forbidden {
 public:
  explicit Forbidden(size_t vertices) : last_(vertices + 1, -1) {}
  void start(int vertex) { vertex_ = vertex; }
  void add(int colour) {
    if (colour >= 0) last_[static_cast<size_t>(colour)] = vertex_;
  }
  int smallest_allowed() const {
    int c = 0;
    while (last_[static_cast<size_t>(c)] == vertex_) ++c;
    return c;
  }

 private:
  std::vector<int> last_;
  int vertex_ = -1;
};

VertexColours finished(std::vector<int> colours) {
  VertexColours result{std::move(colours), 1};
  for (int c : result.of) result.count = std::max(result.count, c + 1);
  return result;
}

class StarColouring {
 public:
  explicit StarColouring(const Adjacency& graph)
      : graph_(graph), colours_(graph.size(), -1), forbidden_(graph.size()) {}

  VertexColours run() {
    const auto degrees =
        ir::mapped(graph_, [&](const auto& neighbours) { return neighbours.size(); });
    for (int v : largest_first(degrees)) {
      forbidden_.start(v);
      for (int w : near(v)) forbid_by(v, w);
      colours_[static_cast<size_t>(v)] = forbidden_.smallest_allowed();
    }
    return finished(std::move(colours_));
  }

 private:
  const std::vector<int>& near(int v) const { return graph_[static_cast<size_t>(v)]; }
  int colour(int v) const { return colours_[static_cast<size_t>(v)]; }

  // Forbids colours along paths v - w - x - y. While w has no colour, v and x must differ. Once w has one, v may take
  // the colour of x only if x has no other neighbour of w's colour, and v has none.
  void forbid_by(int v, int w) {
    forbidden_.add(colour(w));
    bool again = colour(w) >= 0 && std::any_of(near(v).begin(), near(v).end(), [&](int other) {
                   return other != w && colour(other) == colour(w);
                 });
    for (int x : near(w)) {
      if (x == v || colour(x) < 0) continue;
      if (colour(w) < 0 || again || has_another(x, w)) forbidden_.add(colour(x));
    }
  }
  bool has_another(int x, int w) const {
    return std::any_of(near(x).begin(), near(x).end(),
                       [&](int y) { return y != w && colour(y) == colour(w); });
  }

  const Adjacency& graph_;
  std::vector<int> colours_;
  Forbidden forbidden_;
};

}  // namespace

VertexColours colour_columns(const std::vector<std::vector<int>>& rows, int columns) {
  auto n = static_cast<size_t>(columns);
  std::vector<std::vector<int>> rows_of(n);
  for (size_t r = 0; r < rows.size(); ++r)
    for (int c : rows[r]) rows_of[static_cast<size_t>(c)].push_back(static_cast<int>(r));
  std::vector<size_t> degrees(n, 0);
  for (size_t c = 0; c < n; ++c)
    for (int r : rows_of[c]) degrees[c] += rows[static_cast<size_t>(r)].size();
  std::vector<int> colours(n, -1);
  Forbidden forbidden(n);
  for (int c : largest_first(degrees)) {
    forbidden.start(c);
    for (int r : rows_of[static_cast<size_t>(c)])
      for (int other : rows[static_cast<size_t>(r)])
        forbidden.add(colours[static_cast<size_t>(other)]);
    colours[static_cast<size_t>(c)] = forbidden.smallest_allowed();
  }
  return finished(std::move(colours));
}

VertexColours star_colouring(const Adjacency& graph) { return StarColouring(graph).run(); }

bool is_alone(const Adjacency& graph, const VertexColours& colours, int i, int j) {
  int wanted = colours.of[static_cast<size_t>(j)];
  if (wanted == colours.of[static_cast<size_t>(i)]) return false;  // the diagonal entry of row i
  return std::ranges::none_of(graph[static_cast<size_t>(i)], [&](int k) {
    return k != j && colours.of[static_cast<size_t>(k)] == wanted;
  });
}

}  // namespace retrograde::autodiff
