// Which loops of an update may run concurrently inside of which others, and which may be reordered. Random updates over
// small domains are compared with all pairs of their iterations.
#include "graph/definitions/race_checks.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "frontend/language/func.h"
#include "frontend/language/rdom.h"

namespace retrograde::graph {
namespace {

using Names = std::vector<std::string>;

struct RaceChecks : ::testing::Test {
  RaceChecks() { u(x, y, t) = 0; }
  // The update of u at `place`.
  void define(const std::vector<Expr>& place, const Expr& value) { u(place) = value; }
  const Definition& update() const { return u.function()->updates.at(0); }
  std::string name(int variable) const {
    return update().rvars.at(static_cast<size_t>(variable)).var;
  }

  // Whether the loop over variable i may run concurrently inside of loops over the others listed.
  bool is_free(int i, const std::vector<int>& around) const {
    std::unordered_set<std::string> names;
    for (const int j : around) names.insert(name(j));
    return can_prove_race_free(*u.function(), update(), name(i), names);
  }
  // The least slope of fronts over variables 0 and 1; 0: none up to 4.
  int slope() const {
    for (int slope = 1; slope <= 4; ++slope) {
      if (can_prove_skewed_order(*u.function(), update(), name(0), name(1), slope)) return slope;
    }
    return 0;
  }
  bool keeps_order(const std::vector<int>& after) const {
    Names from, to;
    for (size_t i = 0; i < after.size(); ++i) from.push_back(name(static_cast<int>(i)));
    for (const int i : after) to.push_back(name(i));
    return can_prove_same_order(*u.function(), update(), from, to);
  }

