// Which iterations of updates meet, and which orders of loops keep theirs.
#include <gtest/gtest.h>

#include "autoschedule/access/dependences.h"
#include "frontend/language/integer_ops.h"
#include "support/variables.h"

namespace retrograde {
namespace {

using namespace planning;
using Range = ir::ConstantRange;
using Distances = std::vector<std::vector<Range>>;

// The last stage of a program of one Func.
struct LastStage {
  explicit LastStage(const Func& f) : graph({f.function()}), dependences(graph) {
    id.func = graph.find(f.function().get());
    id.stage = static_cast<int16_t>(graph.func(id.func).stages.size() - 1);
  }
  Distances distances() {
    return ir::mapped(dependences.of(id).all(), &planning::Dependence::distances);
  }
  bool at_once(int iterator, IteratorSet around = 0) {
    return dependences.may_run_at_once(id, iterator, around);
  }
  bool keeps(const std::vector<LoopStep>& loops) { return dependences.keeps_order(id, loops); }

  AccessGraph graph;
  Dependences dependences;
  StageId id;
};

const Range still{0, 0};
Range exactly(int64_t distance) { return {distance, distance}; }

TEST(Dependences, HaveConstantDistancesInATimeLoop) {
  Func f("f");
  RDom r(1, 98, 1, 20);
  f(x, y, c) = 1.0f;
  f(r.x, r.y, c) = f(r.x - 1, r.y - 1, c) + f(r.x + 1, r.y - 1, c);
  LastStage stage(f);  // c, r.x, r.y
  EXPECT_EQ(stage.distances(),
            (Distances{{still, exactly(1), exactly(1)}, {still, exactly(-1), exactly(1)}}));
  EXPECT_TRUE(stage.at_once(0)) << "a pure variable";
  EXPECT_FALSE(stage.at_once(1));
  EXPECT_TRUE(stage.at_once(1, set_of(2))) << "inside of a loop over time";
  EXPECT_FALSE(stage.at_once(2));
  EXPECT_TRUE(stage.at_once(2, set_of(1))) << "one place reads others";
  const StageDependences& forms = stage.dependences.of(stage.id);
  EXPECT_TRUE(forms.are_dependent(1) && forms.are_dependent(2));
  EXPECT_FALSE(forms.are_dependent(0) || forms.are_dependent(1, set_of(2)));
  EXPECT_FALSE(stage.dependences.commutes(stage.id));
  EXPECT_TRUE(stage.dependences.of(stage.id).writes_once(set_of(1) | set_of(2)));
}

TEST(Dependences, AreKeptByLoopsThatRunTheEarlierIterationFirst) {
  Func f("f");
  RDom r(1, 98, 1, 20);
  f(x, y) = 1.0f;
  f(r.x, r.y) = f(r.x - 1, r.y - 1) + f(r.x + 1, r.y - 1);
  LastStage stage(f);  // r.x, r.y
  EXPECT_TRUE(stage.keeps({{1}, {0}}));
  EXPECT_FALSE(stage.keeps({{0}, {1}}));
  EXPECT_TRUE(stage.keeps({{1}, {0, 1, true}}));
  EXPECT_FALSE(stage.keeps({{1, 1, true}, {0}}));
  EXPECT_TRUE(stage.keeps({{1, 4}, {1}, {0, 8}, {0}}));
  EXPECT_FALSE(stage.keeps({{1, 4}, {0, 8}, {1}, {0}})) << "tiles of time and place";
  EXPECT_FALSE(stage.keeps({{1, 4}, {0, 8, true}, {1}, {0}}));
  EXPECT_TRUE(stage.keeps({{1}, {0, 8, true}, {0, 1, true}}));
  EXPECT_FALSE(stage.keeps({{1}, {1, 4}, {0}})) << "remainders of time outside";
}

TEST(Dependences, OfOneDirectionAllowTiles) {
  Func f("f");
  RDom r(1, 98, 1, 50);
  f(x, y) = 1.0f;
  f(r.x, r.y) = f(r.x - 1, r.y) + f(r.x, r.y - 1);
  LastStage stage(f);
  EXPECT_TRUE(stage.keeps({{0}, {1}}));
  EXPECT_TRUE(stage.keeps({{1, 8}, {0, 8}, {1}, {0}}));
  EXPECT_TRUE(stage.keeps({{0, 8}, {1, 8}, {0}, {1}}));
  EXPECT_FALSE(stage.at_once(0, set_of(1)));
}

TEST(Dependences, OfSumsAreCarriedButCommute) {
  ImageParam image(Float(32), 2, "image");
  Func sum("sum"), maximum("maximum"), last("last");
  RDom r(0, 30, 0, 20);
  sum(x) = 0.0f;
  sum(x) += image(x + r.x, r.y);
  LastStage stage(sum);  // x, r.x, r.y
  EXPECT_EQ(stage.distances(), (Distances{{still, {-29, 29}, {1, 19}}, {still, {1, 29}, still}}));
  EXPECT_FALSE(stage.at_once(1) || stage.at_once(1, set_of(2)) || stage.at_once(2));
  EXPECT_TRUE(stage.dependences.commutes(stage.id));
  EXPECT_FALSE(stage.keeps({{1}, {2}, {0}})) << "bits change";
  EXPECT_TRUE(stage.keeps({{2}, {0}, {1}}));
  EXPECT_FALSE(stage.keeps({{1, 1, true}, {2}, {0}}));
  EXPECT_FALSE(stage.dependences.of(stage.id).writes_once(set_of(1)));
  last(x) = 0.0f;
  last(x) = image(x + r.x, r.y);
  LastStage overwritten(last);
  EXPECT_FALSE(overwritten.dependences.commutes(overwritten.id));
  EXPECT_FALSE(overwritten.keeps({{1}, {2}, {0}}));
  EXPECT_TRUE(overwritten.keeps({{2}, {0}, {1}}));
}

TEST(Dependences, OfDataDependentWritesMayBeAnywhere) {
  ImageParam places(Int(32), 2, "places");
  Func bins("bins"), shifted("shifted");
  RDom r(0, 30, 0, 20);
  bins(x) = 0.0f;
  bins(places(r.x, r.y)) += 1.0f;
  LastStage stage(bins);
  EXPECT_EQ(stage.distances(), (Distances{{{-29, 29}, {1, 19}}, {{1, 29}, still}}));
  EXPECT_FALSE(stage.at_once(0) || stage.at_once(1));
  EXPECT_TRUE(stage.dependences.of(stage.id).are_dependent(0));
  // The row is data-dependent, but different for each r.x: the same summand for both iterations.
  shifted(x, y) = 0.0f;
  shifted(r.x + places(0, y), y) = shifted(r.x + places(0, y) + 40, y) + 1.0f;
  LastStage moved(shifted);  // y, r.x, r.y
  EXPECT_TRUE(moved.at_once(1));
  EXPECT_TRUE(moved.dependences.of(moved.id).are_independent(1, set_of(2)));
  EXPECT_FALSE(moved.at_once(2));
}

TEST(Dependences, RespectRemaindersAndConditions) {
  Func f("f"), g("g"), h("h"), k("k"), part("part");
  RDom r(0, 40), odd(1, 97), below(0, 10, 0, 10), last(0, 16, 0, 4);
  f(x) = 1.0f;
  f(2 * r) = f(2 * r + 1) + f(2 * r + 81);
  EXPECT_EQ(LastStage(f).distances(), Distances());
  odd.where(odd % 2 == 1);
  g(x) = 1.0f;
  g(odd) = g(odd - 1) + g(odd + 1);
  EXPECT_EQ(LastStage(g).distances(), Distances());
  below.where(below.x < below.y);
  h(x, y) = 1.0f;
  h(below.x, below.y) = h(below.y, below.x);
  EXPECT_EQ(LastStage(h).distances(), Distances()) << "transposes one half into the other";
  k(x) = 1.0f;
  k(r / 4) = k(r / 4 + 1) + 1.0f;
  EXPECT_EQ(LastStage(k).distances(), (Distances{{{1, 3}}, {{1, 7}}}));
  last.where(16 * last.y + last.x < 50);
  part(y) = 0.0f;
  part(last.y) += 1.0f;
  LastStage tail(part);
  const StageDependences& forms = tail.dependences.of(tail.id);
  EXPECT_TRUE(forms.are_dependent(0)) << "in all but the last parts";
  EXPECT_TRUE(forms.are_independent(1) && tail.at_once(1));
}

TEST(Dependences, SeeThatDigitsOfOneNumberDiffer) {
  Func f("f"), g("g"), h("h");
  Param<int> size("size");
  RDom r(0, 4, 0, 25), s(0, size, 0, size);
  f(x) = 1.0f;
  f(4 * r.y + r.x) += 1.0f;
  EXPECT_EQ(LastStage(f).distances(), Distances());
  f(3 * r.y + r.x) += 1.0f;
  EXPECT_EQ(LastStage(f).distances(), (Distances{{exactly(-3), exactly(1)}}));
  // Full rank, of loops whose sizes are not known.
  g(x, y) = 1.0f;
  g(2 * s.x + s.y, s.x + s.y) += 1.0f;
  LastStage full(g);
  EXPECT_EQ(full.distances(), Distances());
  EXPECT_TRUE(full.dependences.of(full.id).writes_once(set_of(0) | set_of(1)));
  g(2 * s.x + 2 * s.y, s.x + s.y) += 1.0f;
  LastStage deficient(g);
  EXPECT_FALSE(deficient.dependences.of(deficient.id).writes_once(set_of(0) | set_of(1)));
  EXPECT_TRUE(deficient.dependences.of(deficient.id).writes_once(set_of(0)));
}

TEST(Dependences, OfReversedReadsDependOnBothIterations) {
  Func f("f"), g("g");
  RDom half(0, 10), all(0, 20);
  f(x) = 1.0f;
  f(19 - half) = f(half);
  EXPECT_EQ(LastStage(f).distances(), Distances()) << "one half is written, the other read";
  g(x) = 1.0f;
  g(19 - all) = g(all);
  LastStage stage(g);
  EXPECT_FALSE(stage.at_once(0));
  EXPECT_EQ(stage.distances(), (Distances{{{1, 19}}}));
}

TEST(Dependences, HoldForAllPointsOfAnIteration) {
  Func f("f"), g("g");
  RDom r(0, 10);
  f(x, y) = 1.0f;
  f(r, scatter(0, 1)) = f(r, gather(1, 0));
  EXPECT_TRUE(LastStage(f).at_once(0));
  g(x) = 1.0f;
  g(r + scatter(0, 1)) = g(r + gather(1, 0));
  EXPECT_FALSE(LastStage(g).at_once(0));
}

TEST(Dependences, AskTheRulesOfDirectivesWhereFormsAreSilent) {
  Func f("f"), g("g");
  Param<int> size("size");
  RDom colours(1, 30, 0, 6), half(0, size / 2);
  const Expr is_due = (colours.x + colours.y) % 2 == 0;
  f(x) = 1.0f;
  f(colours.x) = select(is_due, f(colours.x - 1) + f(colours.x + 1), f(colours.x));
  LastStage stage(f);
  EXPECT_FALSE(stage.dependences.of(stage.id).are_independent(0, set_of(1)));
  EXPECT_TRUE(stage.at_once(0, set_of(1))) << "odd places read even ones";
  EXPECT_TRUE(stage.keeps({{1}, {0, 1, true}}));
  g(x) = 1.0f;
  g(size - 1 - half) = g(half);
  LastStage mirrored(g);
  EXPECT_FALSE(mirrored.dependences.of(mirrored.id).are_independent(0));
  EXPECT_FALSE(mirrored.dependences.of(mirrored.id).are_dependent(0));
  EXPECT_TRUE(mirrored.at_once(0));
}

}  // namespace
}  // namespace retrograde
