// Translation of users' expressions and definitions to IR.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <limits>

#include "ir/equal.h"
#include "ir/print.h"
#include "ir/visit.h"

using namespace retrograde;

namespace {

std::string shown(const Expr& e) { return ir::print(e); }
bool is_op(const Expr& e, ir::Op op) {
  const ir::Call* call = e.as<ir::Call>();
  return call && call->is_op(op);
}

// ---- expressions ----

TEST(Expressions, VarsAndConstantsFormIntegerExpressions) {
  Var x("x"), y("y");
  Expr e = 2 * x + y - 1;
  EXPECT_EQ(e.type(), Int(32));
  EXPECT_TRUE(ir::uses_variable(e, "x") && ir::uses_variable(e, "y"));
}

TEST(Expressions, FloatConstantsAreNotTruncated) {
  Var x("x");
  Expr scaled = cast<float>(x) * 0.5f;
  EXPECT_EQ(scaled.type(), Float(32));
  EXPECT_EQ(*ir::as_const_float(scaled.as<ir::Mul>()->b), 0.5);
  EXPECT_EQ((x * 0.5f).type(), Float(32));
}

TEST(Expressions, LiteralsTakeTheTypeOfTheOtherSide) {
  Var x("x");
  Expr byte = cast<uint8_t>(x);
  EXPECT_EQ((byte + 1).type(), UInt(8));
  EXPECT_EQ((byte & 15).type(), UInt(8));
  EXPECT_EQ((byte << 2).type(), UInt(8));
  EXPECT_EQ(select(x > 2, byte, 0).type(), UInt(8));
  EXPECT_EQ(min(byte, 200).type(), UInt(8));
  EXPECT_EQ(clamp(byte, 3, 20).type(), UInt(8));
}

TEST(Expressions, MixedTypesPromote) {
  Var x("x");
  EXPECT_EQ((cast<uint8_t>(x) + cast<int16_t>(x)).type(), Int(16));
  EXPECT_EQ((cast<float>(x) + x).type(), Float(32));
  EXPECT_EQ((cast<double>(x) * cast<float>(x)).type(), Float(64));
  EXPECT_EQ((cast<uint32_t>(x) ^ cast<int32_t>(x)).type(), Int(32));
}

TEST(Expressions, AbsoluteValuesOfSignedIntegersAreUnsigned) {
  Var x("x");
  EXPECT_EQ(abs(Expr(x)).type(), UInt(32));
  EXPECT_EQ(abs(cast<float>(x)).type(), Float(32));
  EXPECT_EQ(absd(cast<int8_t>(x), cast<int8_t>(3)).type(), UInt(8));
}

TEST(Expressions, FunctionsOfRealNumbersConvertIntegersToFloat32) {
  Var x("x");
  EXPECT_EQ(sqrt(x).type(), Float(32));
  EXPECT_EQ(sin(cast<double>(x)).type(), Float(64));
  EXPECT_EQ(exp(cast<float16_t>(x)).type(), Float(16));
  EXPECT_EQ(atan2(cast<float>(x), x).type(), Float(32));
  EXPECT_EQ(is_nan(cast<float>(x)).type(), Bool());
  EXPECT_EQ(floor(cast<float>(x) / 2).type(), Float(32));
}

TEST(Expressions, PowOfAnIntegerConstantMultiplies) {
  Var x("x");
  Expr cube = pow(cast<float>(x), 3);
  EXPECT_EQ(cube.kind(), ir::Kind::Mul);
  EXPECT_TRUE(is_op(pow(cast<float>(x), 2.5f), ir::Op::pow));
  EXPECT_EQ(pow(cast<float>(x), -1).kind(), ir::Kind::Div);
  EXPECT_EQ(pow(cast<float>(x), 2.0f).kind(), ir::Kind::Mul) << "a square is as exact";
}

TEST(Expressions, SelectChoosesTheFirstThatHolds) {
  Var x("x");
  Expr e = select(x == 0, 10, x == 1, 20, 30);
  const ir::Select* outer = e.as<ir::Select>();
  ASSERT_TRUE(outer);
  EXPECT_EQ(*ir::as_const_int(outer->when_true), 10);
  const ir::Select* inner = outer->when_false.as<ir::Select>();
  ASSERT_TRUE(inner);
  EXPECT_EQ(*ir::as_const_int(inner->when_false), 30);
}

TEST(Expressions, SelectOfTuplesGoesElementByElement) {
  Var x("x");
  Tuple t = select(x > 0, Tuple(x, 1.0f), Tuple(0, 2.0f));
  ASSERT_EQ(t.size(), 2u);
  EXPECT_EQ(t[0].type(), Int(32));
  EXPECT_EQ(t[1].type(), Float(32));
}

TEST(Expressions, MuxIsAChainOfSelects) {
  Var c("c");
  Expr e = mux(c, {1, 2, 3});
  EXPECT_EQ(e.kind(), ir::Kind::Select);
  EXPECT_EQ(*ir::as_const_int(mux(Expr(1), {10, 20, 30})), 20);
}

TEST(Expressions, MinAndMaxTakeManyArguments) {
  Var x("x"), y("y"), z("z");
  Expr e = min(x, y, z, 3);
  EXPECT_EQ(e.kind(), ir::Kind::Min);
  EXPECT_TRUE(ir::uses_variable(e, "z"));
  EXPECT_EQ(*ir::as_const_int(max(Expr(1), 5, 3)), 5);
}

TEST(Expressions, RoundToZeroDivisionFollowsC) {
  for (int a : {-7, -1, 0, 5, 8}) {
    for (int b : {-3, 2, 4}) {
      const auto value = [](const Expr& e) {
        auto result = ir::as_const_int(e);
        return result ? *result : INT64_MIN;
      };
      EXPECT_EQ(value(div_round_to_zero(Expr(a), Expr(b))), a / b) << a << " " << b;
      EXPECT_EQ(value(mod_round_to_zero(Expr(a), Expr(b))), a % b) << a << " " << b;
    }
  }
}

TEST(Expressions, PrintOfAnExprIsTheOperatorOfTheLanguage) {
  Var x("x");
  Expr e = x + 1;
  const Expr constant = x + 2;
  static_assert(std::is_same_v<decltype(print(e)), Expr>);
  EXPECT_TRUE(is_op(print(e), ir::Op::print));
  EXPECT_TRUE(is_op(print(constant), ir::Op::print));
  EXPECT_TRUE(is_op(print(x, "at", x), ir::Op::print));
  EXPECT_TRUE(is_op(print_when(x > 3, e, "large"), ir::Op::print_when));
  EXPECT_TRUE(is_op(require(x > 3, e, "too small:", x), ir::Op::require));
}

TEST(Expressions, RandomCallsWithoutSeedDiffer) {
  EXPECT_FALSE(ir::equal(random_float(), random_float()));
  EXPECT_TRUE(ir::equal(random_float(3), random_float(3)));
  EXPECT_EQ(random_uint().type(), UInt(32));
  EXPECT_EQ(random_int().type(), Int(32));
}

TEST(Expressions, ShiftAmountsKeepTheirSignAndAreNotWrapped) {
  Var x("x");
  Expr e = cast<uint8_t>(x) << Expr(300);
  const ir::Call* call = e.as<ir::Call>();
  ASSERT_TRUE(call) << shown(e);
  EXPECT_GE(*ir::as_const_int(call->args[1]), 8);
}

// ---- definitions ----

TEST(Definitions, FirstDefinitionFixesArgumentsAndTypes) {
  Var x("x"), y("y");
  Func f("first_definition");
  EXPECT_FALSE(f.defined());
  f(x, y) = cast<uint16_t>(x + y);
  EXPECT_TRUE(f.defined());
  EXPECT_EQ(f.dimensions(), 2);
  EXPECT_EQ(f.args()[1].name(), "y");
  EXPECT_EQ(f.output_types(), std::vector<Type>{UInt(16)});
  EXPECT_EQ(f.value().type(), UInt(16));
}

TEST(Definitions, NamesAreUniqueAndKeptWhereTheyCanBe) {
  Func a("some_unusual_name"), b("some_unusual_name");
  EXPECT_EQ(a.name(), "some_unusual_name");
  EXPECT_NE(b.name(), a.name());
  EXPECT_EQ(b.name().rfind("some_unusual_name", 0), 0u);
}

TEST(Definitions, SecondAssignmentIsAnUpdate) {
  Var x("x");
  Func f;
  f(x) = 1;
  f(x) = f(x) + 2;
  EXPECT_EQ(f.num_update_definitions(), 1);
  EXPECT_TRUE(f.has_update_definition());
}

TEST(Definitions, AccumulationDefinesTheNeutralElementFirst) {
  Var x("x");
  RDom r(0, 5);
  Func total, product_of;
  total(x) += cast<float>(x + r);
  product_of(x) *= 2;
  EXPECT_TRUE(ir::is_zero(total.value()));
  EXPECT_EQ(total.value().type(), Float(32));
  EXPECT_TRUE(ir::is_one(product_of.value()));
  EXPECT_EQ(total.num_update_definitions(), 1);
  EXPECT_EQ(total.rvars()[0].name(), RVar(r).name());
}

TEST(Definitions, HistogramGetsAFreshPureVariable) {
  RDom r(0, 5);
  Var x("x");
  Func f, hist;
  f(x) = x % 3;
  hist(f(r)) += 1;
  EXPECT_EQ(hist.dimensions(), 1);
  EXPECT_TRUE(ir::uses_variable(hist.update_args()[0], RVar(r).name()));
}

TEST(Definitions, PlaceholderStandsForAllMissingDimensions) {
  Var x("x"), y("y"), c("c");
  Func f, g, h;
  f(x, y, c) = x + y + c;
  g(_) = f(_) * 2;
  EXPECT_EQ(g.dimensions(), 3);
  h(x, _) = f(_, x);
  EXPECT_EQ(h.dimensions(), 3);
  EXPECT_EQ(shown(h.value()), shown(Expr(f(Var::implicit(0), Var::implicit(1), x))));
  g(_) += f(_);
  EXPECT_EQ(g.num_update_definitions(), 1);
}

TEST(Definitions, TuplesHoldSeveralValues) {
  Var x("x");
  Func f, g;
  f(x) = Tuple(x, cast<float>(x));
  EXPECT_EQ(f.outputs(), 2);
  EXPECT_EQ(Expr(f(x)[1]).type(), Float(32));
  f(x)[1] += 2.0f;
  g(x) = f(x);
  EXPECT_EQ(g.outputs(), 2);
  // The first value is written back unchanged.
  const Tuple values = f.update_values();
  const ir::Call* kept = values[0].as<ir::Call>();
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->component, 0);
  EXPECT_EQ(kept->symbol.raw(), f.function().get());
}

