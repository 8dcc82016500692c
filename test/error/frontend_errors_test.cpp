// One test for each check of definitions, schedules and arguments: the kind of the error, and a
// phrase of its rule.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <functional>

using namespace retrograde;

namespace {

template <typename Kind>
void expect_error(const std::function<void()>& program, const std::vector<std::string>& phrases) {
  try {
    program();
    FAIL() << "no error";
  } catch (const Kind& error) {
    for (const std::string& phrase : phrases) {
      EXPECT_NE(std::string(error.what()).find(phrase), std::string::npos)
          << "\"" << phrase << "\" in\n"
          << error.what();
    }
    EXPECT_FALSE(error.message().rule.empty()) << error.what();
  }
}

void expect_compile_error(const std::function<void()>& program,
                          const std::vector<std::string>& phrases) {
  expect_error<CompileError>(program, phrases);
}

struct Setting {
  Var x{"x"}, y{"y"}, z{"z"}, xo{"xo"}, xi{"xi"};
  Func f{"source"};
  Setting() { f(x, y) = x + y; }
};

// ---- expressions ----

TEST(ExpressionErrors, UndefinedOperand) {
  expect_compile_error([] { Expr e = Expr() + 1; }, {"undefined"});
  expect_compile_error([] { sqrt(Expr()); }, {"sqrt", "must be a defined expression"});
  expect_compile_error([] { lerp(Expr(), 1.0f, 0.5f); }, {"lerp", "must be a defined expression"});
}

TEST(ExpressionErrors, BitsOfFloats) {
  expect_compile_error([] { Expr e = Expr(1.0f) & 3; }, {"bitwise_and"});
  expect_compile_error([] { Expr e = Expr(1.0f) << 3; }, {"it takes integers"});
  expect_compile_error([] { popcount(Expr(1.0f)); }, {"popcount", "float32"});
}

TEST(ExpressionErrors, LiteralThatDoesNotFit) {
  expect_compile_error([] { Expr e = cast<uint8_t>(Var("x")) + 300; }, {"300", "fit"});
}

TEST(ExpressionErrors, SelectOnSomethingThatIsNoBool) {
  expect_compile_error([] { select(Var("x"), 1, 2); }, {"bool"});
}

TEST(ExpressionErrors, SelectBetweenTuplesOfDifferentSizes) {
  expect_compile_error([] { select(Expr(true), Tuple(1, 2), Tuple(1, 2, 3)); }, {"one size"});
}

TEST(ExpressionErrors, ReinterpretToAnotherWidth) {
  expect_compile_error([] { reinterpret<double>(Expr(1.0f)); }, {"equally wide"});
}

TEST(ExpressionErrors, LerpOfDifferentTypes) {
  Var x;
  expect_compile_error([&] { lerp(cast<uint8_t>(x), cast<uint16_t>(x), 0.5f); },
                       {"both values have one type"});
  expect_compile_error([&] { lerp(cast<float>(x), cast<float>(x), x); }, {"weight"});
}

TEST(ExpressionErrors, FastFunctionsOfDoubles) {
  expect_compile_error([] { fast_exp(Expr(1.0)); }, {"fast_exp", "float32"});
}

TEST(ExpressionErrors, MuxOfNothing) {
  expect_compile_error([] { mux(Expr(0), std::vector<Expr>{}); }, {"at least one value"});
}

TEST(ExpressionErrors, PrintWhenWithoutACondition) {
  expect_compile_error([] { print_when(Expr(1), Expr(2)); }, {"print_when", "bool"});
  expect_compile_error([] { require(Expr(1), Expr(2), "text"); }, {"require", "bool"});
}

TEST(ExpressionErrors, RandomSeedThatIsNoInteger) {
  expect_compile_error([] { random_float(Expr(0.5f)); }, {"seed is an integer"});
}

// rule: the name of a Var is an identifier
TEST(ExpressionErrors, NamesThatAreNoIdentifiers) {
  expect_compile_error([] { Var v("a b"); }, {"\"a b\"", "identifier"});
}

TEST(ExpressionErrors, TupleIndexOutOfRange) {
  expect_compile_error(
      [] {
        Tuple t(1, 2);
        t[2];
      },
      {"it has 2 elements"});
  expect_compile_error([] { Tuple t(std::vector<Expr>{}); }, {"at least one element"});
}

// ---- calls ----

TEST(CallErrors, UndefinedFunc) {
  Func g("nothing");
  Var x("x");
  expect_compile_error([&] { Expr e = g(x); }, {"\"nothing\"", "defined before it is read"});
  expect_compile_error(
      [&] {
        Func h;
        h(x) = g(x) + 1;
      },
      {"defined before it is read"});
}

TEST(CallErrors, WrongNumberOfCoordinates) {
  Setting s;
  expect_compile_error([&] { Expr e = s.f(s.x); },
                       {"one coordinate for each dimension", "2 dimensions", "1 coordinates"});
  Buffer<float> b(3, 3);
  ImageParam in(Float(32), 3, "three");
  expect_compile_error([&] { Expr e = b(s.x); }, {"one coordinate for each dimension"});
  expect_compile_error([&] { Expr e = in(s.x, s.y); },
                       {"\"three\"", "one coordinate for each dimension"});
  expect_compile_error([&] { Expr e = s.f(s.x, s.y, s.z, _); },
                       {"one coordinate for each dimension"});
}

TEST(CallErrors, FloatCoordinates) {
  Setting s;
  expect_compile_error([&] { Expr e = s.f(s.x * 0.5f, s.y); },
                       {"coordinates are integers", "float32"});
}

TEST(CallErrors, UndefinedCoordinates) {
  Setting s;
  expect_compile_error([&] { Expr e = s.f(Expr(), s.y); }, {"must be a defined expression"});
}

TEST(CallErrors, TupleAsOneValue) {
  Var x("x");
  Func t("pair");
  t(x) = Tuple(x, x + 1);
  expect_compile_error([&] { Expr e = t(x); }, {"\"pair\"", "Tuple"});
  expect_compile_error([&] { Expr e = t(x)[2]; }, {"it has 2 values"});
  expect_compile_error([&] { t.value(); }, {"values()"});
}

// ---- definitions ----

TEST(DefinitionErrors, UndefinedRightHandSide) {
  Var x("x");
  expect_compile_error(
      [&] {
        Func g("g_undefined");
        g(x) = Expr();
      },
      {"\"g_undefined\"", "must be a defined expression"});
  expect_compile_error(
      [&] {
        Func g;
        g(x) = Tuple(x, Expr());
      },
      {"element 1 of the Tuple"});
  expect_compile_error(
      [&] {
        Func g;
        g(x) += Expr();
      },
      {"must be a defined expression"});
}

TEST(DefinitionErrors, UndefinedLeftHandSide) {
  expect_compile_error(
      [&] {
        Func g;
        g(Expr()) = 1;
      },
      {"left-hand side must be a defined expression"});
}

TEST(DefinitionErrors, HandleValues) {
  Var x("x");
  expect_compile_error(
      [&] {
        Func g;
        g(x) = Expr("text");
      },
      {"values are numbers"});
}

// rule: the arguments of a first definition are Vars
TEST(DefinitionErrors, ArgumentsOfAFirstDefinitionAreDistinctVars) {
  Var x("x");
  expect_compile_error(
      [&] {
        Func g;
        g(x + 1) = x;
      },
      {"are Vars", "(x + 1)"});
  expect_compile_error(
      [&] {
        Func g;
        g(3) = x;
      },
      {"are Vars"});
  expect_compile_error(
      [&] {
        Func g;
        g(x, x) = x;
      },
      {"different Vars", "stands there twice"});
  Param<int> p("p_arg", 1);
  expect_compile_error(
      [&] {
        Func g;
        g(p) = 1;
      },
      {"are Vars"});
}

TEST(DefinitionErrors, FreeVariables) {
  Setting s;
  expect_compile_error(
      [&] {
        Func g;
        g(s.x) = s.x + s.z;
      },
      {"\"z\"", "stands on the left-hand side"});
  s.f(s.x, s.y) = 1;
  expect_compile_error([&] { s.f(s.x, 3) = s.y; }, {"\"y\"", "stands on the left-hand side"});
  expect_compile_error([&] { s.f(s.x, s.z) = s.y; }, {"stands on the left-hand side"});
}

TEST(DefinitionErrors, ImplicitVariablesWithoutPlaceholder) {
  Setting s;
  expect_compile_error(
      [&] {
        Func g;
        g(s.x) = s.f(s.x, _0);
      },
      {"needs _ on the left-hand side"});
}

TEST(DefinitionErrors, ReductionVariablesInAFirstDefinition) {
  Var x("x");
  RDom r(0, 4);
  expect_compile_error(
      [&] {
        Func g;
        g(x) = x + r;
      },
      {"no reduction variables"});
}

TEST(DefinitionErrors, ReductionVariablesOfTwoDomains) {
  Var x("x");
  RDom r(0, 4), q(0, 4);
  expect_compile_error(
      [&] {
        Func g;
        g(x) = 0;
        g(x) += r + q;
      },
      {"come from one RDom"});
  RDom p(0, 4);
  p.where(p.x < q.x);
  expect_compile_error(
      [&] {
        Func g;
        g(x) = 0;
        g(x) += p;
      },
      {"come from one RDom"});
}

TEST(DefinitionErrors, BoundsOfADomainThatReadTheFuncItself) {
  expect_error<UserError>(
      [] {
        Func f("f");
        Var x("x");
        f(x) = x;
        RDom r(0, clamp(f(5), 0, 8), "r");
        f(r) = f(r) + 1;
      },
      {"\"f\"", "before its update runs", "f(5)", "another Func"});
}

// rule: all definitions of a Func have as many values
TEST(DefinitionErrors, UpdateOfAnotherTypeOrSize) {
  Setting s;
  expect_compile_error([&] { s.f(s.x, s.y) = 1.5f; }, {"same types", "int32", "float32"});
  expect_compile_error([&] { s.f(s.x, s.y) += cast<uint64_t>(s.x); }, {"same types"});
  expect_compile_error([&] { s.f(s.x) = 1; }, {"as many arguments"});
  expect_compile_error([&] { s.f(s.x, s.y) = Tuple(1, 2); }, {"as many values"});
  expect_compile_error([&] { s.f(s.x, s.y) += Tuple(1, 2); }, {"as many values"});
}

TEST(DefinitionErrors, UpdateAfterUse) {
  Setting s;
  Func g("user");
  g(s.x, s.y) = s.f(s.x, s.y);
  expect_compile_error([&] { s.f(s.x, s.y) += 1; },
                       {"\"source", "complete when another Func uses it"});
}

TEST(DefinitionErrors, UpdateWithoutFirstDefinition) {
  Var x("x");
  Func g("fresh");
  expect_compile_error([&] { g(x)[0] = 1; }, {"defined before it is read"});
}

TEST(DefinitionErrors, FloatCoordinateOnTheLeft) {
  Setting s;
  expect_compile_error([&] { s.f(cast<float>(s.x), s.y) = 1; }, {"coordinates are integers"});
}

TEST(DefinitionErrors, PureVariableOutOfItsPlace) {
  Setting s;
  expect_compile_error([&] { s.f(s.x, s.y) = s.f(s.x - 1, s.y); },
                       {"its own place", "Use an RDom"});
  expect_compile_error([&] { s.f(s.x, s.y) += s.f(s.y, s.x); }, {"its own place"});
}

TEST(DefinitionErrors, RecurrenceWithoutFirstValue) {
  Var x("x");
  Func g("recurrence");
  expect_compile_error([&] { g(x) = g(x - 1) + 1; },
                       {"\"recurrence\"", "defined before it is read"});
}

TEST(DefinitionErrors, RecursionAmongFuncs) {
  // Cannot be written with Funcs; contents put together by hand are checked too.
  Var x("x");
  Func a("circle_a"), b("circle_b");
  a(x) = x;
  b(x) = a(x);
  a.function()->pure->values[0] = b(x);
  expect_compile_error([&] { ir::topological_order({b.function()}); },
                       {"circle", "\"circle_b\" -> \"circle_a\""});
  a.function()->pure->values[0] = x;
}

// rule: a definition has the dimensions that the Func was declared with
TEST(DefinitionErrors, DeclaredTypesAndDimensions) {
  Var x("x");
  expect_compile_error(
      [&] {
        Func g(Float(32), 1, "declared");
        g(x) = x;
      },
      {"\"declared\"", "float32", "int32"});
  expect_compile_error(
      [&] {
        Func g(Int(32), 2);
        g(x) = x;
      },
      {"declared with 2"});
}

// rule: a parameter and a pure variable of one definition have different names
TEST(DefinitionErrors, ParameterNamedLikeAVar) {
  Var x("same_name");
  Param<int> p("same_name", 1);
  expect_compile_error(
      [&] {
        Func g;
        g(x) = x + p;
      },
      {"different names", "\"same_name\""});
}

// rule: parameters of one pipeline have different names
TEST(DefinitionErrors, TwoParametersOfOneName) {
  Var x("x");
  Param<int> p("twin", 1), q("twin", 2);
  Func g;
  g(x) = p + q;
  expect_compile_error([&] { g.infer_arguments(); }, {"different names", "\"twin\""});
}

// ---- reduction domains ----

TEST(DomainErrors, BoundsThatAreNoIntegers) {
  expect_compile_error([] { RDom r(0.5f, 3); }, {"must be an integer"});
  expect_compile_error([] { RDom r(Expr(), 3); }, {"must be a defined expression"});
  expect_compile_error([] { RDom r(0, -3); }, {"not negative"});
  expect_compile_error([] { RDom r(Region{}); }, {"at least one variable"});
}

TEST(DomainErrors, BoundsThatVary) {
  Var x("x");
  expect_compile_error([&] { RDom r(0, x); }, {"known before any loop starts", "\"x\""});
}

TEST(DomainErrors, LatePredicate) {
  Var x("x");
  RDom r(0, 4);
  Func g;
  g(x) += r;
  expect_compile_error([&] { r.where(r > 2); }, {"before the domain's first use"});
}

TEST(DomainErrors, PredicateThatIsNoBool) {
  RDom r(0, 4);
  expect_compile_error([&] { r.where(r + 1); }, {"bool"});
  expect_compile_error([&] { r.where(Expr()); }, {"must be a defined expression"});
  expect_compile_error([&] { RDom().where(Expr(true)); }, {"the RDom was given a domain"});
}

TEST(DomainErrors, SeveralVariablesAsOne) {
  RDom r(0, 4, 0, 4);
  expect_compile_error([&] { Expr e = r; }, {"only a domain of one variable"});
  expect_compile_error([&] { r[2]; }, {"it has 2 variables"});
}

TEST(DomainErrors, NameOfALoopAsAValue) {
  RVar r("rxo");
  expect_compile_error([&] { Expr e = r; }, {"only a variable of an RDom"});
}

TEST(DomainErrors, InlineReductionWithoutADomain) {
  Var x("x");
  RDom r(0, 3), q(0, 3);
  expect_compile_error([&] { sum(Expr(x)); }, {"must use a reduction variable"});
  expect_compile_error([&] { sum(r + q); }, {"one RDom"});
  expect_compile_error([&] { sum(Expr()); }, {"must be defined"});
  Setting s;
  expect_compile_error([&] { sum(Expr(r), s.f); }, {"must have no definition"});
}

TEST(BoundaryErrors, MoreBoundsThanDimensions) {
  using namespace retrograde::BoundaryConditions;
  Setting s;
  expect_compile_error(
      [&] {
        repeat_edge(s.f, {{0, 1}, {0, 1}, {0, 1}});
      },
      {"at most its dimensions"});
  expect_compile_error([&] { repeat_edge(Func("empty"), {{0, 1}}); }, {"must have a definition"});
  expect_compile_error(
      [&] {
        constant_exterior(s.f, Tuple(0, 1), {{0, 1}});
      },
      {"one constant for each value"});
}

// ---- schedules ----

TEST(ScheduleErrors, UndefinedFunc) {
  Var x("x");
  Func g("unscheduled");
  expect_compile_error([&] { g.vectorize(x, 4); }, {"\"unscheduled\"", "needs a definition"});
  expect_compile_error([&] { g.bound(x, 0, 4); }, {"needs a definition"});
}

TEST(ScheduleErrors, UnknownLoop) {
  Setting s;
  expect_compile_error([&] { s.f.parallel(s.z); }, {"\"z\" must be a loop", "\"y\", \"x\""});
  expect_compile_error([&] { s.f.split(s.z, s.xo, s.xi, 4); }, {"\"z\" must be a loop"});
  expect_compile_error([&] { s.f.vectorize(s.z, 4); }, {"must be a loop"});
  expect_compile_error([&] { s.f.unroll(s.z); }, {"must be a loop"});
  expect_compile_error([&] { s.f.reorder(s.z, s.x); }, {"must be a loop"});
  expect_compile_error([&] { s.f.fuse(s.x, s.z, s.xo); }, {"must be a loop"});
  expect_compile_error([&] { s.f.rename(s.z, s.xo); }, {"must be a loop"});
}

TEST(ScheduleErrors, LoopThatWasSplitAway) {
  Setting s;
  s.f.split(s.x, s.xo, s.xi, 4);
  expect_compile_error([&] { s.f.split(s.x, Var("a"), Var("b"), 4); },
                       {"\"x\" was split into \"xo\" and \"xi\""});
  expect_compile_error([&] { s.f.parallel(s.x); }, {"was split into"});
}

TEST(ScheduleErrors, LoopThatWasFusedAway) {
  Setting s;
  s.f.fuse(s.x, s.y, s.z);
  expect_compile_error([&] { s.f.vectorize(s.x); }, {"\"x\" was fused into \"z\""});
}

// rule: the loops of a stage have different names
TEST(ScheduleErrors, ReusedNames) {
  Setting s;
  expect_compile_error([&] { s.f.split(s.x, s.y, s.xi, 4); }, {"\"y\" is a loop already"});
  expect_compile_error([&] { s.f.split(s.x, s.xo, s.xo, 4); }, {"different names"});
  s.f.split(s.x, s.xo, s.xi, 4);
  expect_compile_error([&] { s.f.rename(s.y, s.xi); }, {"\"xi\" is a loop already"});
  EXPECT_NO_THROW(s.f.split(s.y, s.x, Var("yi"), 4)) << "no loop has the name x any more";
}

// rule: a factor is at least 1
TEST(ScheduleErrors, FactorsThatAreNotPositive) {
  Setting s;
  expect_compile_error([&] { s.f.split(s.x, s.xo, s.xi, 0); }, {"at least 1", "it is 0"});
  expect_compile_error([&] { s.f.vectorize(s.x, -4); }, {"at least 1", "it is -4"});
  expect_compile_error([&] { s.f.unroll(s.x, Expr(2.5f)); }, {"a factor is an integer"});
  expect_compile_error([&] { s.f.parallel(s.x, Expr()); }, {"must be a defined expression"});
}

// rule: each loop is named once
TEST(ScheduleErrors, ReorderNamesALoopTwice) {
  Setting s;
  expect_compile_error([&] { s.f.reorder(s.x, s.x); }, {"named twice"});
}

TEST(ScheduleErrors, FuseOfLoopsThatAreNotNeighbours) {
  Var x("x"), y("y"), z("z"), t("t");
  Func g;
  g(x, y, z) = x;
  expect_compile_error([&] { g.fuse(x, x, t); }, {"two loops"});
  g.fuse(x, z, t);
  EXPECT_EQ(g.get_schedule().dims[0].var, "t");
  EXPECT_EQ(g.get_schedule().dims[1].var, "y");
  RDom r(0, 4, 0, 4, 0, 4);
  g(x, y, z) = g(x, y, z) * 2 + r.x + r.y + r.z;
  expect_compile_error([&] { g.update().fuse(r.x, r.z, RVar("rt")); },
                       {"fuse", "order of reduction loops"});
}

TEST(ScheduleErrors, TileWithListsOfDifferentLengths) {
  Setting s;
  expect_compile_error([&] { s.f.tile({s.x, s.y}, {s.xi}, {4, 4}); }, {"one length"});
}

TEST(ScheduleErrors, RacesOverReductionVariables) {
  Var x("x"), y("y");
  RDom r(0, 8);
  Func g("racy");
  g(x) = 0;
  g(x) += r;
  expect_compile_error(
      [&] { g.update().vectorize(r, 4); },
      {"vectorize \"racy.update(0)\"", "must not touch the same element", "Use \"x\" instead"});
  expect_compile_error([&] { g.update().parallel(r); }, {"must not touch the same element"});
  RVar ro("ro"), ri("ri");
  g.update().split(r, ro, ri, 2);
  expect_compile_error([&] { g.update().parallel(ro); }, {"must not touch the same element"});
  Func scan("scan");
  scan(x) = 0;
  scan(r + 1) = scan(r) + 1;
  expect_compile_error([&] { scan.update().vectorize(r, 4); }, {"must not touch the same element"});
}

TEST(ScheduleErrors, OrderOfReductionLoopsThatMatters) {
  Var x("x");
  RDom r(0, 8, 0, 8);
  Func g("ordered");
  g(x) = 0;
  g(x) = g(x) * 2 + r.x + 3 * r.y;
  expect_compile_error([&] { g.update().reorder(r.y, r.x); }, {"only where it changes no result"});
  g.update().reorder(x, r.x, r.y);  // the reduction loops keep their order
}

TEST(ScheduleErrors, TailsThatWouldRepeatPoints) {
  Var x("x"), xo("xo"), xi("xi");
  RDom r(0, 8);
  RVar ro("ro"), ri("ri");
  Func g;
  g(x) = 0;
  g(x) += r;
  expect_compile_error([&] { g.update().split(x, xo, xi, 4, TailStrategy::ShiftInwards); },
                       {"does not run a point twice"});
  expect_compile_error([&] { g.update().split(r, ro, ri, 4, TailStrategy::RoundUp); },
                       {"exactly over its domain"});
}

TEST(ScheduleErrors, UpdateThatDoesNotExist) {
  Setting s;
  expect_compile_error([&] { s.f.update(0); }, {"it has 0 update definitions"});
  expect_compile_error([&] { s.f.update_value(3); }, {"it has 0 update definitions"});
}

TEST(ScheduleErrors, BoundsOfUnknownVariables) {
  Setting s;
  expect_compile_error([&] { s.f.bound(s.z, 0, 3); }, {"must be a pure variable", "\"x\", \"y\""});
  expect_compile_error([&] { s.f.bound(s.x, 0, -3); }, {"not negative"});
  expect_compile_error([&] { s.f.set_estimate(s.z, 0, 3); }, {"must be a pure variable"});
  expect_compile_error([&] { s.f.set_estimates({{0, 3}}); }, {"one for each dimension"});
  expect_compile_error([&] { s.f.reorder_storage(s.x, s.z); }, {"must be one of its dimensions"});
}

// ---- buffers and parameters ----

// rule: an extent is not negative
TEST(BufferErrors, Sizes) {
  expect_compile_error([] { Buffer<float> b(-1, 3); }, {"not negative", "-1 x 3"});
  expect_compile_error([] { Buffer<double> b(INT32_MAX, INT32_MAX, INT32_MAX); },
                       {"address space"});
  expect_compile_error([] { Buffer<double> b(1 << 30, 1 << 30); },
                       {"address space", "1073741824 x 1073741824"});
}

TEST(BufferErrors, UndefinedHandle) {
  Buffer<float> b;
  Var x("x");
  expect_compile_error([&] { b.width(); }, {"it was never given one"});
  expect_compile_error([&] { b(0); }, {"operator()"});
  expect_compile_error([&] { Expr e = b(x); }, {"operator()"});
}

TEST(BufferErrors, WrongStaticTypeOrDimensions) {
  Buffer<> b(Float(32), 3, 3);
  expect_compile_error([&] { Buffer<int> c = b; }, {"element types must agree", "float32"});
  expect_compile_error([&] { b.as<float, 3>(); }, {"dimensions must agree"});
  expect_compile_error([&] { b.dim(2); }, {"it has 2 dimensions"});
}

TEST(BufferErrors, CropsAndSlicesOutside) {
  Buffer<float> b(8, 8, "cropped");
  expect_compile_error([&] { b.crop(0, 4, 8); },
                       {"\"cropped\"", "lies inside the buffer", "[0, 8)"});
  expect_compile_error([&] { b.slice(1, 8); }, {"lies inside the buffer"});
  expect_compile_error([&] { b.cropped(2, 0, 1); }, {"it has 2 dimensions"});
}

// rule: the buffer has as many dimensions as the parameter
// rule: a dimension is numbered from 0
TEST(ParameterErrors, BuffersThatDoNotFit) {
  ImageParam in(UInt(8), 2, "bytes");
  expect_compile_error([&] { in.set(Buffer<float>(3, 3)); }, {"\"bytes\"", "uint8", "float32"});
  expect_compile_error([&] { in.set(Buffer<uint8_t>(3)); }, {"as many dimensions"});
  expect_compile_error([&] { in.dim(2).extent(); }, {"it has 2 dimensions"});
  expect_compile_error([&] { in.dim(0).set_extent(-1); }, {"not negative"});
  expect_compile_error([] { ImageParam().width(); }, {"needs a type and dimensions"});
  expect_compile_error([] { ImageParam bad(Handle(), 1); }, {"elements are numbers"});
}

TEST(ParameterErrors, ValuesThatDoNotFit) {
  Param<uint8_t> p("byte_p");
  expect_compile_error([&] { p.set(300); }, {"\"byte_p\"", "300", "uint8"});
  expect_compile_error([&] { p.set(-1); }, {"must fit"});
  expect_compile_error([&] { p.set(0.5); }, {"must fit"});
  expect_compile_error([&] { p.get(); }, {"none"});
  Param<> any(Int(32), "any_type_p");
  any.set(1);
  expect_compile_error([&] { any.get<float>(); }, {"types must agree"});
  expect_compile_error([&] { Param<float> q(any); }, {"types must agree"});
}

TEST(PipelineErrors, Outputs) {
  Setting s;
  expect_compile_error([] { Pipeline p(Func("no_output")); },
                       {"\"no_output\"", "needs a definition"});
  expect_compile_error([] { Pipeline p(std::vector<Func>{}); }, {"at least one output"});
  expect_compile_error([&] { Pipeline p({s.f, s.f}); }, {"given twice"});
  expect_compile_error([] { Pipeline().compile_jit(); }, {"constructed without any"});
  expect_compile_error([] { Func("undefined_output").realize({3}); }, {"needs a definition"});
}

// ---- arguments of calls: found before anything is compiled ----

TEST(CallArguments, Sizes) {
  Setting s;
  expect_error<RuntimeError>([&] { s.f.realize({3}); }, {"one size for each dimension"});
  expect_error<RuntimeError>(
      [&] {
        s.f.realize({3, -1});
      },
      {"sizes are not negative", "dimension 1 is -1"});
  expect_error<RuntimeError>([&] { s.f.realize({-3, 4}); }, {"sizes are not negative"});
  expect_error<UserError>([&] { s.f.realize({INT32_MAX, INT32_MAX}); }, {"address space"});
}

// rule: must have the right element type
TEST(CallArguments, OutputBuffers) {
  Setting s;
  Buffer<float> wrong_type(4, 4);
  Buffer<int> wrong_dimensions(4), undefined, right(4, 4);
  expect_error<RuntimeError>([&] { s.f.realize(wrong_type); },
                             {"element type", "float32", "int32"});
  expect_error<RuntimeError>([&] { s.f.realize(wrong_dimensions); }, {"number of dimensions"});
  expect_error<RuntimeError>([&] { s.f.realize(undefined); }, {"must not be null"});
  expect_error<RuntimeError>([&] { s.f.realize({right, right}); }, {"one buffer for each value"});
  expect_error<RuntimeError>([&] { s.f.realize(static_cast<halide_buffer_t*>(nullptr)); },
                             {"must not be null"});
  Runtime::Buffer<int> no_memory(nullptr, 4, 4);
  expect_error<RuntimeError>([&] { s.f.realize(no_memory); }, {"must have memory"});
}

}  // namespace
