// graph_colouring.h -- greedy colouring of an explicit, irregular pattern.
//
// It is used where a linear form (colouring.h) wastes colours: a pattern with few wide columns, or a Hessian with a
// dense row.
//
// Source: Gebremedhin, Manne & Pothen, What color is your Jacobian?, SIAM Review 47, 2005: partial distance-2 colouring
// of columns (section 4.2), star colouring (section 4.3). Vertices are taken by decreasing degree, then by number; each
// gets the smallest permitted colour.
#pragma once

#include <vector>

namespace retrograde::autodiff {

// Maps each vertex to its neighbours, ascending, without itself.
using Adjacency = std::vector<std::vector<int>>;

struct VertexColours {
  std::vector<int> of;  // in [0, count)
  int count = 1;
};

// Gives columns that share a row different colours. `rows` lists the columns of the entries of each row.
VertexColours colour_columns(const std::vector<std::vector<int>>& rows, int columns);

// A colouring in which neighbours differ and no path of four vertices has only two colours. In a symmetric matrix every
// entry (i, j) is then the only one of its colour in row i or in row j.
VertexColours star_colouring(const Adjacency& graph);

// Whether column j is the only one of its colour in row i, for a neighbour j of i.
bool is_alone(const Adjacency& graph, const VertexColours& colours, int i, int j);

}  // namespace retrograde::autodiff