TEST(Definitions, AFuncDoesNotOwnItselfThroughItsUpdates) {
  std::weak_ptr<graph::FuncContents> watched;
  {
    Var x("x");
    RDom r(0, 4, 0, 4);
    r.where(r.x < r.y);
    Func f;
    f(x) = 0;
    f(x) += f(x) * r.x + r.y;
    watched = f.function();
  }
  EXPECT_TRUE(watched.expired());
}

TEST(Definitions, NorThroughADomainThatReadsIt) {
  std::weak_ptr<graph::FuncContents> watched;
  {
    Var x("x");
    Func f;
    f(x) = x;
    RDom r(0, 8);
    r.where(f(r) > 2);
    f(r) = f(r) * 10 + r;
    watched = f.function();
  }
  EXPECT_TRUE(watched.expired());
}

TEST(Definitions, AnUpdateTakenOutOfItsFuncKeepsTheFuncAlive) {
  Expr value;
  {
    Var x("x");
    Func f;
    f(x) = 0;
    f(x) = f(x) + 1;
    value = f.update_value();
  }
  bool alive = true;
  ir::walk(value, [&](const ir::Call& call) { alive = alive && call.symbol.lock() != nullptr; });
  EXPECT_TRUE(alive);
}

TEST(Definitions, PredicatesOfADomainBelongToTheUpdate) {
  Var x("x");
  RDom r(0, 8, 0, 8);
  r.where(r.x < r.y);
  r.where(r.x != 3);
  Func f;
  f(x) += r.x;
  const graph::Definition& update = f.function()->updates[0];
  ASSERT_TRUE(update.predicate.defined());
  EXPECT_EQ(update.rvars.size(), 2u);
  EXPECT_TRUE(ir::uses_variable(update.predicate, r.y.name()));
}

