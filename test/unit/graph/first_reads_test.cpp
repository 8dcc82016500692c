// Tests which Funcs and images a Func reads, and that remembered answers follow its definitions.
#include "graph/definitions/first_reads.h"

#include <gtest/gtest.h>

#include "frontend/language/func.h"
#include "ir/node_set.h"
#include "ir/walk_once.h"

namespace retrograde::graph {
namespace {

const Var x("x");

std::vector<std::string> names_read(const Func& f) {
  std::vector<std::string> names;
  for (const ir::Call* call : first_reads(*f.function())) names.push_back(call->name);
  return names;
}

struct FirstReads : testing::Test {
  FirstReads() {
    a(x) = 1.0f;
    b(x) = 2.0f;
    f(x) = b(x) + a(x) * b(x + 1) + image(x);
  }
  Func a{"reads_a"}, b{"reads_b"}, f{"reads_f"};
  ImageParam image{Float(32), 1, "reads_image"};
};

TEST_F(FirstReads, AreInTheOrderOfTheWalkAndOnceForEach) {
  EXPECT_EQ(names_read(f), (std::vector<std::string>{b.name(), a.name(), "reads_image"}));
}

TEST_F(FirstReads, RememberedOnesFollowNewDefinitions) {
  const FirstReadsMemo memo;
  EXPECT_EQ(names_read(f).size(), 3u);
  const RDom r(0, 4);
  f(r) += f(r) * image(r + 1);
  EXPECT_EQ(names_read(f).back(), f.name()) << "the update reads the Func itself";
  EXPECT_EQ(names_read(f).size(), 4u);
}

TEST_F(FirstReads, RememberedOnesAreOfTheirFuncAlone) {
  const FirstReadsMemo memo;
  EXPECT_EQ(names_read(f).size(), 3u);
  EXPECT_TRUE(names_read(a).empty());
  const FirstReadsMemo inner;
  EXPECT_EQ(names_read(f).size(), 3u);
}

TEST(WalkOnce, NodesOfEarlierExpressionsAreSkipped) {
  const Expr shared = Expr(x) * 2, first = shared + 1, second = shared - 1;
  ir::NodeSet visited;
  int nodes = 0;
  const auto count = [&](const Expr&) { return ++nodes, true; };
  ir::walk_once(first, visited, count);
  const int of_first = nodes;
  ir::walk_once(second, visited, count);
  EXPECT_EQ(nodes - of_first, 2) << "the difference and its constant";
}

}  // namespace
}  // namespace retrograde::graph
