// undef: nothing is stored where it is selected.
#include <gtest/gtest.h>

#include "retrograde/retrograde.h"
#include "support/variables.h"

namespace retrograde {
namespace {

std::vector<int> values_of(const Buffer<int>& b) {
  std::vector<int> values;
  for (int i = 0; i < b.width(); ++i) values.push_back(b(i));
  return values;
}
using Ints = std::vector<int>;

TEST(ResolveUndef, AnUndefArmKeepsWhatWasStored) {
  Func f("f");
  RDom r(0, 4);
  f(x) = 7;
  f(r) = select(r == 2, 9, undef<int>());
  f(r) = select(r != 3, undef<int>(), 5);
  EXPECT_EQ(values_of(f.realize({4})), (Ints{7, 7, 9, 5}));
}

TEST(ResolveUndef, ThePureDefinitionStoresOnlyWhereItIsDefined) {
  Func f("f");
  f(x) = select(x % 2 == 0, x, undef<int>());
  Buffer<int> out(4);
  out.fill(-1);
  f.realize(out);
  EXPECT_EQ(values_of(out), (Ints{0, -1, 2, -1}));
}

TEST(ResolveUndef, NestedSelectsAndArithmetic) {
  Func f("f");
  RDom r(0, 6);
  Expr inner = select(r % 2 == 0, r * 10, undef<int>());
  f(x) = -1;
  f(r) = select(r < 3, inner + 1, r == 4, undef<int>(), 100);
  EXPECT_EQ(values_of(f.realize({6})), (Ints{1, -1, 21, 100, -1, 100}));
}

TEST(ResolveUndef, AnInlinedFuncBringsItsUndef) {
  Func f("f"), sparse("sparse");
  RDom r(0, 4);
  sparse(x) = select(x > 1, x, undef<int>());
  f(x) = 50;
  f(r) = sparse(r) * 2;
  EXPECT_EQ(values_of(f.realize({4})), (Ints{50, 50, 4, 6}));
}

TEST(ResolveUndef, WithAPredicateOfTheDomainAndVectors) {
  Buffer<int> in(8);
  for (int i = 0; i < 8; ++i) in(i) = i;
  Func f("f");
  RDom r(0, 16);
  r.where(r < 8);  // the elements beyond are not read
  f(x) = 0;
  f(r) = select(in(r) % 3 == 0, in(r) + 20, undef<int>());
  f.update().vectorize(r, 4);
  EXPECT_EQ(values_of(f.realize({8})), (Ints{20, 0, 0, 23, 0, 0, 26, 0}));
}

TEST(ResolveUndef, ElementsOfATupleKeepTheirOldValuesByName) {
  Func f("f");
  RDom r(0, 4);
  f(x) = Tuple(1, 2);
  f(r) = Tuple(select(r < 2, r + 10, f(r)[0]), select(r == 1, f(r)[1], f(r)[0] + 30));
  Realization both = f.realize({4});
  EXPECT_EQ(values_of(both[0]), (Ints{10, 11, 1, 1}));
  EXPECT_EQ(values_of(both[1]), (Ints{31, 2, 31, 31}));
}

TEST(ResolveUndef, ElementsOfATupleWithOneCondition) {
  Func f("f");
  RDom r(0, 3);
  f(x) = Tuple(1, 2, 3);
  f(r) = Tuple(select(r == 1, f(r)[1], undef<int>()), undef<int>(),
               select(r == 1, f(r)[0], undef<int>()));
  Realization all = f.realize({3});
  EXPECT_EQ(values_of(all[0]), (Ints{1, 2, 1}));
  EXPECT_EQ(values_of(all[1]), (Ints{2, 2, 2}));
  EXPECT_EQ(values_of(all[2]), (Ints{3, 1, 3}));
}

TEST(ResolveUndef, AnElementUpdatedAloneSpeaksForAll) {
  Func f("f");
  RDom r(0, 4);
  f(x) = Tuple(1, 2, 3);
  f(r)[1] += select(r > 1, 10, undef<int>());
  Realization all = f.realize({4});
  EXPECT_EQ(values_of(all[0]), (Ints{1, 1, 1, 1}));
  EXPECT_EQ(values_of(all[1]), (Ints{2, 2, 12, 12}));
  EXPECT_EQ(values_of(all[2]), (Ints{3, 3, 3, 3}));
}

// An element that was never stored may hold any value, so it bounds no coordinate.
TEST(ResolveUndef, PartlyStoredValuesBoundNothing) {
  Func index("index"), table("table"), out("out");
  index(x) = select(x == 0, 3, undef<int>());
  table(x) = x;
  out(x) = table(index(x));
  index.compute_root();
  table.compute_root();
  EXPECT_THROW(out.realize({4}), UserError);
}

}  // namespace
}  // namespace retrograde