TEST(Definitions, LoopsAreReductionVariablesInsidePureOnes) {
  Var x("x"), y("y");
  RDom r(0, 3, 0, 4);
  Func f;
  f(x, y) = 0;
  f(x, y) += r.x * r.y;
  EXPECT_EQ(Stage(f).dump_argument_list(), "x, y");
  EXPECT_EQ(f.update().dump_argument_list(), r.x.name() + ", " + r.y.name() + ", x, y");
  EXPECT_EQ(r.x.domain(), r.domain());
}

TEST(Definitions, RandomNumbersDependOnThePoint) {
  Var x("x");
  Func f;
  f(x) = random_float(7);
  EXPECT_TRUE(ir::uses_variable(f.value(), "x"));
}

TEST(Definitions, FuncsAreOrderedProducersFirst) {
  Var x("x");
  Func a("order_a"), b("order_b"), c("order_c");
  a(x) = x;
  b(x) = a(x) + a(x + 1);
  c(x) = b(x) + a(x);
  std::vector<std::string> names;
  for (const auto& f : graph::topological_order({c.function()})) names.push_back(f->name);
  EXPECT_EQ(names, (std::vector<std::string>{"order_a", "order_b", "order_c"}));
}

TEST(Definitions, ALongChainOfFuncsIsOrderedWithoutDeepRecursion) {
  Var x("x");
  std::vector<Func> chain(20000);
  chain[0](x) = x;
  for (size_t i = 1; i < chain.size(); i++) chain[i](x) = chain[i - 1](x) + 1;
  EXPECT_EQ(graph::topological_order({chain.back().function()}).size(), chain.size());
}

