// One test for each check of definitions, schedules and arguments: the kind of the error, and a
// phrase of its rule.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include "support/errors.h"

using namespace retrograde;

namespace {

struct Setting {
  Var x{"x"}, y{"y"}, z{"z"}, xo{"xo"}, xi{"xi"};
  Func f{"source"};
  Setting() { f(x, y) = x + y; }
};

// ---- expressions ----

TEST(ExpressionErrors, UndefinedOperand) {
  expect_error({"undefined"}, [] { Expr e = Expr() + 1; });
  expect_error({"sqrt", "must be a defined expression"}, [] { sqrt(Expr()); });
  expect_error({"lerp", "must be a defined expression"}, [] { lerp(Expr(), 1.0f, 0.5f); });
}

TEST(ExpressionErrors, BitsOfFloats) {
  expect_error({"bitwise_and"}, [] { Expr e = Expr(1.0f) & 3; });
  expect_error({"it takes integers"}, [] { Expr e = Expr(1.0f) << 3; });
  expect_error({"popcount", "float32"}, [] { popcount(Expr(1.0f)); });
}

TEST(ExpressionErrors, LiteralThatDoesNotFit) {
  expect_error({"300", "fit"}, [] { Expr e = cast<uint8_t>(Var("x")) + 300; });
}

TEST(ExpressionErrors, SelectOnSomethingThatIsNoBool) {
  expect_error({"bool"}, [] { select(Var("x"), 1, 2); });
}

TEST(ExpressionErrors, SelectBetweenTuplesOfDifferentSizes) {
  expect_error({"one size"}, [] { select(Expr(true), Tuple(1, 2), Tuple(1, 2, 3)); });
}

TEST(ExpressionErrors, ReinterpretToAnotherWidth) {
  expect_error({"equally wide"}, [] { reinterpret<double>(Expr(1.0f)); });
}

TEST(ExpressionErrors, LerpOfDifferentTypes) {
  Var x;
  expect_error({"both values have one type"},
               [&] { lerp(cast<uint8_t>(x), cast<uint16_t>(x), 0.5f); });
  expect_error({"weight"}, [&] { lerp(cast<float>(x), cast<float>(x), x); });
}

TEST(ExpressionErrors, FmaOfIntegers) {
  Var x;
  expect_error({"fma", "it takes floats", "int32"}, [&] { fma(x, x, 1); });
  expect_error({"fma", "must be a defined expression"}, [&] { fma(1.0f, Expr(), 1.0f); });
}

TEST(ExpressionErrors, FastFunctionsOfDoubles) {
  expect_error({"fast_exp", "float32"}, [] { fast_exp(Expr(1.0)); });
}

TEST(ExpressionErrors, MuxOfNothing) {
  expect_error({"at least one value"}, [] { mux(Expr(0), std::vector<Expr>{}); });
}

TEST(ExpressionErrors, PrintWhenWithoutACondition) {
  expect_error({"print_when", "bool"}, [] { print_when(Expr(1), Expr(2)); });
  expect_error({"require", "bool"}, [] { require(Expr(1), Expr(2), "text"); });
}

TEST(ExpressionErrors, RandomSeedThatIsNoInteger) {
  expect_error({"seed is an integer"}, [] { random_float(Expr(0.5f)); });
}

// rule: the name of a Var is an identifier
TEST(ExpressionErrors, NamesThatAreNoIdentifiers) {
  expect_error({"\"a b\"", "identifier"}, [] { Var v("a b"); });
}

TEST(ExpressionErrors, TupleIndexOutOfRange) {
  expect_error({"it has 2 elements"}, [] {
    Tuple t(1, 2);
    t[2];
  });
  expect_error({"at least one element"}, [] { Tuple t(std::vector<Expr>{}); });
}

// ---- calls ----

TEST(CallErrors, UndefinedFunc) {
  Func g("nothing");
  Var x("x");
  expect_error({"\"nothing\"", "defined before it is read"}, [&] { Expr e = g(x); });
  expect_error({"defined before it is read"}, [&] {
    Func h;
    h(x) = g(x) + 1;
  });
}

TEST(CallErrors, WrongNumberOfCoordinates) {
  Setting s;
  expect_error({"one coordinate for each dimension", "2 dimensions", "1 coordinates"},
               [&] { Expr e = s.f(s.x); });
  Buffer<float> b(3, 3);
  ImageParam in(Float(32), 3, "three");
  expect_error({"one coordinate for each dimension"}, [&] { Expr e = b(s.x); });
  expect_error({"\"three\"", "one coordinate for each dimension"}, [&] { Expr e = in(s.x, s.y); });
  expect_error({"one coordinate for each dimension"}, [&] { Expr e = s.f(s.x, s.y, s.z, _); });
}

TEST(CallErrors, FloatCoordinates) {
  Setting s;
  expect_error({"coordinates are integers", "float32"}, [&] { Expr e = s.f(s.x * 0.5f, s.y); });
}

TEST(CallErrors, UndefinedCoordinates) {
  Setting s;
  expect_error({"must be a defined expression"}, [&] { Expr e = s.f(Expr(), s.y); });
}

TEST(CallErrors, TupleAsOneValue) {
  Var x("x");
  Func t("pair");
  t(x) = Tuple(x, x + 1);
  expect_error({"\"pair\"", "Tuple"}, [&] { Expr e = t(x); });
  expect_error({"it has 2 values"}, [&] { Expr e = t(x)[2]; });
  expect_error({"values()"}, [&] { t.value(); });
}

// ---- definitions ----

TEST(DefinitionErrors, UndefinedRightHandSide) {
  Var x("x");
  expect_error({"\"g_undefined\"", "must be a defined expression"}, [&] {
    Func g("g_undefined");
    g(x) = Expr();
  });
  expect_error({"element 1 of the Tuple"}, [&] {
    Func g;
    g(x) = Tuple(x, Expr());
  });
  expect_error({"must be a defined expression"}, [&] {
    Func g;
    g(x) += Expr();
  });
}

TEST(DefinitionErrors, UndefinedLeftHandSide) {
  expect_error({"left-hand side must be a defined expression"}, [&] {
    Func g;
    g(Expr()) = 1;
  });
}

// rule: the arguments of a first definition are Vars
TEST(DefinitionErrors, ArgumentsOfAFirstDefinitionAreDistinctVars) {
  Var x("x");
  expect_error({"are Vars", "(x + 1)"}, [&] {
    Func g;
    g(x + 1) = x;
  });
  expect_error({"are Vars"}, [&] {
    Func g;
    g(3) = x;
  });
  expect_error({"different Vars", "appears twice"}, [&] {
    Func g;
    g(x, x) = x;
  });
  Param<int> p("p_arg", 1);
  expect_error({"are Vars"}, [&] {
    Func g;
    g(p) = 1;
  });
}

TEST(DefinitionErrors, FreeVariables) {
  Setting s;
  expect_error({"\"z\"", "appears on the left-hand side"}, [&] {
    Func g;
    g(s.x) = s.x + s.z;
  });
  s.f(s.x, s.y) = 1;
  expect_error({"\"y\"", "appears on the left-hand side"}, [&] { s.f(s.x, 3) = s.y; });
  expect_error({"appears on the left-hand side"}, [&] { s.f(s.x, s.z) = s.y; });
}

TEST(DefinitionErrors, ImplicitVariablesWithoutPlaceholder) {
  Setting s;
  expect_error({"needs _ on the left-hand side"}, [&] {
    Func g;
    g(s.x) = s.f(s.x, _0);
  });
}

TEST(DefinitionErrors, ReductionVariablesInAFirstDefinition) {
  Var x("x");
  RDom r(0, 4);
  expect_error({"no reduction variables"}, [&] {
    Func g;
    g(x) = x + r;
  });
}

TEST(DefinitionErrors, ReductionVariablesOfTwoDomains) {
  Var x("x");
  RDom r(0, 4), q(0, 4);
  expect_error({"come from one RDom"}, [&] {
    Func g;
    g(x) = 0;
    g(x) += r + q;
  });
  RDom p(0, 4);
  p.where(p.x < q.x);
  expect_error({"come from one RDom"}, [&] {
    Func g;
    g(x) = 0;
    g(x) += p;
  });
}

TEST(DefinitionErrors, BoundsOfADomainThatReadTheFuncItself) {
  expect_error<UserError>({"\"f\"", "before its update runs", "f(5)", "another Func"}, [] {
    Func f("f");
    Var x("x");
    f(x) = x;
    RDom r(0, clamp(f(5), 0, 8), "r");
    f(r) = f(r) + 1;
  });
}

// rule: all definitions of a Func have the same number of values
TEST(DefinitionErrors, UpdateOfAnotherTypeOrSize) {
  Setting s;
  expect_error({"same types", "int32", "float32"}, [&] { s.f(s.x, s.y) = 1.5f; });
  expect_error({"same types"}, [&] { s.f(s.x, s.y) += cast<uint64_t>(s.x); });
  Func sum("sum");
  sum(s.x) = 0;
  expect_error({"The constant 0 of the first definition is of type int32", "0.0f, in Python 0.0"},
               [&] { sum(s.x) += 0.5f; });
  expect_error({"cast(float64, 0)"}, [&] { sum(s.x) += Expr(0.5); });
  Func ramp("ramp");
  ramp(s.x) = s.x;
  expect_error({"Convert the right-hand side: cast(int32, ...)"}, [&] { ramp(s.x) += 0.5f; });
  expect_error({"the same number of arguments"}, [&] { s.f(s.x) = 1; });
  expect_error({"the same number of values"}, [&] { s.f(s.x, s.y) = Tuple(1, 2); });
  expect_error({"the same number of values"}, [&] { s.f(s.x, s.y) += Tuple(1, 2); });
}

TEST(DefinitionErrors, UpdateAfterUse) {
  Setting s;
  Func g("user");
  g(s.x, s.y) = s.f(s.x, s.y);
  expect_error({"\"source", "complete when another Func uses it"}, [&] { s.f(s.x, s.y) += 1; });
}

TEST(DefinitionErrors, AStepOfARecurrenceThatContainsASum) {
  Var i("i");
  RDom k(0, 4, "k"), t(1, 8, "t");
  ImageParam w(Float(32), 2, "w");
  Var n("n");
  Func h("hidden");
  h(i, n) = 0.0f;
  expect_error({"it runs over one RDom", "make each step a Func of its own"},
               [&] { h(i, t) = tanh(sum(w(k, i) * h(k, t - 1))); });
  expect_error({"complete when another Func uses it", "reads \"sum\", which reads \"hidden\"",
                "step n reads step n - 1"},
               [&] { h(i, t) = tanh(sum(k, w(k, i) * h(k, t - 1))); });
  Func user("user");
  user(i) = h(i, 0);
  expect_error({"complete when another Func uses it"}, [&] { h(i, t) = h(i, t - 1) + 1.0f; });
}

TEST(DefinitionErrors, UpdateWithoutFirstDefinition) {
  Var x("x");
  Func g("fresh");
  expect_error({"defined before it is read"}, [&] { g(x)[0] = 1; });
}

TEST(DefinitionErrors, FloatCoordinateOnTheLeft) {
  Setting s;
  expect_error({"coordinates are integers"}, [&] { s.f(cast<float>(s.x), s.y) = 1; });
}

TEST(DefinitionErrors, PureVariableOutOfItsPlace) {
  Setting s;
  expect_error({"keeps its position", "Use an RDom"}, [&] { s.f(s.x, s.y) = s.f(s.x - 1, s.y); });
  expect_error({"keeps its position"}, [&] { s.f(s.x, s.y) += s.f(s.y, s.x); });
}

TEST(DefinitionErrors, RecurrenceWithoutFirstValue) {
  Var x("x");
  Func g("recurrence");
  expect_error({"\"recurrence\"", "defined before it is read"}, [&] { g(x) = g(x - 1) + 1; });
}

TEST(DefinitionErrors, RecursionAmongFuncs) {
  // Cannot be written with Funcs; contents assembled by hand are checked too.
  Var x("x");
  Func a("circle_a"), b("circle_b");
  a(x) = x;
  b(x) = a(x);
  a.function()->pure->values[0] = b(x);
  expect_error({"circle", "\"circle_b\" -> \"circle_a\""},
               [&] { graph::topological_order({b.function()}); });
  a.function()->pure->values[0] = x;
}

// rule: a definition has the dimensions that the Func was declared with
TEST(DefinitionErrors, DeclaredTypesAndDimensions) {
  Var x("x");
  expect_error({"\"declared\"", "float32", "int32"}, [&] {
    Func g(Float(32), 1, "declared");
    g(x) = x;
  });
  expect_error({"declared with 2"}, [&] {
    Func g(Int(32), 2);
    g(x) = x;
  });
}

// rule: a parameter and a pure variable of one definition have different names
TEST(DefinitionErrors, ParameterNamedLikeAVar) {
  Var x("same_name");
  Param<int> p("same_name", 1);
  expect_error({"different names", "\"same_name\""}, [&] {
    Func g;
    g(x) = x + p;
  });
}

// rule: parameters of one pipeline have different names
TEST(DefinitionErrors, TwoParametersOfOneName) {
  Var x("x");
  Param<int> p("twin", 1), q("twin", 2);
  Func g;
  g(x) = p + q;
  expect_error({"different names", "\"twin\""}, [&] { g.infer_arguments(); });
}

// ---- reduction domains ----

TEST(DomainErrors, BoundsThatAreNoIntegers) {
  expect_error({"must be an integer"}, [] { RDom r(0.5f, 3); });
  expect_error({"must be a defined expression"}, [] { RDom r(Expr(), 3); });
  expect_error({"not negative"}, [] { RDom r(0, -3); });
  expect_error({"at least one variable"}, [] { RDom r(Region{}); });
}

TEST(DomainErrors, BoundsThatVary) {
  Var x("x");
  expect_error({"known before any loop starts", "\"x\""}, [&] { RDom r(0, x); });
}

TEST(DomainErrors, LatePredicate) {
  Var x("x");
  RDom r(0, 4);
  Func g;
  g(x) += r;
  expect_error({"before the domain's first use"}, [&] { r.where(r > 2); });
}

TEST(DomainErrors, PredicateThatIsNoBool) {
  RDom r(0, 4);
  expect_error({"bool"}, [&] { r.where(r + 1); });
  expect_error({"must be a defined expression"}, [&] { r.where(Expr()); });
  expect_error({"the RDom was given a domain"}, [&] { RDom().where(Expr(true)); });
}

TEST(DomainErrors, SeveralVariablesAsOne) {
  RDom r(0, 4, 0, 4);
  expect_error({"only a domain of one variable"}, [&] { Expr e = r; });
  expect_error({"it has 2 variables"}, [&] { r[2]; });
}

TEST(DomainErrors, NameOfALoopAsAValue) {
  RVar r("rxo");
  expect_error({"only a variable of an RDom"}, [&] { Expr e = r; });
}

TEST(DomainErrors, InlineReductionWithoutADomain) {
  Var x("x");
  RDom r(0, 3), q(0, 3);
  expect_error({"must use a reduction variable"}, [&] { sum(Expr(x)); });
  expect_error({"one RDom"}, [&] { sum(r + q); });
  expect_error({"must be defined"}, [&] { sum(Expr()); });
  Setting s;
  expect_error({"must have no definition"}, [&] { sum(Expr(r), s.f); });
}

TEST(BoundaryErrors, MoreBoundsThanDimensions) {
  using namespace retrograde::BoundaryConditions;
  Setting s;
  expect_error({"at most its dimensions"}, [&] { repeat_edge(s.f, {{0, 1}, {0, 1}, {0, 1}}); });
  expect_error({"must have a definition"}, [&] { repeat_edge(Func("empty"), {{0, 1}}); });
  expect_error({"one constant for each value"}, [&] {
    constant_exterior(s.f, Tuple(0, 1), {{0, 1}});
  });
}

// ---- schedules ----

TEST(ScheduleErrors, UndefinedFunc) {
  Var x("x");
  Func g("unscheduled");
  expect_error({"\"unscheduled\"", "needs a definition"}, [&] { g.vectorize(x, 4); });
  expect_error({"needs a definition"}, [&] { g.bound(x, 0, 4); });
}

TEST(ScheduleErrors, UnknownLoop) {
  Setting s;
  expect_error({"\"z\" must be a loop", "\"y\", \"x\""}, [&] { s.f.parallel(s.z); });
  expect_error({"\"z\" must be a loop"}, [&] { s.f.split(s.z, s.xo, s.xi, 4); });
  expect_error({"must be a loop"}, [&] { s.f.vectorize(s.z, 4); });
  expect_error({"must be a loop"}, [&] { s.f.unroll(s.z); });
  expect_error({"must be a loop"}, [&] { s.f.reorder(s.z, s.x); });
  expect_error({"must be a loop"}, [&] { s.f.fuse(s.x, s.z, s.xo); });
  expect_error({"must be a loop"}, [&] { s.f.rename(s.z, s.xo); });
}

TEST(ScheduleErrors, LoopThatWasSplitAway) {
  Setting s;
  s.f.split(s.x, s.xo, s.xi, 4);
  expect_error({"\"x\" was split into \"xo\" and \"xi\""},
               [&] { s.f.split(s.x, Var("a"), Var("b"), 4); });
  expect_error({"was split into"}, [&] { s.f.parallel(s.x); });
}

TEST(ScheduleErrors, LoopThatWasFusedAway) {
  Setting s;
  s.f.fuse(s.x, s.y, s.z);
  expect_error({"\"x\" was fused into \"z\""}, [&] { s.f.vectorize(s.x); });
}

// rule: the loops of a stage have different names
TEST(ScheduleErrors, ReusedNames) {
  Setting s;
  expect_error({"\"y\" is a loop already"}, [&] { s.f.split(s.x, s.y, s.xi, 4); });
  expect_error({"different names"}, [&] { s.f.split(s.x, s.xo, s.xo, 4); });
  s.f.split(s.x, s.xo, s.xi, 4);
  expect_error({"\"xi\" is a loop already"}, [&] { s.f.rename(s.y, s.xi); });
  EXPECT_NO_THROW(s.f.split(s.y, s.x, Var("yi"), 4)) << "no loop has the name x any more";
}

// rule: a factor is at least 1
TEST(ScheduleErrors, FactorsThatAreNotPositive) {
  Setting s;
  expect_error({"at least 1", "it is 0"}, [&] { s.f.split(s.x, s.xo, s.xi, 0); });
  expect_error({"at least 1", "it is -4"}, [&] { s.f.vectorize(s.x, -4); });
  expect_error({"a factor is an integer"}, [&] { s.f.unroll(s.x, Expr(2.5f)); });
  expect_error({"must be a defined expression"}, [&] { s.f.parallel(s.x, Expr()); });
}

// rule: each loop is named once
TEST(ScheduleErrors, ReorderNamesALoopTwice) {
  Setting s;
  expect_error({"named twice"}, [&] { s.f.reorder(s.x, s.x); });
}

TEST(ScheduleErrors, FuseOfLoopsThatAreNotNeighbours) {
  Var x("x"), y("y"), z("z"), t("t");
  Func g;
  g(x, y, z) = x;
  expect_error({"two loops"}, [&] { g.fuse(x, x, t); });
  g.fuse(x, z, t);
  EXPECT_EQ(g.get_schedule().dims[0].var, "t");
  EXPECT_EQ(g.get_schedule().dims[1].var, "y");
  RDom r(0, 4, 0, 4, 0, 4);
  g(x, y, z) = g(x, y, z) * 2 + r.x + r.y + r.z;
  expect_error({"fuse", "order of reduction loops"},
               [&] { g.update().fuse(r.x, r.z, RVar("rt")); });
}

TEST(ScheduleErrors, TileWithListsOfDifferentLengths) {
  Setting s;
  expect_error({"one length"}, [&] { s.f.tile({s.x, s.y}, {s.xi}, {4, 4}); });
}

TEST(ScheduleErrors, RacesOverReductionVariables) {
  Var x("x"), y("y");
  RDom r(0, 8);
  Func g("racy");
  g(x) = 0;
  g(x) += r;
  expect_error(
      {"vectorize \"racy.update(0)\"", "must not touch the same element", "Use \"x\" instead"},
      [&] { g.update().vectorize(r, 4); });
  expect_error({"must not touch the same element"}, [&] { g.update().parallel(r); });
  RVar ro("ro"), ri("ri");
  g.update().split(r, ro, ri, 2);
  expect_error({"must not touch the same element"}, [&] { g.update().parallel(ro); });
  Func scan("scan");
  scan(x) = 0;
  scan(r + 1) = scan(r) + 1;
  expect_error({"must not touch the same element"}, [&] { scan.update().vectorize(r, 4); });
}

TEST(ScheduleErrors, OrderOfReductionLoopsThatMatters) {
  Var x("x");
  RDom r(0, 8, 0, 8);
  Func g("ordered");
  g(x) = 0;
  g(x) = g(x) * 2 + r.x + 3 * r.y;
  expect_error({"only where it changes no result"}, [&] { g.update().reorder(r.y, r.x); });
  g.update().reorder(x, r.x, r.y);  // the reduction loops keep their order
}

TEST(ScheduleErrors, TailsThatWouldRepeatPoints) {
  Var x("x"), xo("xo"), xi("xi");
  RDom r(0, 8);
  RVar ro("ro"), ri("ri");
  Func g;
  g(x) = 0;
  g(x) += r;
  expect_error({"does not run a point twice"},
               [&] { g.update().split(x, xo, xi, 4, TailStrategy::ShiftInwards); });
  expect_error({"exactly over its domain"},
               [&] { g.update().split(r, ro, ri, 4, TailStrategy::RoundUp); });
}

TEST(ScheduleErrors, UpdateThatDoesNotExist) {
  Setting s;
  expect_error({"it has 0 update definitions"}, [&] { s.f.update(0); });
  expect_error({"it has 0 update definitions"}, [&] { s.f.update_value(3); });
}

TEST(ScheduleErrors, BoundsOfUnknownVariables) {
  Setting s;
  expect_error({"must be a pure variable", "\"x\", \"y\""}, [&] { s.f.bound(s.z, 0, 3); });
  expect_error({"not negative"}, [&] { s.f.bound(s.x, 0, -3); });
  expect_error({"must be a pure variable"}, [&] { s.f.set_estimate(s.z, 0, 3); });
  expect_error({"one for each dimension"}, [&] { s.f.set_estimates({{0, 3}}); });
  expect_error({"must be one of its dimensions"}, [&] { s.f.reorder_storage(s.x, s.z); });
}

// ---- buffers and parameters ----

// rule: an extent is not negative
TEST(BufferErrors, Sizes) {
  expect_error({"not negative", "-1 x 3"}, [] { Buffer<float> b(-1, 3); });
  expect_error({"address space"}, [] { Buffer<double> b(INT32_MAX, INT32_MAX, INT32_MAX); });
  expect_error({"address space", "1073741824 x 1073741824"},
               [] { Buffer<double> b(1 << 30, 1 << 30); });
}

// Dimension 2 would begin at element 2^31, which is negative as an int32.
TEST(BufferErrors, StridesThatOverflow) {
  const int n = 1 << 16, half = 1 << 15;
  static uint8_t memory[4];  // never touched
  const std::initializer_list<std::string_view> words{"strides must fit 31 bits",
                                                      "65536 x 32768 x 2", "2147483648"};
  expect_error(words, [&] { Buffer<uint8_t> b(memory, n, half, 2); });
  expect_error(words, [&] { Buffer<uint8_t> b(memory, std::vector<int>{n, half, 2}); });
  expect_error(words, [&] { Buffer<> b(UInt(8), static_cast<void*>(memory), n, half, 2); });
  expect_error(words, [&] { Buffer<uint8_t> b(n, half, 2); });
  expect_error(words, [&] {
    Buffer<uint8_t> b(std::vector<int>{n, half, 2}, std::vector<int>{0, 1, 2});
  });
  expect_error({"strides must fit 31 bits"},
               [&] { Buffer<uint8_t>::make_interleaved(n, 3, half + 1); });
  expect_error({"strides must fit 31 bits"},
               [&] { Buffer<uint8_t>::make_interleaved(memory, n, 3, half); });
  expect_error({"strides must fit 31 bits"},
               [&] { Buffer<>::make_interleaved(UInt(8), n, 3, half); });
  // All strides are 0 here: the shape is legal, but a dense Buffer of it would not be.
  const halide_dimension_t shape[] = {{0, n, 0}, {0, half, 0}, {0, 2, 0}};
  Buffer<uint8_t> same(memory, 3, shape);
  expect_error(words, [&] { Buffer<float>::make_with_shape_of(same); });
  expect_error(words, [&] { same.copy(); });
  expect_error(words, [&] { same.copy_to_planar(); });
  const halide_dimension_t wide[] = {{0, n, 0}, {0, 2, 0}, {0, half, 0}};
  expect_error({"strides must fit 31 bits"},
               [&] { Buffer<uint8_t>(memory, 3, wide).copy_to_interleaved(); });
  const halide_dimension_t plane[] = {{0, n, 1}, {0, half, n}};
  Buffer<uint8_t> flat(memory, 2, plane);
  expect_error({"strides must fit 31 bits", "2147483648"}, [&] { flat.embed(2); });
  expect_error({"strides must fit 31 bits"}, [&] { flat.add_dimension(); });
  EXPECT_EQ(flat.dimensions(), 2);
  EXPECT_EQ(flat.cropped(1, 0, 2).embedded(2).stride(2), 2 * n);
}

TEST(BufferErrors, StridesThatJustFit) {
  static uint8_t memory[4];  // never touched
  const Buffer<uint8_t> b(memory, 65535, 32768, 2);
  EXPECT_EQ(b.stride(2), 2147450880);
  const Buffer<uint8_t> two(memory, 50000, 50000);
  EXPECT_EQ(two.number_of_elements(), 2500000000u);
  EXPECT_EQ(&two(49999, 49999) - two.data(), 2499999999);
}

TEST(BufferErrors, CoordinatesThatOverflow) {
  Buffer<uint8_t> b(4, 4);
  const std::initializer_list<std::string_view> words{"coordinates must fit int32"};
  expect_error(words, [&] { b.set_min(0, INT32_MAX); });
  expect_error(words, [&] { b.set_min(INT32_MAX - 3); });
  b.set_min(INT32_MAX - 4, INT32_MIN);
  EXPECT_EQ(b.right(), INT32_MAX - 1);
  expect_error(words, [&] { b.translate(0, 1); });
  expect_error(words, [&] { b.translate(1, -1); });
  expect_error(words, [&] { b.translated({0, -1}); });
}

TEST(BufferErrors, CopiesOfWhatIsNotThere) {
  Buffer<uint8_t> b(4, 4);
  expect_error({"an interleaved Buffer has three dimensions", "it has 2"},
               [&] { b.copy_to_interleaved(); });
  b.deallocate();
  expect_error({"the buffer must have memory"}, [&] { b.copy(); });
}

TEST(BufferErrors, UndefinedHandle) {
  Buffer<float> b;
  Var x("x");
  expect_error({"it was never given one"}, [&] { b.width(); });
  expect_error({"operator()"}, [&] { b(0); });
  expect_error({"operator()"}, [&] { Expr e = b(x); });
}

TEST(BufferErrors, WrongStaticTypeOrDimensions) {
  Buffer<> b(Float(32), 3, 3);
  expect_error({"element types must agree", "float32"}, [&] { Buffer<int> c = b; });
  expect_error({"dimensions must agree"}, [&] { b.as<float, 3>(); });
  expect_error({"it has 2 dimensions"}, [&] { b.dim(2); });
}

TEST(BufferErrors, CropsAndSlicesOutside) {
  Buffer<float> b(8, 8, "cropped");
  expect_error({"\"cropped\"", "lies inside the buffer", "[0, 8)"}, [&] { b.crop(0, 4, 8); });
  expect_error({"lies inside the buffer"}, [&] { b.slice(1, 8); });
  expect_error({"it has 2 dimensions"}, [&] { b.cropped(2, 0, 1); });
}

// rule: the buffer has as many dimensions as the parameter
// rule: a dimension is numbered from 0
TEST(ParameterErrors, BuffersThatDoNotFit) {
  ImageParam in(UInt(8), 2, "bytes");
  expect_error({"\"bytes\"", "uint8", "float32"}, [&] { in.set(Buffer<float>(3, 3)); });
  expect_error({"as many dimensions"}, [&] { in.set(Buffer<uint8_t>(3)); });
  expect_error({"it has 2 dimensions"}, [&] { in.dim(2).extent(); });
  expect_error({"not negative"}, [&] { in.dim(0).set_extent(-1); });
  expect_error({"needs a type and dimensions"}, [] { ImageParam().width(); });
  expect_error({"elements are numbers or pointers"}, [] { ImageParam bad(Type(), 1); });
}

TEST(ParameterErrors, ValuesThatDoNotFit) {
  Param<uint8_t> p("byte_p");
  expect_error({"\"byte_p\"", "300", "uint8"}, [&] { p.set(300); });
  expect_error({"must fit"}, [&] { p.set(-1); });
  expect_error({"must fit"}, [&] { p.set(0.5); });
  expect_error({"none"}, [&] { p.get(); });
  Param<> any(Int(32), "any_type_p");
  any.set(1);
  expect_error({"types must agree"}, [&] { any.get<float>(); });
  expect_error({"types must agree"}, [&] { Param<float> q(any); });
}

TEST(PipelineErrors, Outputs) {
  Setting s;
  expect_error({"\"no_output\"", "needs a definition"}, [] { Pipeline p(Func("no_output")); });
  expect_error({"at least one output"}, [] { Pipeline p(std::vector<Func>{}); });
  expect_error({"given twice"}, [&] { Pipeline p({s.f, s.f}); });
  expect_error({"constructed without any"}, [] { Pipeline().compile_jit(); });
  expect_error({"needs a definition"}, [] { Func("undefined_output").realize({3}); });
}

// ---- arguments of calls: checked before compilation ----

TEST(CallArguments, Sizes) {
  Setting s;
  expect_error<RuntimeError>({"one size for each dimension"}, [&] { s.f.realize({3}); });
  expect_error<RuntimeError>({"sizes are not negative", "dimension 1 is -1"}, [&] {
    s.f.realize({3, -1});
  });
  expect_error<RuntimeError>({"sizes are not negative"}, [&] { s.f.realize({-3, 4}); });
  expect_error<UserError>({"address space"}, [&] { s.f.realize({INT32_MAX, INT32_MAX}); });
}

// rule: must have the right element type
TEST(CallArguments, OutputBuffers) {
  Setting s;
  Buffer<float> wrong_type(4, 4);
  Buffer<int> wrong_dimensions(4), undefined, right(4, 4);
  expect_error<RuntimeError>({"element type", "float32", "int32"},
                             [&] { s.f.realize(wrong_type); });
  expect_error<RuntimeError>({"number of dimensions"}, [&] { s.f.realize(wrong_dimensions); });
  expect_error<RuntimeError>({"must not be null"}, [&] { s.f.realize(undefined); });
  expect_error<RuntimeError>({"one buffer for each value"}, [&] { s.f.realize({right, right}); });
  expect_error<RuntimeError>({"must not be null"},
                             [&] { s.f.realize(static_cast<halide_buffer_t*>(nullptr)); });
  Runtime::Buffer<int> no_memory(nullptr, 4, 4);
  expect_error<RuntimeError>({"must have memory"}, [&] { s.f.realize(no_memory); });
}

}  // namespace