  Var x{"x"}, y{"y"}, t{"t"};
  Func u{"u"};
  RDom r{1, 8, 1, 6, 1, 5, "r"};
};

TEST_F(RaceChecks, StencilsOfTheStepBefore) {
  define({r.x, r.y, r.z}, u(r.x - 1, r.y, r.z - 1) + u(r.x + 1, r.y, r.z - 1) +
                              u(r.x, r.y - 1, r.z - 1) + u(r.x, r.y + 1, r.z - 1));
  EXPECT_TRUE(is_free(0, {2}));
  EXPECT_TRUE(is_free(1, {2}));
  EXPECT_TRUE(is_free(0, {1, 2}));
  EXPECT_FALSE(is_free(0, {}));
  EXPECT_FALSE(is_free(0, {1})) << "(x, y, t) reads (x - 1, y, t - 1)";
  EXPECT_FALSE(is_free(2, {}));
  EXPECT_TRUE(keeps_order({1, 0, 2}));
  EXPECT_FALSE(keeps_order({0, 2, 1}));
  EXPECT_FALSE(keeps_order({2, 0, 1}));
}

// Loops over strips of four rows and over the rows of a strip, which keeps the name.
TEST_F(RaceChecks, StepsOfALoop) {
  define({r.x, r.y, r.z}, u(r.x - 1, r.y - 1, r.z));
  const std::string x = name(0), y = name(1), z = name(2);
  const std::vector<Split> strips{{Split::Kind::Split, y, "strips", y, 4}};
  const auto keeps = [&](const Names& after) {
    return can_prove_same_order(*u.function(), update(), {x, y, "strips", z}, after, strips);
  };
  EXPECT_TRUE(keeps({y, x, "strips", z}));
  EXPECT_TRUE(keeps({y, "strips", x, z}));
  EXPECT_FALSE(keeps({x, "strips", y, z})) << "row 4 would run before row 3";
}

TEST_F(RaceChecks, StepsOfALoopOverRowsThatLieAStepApart) {
  define({r.x, r.y, r.z}, u(r.x + 1, r.y - 4, r.z));
  const std::string x = name(0), y = name(1), z = name(2);
  const std::vector<Split> strips{{Split::Kind::Split, y, "strips", y, 4}};
  const auto keeps = [&](const Names& after) {
    return can_prove_same_order(*u.function(), update(), {x, y, "strips", z}, after, strips);
  };
  EXPECT_TRUE(keeps({x, "strips", y, z}));
  EXPECT_TRUE(keeps({y, x, "strips", z}));
  EXPECT_FALSE(keeps({y, "strips", x, z})) << "column x + 1 runs later";
}

TEST_F(RaceChecks, TwoStepsBack) {
  define({r.x, r.y, r.z},
         2 * u(r.x, r.y, r.z - 1) - u(r.x, r.y, r.z - 2) + u(r.x + 1, r.y, r.z - 1));
  EXPECT_TRUE(is_free(0, {2}));
  EXPECT_TRUE(is_free(1, {})) << "rows are independent";
  EXPECT_FALSE(is_free(0, {1}));
}

TEST_F(RaceChecks, AReadWithinTheStep) {
  define({r.x, r.y, r.z}, u(r.x - 1, r.y, r.z) + u(r.x + 1, r.y, r.z - 1));
  EXPECT_FALSE(is_free(0, {2}));
  EXPECT_FALSE(is_free(0, {1, 2}));
  EXPECT_TRUE(is_free(1, {}));
}

TEST_F(RaceChecks, SymbolicSizes) {
  Param<int> width("width"), steps("steps");
  RDom s(1, width - 2, 1, 6, 1, steps, "s");
  define({s.x, s.y, s.z}, u(s.x - 1, s.y, s.z - 1) + u(s.x + 1, s.y + 1, s.z - 1));
  EXPECT_TRUE(is_free(0, {2}));
  EXPECT_TRUE(is_free(1, {2}));
  EXPECT_FALSE(is_free(0, {}));
}

// In place, half of the points at a time.
TEST_F(RaceChecks, RedAndBlackPoints) {
  RDom s(1, 8, 1, 6, 0, 2, 0, 4, "s");
  s.where((s.x + s.y) % 2 == s.z);
  define({s.x, s.y, 0},
         u(s.x - 1, s.y, 0) + u(s.x + 1, s.y, 0) + u(s.x, s.y - 1, 0) + u(s.x, s.y + 1, 0));
  EXPECT_TRUE(is_free(0, {2, 3}));
  EXPECT_TRUE(is_free(1, {2, 3}));
  EXPECT_FALSE(is_free(0, {3})) << "black points read red ones";
  EXPECT_TRUE(is_free(0, {2})) << "red points read black ones only";
  EXPECT_FALSE(keeps_order({0, 1, 3, 2})) << "all sweeps of the red points first";
}

// The other points store the value that they have.
TEST_F(RaceChecks, RedAndBlackPointsByChoice) {
  const Expr here = u(r.x, r.y, 0);
  const Expr next = u(r.x - 1, r.y, 0) + u(r.x + 1, r.y, 0) + u(r.x, r.y - 1, 0);
  define({r.x, r.y, 0}, select((r.x + r.y + r.z) % 2 == 0, next, here));
  EXPECT_TRUE(is_free(0, {2}));
  EXPECT_TRUE(is_free(1, {2}));
  EXPECT_FALSE(is_free(0, {}));
  EXPECT_FALSE(can_prove_race_free(*u.function(), update(), name(0), {name(2)}, true));
  EXPECT_TRUE(keeps_order({1, 0, 2}));
  EXPECT_FALSE(keeps_order({2, 0, 1}));
}

TEST_F(RaceChecks, TheFirstArmMayKeepTheValue) {
  const Expr here = u(r.x, r.y, 0);
  define({r.x, r.y, 0}, select((r.x + r.y) % 2 == r.z % 2, here, u(r.x - 1, r.y, 0)));
  EXPECT_TRUE(is_free(0, {2}));
  EXPECT_FALSE(is_free(0, {}));
}

TEST_F(RaceChecks, AChoiceThatChangesBothColours) {
  const Expr next = u(r.x - 1, r.y, 0) + u(r.x + 1, r.y, 0);
  define({r.x, r.y, 0}, select((r.x + r.y + r.z) % 2 == 0, next, 2 * u(r.x, r.y, 0)));
  EXPECT_FALSE(is_free(0, {2}));
}

// An iteration that stores the old value would undo what another one stores there.
TEST_F(RaceChecks, AnElementOfWhichOneIterationKeepsTheValue) {
  define({r.y, r.z, 0}, select(r.x == 3, u(r.y, r.z, 0) + 1, u(r.y, r.z, 0)));
  EXPECT_FALSE(is_free(0, {1, 2}));
}

TEST_F(RaceChecks, PointsInPlaceOfOneColour) {
  RDom s(1, 8, 1, 6, 0, 2, 0, 4, "s");
  s.where((s.x + s.y) % 2 == s.z);
  define({s.x, s.y, 0}, u(s.x - 1, s.y - 1, 0) + u(s.x, s.y, 0));
  EXPECT_FALSE(is_free(0, {2, 3})) << "a diagonal neighbour has the same colour";
}

// Diagonals of a sweep that needs the points to the left and below.
TEST_F(RaceChecks, Wavefronts) {
  RDom s(0, 6, 0, 12, "s");
  s.where(s.y - s.x >= 0 && s.y - s.x < 6);
  const Expr i = s.x + 1, j = s.y - s.x + 1;
  define({i, j, 0}, u(i - 1, j, 0) + u(i, j - 1, 0));
  EXPECT_TRUE(is_free(0, {1}));
  EXPECT_FALSE(is_free(0, {}));
  EXPECT_TRUE(keeps_order({1, 0})) << "column by column";
}

TEST_F(RaceChecks, FrontsOfATable) {
  define({r.x, r.y, 0}, u(r.x - 1, r.y, 0) + u(r.x, r.y - 1, 0) + u(r.x - 1, r.y - 1, 0));
  EXPECT_EQ(slope(), 1);
}

TEST_F(RaceChecks, FrontsAreSteeperIfTheRowBeforeIsReadAhead) {
  define({r.x, r.y, 0}, u(r.x - 1, r.y, 0) + u(r.x + 2, r.y - 1, 0));
  EXPECT_EQ(slope(), 3);
}

TEST_F(RaceChecks, FrontsAreSteeperIfARowIsReadThatIsYetToBeWritten) {
  define({r.x, r.y, 0}, u(r.x - 1, r.y, 0) + u(r.x - 1, r.y + 1, 0));
  EXPECT_EQ(slope(), 2);
}

TEST_F(RaceChecks, FrontsOfRowsThatAreReadFurtherAway) {
  define({r.x, r.y, 0}, u(r.x - 3, r.y, 0) + u(r.x + 2, r.y - 3, 0));
  EXPECT_EQ(slope(), 1);
}

TEST_F(RaceChecks, NoFrontsOfARowThatIsReadAsAWhole) {
  define({r.x, r.y, 0}, u(r.x - 1, r.y, 0) + u(8, r.y - 1, 0));
  EXPECT_EQ(slope(), 0);
}

// The next row overwrites an element that this one reads a step later.
TEST_F(RaceChecks, FrontsOfARowInPlace) {
  define({r.x, 0, 0}, u(r.x - 1, 0, 0) + r.y);
  EXPECT_EQ(slope(), 2);
}

TEST_F(RaceChecks, FrontsOfReadsThatAreClamped) {
  define({r.x, r.y, 0}, u(max(r.x - 1, 0), r.y, 0) + u(r.x, max(r.y - 1, 1), 0));
  EXPECT_EQ(slope(), 1);
}

TEST_F(RaceChecks, PlacesThatDataDecide) {
  Func place("place");
  place(x) = x;
  define({place(r.x), r.y, r.z}, u(r.x, r.y, r.z - 1));
  EXPECT_FALSE(is_free(0, {1, 2}));
  EXPECT_TRUE(is_free(1, {}));
}

TEST_F(RaceChecks, StepsWhosePlaceDataDecide) {
  Func place("place");
  place(x) = x;
  define({r.x, r.y, place(r.z)}, u(r.x - 1, r.y, place(r.z) - 1));
  EXPECT_TRUE(is_free(0, {2})) << "the place is the same for all points of a step";
  EXPECT_FALSE(is_free(0, {}));
}

TEST_F(RaceChecks, PlacesThatTheFuncItselfDecides) {
  define({r.x, r.y, r.z}, u(u(r.x, r.y, r.z - 1), r.y, r.z - 1));
  EXPECT_TRUE(is_free(0, {2}));
  EXPECT_TRUE(is_free(1, {}));
  EXPECT_FALSE(is_free(0, {1}));
}

// ---- all pairs of iterations ----

using Point = std::vector<int>;

// The place of an access: for each dimension, factors of the variables and a constant; reduced to rest classes if
// `modulus` is positive.
struct Access {
  std::vector<Point> rows;
  int modulus = 0;