TEST(Definitions, SharedSubexpressionsAreVisitedOnce) {
  Var x("x");
  Func f;
  Expr e = x;
  for (int i = 0; i < 200; i++) e = e + e;  // 2^200 paths
  f(x) = e;
  Func g;
  g(x) = 0;
  g(x) += e;
  EXPECT_EQ(graph::direct_callees(*g.function()).size(), 0u);
}

// ---- parameters ----

TEST(Parameters, AreFoundInFirstUseOrder) {
  Var x("x");
  Param<float> gain("gain_p");
  ImageParam in(Float(32), 1, "in_p");
  Buffer<float> table(16, "table_p");
  Func f, g;
  f(x) = in(x)*gain;
  g(x) = f(x) + table(clamp(x, 0, 15)) + in.width();
  std::vector<std::string> names;
  for (const auto& p : graph::parameters_of({g.function()})) names.push_back(p->name);
  EXPECT_EQ(names, (std::vector<std::string>{"in_p", "gain_p", "table_p"}));
  EXPECT_EQ(g.infer_arguments().size(), 2u);  // the table is embedded in the program
}

TEST(Parameters, HoldValuesOfTheirType) {
  Param<int> n("n_p", 3);
  EXPECT_EQ(n.get(), 3);
  n.set(7);
  EXPECT_EQ(n.get(), 7);
  Param<> any(UInt(8), "any_p");
  any.set(200);
  EXPECT_EQ(any.get<uint8_t>(), 200);
  Param<float> ranged("ranged_p", 0.5f, 0.0f, 1.0f);
  EXPECT_EQ(*ir::as_const_float(ranged.max_value()), 1.0);
}

TEST(Parameters, FactsOfShapesAreExprs) {
  ImageParam in(UInt(8), 2, "facts_p");
  EXPECT_EQ(shown(in.dim(1).min()), "facts_p.min.1");
  EXPECT_TRUE(ir::uses_variable(in.right(), "facts_p.extent.0"));
  const uint64_t before = in.parameter()->version;
  in.dim(0).set_stride(3);
  EXPECT_GT(in.parameter()->version, before);
}

