// graph_colouring -- greedy colours of an explicit, irregular pattern, where a linear form
// (colouring.h) is wasteful: columns of which few are wide, or a Hessian with a dense row.
//
// Source: Gebremedhin, Manne & Pothen, What color is your Jacobian?, SIAM Review 47, 2005: partial
// distance-2 colouring of columns (section 4.2), star colouring (section 4.3). Vertices are taken
// by falling degree, then by number, each gets the smallest colour that is allowed.
#pragma once

#include <vector>

namespace retrograde::autodiff {

// Vertex -> its neighbours, ascending, without itself.
using Adjacency = std::vector<std::vector<int>>;

struct VertexColours {
  std::vector<int> of;  // in [0, count)
  int count = 1;
};

// Columns that share a row differ. rows: the columns of the entries of each row.
VertexColours colour_columns(const std::vector<std::vector<int>>& rows, int columns);

// Neighbours differ, and no path of four vertices has two colours: in a symmetric matrix every
// entry (i, j) is then alone of its colour in row i, or in row j.
VertexColours star_colouring(const Adjacency& graph);

// Whether column j is alone of its colour in row i, for a neighbour j of i.
bool is_alone(const Adjacency& graph, const VertexColours& colours, int i, int j);

}  // namespace retrograde::autodiff
