// Tests the colouring of sparsity patterns: linear forms (colouring.h) and greedy colours of explicit graphs
// (graph_colouring.h). They are checked by their definitions on random patterns, against known optima, and on small
// graphs against the smallest number of colours that any assignment needs. Also tests limits on the time that the
// search for a pattern may take.
#include "autodiff/matrices/colouring.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "autodiff/matrices/compressed.h"
#include "autodiff/matrices/graph_colouring.h"
#include "frontend/language/func.h"
#include "support/errors.h"

namespace retrograde::autodiff {
namespace {

using Differences = std::vector<std::vector<int64_t>>;

Differences of_stencil(const Differences& offsets) {
  Differences result;
  for (const auto& a : offsets) {
    for (const auto& b : offsets) {
      std::vector<int64_t> d;
      for (size_t k = 0; k < a.size(); ++k) d.push_back(a[k] - b[k]);
      result.push_back(d);
    }
  }
  return result;
}

int64_t colours_of(const Differences& differences, size_t dimensions) {
  auto found = smallest_colouring(differences, dimensions, 1000);
  if (!found) return -1;
  for (const auto& d : differences) {
    bool zero = std::all_of(d.begin(), d.end(), [](int64_t c) { return c == 0; });
    EXPECT_EQ(found->of(d) == 0, zero);
  }
  return found->count;
}

TEST(LinearColouring, KnownOptima) {
  EXPECT_EQ(colours_of({{0}}, 1), 1);
  EXPECT_EQ(colours_of(of_stencil({{-1}, {0}, {1}}), 1), 3);
  EXPECT_EQ(colours_of(of_stencil({{0}, {2}, {4}}), 1), 3);
  EXPECT_EQ(colours_of({{-1}, {1}}, 1), 2);
  EXPECT_EQ(colours_of(of_stencil({{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}}), 2), 5);
  EXPECT_EQ(colours_of({{1, 0}, {0, 1}, {-1, 0}, {0, -1}}, 2), 2);  // a chessboard
  Differences cross = {{0, 0, 0}};
  for (size_t d = 0; d < 3; ++d) {
    for (int64_t s : {-1, 1}) {
      cross.push_back({0, 0, 0});
      cross.back()[d] = s;
    }
  }
  EXPECT_EQ(colours_of(of_stencil(cross), 3), 7);
}

TEST(LinearColouring, RandomStencilsNeedNoFewerThanTheyHaveElements) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int64_t> pick(-3, 3);
  for (int trial = 0; trial < 50; ++trial) {
    Differences offsets;
    for (int k = 0; k < 4; ++k) offsets.push_back({pick(random), pick(random)});
    std::sort(offsets.begin(), offsets.end());
    offsets.erase(std::unique(offsets.begin(), offsets.end()), offsets.end());
    int64_t count = colours_of(of_stencil(offsets), 2);
    EXPECT_GE(count, static_cast<int64_t>(offsets.size()));
    EXPECT_LE(count, 49);
  }
}

TEST(LinearColouring, GivesUpBeyondTheMost) {
  EXPECT_FALSE(smallest_colouring({{1}, {2}, {3}}, 1, 3).has_value());
  EXPECT_TRUE(smallest_colouring({{1}, {2}, {3}}, 1, 4).has_value());
}

TEST(LinearColouring, OfABoxNumbersItsElements) {
  Colouring c = one_colour_each({3, 4});
  EXPECT_EQ(c.count, 12);
  std::vector<bool> seen(12, false);
  for (int64_t y = 5; y < 9; ++y) {
    for (int64_t x = -2; x < 1; ++x) {
      auto colour = static_cast<size_t>(c.of(std::vector<int64_t>{x, y}));
      EXPECT_FALSE(seen[colour]);
      seen[colour] = true;
    }
  }
}

Adjacency random_graph(std::mt19937& random, int vertices, int edges) {
  Adjacency graph(static_cast<size_t>(vertices));
  std::uniform_int_distribution<int> pick(0, vertices - 1);
  for (int e = 0; e < edges; ++e) {
    int a = pick(random), b = pick(random);
    if (a == b) continue;
    graph[static_cast<size_t>(a)].push_back(b);
    graph[static_cast<size_t>(b)].push_back(a);
  }
  for (auto& list : graph) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return graph;
}

// Checks the definition: neighbours differ, and every entry is the only one of its colour in its row or in its
// transpose's.
bool recovers(const Adjacency& graph, const VertexColours& c) {
  for (int i = 0; i < static_cast<int>(graph.size()); ++i) {
    for (int j : graph[static_cast<size_t>(i)]) {
      if (c.of[static_cast<size_t>(i)] == c.of[static_cast<size_t>(j)]) return false;
      if (!is_alone(graph, c, i, j) && !is_alone(graph, c, j, i)) return false;
    }
  }
  return true;
}

TEST(StarColouring, RecoversRandomSymmetricMatrices) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 300; ++trial) {
    int vertices = 2 + trial % 25;
    Adjacency graph = random_graph(random, vertices, trial % 60);
    VertexColours c = star_colouring(graph);
    EXPECT_TRUE(recovers(graph, c)) << trial;
    EXPECT_LE(c.count, vertices);
  }
}