// ---- Funcs created inside expressions ----

TEST(InlineReductions, ExtremesStartFromTheLimitsOfTheType) {
  RDom r(0, 5);
  const auto initial = [](const Expr& e) {
    return graph::func_of(*e.as<ir::Call>())->pure->values[0];
  };
  EXPECT_EQ(*ir::as_const_int(initial(maximum(cast<int8_t>(r)))), -128);
  EXPECT_EQ(*ir::as_const_int(initial(minimum(cast<uint8_t>(r)))), 255);
  EXPECT_EQ(*ir::as_const_float(initial(minimum(cast<float>(r)))),
            std::numeric_limits<double>::infinity());
}

TEST(InlineReductions, SumMakesAFuncWithAnUpdate) {
  Var x("x");
  Func f, g;
  RDom r(-1, 3);
  f(x) = x * x;
  Expr e = sum(f(x + r), "blur_sum");
  const ir::Call* call = e.as<ir::Call>();
  ASSERT_TRUE(call);
  auto made = graph::func_of(*call);
  EXPECT_EQ(made->name, "blur_sum");
  EXPECT_EQ(made->args, std::vector<std::string>{"x"});
  EXPECT_EQ(made->updates.size(), 1u);
}

TEST(InlineReductions, OuterReductionVariablesBecomeArguments) {
  Var x("x");
  RDom outer(0, 3), inner(0, 4);
  Func f, g;
  f(x) = x;
  g(x) += sum(inner, f(x + outer * 4 + inner));
  EXPECT_EQ(g.rvars().size(), 1u);
  EXPECT_EQ(g.rvars()[0].name(), RVar(outer).name());
}

TEST(InlineReductions, ANamedDomainIsRunOverEvenIfUnused) {
  RDom r(0, 5);
  Expr e = sum(r, Expr(1));
  auto made = graph::func_of(*e.as<ir::Call>());
  EXPECT_EQ(made->updates[0].rvars.size(), 1u);
}

TEST(InlineReductions, ArgmaxGivesPlaceAndValue) {
  Var x("x");
  Func f;
  RDom r(0, 5, 0, 6);
  f(x) = cast<float>(x);
  Tuple t = argmax(f(r.x * r.y));
  ASSERT_EQ(t.size(), 3u);
  EXPECT_EQ(t[0].type(), Int(32));
  EXPECT_EQ(t[2].type(), Float(32));
}

TEST(BoundaryConditions, KeepNamesAndDimensionsOfTheSource) {
  using namespace retrograde::BoundaryConditions;
  Var x("x"), y("y");
  Func f;
  f(x, y) = x + y;
  EXPECT_EQ(repeat_edge(f, {{0, 10}, {Expr(), Expr()}}).dimensions(), 2);
  EXPECT_EQ(constant_exterior(f, 0, {{0, 10}}).args()[0].name(), "x");
  EXPECT_EQ(constant_exterior(f, 0, 0, 10, 0, 20).dimensions(), 2);
  Buffer<uint8_t> image(4, 5, 3);
  ImageParam in(Float(32), 2);
  EXPECT_EQ(mirror_image(image).dimensions(), 3);
  EXPECT_EQ(mirror_interior(in).dimensions(), 2);
  EXPECT_EQ(repeat_image(in, {{0, 10}, {0, 10}}).dimensions(), 2);
  EXPECT_EQ(constant_exterior(image, 7).output_types()[0], UInt(8));
}

// ---- schedules ----

TEST(Schedules, SplitReplacesALoopByTwo) {
  Var x("x"), y("y"), xo("xo"), xi("xi");
  Func f;
  f(x, y) = x + y;
  f.split(x, xo, xi, 8);
  EXPECT_EQ(Stage(f).dump_argument_list(), "xi, xo, y");
  f.reorder(xi, y, xo);
  EXPECT_EQ(Stage(f).dump_argument_list(), "xi, y, xo");
}