  Point at(const Point& iteration) const {
    Point place;
    for (const Point& row : rows) {
      int sum = row.back();
      for (size_t i = 0; i < iteration.size(); ++i) sum += row[i] * iteration[i];
      place.push_back(modulus ? (sum % modulus + modulus) % modulus : sum);
    }
    return place;
  }
  std::vector<Expr> exprs(const RDom& r) const {
    std::vector<Expr> result;
    for (const Point& row : rows) {
      Expr sum = row.back();
      for (size_t i = 0; i + 1 < row.size(); ++i) sum = sum + row[i] * r[static_cast<int>(i)];
      result.push_back(modulus ? sum % modulus : sum);
    }
    return result;
  }
};

struct RandomUpdate {
  static constexpr int dims = 2;

  explicit RandomUpdate(unsigned seed) : random(seed) {
    const int rank = 2 + pick(2);
    for (int i = 0; i < rank; ++i) extents.push_back(1 + pick(4));
    write = some_access(2);
    for (int n = 1 + pick(2); n > 0; --n)
      reads.push_back(pick(3) ? shifted(write) : some_access(3));
    parity = pick(3) == 0 ? 1 + pick(2) : 0;
    chooses = parity && pick(2);
  }

  int pick(int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); }
  Access some_access(int factors) {
    Access result;
    for (int d = 0; d < dims; ++d) {
      Point row(extents.size() + 1);
      for (int& factor : row) factor = pick(2) ? pick(factors) : 0;
      row[static_cast<size_t>(pick(static_cast<int>(extents.size())))] = pick(4) ? 1 : -1;
      result.rows.push_back(row);
    }
    if (pick(6) == 0) result.modulus = 2 + pick(3);
    return result;
  }
  Access shifted(Access access) {
    for (Point& row : access.rows) row.back() += pick(3) - 1;
    return access;
  }
  bool changes(const Point& p) const { return !parity || (p[0] + p[1]) % (parity + 1) == 0; }
  bool holds(const Point& p) const { return chooses || changes(p); }

