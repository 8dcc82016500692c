// Searches over plans: what they find, what they keep, and that nothing but the program decides it.
#include "autoschedule/search/search.h"

#include <gtest/gtest.h>

#include "autoschedule/search/fit_memory.h"
#include "autoschedule/search/start.h"
#include "unit/plan/plan_testing.h"

namespace retrograde::planning {
namespace {

// A blur of a costly Func, with its last stage at root and nothing else decided.
struct SearchTest : ::testing::Test {
  SearchTest() {
    heavy(x, y) = exp(sin(cast<float>(x)) * cast<float>(y));
    rows(x, y) = heavy(x - 1, y) + heavy(x, y) + heavy(x + 1, y);
    out(x, y) = rows(x, y - 1) + rows(x, y) + rows(x, y + 1);
    out.set_estimates({{0, 1000}, {0, 800}});
    heavy.compute_root();
    rows.compute_root();
    out.compute_root();
    start = imported({out});
    accesses.emplace(start.program->outputs);
    sizes.emplace(*accesses, SizeDefaults{unknown_extent});
  }
  SearchResult found(const SearchOptions& options) {
    CostModel cost(*accesses, *sizes, machine);
    Dependences dependences(*accesses);
    return search(start, {*accesses, *sizes, machine, dependences}, cost, options);
  }
  FuncId id(const std::string& name) const {
    for (size_t i = 0; i < start.program->funcs.size(); ++i) {
      if (graph::without_numbers(start.program->funcs[i]->name) == name)
        return static_cast<FuncId>(i);
    }
    return -1;
  }

