#include "autodiff/matrices/colour_table.h"

#include <algorithm>

#include "autodiff/inversion/isl_points.h"
#include "autodiff/matrices/graph_colouring.h"
#include "ir/build.h"

namespace retrograde::autodiff {

namespace {

// The most entries of a pattern that is examined entry by entry.
constexpr int64_t many_entries = 20'000;

// Numbers the elements of a box, dimension 0 innermost.
struct Numbering {
  std::vector<ConstantRange> ranges;
  int64_t size() const {
    int64_t result = 1;
    for (const ConstantRange& r : ranges) result = std::min(result * r.extent(), many_entries + 1);
    return result;
  }
  int number(const int64_t* point) const {
    int64_t result = 0;
    for (size_t d = ranges.size(); d-- > 0;)
      result = result * ranges[d].extent() + (point[d] - ranges[d].min);
    return static_cast<int>(result);
  }
};

Buffer<int> table_over(const Numbering& box, const std::vector<int64_t>& more) {
  std::vector<int> sizes, mins;
  for (const ConstantRange& r : box.ranges) {
    sizes.push_back(static_cast<int>(r.extent()));
    mins.push_back(static_cast<int>(r.min));
  }
  for (int64_t extent : more) {
    sizes.push_back(static_cast<int>(extent));
    mins.push_back(0);
  }
  Buffer<int> result(sizes);
  result.set_min(mins);
  result.fill(0);
  return result;
}

// Reads the nearest element of the table.
Expr read(const Buffer<int>& table, const std::vector<Expr>& at) {
  std::vector<Expr> place;
  for (size_t d = 0; d < at.size(); ++d) {
    int dim = static_cast<int>(d), min = table.min(dim);
    place.push_back(clamp(at[d], min, min + table.extent(dim) - 1));
  }
  auto parameter = table.parameter();
  return call_image(parameter->name, parameter->type, place, SymbolRef(parameter));
}

using Entries = std::vector<std::pair<int, int>>;  // row, column

Entries entries_at(const std::vector<std::vector<int64_t>>& points, const Numbering& rows,
                   const Numbering& columns) {
  Entries result;
  for (const auto& p : points)
    result.push_back({rows.number(p.data()), columns.number(p.data() + rows.ranges.size())});
  return result;
}

void sort_unique(std::vector<int>& list) {
  std::ranges::sort(list);
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

Adjacency graph_of(const Entries& entries, int64_t vertices) {
  Adjacency graph(static_cast<size_t>(vertices));
  for (auto [i, j] : entries) {
    if (i == j) continue;
    graph[static_cast<size_t>(i)].push_back(j);
    graph[static_cast<size_t>(j)].push_back(i);
  }
  for (auto& neighbours : graph) sort_unique(neighbours);
  return graph;
}

std::vector<std::vector<int>> rows_of(const Entries& entries, int64_t rows) {
  std::vector<std::vector<int>> result(static_cast<size_t>(rows));
  for (auto [i, j] : entries) result[static_cast<size_t>(i)].push_back(j);
  for (auto& row : result) sort_unique(row);
  return result;
}

ColourTable table_of(const Numbering& box, const VertexColours& colours) {
  ColourTable result;
  result.count = colours.count;
  result.colours = table_over(box, {});
  std::copy(colours.of.begin(), colours.of.end(), result.colours.data());
  return result;
}

void add_alone(ColourTable& table, const Numbering& box, const Adjacency& graph,
               const VertexColours& colours) {
  table.alone = table_over(box, {table.count});
  int* alone = table.alone.data();
  size_t n = graph.size();
  for (size_t i = 0; i < n; ++i) {
    // The diagonal entry: no neighbour has the vertex's own colour.
    alone[i + static_cast<size_t>(colours.of[i]) * n] = 1;
    for (int j : graph[i]) {
      auto c = static_cast<size_t>(colours.of[static_cast<size_t>(j)]);
      alone[i + c * n] = is_alone(graph, colours, static_cast<int>(i), j);
    }
  }
}

Numbering around(const std::vector<ConstantRange>& a, const std::vector<ConstantRange>& b) {
  Numbering result{a};
  for (size_t d = 0; d < a.size(); ++d) result.ranges[d] = hull(a[d], b[d]);
  return result;
}

}  // namespace

Expr ColourTable::of(const std::vector<Expr>& column) const {
  return clamp(read(colours, column), 0, static_cast<int>(count) - 1);
}

Expr ColourTable::is_alone(const std::vector<Expr>& row, const Expr& colour) const {
  std::vector<Expr> place = row;
  place.push_back(colour);
  return read(alone, place) != 0;
}

std::optional<ColourTable> colour_table(const isl::map& pattern, bool symmetric,
                                        int64_t fewer_than) {
  auto row_ranges = ranges_of(pattern.domain()), column_ranges = ranges_of(pattern.range());
  if (!row_ranges || !column_ranges) return std::nullopt;
  Numbering rows{*row_ranges}, columns{*column_ranges};
  if (symmetric) rows = columns = around(*row_ranges, *column_ranges);
  if (rows.size() > many_entries || columns.size() > many_entries) return std::nullopt;
  auto points = points_of(pattern.wrap().flatten(), many_entries);
  if (!points) return std::nullopt;
  Entries list = entries_at(*points, rows, columns);
  if (!symmetric) {
    VertexColours colours =
        colour_columns(rows_of(list, rows.size()), static_cast<int>(columns.size()));
    if (colours.count >= fewer_than) return std::nullopt;
    return table_of(columns, colours);
  }
  Adjacency graph = graph_of(list, rows.size());
  VertexColours colours = star_colouring(graph);
  if (colours.count >= fewer_than) return std::nullopt;
  ColourTable result = table_of(rows, colours);
  add_alone(result, rows, graph, colours);
  return result;
}

}  // namespace retrograde::autodiff