TEST(StarColouring, KnownCounts) {
  Adjacency arrow(6), path(9);
  for (int i = 1; i < 6; ++i) {
    arrow[0].push_back(i);
    arrow[static_cast<size_t>(i)].push_back(0);
  }
  for (int i = 0; i + 1 < 9; ++i) {
    path[static_cast<size_t>(i)].push_back(i + 1);
    path[static_cast<size_t>(i) + 1].push_back(i);
  }
  EXPECT_EQ(star_colouring(arrow).count, 2);
  EXPECT_EQ(star_colouring(path).count, 3);
  EXPECT_EQ(star_colouring(Adjacency(4)).count, 1);
}

// The smallest number of colours, by trying every assignment.
int fewest(const Adjacency& graph) {
  auto n = static_cast<int>(graph.size());
  for (int colours = 1;; ++colours) {
    VertexColours c{std::vector<int>(graph.size(), 0), colours};
    for (;;) {
      if (recovers(graph, c)) return colours;
      int v = 0;
      while (v < n && ++c.of[static_cast<size_t>(v)] == colours) c.of[static_cast<size_t>(v++)] = 0;
      if (v == n) break;
    }
  }
}

TEST(StarColouring, IsWithinOneOfTheOptimumOnSmallGraphs) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 40; ++trial) {
    Adjacency graph = random_graph(random, 6, 3 + trial % 8);
    int count = star_colouring(graph).count, best = fewest(graph);
    EXPECT_GE(count, best);
    EXPECT_LE(count, best + 1);
  }
}

TEST(ColumnColouring, ColumnsOfOneRowDiffer) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 100; ++trial) {
    std::vector<std::vector<int>> rows(12);
    size_t widest = 0;
    for (auto& row : rows) {
      for (int c = 0; c < 15; ++c) {
        if (random() % 5 == 0) row.push_back(c);
      }
      widest = std::max(widest, row.size());
    }
    VertexColours c = colour_columns(rows, 15);
    EXPECT_GE(c.count, static_cast<int>(widest));
    for (const auto& row : rows) {
      std::vector<int> seen;
      for (int column : row) seen.push_back(c.of[static_cast<size_t>(column)]);
      std::sort(seen.begin(), seen.end());
      EXPECT_TRUE(std::adjacent_find(seen.begin(), seen.end()) == seen.end());
    }
  }
}

struct PatternQuery {
  Var x{"x"};
  Func seed{"seed"}, g{"g"};
  CompressionQuery query;
  PatternQuery() {
    seed(x) = 1.0f;
    g(x) = seed(clamp(3 * x / 2, 0, 6)) + seed(x % 3);
    const Box box{{Expr(0), Expr(6)}};
    query = {.output = g.function(), .seed = seed.function(), .rows = box, .columns = box};
  }
};

TEST(Compression, PatternsThatTakeTooLongToFindAreRefused) {
  CompressionQuery query = PatternQuery().query;
  EXPECT_NE(Compressed::make(query), nullptr);
  query.operations = 20;
  expect_error<Unsupported>(
      {query.output->name.c_str(), "bounded search", "20 operations", "single directions"},
      [&] { Compressed::make(query); });
}

// A pattern of pieces in steps, which isl joins by their hull. isl crashes if its budget of operations ends there.
TEST(Compression, PiecesAreJoinedWhateverIsLeftOfTheOperations) {
  for (unsigned long operations : {1, 50, 400}) {
    IslContext context;
    const isl::set steps(isl::ctx(context.ctx),
                         "{ [x, y] : 0 <= x <= 3 and 0 <= y <= 3; [x, y] : 4 <= x <= 5 and "
                         "1 <= y <= 2; [x, y] : x = 6 and y = 1 }");
    isl_ctx_reset_operations(context.ctx);
    isl_ctx_set_max_operations(context.ctx, operations);
    EXPECT_LE(isl_set_n_basic_set(coalesced(steps).get()), 3);
    EXPECT_EQ(isl_ctx_get_max_operations(context.ctx), operations);
  }
}

// The budget of operations ends anywhere between the pattern and its last entry.
TEST(Compression, IsFoundOrRefusedForAnyNumberOfOperations) {
  const Expr place = variable("p");
  int found = 0, refused = 0;
  for (unsigned long operations = 20; operations < 6000; operations += 20) {
    CompressionQuery query = PatternQuery().query;
    query.operations = operations;
    try {
      const auto matrix = Compressed::make(query);
      const FuncPtr all = matrix->evaluate();
      ASSERT_NE(all, nullptr);
      EXPECT_FALSE(is_const_true(matrix->may_be_nonzero({place}, {place})));
      const auto offsets = matrix->offsets();
      ASSERT_TRUE(offsets.has_value());
      EXPECT_EQ(offsets->at(0).min, -6);
      EXPECT_EQ(offsets->at(0).max, 2);
      found++;
    } catch (const Unsupported& e) {
      expect_mentions(e.what(), {"bounded search"});
      refused++;
    }
  }
  EXPECT_GT(found, 0);
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace retrograde::autodiff