  Var x{"x"}, y{"y"};
  Func heavy{"heavy"}, rows{"rows"}, out{"out"};
  const Machine machine = {};
  Plan start;
  std::optional<AccessGraph> accesses;
  std::optional<SizeModel> sizes;
};

TEST_F(SearchTest, SerialLoopsBecomeParallelVectorsAndProducersMove) {
  const SearchResult result = found({});
  const FoundPlan& best = result.found[0];
  // Two threads; lowering vectorises the loops of the start, too.
  EXPECT_LT(best.cost.seconds, result.start.cost.seconds / 2);
  EXPECT_FALSE(best.steps.empty());
  EXPECT_EQ(best.steps.back().seconds, best.cost.seconds);
  const std::string text = plain_text(best.plan);
  EXPECT_NE(text.find("out  root  parallel"), std::string::npos) << text;
  EXPECT_NE(text.find("vector x"), std::string::npos) << text;
  EXPECT_EQ(text.find("rows  root"), std::string::npos) << text;
  EXPECT_EQ(broken_invariant(best.plan), "");
}

TEST_F(SearchTest, FuncsThatAreToBeAtRootStayThere) {
  SearchOptions options;
  options.at_root.assign(start.funcs.size(), false);
  options.at_root[static_cast<size_t>(id("heavy"))] = true;
  const std::string text = plain_text(found(options).found[0].plan);
  EXPECT_NE(text.find("heavy  root"), std::string::npos) << text;
}

// heavy has 1002 x 802 elements and rows 1000 x 802, of 4 bytes, and both are alive at once.
TEST_F(SearchTest, FuncsLeaveMemoryUntilTheyFit) {
  CostModel cost(*accesses, *sizes, machine);
  Dependences dependences(*accesses);
  const Context context{*accesses, *sizes, machine, dependences};
  const auto fitted = [&](double most_bytes, double most_seconds) {
    SearchOptions options;
    options.most_bytes = most_bytes;
    return fit_memory({start, cost.price(start), {}}, context, cost, options, most_seconds);
  };
  const double all = 4 * (1002 + 1000) * 802.0;
  EXPECT_EQ(cost.price(start).peak_bytes, all);
  EXPECT_TRUE(fitted(all, 1).plan == start);
  EXPECT_TRUE(fitted(all / 2, 0).plan == start) << "it takes longer than it may";
  const FoundPlan half = fitted(all * 0.6, 1);
  EXPECT_LE(half.cost.peak_bytes, all * 0.6);
  EXPECT_GT(half.cost.peak_bytes, 0.1 * all) << "no more than has to leave memory";
  EXPECT_EQ(broken_invariant(half.plan), "");
}

TEST_F(SearchTest, AWiderSearchFindsNothingSlower) {
  const SearchResult narrow = found({.width = 1}), wide = found({.width = 4});
  EXPECT_LE(wide.found[0].cost.seconds, narrow.found[0].cost.seconds);
  EXPECT_GT(wide.priced, narrow.priced);
  for (const FoundPlan& other : wide.found)
    EXPECT_LE(wide.found[0].cost.seconds, 1.1 * other.cost.seconds) << "for shorter code";
}

TEST_F(SearchTest, EqualSearchesFindEqualPlans) {
  const SearchResult first = found({.width = 3}), second = found({.width = 3});
  ASSERT_EQ(first.found.size(), second.found.size());
  for (size_t i = 0; i < first.found.size(); ++i)
    EXPECT_EQ(to_text(first.found[i].plan), to_text(second.found[i].plan));
  EXPECT_EQ(first.priced, second.priced);
}

TEST_F(SearchTest, KeptFuncsRunAsBefore) {
  SearchOptions options;
  options.kept.assign(start.funcs.size(), false);
  options.kept[static_cast<size_t>(id("heavy"))] = true;
  for (const FoundPlan& found : found(options).found) {
    EXPECT_TRUE(found.plan.of(id("heavy")) == start.of(id("heavy")));
    for (const SearchStep& step : found.steps) EXPECT_NE(step.func, id("heavy"));
  }
}

// A product of matrices, one of which lies across the lanes of the tile.
TEST(SearchOperands, AreStoredAlongLanesUnlessTheyAreKept) {
  Var x{"x"}, y{"y"}, z{"z"};
  RDom r(0, 64);
  Func a("a"), rows("rows"), out("out");
  a(z, y) = cast<float>(z + y);
  rows(z, x) = cast<float>(z * x);
  out(x, y) = 0.0f;
  out(x, y) += a(r, y) * rows(r, x);
  out.set_estimates({{0, 512}, {0, 512}});
  for (Func* f : {&a, &rows, &out}) f->compute_root();
  const Plan start = imported({out});
  const AccessGraph accesses(start.program->outputs);
  const SizeModel sizes(accesses, {unknown_extent});
  const Machine machine = {};
  Dependences dependences(accesses);
  const auto& funcs = start.program->funcs;
  const auto kept = static_cast<FuncId>(std::ranges::find(funcs, rows.function()) - funcs.begin());
  const auto order = [&](const SearchOptions& options) {
    CostModel cost(accesses, sizes, machine);
    const SearchResult result =
        search(start, {accesses, sizes, machine, dependences}, cost, options);
    return result.found[0].plan.of(kept).storage.order;
  };
  EXPECT_EQ(order({}), (std::vector<int16_t>{1, 0}));
  SearchOptions options;
  options.kept.assign(start.funcs.size(), false);
  options.kept[static_cast<size_t>(kept)] = true;
  EXPECT_EQ(order(options), start.of(kept).storage.order);
}

TEST_F(SearchTest, PlansKeepWithinTheMemoryOfTheStart) {
  // Without `rows` at root, which the search stores again.
  start = parsed("out  root\nrows  inline\nheavy  root\n", start.program);
  SearchOptions options;
  options.most_bytes = CostModel(*accesses, *sizes, machine).price(start).peak_bytes;
  const SearchResult result = found(options);
  for (const FoundPlan& found : result.found)
    EXPECT_LE(found.cost.peak_bytes, result.start.cost.peak_bytes);
}

// A few values beside many: 0.4 % of the time.
TEST_F(SearchTest, FuncsWithASmallShareAreOnlyComputedElsewhere) {
  Func table("table"), few("few"), many("many");
  table(x, y) = sin(cast<float>(x + y));
  few(x, y) = table(x, y) * 2;
  many(x, y) = exp(sin(cast<float>(x)) * cast<float>(y)) + exp(few(x, y / 200) * cast<float>(y));
  many.set_estimates({{0, 1600}, {0, 1600}}).bound(x, 0, 1600);
  table.compute_root();
  few.compute_root();
  many.compute_root().parallel(y).vectorize(x, 16);
  start = imported({many});
  accesses.emplace(start.program->outputs);
  sizes.emplace(*accesses, SizeDefaults{unknown_extent});
  const SearchResult result = found({.least_gain_of_all = 0.0001});
  std::vector<std::string> moves;
  for (const SearchStep& step : result.found[0].steps)
    if (step.func == id("table")) moves.push_back(step.move);
  EXPECT_EQ(moves, (std::vector<std::string>{"compute_at", "inline_func"}));
}

TEST_F(SearchTest, ASearchFromNothingKeepsWhatItMust) {
  start = parsed("out  root  y:8, y, x\nrows  at out/y:8  y, x\nheavy  at rows/y  (y, x)  y, x\n",
                 start.program);
  Dependences dependences(*accesses);
  const Context context{*accesses, *sizes, machine, dependences};
  std::vector<bool> kept(start.funcs.size(), false);
  const Plan nothing = plan_from_nothing(start, kept, context);
  EXPECT_EQ(plain_text(nothing),
            "out  root  parallel y, x:16 GuardWithIf, vector x\n"
            "rows  root  parallel y, x:16 GuardWithIf, vector x\n"
            "heavy  root  parallel y, x:16 GuardWithIf, vector x\n");
  kept[static_cast<size_t>(id("rows"))] = true;  // with the loop in which it is computed
  EXPECT_EQ(plain_text(plan_from_nothing(start, kept, context)),
            "out  root  y:8, y, x\n"
            "rows  at out/y:8\n"
            "heavy  root  (y, x)  parallel x, y:16 GuardWithIf, vector y\n");  // as it is read
}

// Two outputs that read a Func in the loops that they share.
TEST_F(SearchTest, ASearchFromNothingKeepsTheReadersOfAKeptFunc) {
  Func both("both");
  both(x, y) = rows(x, y) - 1;
  both.set_estimates({{0, 1000}, {0, 800}});
  start = parsed(
      "both  root  shared with out/y  y, x\nout  root  y, x\nrows  at out/y  y, x\nheavy  root\n",
      std::vector<Func>{out, both});
  accesses.emplace(start.program->outputs);
  sizes.emplace(*accesses, SizeDefaults{unknown_extent});
  Dependences dependences(*accesses);
  std::vector<bool> kept(start.funcs.size(), false);
  kept[static_cast<size_t>(id("rows"))] = true;
  const Plan nothing = plan_from_nothing(start, kept, {*accesses, *sizes, machine, dependences});
  EXPECT_TRUE(nothing.of(id("both")) == start.of(id("both"))) << plain_text(nothing);
  EXPECT_EQ(broken_invariant(nothing), "");
}

TEST_F(SearchTest, ASearchFromNothingStoresWhatAnOpaqueFuncReads) {
  rows.memoize();
  start = imported({out});
  accesses.emplace(start.program->outputs);
  sizes.emplace(*accesses, SizeDefaults{unknown_extent});
  Dependences dependences(*accesses);
  const Plan nothing = plan_from_nothing(start, {}, {*accesses, *sizes, machine, dependences});
  EXPECT_EQ(plain_text(nothing),
            "out  root  parallel y, x:16 GuardWithIf, vector x\n"
            "rows  root  opaque memoize\n"
            "heavy  root  parallel y, x:16 GuardWithIf, vector x\n");
}

TEST_F(SearchTest, ASearchFromNothingKeepsLanesOfLongSums) {
  for (const int terms : {500, 600}) {
    Func sum("sum");
    RDom r(0, terms, "r");
    sum(y) = 0.0f;
    sum(y) += heavy(r.x, y);
    sum.set_estimate(y, 0, 100);
    sum.compute_root().update().allow_race_conditions().vectorize(r.x, 16);
    const Plan plan = imported({sum});
    const AccessGraph graph(plan.program->outputs);
    const SizeModel known(graph, SizeDefaults{unknown_extent});
    Dependences dependences(graph);
    const std::string text =
        plain_text(plan_from_nothing(plan, {}, {graph, known, machine, dependences}));
    EXPECT_EQ(text.find("vector r.x") != std::string::npos, terms == 600) << text;
  }
}

TEST_F(SearchTest, ResultsOfTwoStartsAreInOrder) {
  SearchResult both = found({});
  const size_t count = both.found.size();
  merge(both, found({}));  // nothing new
  EXPECT_EQ(both.found.size(), count);
  const SearchResult known = both;
  start = both.found[0].plan;
  start.funcs = parsed("out  root\nrows  inline\nheavy  root\n", start.program).funcs;
  merge(both, found({.without = {"compute_at", "slide"}}));
  EXPECT_GT(both.found.size(), count);
  EXPECT_TRUE(both.start.plan == known.start.plan);
  EXPECT_GT(both.priced, known.priced);
  EXPECT_TRUE(std::ranges::is_sorted(both.found, {},
                                     [](const FoundPlan& plan) { return plan.cost.seconds; }));
}

}  // namespace
}  // namespace retrograde::planning