  std::vector<Point> iterations() const {  // in their order
    std::vector<Point> all{Point(extents.size())};
    for (size_t i = 0; i < extents.size(); ++i) {
      std::vector<Point> more;
      for (int v = 0; v < extents[i]; ++v) {
        for (Point p : all) p[i] = v, more.push_back(p);
      }
      all = more;
    }
    std::erase_if(all, [&](const Point& p) { return !holds(p); });
    return all;
  }
  bool conflict(const Point& p, const Point& q) const {
    if (write.at(p) == write.at(q)) return true;
    return changes(p) && changes(q) && std::ranges::any_of(reads, [&](const Access& read) {
             return write.at(p) == read.at(q) || write.at(q) == read.at(p);
           });
  }
  Func func() const {
    std::vector<Range> ranges;
    for (const int extent : extents) ranges.push_back({0, extent});
    RDom r(ranges);
    const Expr changes = parity ? (r[0] + r[1]) % (parity + 1) == 0 : const_true();
    if (parity && !chooses) r.where(changes);
    Var x("x"), y("y");
    Func u("u");
    u(x, y) = 0;
    Expr sum = 1;
    for (const Access& read : reads) sum = sum + u(read.exprs(r));
    const std::vector<Expr> place = write.exprs(r);
    u(place) = chooses ? select(changes, sum + r[0], u(place)) : sum + r[0];
    return u;
  }