TEST(Schedules, TileOrdersBlocks) {
  Var x("x"), y("y"), xo("xo"), yo("yo"), xi("xi"), yi("yi");
  Func f, g;
  f(x, y) = x + y;
  f.tile(x, y, xo, yo, xi, yi, 8, 4);
  EXPECT_EQ(Stage(f).dump_argument_list(), "xi, yi, xo, yo");
  g(x, y) = x + y;
  g.tile({x, y}, {xi, yi}, {8, 4});
  EXPECT_EQ(Stage(g).dump_argument_list(), "xi, yi, x, y");
}

TEST(Schedules, VectorizeByAFactorKeepsTheNameForTheOuterLoop) {
  Var x("x"), y("y");
  Func f;
  f(x, y) = x + y;
  f.vectorize(x, 8).parallel(y);
  const auto& dims = f.get_schedule().dims;
  ASSERT_EQ(dims.size(), 3u);
  EXPECT_EQ(dims[0].runs, ForType::Vectorized);
  EXPECT_EQ(dims[1].var, "x");
  EXPECT_EQ(dims[1].runs, ForType::Serial);
  EXPECT_EQ(dims[2].runs, ForType::Parallel);
}

TEST(Schedules, FuseMakesOneLoop) {
  Var x("x"), y("y"), t("t");
  Func f;
  f(x, y) = x + y;
  f.fuse(x, y, t).parallel(t);
  EXPECT_EQ(Stage(f).dump_argument_list(), "t");
}

TEST(Schedules, StorageFollowsComputationUnlessAskedFor) {
  Var x("x"), y("y");
  Func f, g;
  f(x, y) = x + y;
  g(x, y) = f(x, y);
  f.compute_at(g, x);
  EXPECT_EQ(f.function()->schedule.store_level.var, "x");
  f.store_at(g, y).compute_at(g, x);
  EXPECT_EQ(f.function()->schedule.store_level.var, "y");
  EXPECT_EQ(f.function()->schedule.compute_level.var, "x");
  f.compute_root();
  EXPECT_EQ(f.function()->schedule.compute_level.kind, graph::LoopLevel::Kind::Root);
}

TEST(Schedules, IndependentReductionLoopsMayRunInParallel) {
  Var x("x"), y("y");
  RDom r(0, 8, 0, 8);
  Func f, rvo;
  f(x, y) = 0;
  f(r.x, r.y) = f(r.x, r.y) + 1;
  RVar rxo("rxo"), rxi("rxi");
  f.update().parallel(r.y).split(r.x, rxo, rxi, 4).vectorize(rxi);
  EXPECT_EQ(f.update().get_schedule().dims[0].runs, ForType::Vectorized);
}

TEST(Schedules, ReductionLoopsOfASumMayChangeOrder) {
  Var x("x");
  RDom r(0, 8, 0, 8);
  Func f;
  f(x) += cast<float>(r.x * x + r.y);
  f.update().reorder(r.y, r.x);
  EXPECT_EQ(f.update().get_schedule().dims[0].var, r.y.name());
  f.update().reorder(x, r.x, r.y);
  EXPECT_EQ(f.update().get_schedule().dims[0].var, "x");
}

TEST(Schedules, DirectivesMakeCompiledCodeStale) {
  Var x("x");
  Func f;
  f(x) = x;
  const uint64_t before = f.function()->version;
  f.vectorize(x, 4);
  EXPECT_GT(f.function()->version, before);
}

TEST(Schedules, BoundsAndEstimatesAreKeptByVariable) {
  Var x("x"), y("y");
  Func f;
  f(x, y) = x + y;
  f.bound(x, 0, 64).bound_extent(y, 3).set_estimates({{0, 100}, {0, 200}});
  EXPECT_EQ(f.function()->schedule.bounds.size(), 2u);
  EXPECT_FALSE(f.function()->schedule.bounds[1].min.defined());
  EXPECT_EQ(*ir::as_const_int(f.function()->schedule.estimates[1].extent), 200);
}

}  // namespace