  std::mt19937 random;
  Point extents;
  Access write;
  std::vector<Access> reads;
  int parity = 0;
  bool chooses =
      false;  // between a new value and the old one by the parity, instead of skipping iterations
};

// Whether some pair of iterations that conflict has the property.
bool any_conflict(const RandomUpdate& u,
                  const std::function<bool(const Point&, const Point&)>& is) {
  const std::vector<Point> all = u.iterations();
  for (const Point& p : all) {
    for (const Point& q : all) {
      if (p != q && u.conflict(p, q) && is(p, q)) return true;
    }
  }
  return false;
}

bool runs_before(const Point& p, const Point& q, const std::vector<size_t>& order) {
  for (auto i = order.rbegin(); i != order.rend(); ++i) {
    if (p[*i] != q[*i]) return p[*i] < q[*i];
  }
  return false;
}

struct Score {
  int proven = 0, possible = 0;
};

void check_loops(const RandomUpdate& program, const FuncContents& f, Score& score) {
  const Definition& update = f.updates.at(0);
  const size_t rank = program.extents.size();
  if (update.rvars.size() != rank) return;
  for (size_t i = 0; i < rank; ++i) {
    for (unsigned around = 0; around < 1u << rank; ++around) {
      if (around >> i & 1u) continue;
      std::unordered_set<std::string> names;
      for (size_t j = 0; j < rank; ++j) {
        if (around >> j & 1u) names.insert(update.rvars[j].var);
      }
      const bool races = any_conflict(program, [&](const Point& p, const Point& q) {
        for (size_t j = 0; j < rank; ++j) {
          if ((around >> j & 1u) && p[j] != q[j]) return false;
        }
        return p[i] != q[i];
      });
      const bool proven = can_prove_race_free(f, update, update.rvars[i].var, names);
      EXPECT_FALSE(proven && races) << "variable " << i << " inside of " << around;
      score.proven += proven;
      score.possible += !races;
    }
  }
}

void check_orders(const RandomUpdate& program, const FuncContents& f, Score& score) {
  const Definition& update = f.updates.at(0);
  std::vector<size_t> before, after;
  for (size_t i = 0; i < program.extents.size(); ++i) before.push_back(i);
  if (update.rvars.size() != before.size()) return;
  const auto names = [&](const std::vector<size_t>& order) {
    Names result;
    for (const size_t i : order) result.push_back(update.rvars[i].var);
    return result;
  };
  after = before;
  do {
    const bool changes = any_conflict(program, [&](const Point& p, const Point& q) {
      return runs_before(p, q, before) && runs_before(q, p, after);
    });
    const bool proven = can_prove_same_order(f, update, names(before), names(after));
    EXPECT_FALSE(proven && changes);
    score.proven += proven;
    score.possible += !changes;
  } while (std::ranges::next_permutation(after).found);
}

void check_skews(const RandomUpdate& program, const FuncContents& f, Score& score) {
  const Definition& update = f.updates.at(0);
  const size_t rank = program.extents.size();
  if (update.rvars.size() != rank) return;
  std::vector<size_t> order;
  for (size_t i = 0; i < rank; ++i) order.push_back(i);
  for (int slope = 1; slope <= 3; ++slope) {
    const auto front = [&](const Point& p) { return p[0] + slope * p[1]; };
    const bool changes = any_conflict(program, [&](const Point& p, const Point& q) {
      const bool is_pair = rank < 3 || p[2] == q[2];
      return is_pair && runs_before(p, q, order) && front(p) >= front(q);
    });
    const bool proven =
        can_prove_skewed_order(f, update, update.rvars[0].var, update.rvars[1].var, slope);
    EXPECT_FALSE(proven && changes);
    score.proven += proven;
    score.possible += !changes;
  }
}

TEST(RaceChecksOfRandomUpdates, AreSoundAndRarelyUnsure) {
  Score loops, orders, skews;
  for (unsigned seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE(text("seed ", seed));
    const RandomUpdate program(seed);
    const Func u = program.func();
    check_loops(program, *u.function(), loops);
    check_orders(program, *u.function(), orders);
    check_skews(program, *u.function(), skews);
    if (::testing::Test::HasFailure()) return;
  }
  EXPECT_GT(loops.possible, 1000);
  EXPECT_GT(loops.proven, loops.possible * 9 / 10) << loops.possible;
  EXPECT_GT(orders.proven, orders.possible * 9 / 10) << orders.possible;
  EXPECT_GT(skews.proven, skews.possible * 9 / 10) << skews.possible;
}

}  // namespace
}  // namespace retrograde::graph
