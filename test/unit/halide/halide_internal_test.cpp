// The parts of Halide::Internal that Halide programs use, and names of newer Halide releases, with
// their effects. Names that Halide does not have must not be in its namespace.
#include "Halide.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "support/errors.h"

// A program's own names, which Halide does not have: no declaration of ours may conflict.
namespace Halide {
struct Compression {
  int level = 3;
};
inline int hessian(int x) { return x + 1; }
struct WarningScope {};
}  // namespace Halide

using namespace Halide;
using namespace Halide::Internal;
using retrograde::expect_error;

namespace {

TEST(HalideNamespace, HoldsNothingThatHalideDoesNotHave) {
  Compression own;
  EXPECT_EQ(own.level, 3);
  EXPECT_EQ(hessian(1), 2);
  [[maybe_unused]] WarningScope scope;
}

// ---- visitors ----

struct Counter : IRGraphVisitor {
  using IRGraphVisitor::visit;
  void visit(const Variable* v) override { names.insert(v->name); }
  void visit(const Call* call) override {
    if (call->call_type == Call::Halide) funcs.push_back(call->name);
    if (call->is_intrinsic(Call::abs)) magnitudes++;
    IRGraphVisitor::visit(call);
  }
  void visit(const Add* sum) override {
    sums++;
    IRGraphVisitor::visit(sum);
  }
  std::set<std::string> names;
  std::vector<std::string> funcs;
  int sums = 0, magnitudes = 0;
};

TEST(Visitors, SeeEachNodeOfAGraphOnce) {
  Var x("x"), y("y");
  Func f("visited");
  f(x) = x;
  Expr shared = x + y;
  for (int i = 0; i < 40; i++) shared = shared + shared;  // 2^40 paths
  Counter seen;
  Expr(abs(shared) * 2 + cast<uint32_t>(f(y))).accept(&seen);
  EXPECT_EQ(seen.sums, 42);
  EXPECT_EQ(seen.names, (std::set<std::string>{"x", "y"}));
  EXPECT_EQ(seen.funcs, std::vector<std::string>{f.name()});
  EXPECT_EQ(seen.magnitudes, 1);
}

struct PathCounter : IRVisitor {
  using IRVisitor::visit;
  void visit(const Variable*) override { uses++; }
  int uses = 0;
};

TEST(Visitors, OfTreesSeeEachUse) {
  Var x("x");
  const Expr sum = Expr(x) * 2;
  PathCounter seen;
  Expr(sum + sum).accept(&seen);
  EXPECT_EQ(seen.uses, 2);
  Expr().accept(&seen);
  EXPECT_EQ(seen.uses, 2);
}

struct Renamed : IRMutator {
  using IRMutator::visit;
  Expr visit(const Variable* v) override {
    calls++;
    return v->name == "x" ? Variable::make(v->type, "z") : Expr(v);
  }
  Expr visit(const IntImm* n) override { return IntImm::make(n->type, n->value + 1); }
  int calls = 0;
};

TEST(Mutators, RebuildWhatChanges) {
  Var x("x"), y("y"), z("z");
  Renamed renamed;
  EXPECT_TRUE(equal(renamed.mutate(x * 2 + y), z * 3 + y));
  EXPECT_TRUE(equal(renamed(x), z));
  const Expr unchanged = sin(cast<float>(y));
  EXPECT_TRUE(renamed.mutate(unchanged).same_as(unchanged));
  EXPECT_FALSE(renamed.mutate(Expr()).defined());
  EXPECT_EQ(renamed.mutate(std::vector<Expr>{x, y}).size(), 2u);
}

struct GraphRenamed : IRGraphMutator {
  using IRGraphMutator::visit;
  Expr visit(const Variable* v) override {
    calls++;
    return Variable::make(v->type, "z");
  }
  int calls = 0;
};

TEST(Mutators, OfGraphsRebuildANodeOnce) {
  Expr shared = Var("x");
  for (int i = 0; i < 40; i++) shared = shared * shared;
  GraphRenamed renamed;
  EXPECT_TRUE(renamed.mutate(shared).defined());
  EXPECT_EQ(renamed.calls, 1);
}

TEST(Nodes, AreMadeAndLookedAt) {
  Var x("x");
  const Expr e = Select::make(LT::make(x, 3), Add::make(x, 1), Expr(0));
  const Select* select = e.as<Select>();
  ASSERT_NE(select, nullptr);
  EXPECT_TRUE(equal(select->condition, x < 3));
  EXPECT_TRUE(equal(select->when_true, x + 1));
  EXPECT_TRUE(equal(Cast::make(Float(32), x), cast<float>(x)));
  EXPECT_TRUE(equal(Not::make(x < 1), !(x < 1)));
  EXPECT_TRUE(
      equal(Let::make("t", x + 1, Variable::make(Int(32), "t") * 2).as<Let>()->value, x + 1));
  EXPECT_EQ(Ramp::make(Expr(x), Expr(2), 4).type(), Int(32, 4));
  EXPECT_EQ(Broadcast::make(Expr(x), 4).as<Broadcast>()->lanes, 4);
  EXPECT_EQ(UIntImm::make(UInt(8), 200).as<UIntImm>()->value, 200u);
  EXPECT_EQ(FloatImm::make(Float(32), 0.5).as<FloatImm>()->value, 0.5);
  EXPECT_EQ(StringImm::make("text").as<StringImm>()->value, "text");
  EXPECT_EQ(Reinterpret::make(UInt(32), cast<float>(x)).type(), UInt(32));
  const Expr external = Call::make(Int(32), "outside", {x}, Call::PureExtern);
  EXPECT_TRUE(external.as<Call>()->is_extern());
  EXPECT_EQ(Call::make(UInt(32), Call::abs, {x}, Call::PureIntrinsic).type(), UInt(32));
  const Expr both = Shuffle::make_concat({x, x + 1});
  EXPECT_EQ(both.type().lanes(), 2);
  EXPECT_EQ(Shuffle::make_slice(both, 0, 1, 1).type().lanes(), 1);
  EXPECT_EQ(Shuffle::make({both, both}, {0, 2, 3}).type().lanes(), 3);
  EXPECT_EQ(Shuffle::make_interleave({both, both}).type().lanes(), 4);
}

TEST(Nodes, LetsBindTheirNamesInReductionDomains) {
  Param<int> p;
  Var x("x");
  RDom r(0, Let::make("x", (p + 8) / p, x * x));
  Func f("f");
  f(x) = 0;
  f(x) += r;
  p.set(3);
  Buffer<int> result = f.realize({2});
  EXPECT_EQ(result(1), 9 * 8 / 2);
  expect_error({"its bounds must be known before any loop starts", "\"x\""},
               [&] { RDom(0, Let::make("t", p, x)); });
}

TEST(Nodes, HaveOperandsThatFit) {
  Var x("x");
  expect_error({"operands of a node are defined"}, [&] { Add::make(x, Expr()); });
  expect_error({"operands of a node have one type", "float32"}, [&] { Add::make(x, 1.0f); });
  expect_error({"the condition of a node is of type bool"}, [&] { Select::make(x, x, x); });
  expect_error({"\"f\"", "a call by name alone calls a C function"},
               [&] { Call::make(Int(32), "f", {x}, Call::Halide); });
}

// ---- constants, simplification, intervals ----

TEST(Constants, OfEveryType) {
  EXPECT_TRUE(equal(make_const(UInt(32), uint32_t{0xffffffff}), Expr(uint32_t{0xffffffff})));
  EXPECT_TRUE(equal(make_const(Float(32), 0.5), Expr(0.5f)));
  EXPECT_TRUE(equal(make_const(UInt(8), 257), Expr(uint8_t{1})));
  EXPECT_EQ(make_const(Int(16, 4), 3).type(), Int(16, 4));
  EXPECT_TRUE(is_const_zero(make_zero(Float(64))) && is_const_one(make_one(UInt(8))));
  EXPECT_TRUE(equal(make_two(Int(8)), Expr(int8_t{2})));
  EXPECT_TRUE(is_const_one(const_true()) && is_const_zero(make_bool(false)));
  EXPECT_TRUE(is_const(Expr(3)) && is_const(Expr(3), 3) && !is_const(Expr(3), 4));
  EXPECT_FALSE(is_const(Var("x")));
  EXPECT_TRUE(is_positive_const(Expr(2.5f)) && is_negative_const(Expr(-1)));
  EXPECT_FALSE(is_positive_const(Expr(0)) || is_negative_const(Expr()));
  EXPECT_EQ(as_const_int(Expr(-7)), -7);
  EXPECT_EQ(as_const_uint(Expr(uint16_t{7})), 7u);
  EXPECT_FALSE(as_const_uint(Expr(7)).has_value());
  EXPECT_EQ(as_const_float(Expr(0.25)), 0.25);
  EXPECT_EQ(is_const_power_of_two_integer(Expr(16)), 4);
  EXPECT_FALSE(is_const_power_of_two_integer(Expr(-16)).has_value());
}

TEST(Simplification, AndSubstitution) {
  Var x("x"), y("y");
  EXPECT_TRUE(equal(simplify(x + y - x), y));
  EXPECT_FALSE(simplify(Expr()).defined());
  EXPECT_TRUE(can_prove(x < x + 1));
  EXPECT_FALSE(can_prove(x < y));
  EXPECT_TRUE(equal(substitute("x", y, x + 1), y + 1));
  EXPECT_TRUE(equal(substitute({{"x", y}, {"y", x}}, x - y), y - x));
  EXPECT_TRUE(equal(substitute(x + 1, y, (x + 1) * 2), y * 2));
  EXPECT_TRUE(equal(graph_substitute("x", y, x + 1), y + 1));
  EXPECT_TRUE(expr_uses_var(x + y, "y") && !expr_uses_var(x + 1, "y"));
  EXPECT_TRUE(is_pure(x + y) && !is_pure(print(x)));
  const Expr power = (x + y) * (x + y);
  const Expr shared = common_subexpression_elimination(power);
  EXPECT_NE(shared.as<Let>(), nullptr);
  EXPECT_TRUE(graph_equal(substitute_in_all_lets(shared), power));
  EXPECT_NE(unique_name('v'), unique_name('v'));
  EXPECT_NE(unique_name("name"), unique_name("name"));
}

TEST(Intervals, OfExpressionsInScope) {
  Var x("x"), y("y");
  Scope<Interval> scope;
  scope.push("x", Interval(0, 10));
  const Interval bounds = bounds_of_expr_in_scope(2 * x + 1, scope);
  EXPECT_TRUE(is_const(bounds.min, 1) && is_const(bounds.max, 21));
  const Interval symbolic = bounds_of_expr_in_scope(x + y, scope);
  EXPECT_TRUE(can_prove(symbolic.max == y + 10));
  EXPECT_FALSE(bounds_of_expr_in_scope(x + y, scope, true).has_upper_bound());
  scope.push("x", Interval(Interval::neg_inf(), 3));
  EXPECT_FALSE(bounds_of_expr_in_scope(x, scope).has_lower_bound());
  EXPECT_TRUE(is_const_one(simplify(x < 4, scope)));
  EXPECT_TRUE(can_prove(x <= 3, scope));
  scope.pop("x");
  EXPECT_TRUE(can_prove(x >= 0, scope));
}

TEST(Intervals, UnionAndIntersection) {
  const Interval low(0, 4), high(3, 9);
  EXPECT_EQ(Interval::make_union(low, high), Interval(0, 9));
  EXPECT_EQ(Interval::make_intersection(low, high), Interval(3, 4));
  EXPECT_TRUE(Interval::nothing().is_empty() && Interval::everything().is_everything());
  EXPECT_EQ(Interval::make_union(Interval::nothing(), low), low);
  EXPECT_EQ(Interval::make_intersection(Interval::everything(), low), low);
  EXPECT_TRUE(Interval::single_point(3).is_single_point() && low.is_bounded());
  EXPECT_TRUE(Interval(Expr(Var("x")), Expr(Var("x"))).can_prove_is_single_point());
  Interval grown = low;
  grown.include(12);
  EXPECT_EQ(grown, Interval(0, 12));
}

TEST(Scopes, HoldTheLastValue) {
  Scope<int> outer, inner;
  outer.push("a", 1);
  inner.set_containing_scope(&outer);
  {
    ScopedBinding<int> binding(inner, "a", 2);
    EXPECT_EQ(inner.get("a"), 2);
    EXPECT_EQ(inner.count("a"), 2u);
  }
  EXPECT_EQ(inner.get("a"), 1);
  EXPECT_EQ(inner.find("b"), nullptr);
  EXPECT_TRUE(inner.empty() && outer.size() == 1 && Scope<>::empty_scope().empty());
  expect_error({"\"b\"", "a name is pushed before it is looked up"}, [&] { inner.get("b"); });
  Scope<> names;
  names.push("n");
  EXPECT_TRUE(names.contains("n"));
}

// ---- Funcs ----

TEST(Functions, AnswerWhatFuncsDo) {
  Var x("x"), y("y");
  Func f("asked"), empty("empty");
  f(x, y) = Tuple(x, cast<float>(y));
  f(x, 0) = Tuple(1, 2.0f);
  const Function function = f.function();
  EXPECT_EQ(function.name(), f.name());
  EXPECT_EQ(function.dimensions(), 2);
  EXPECT_EQ(function.outputs(), 2);
  EXPECT_EQ(function.output_types()[1], Float(32));
  EXPECT_EQ(function.args(), (std::vector<std::string>{"x", "y"}));
  EXPECT_TRUE(function.has_pure_definition() && function.has_update_definition());
  EXPECT_FALSE(function.has_extern_definition() || function.is_pure());
  EXPECT_EQ(function.values().size(), 2u);
  EXPECT_FALSE(empty.function().has_pure_definition() || empty.function().frozen());
  EXPECT_TRUE(f(x, y).function().same_as(function));
  EXPECT_TRUE(f(x, y)[0].function().same_as(function));
  EXPECT_EQ(Func(Int(32), 1, "declared").function().required_dimensions(), 1);
  EXPECT_EQ(Func(Int(32), 1, "declared").function().required_types()[0], Int(32));
  const Func of_image = ImageParam(UInt(8), 3, "image");
  EXPECT_EQ(of_image.function().required_dimensions(), 3);
  EXPECT_EQ(of_image.function().required_types(), std::vector<Type>{UInt(8)});
}

// A program that schedules Funcs which it did not write.
TEST(Functions, LoopsSayWhatTheyAre) {
  Var x("x"), y("y");
  Func f("f");
  RDom r(0, 10, "r");
  f(x, y) = 0.0f;
  f(x, y) += sin(r + x) * y;
  std::string pure, others;
  const auto loops = f.update(0).get_schedule().dims();
  for (auto loop : loops) {
    (loop.is_pure() ? pure : others) += loop.var + " ";
    EXPECT_NE(loop.is_pure(), loop.is_rvar());
    if (loop.is_pure() && loop.var == "x")
      f.update(0).vectorize(VarOrRVar(loop.var, loop.is_rvar()), 4);
  }
  EXPECT_EQ(pure, "x y ");
  EXPECT_EQ(others, r.x.name() + " ");
  EXPECT_EQ(f.update(0).get_schedule().dims().size(), 4u) << "x is split";
}

TEST(Functions, OfNothingAreErrors) {
  const Function nothing;
  expect_error({"a Function belongs to a Func"}, [&] { nothing.name(); });
  expect_error({"a Function belongs to a Func"}, [&] { Func of(nothing); });
  Var x("x");
  Func f("f");
  f(x) = x;
  EXPECT_TRUE(Func(f.function()).same_as(f));
}

// api: eager_inline
TEST(EagerInline, ChangesTheDefinition) {
  Var x("x"), y("y");
  Func f("f"), g("g"), h("h");
  f(x) = x * x;
  g(x) = f(x) + f(x + 1);
  h(x) = g(x) - f(x);
  h.eager_inline(f, g);
  EXPECT_TRUE(equal(simplify(h.value() - (x + 1) * (x + 1)), 0)) << h.value();
  Buffer<int> result = h.realize({4});
  for (int i = 0; i < 4; i++) EXPECT_EQ(result(i), (i + 1) * (i + 1));
  RDom r(0, 4);
  Func sums("sums");
  sums() = 0;
  sums() += f(r);
  sums.update().eager_inline({f});
  EXPECT_EQ(Buffer<int>(sums.realize())(), 0 + 1 + 4 + 9);
}

TEST(DeclaredFuncs, HaveTypesAndDimensionsBeforeTheirDefinition) {
  Func one(Int(16), 2, "one"), two({Float(32), UInt(8)}, 3, "two"), none("none");
  EXPECT_EQ(one.type(), Int(16));
  EXPECT_EQ(one.dimensions(), 2);
  EXPECT_EQ(two.types(), (std::vector<Type>{Float(32), UInt(8)}));
  EXPECT_EQ(two.outputs(), 2);
  EXPECT_EQ(two.dimensions(), 3);
  EXPECT_FALSE(one.defined());
  EXPECT_EQ(none.outputs() + none.dimensions(), 0);
  expect_error({"\"none\"", "needs a definition first"}, [&] { none.type(); });
}

TEST(DeclaredFuncs, PromiseTheirOutputBeforeTheirDefinition) {
  Var x("x"), y("y");
  Func one(Int(32), 2, "one"), two({Int(32), UInt(8)}, 1, "two"), none("none");
  one.output_buffer().dim(0).set_bounds(0, 10).dim(1).set_bounds(0, 6);
  two.output_buffers()[1].dim(0).set_min(0);
  one(x, y) = x + y;
  two(x) = Tuple(x, cast<uint8_t>(x));
  Buffer<int> result = one.realize({10, 6});
  EXPECT_EQ(result(9, 5), 14);
  EXPECT_THROW(one.realize(Buffer<int>(9, 6)), RuntimeError);
  Realization both = two.realize({3});
  EXPECT_EQ(Buffer<uint8_t>(both[1])(2), 2);
  both[1].set_min(1);
  both[0].set_min(1);
  EXPECT_THROW(two.realize(both), RuntimeError);
  expect_error({"\"none", "needs a definition first"}, [&] { none.output_buffer(); });
}

TEST(EagerInline, TakesWhatHasNoScheduleOfItsOwn) {
  Var x("x");
  Func f("f"), g("g"), h("h");
  f(x) = x;
  f(x) += 1;
  g(x) = x;
  h(x) = f(x) + g(x);
  expect_error({"an inlined Func has one pure definition", "update"}, [&] { h.eager_inline(f); });
  g.compute_root();
  expect_error({"an inlined Func has no schedule of its own"}, [&] { h.eager_inline(g); });
}

TEST(NewDirectives, StreamingIsAHintThatChangesNoValue) {
  Var x("x");
  Func table("table"), f("streamed");
  table(x) = x * x;
  table.compute_root();
  f(x) = table(x) + 1;
  f.vectorize(x, 8).stream_stores().stream_loads({table});
  const Buffer<int> found = f.realize({19});
  for (int i = 0; i < 19; ++i) EXPECT_EQ(found(i), i * i + 1);
}

TEST(Tuples, OfSeveralChoices) {
  Var x("x");
  Func f("f");
  f(x) = select(Tuple(x == 0, x < 2), Tuple(10, 20), Tuple(x == 1, x < 3), Tuple(11, 21),
                Tuple(12, 22));
  Realization both = f.realize({4});
  const Buffer<int> first = both[0], second = both[1];
  const int wanted[4][2] = {{10, 20}, {11, 20}, {12, 21}, {12, 22}};
  for (int i = 0; i < 4; i++) {
    EXPECT_EQ(first(i), wanted[i][0]);
    EXPECT_EQ(second(i), wanted[i][1]);
  }
}

TEST(Targets, WithAProcessor) {
  const Target target(Target::Linux, Target::X86, 64, Target::ZnVer3, {Target::AVX2}, 256);
  EXPECT_EQ(target.processor_tune, Target::ZnVer3);
  EXPECT_EQ(target.vector_bits, 256);
  EXPECT_TRUE(target.has_feature(Target::AVX2));
}

// ---- arithmetic ----

int64_t saturated(int64_t value, int64_t low, int64_t high) {
  return value < low ? low : value > high ? high : value;
}
// A right shift that rounds halves up; a negative amount shifts left.
int64_t rounded_right(int64_t value, int amount) {
  if (amount <= 0) return value << -amount;
  return (value + (int64_t{1} << (amount - 1))) >> amount;
}

TEST(Shifts, InTwiceTheBits) {
  Var x("x"), y("y");
  Func f("f");
  const Expr a = cast<int8_t>(x - 128), amount = cast<int8_t>(y - 4);
  f(x, y) =
      Tuple(cast<int>(widening_shift_left(a, amount)), cast<int>(widening_shift_right(a, amount)),
            cast<int>(rounding_shift_right(a, amount)), cast<int>(rounding_shift_left(a, amount)));
  Realization results = f.realize({256, 9});
  for (int j = 0; j < 9; j++) {
    for (int i = 0; i < 256; i++) {
      const int value = i - 128, by = j - 4;
      const int left = by >= 0 ? static_cast<int16_t>(value << by) : value >> -by;
      const int right = by >= 0 ? value >> by : static_cast<int16_t>(value << -by);
      EXPECT_EQ(Buffer<int>(results[0])(i, j), left) << value << " " << by;
      EXPECT_EQ(Buffer<int>(results[1])(i, j), right) << value << " " << by;
      EXPECT_EQ(Buffer<int>(results[2])(i, j), saturated(rounded_right(value, by), -128, 127));
      EXPECT_EQ(Buffer<int>(results[3])(i, j), saturated(rounded_right(value, -by), -128, 127));
    }
  }
}

TEST(Shifts, OfProducts) {
  Func f("f");
  Var x("x");
  const uint16_t most = 0xffff;
  f(x) = Tuple(mul_shift_right(Expr(most), Expr(most), 16),
               rounding_mul_shift_right(Expr(most), Expr(most), 18),
               mul_shift_right(Expr(int16_t{-3}), Expr(int16_t{5}), 1),
               rounding_mul_shift_right(Expr(int16_t{-3}), Expr(int16_t{5}), 1),
               mul_shift_right(Expr(int8_t{-128}), Expr(int8_t{-128}), 2));
  Realization r = f.realize({1});
  const int64_t product = int64_t{most} * most;
  EXPECT_EQ(Buffer<uint16_t>(r[0])(0), product >> 16);
  EXPECT_EQ(Buffer<uint16_t>(r[1])(0), rounded_right(product, 18));
  EXPECT_EQ(Buffer<int16_t>(r[2])(0), -15 >> 1);
  EXPECT_EQ(Buffer<int16_t>(r[3])(0), rounded_right(-15, 1));
  EXPECT_EQ(Buffer<int8_t>(r[4])(0), 127);
}

TEST(WideningOperations, OfANarrowOperand) {
  Var x("x");
  Func f("f");
  const Expr wide = cast<int16_t>(x), narrow = cast<int8_t>(-x);
  f(x) = Tuple(widen_right_add(wide, narrow), widen_right_sub(wide, narrow),
               widen_right_mul(wide, narrow));
  Realization r = f.realize({10});
  EXPECT_EQ(Buffer<int16_t>(r[0])(7), 0);
  EXPECT_EQ(Buffer<int16_t>(r[1])(7), 14);
  EXPECT_EQ(Buffer<int16_t>(r[2])(7), -49);
  expect_error({"the second operand has half the bits of the first"},
               [&] { widen_right_add(wide, wide); });
}

// ---- helpers ----

TEST(Helpers, OfFilesAndText) {
  const std::string file = file_make_temp("retrograde", ".txt");
  assert_file_exists(file);
  write_entire_file(file, std::vector<char>{'a', 'b'});
  EXPECT_EQ(read_entire_file(file), (std::vector<char>{'a', 'b'}));
  expect_error({"the file does not exist", file}, [&] { assert_no_file_exists(file); });
  ensure_no_file_exists(file);
  ensure_no_file_exists(file);
  assert_no_file_exists(file);
  EXPECT_FALSE(file_exists(file));
  expect_error({"the file exists", file}, [&] { assert_file_exists(file); });
  expect_error({file, "the file system allows it"}, [&] { file_unlink(file); });
  const std::string folder = dir_make_temp();
  EXPECT_TRUE(file_exists(folder));
  dir_rmdir(folder);
  EXPECT_EQ(get_env_variable("NO_SUCH_VARIABLE_OF_RETROGRADE"), "");
  EXPECT_GE(get_llvm_version(), 190);
  EXPECT_TRUE(starts_with("abc", "ab") && ends_with("abc", "bc") && !starts_with("a", "ab"));
  EXPECT_EQ(replace_all("a:b:c", ":", "::"), "a::b::c");
  EXPECT_EQ(split_string("a, b, , c", ", "), (std::vector<std::string>{"a", "b", "", "c"}));
  EXPECT_EQ(join_strings(std::vector<std::string>{"a", "b"}, "-"), "a-b");
  EXPECT_EQ(run_with_large_stack([] { return 7; }), 7);
}

TEST(Helpers, OfNumbers) {
  EXPECT_EQ(safe_numeric_cast<int8_t>(300), 44);
  EXPECT_EQ(safe_numeric_cast<int32_t>(1e20f), std::numeric_limits<int32_t>::max());
  EXPECT_EQ(safe_numeric_cast<uint8_t>(-3.5), 0);
  EXPECT_EQ(safe_numeric_cast<int>(std::numeric_limits<double>::quiet_NaN()), 0);
  for (int a = -7; a <= 7; a++) {
    for (int b = -3; b <= 3; b++) {
      EXPECT_EQ(div_imp(a, b), *as_const_int(simplify(Expr(a) / b))) << a << " " << b;
      EXPECT_EQ(mod_imp(a, b), *as_const_int(simplify(Expr(a) % b))) << a << " " << b;
    }
  }
  EXPECT_EQ(div_imp(std::numeric_limits<int>::min(), -1), std::numeric_limits<int>::min());
  EXPECT_EQ(mod_imp(7u, 0u), 0u);
  EXPECT_EQ(gcd(12, 18), 6);
  EXPECT_EQ(lcm(4, 6), 12);
  EXPECT_TRUE(add_would_overflow(32, 1 << 30, 1 << 30) &&
              !add_would_overflow(64, 1 << 30, 1 << 30));
  EXPECT_TRUE(sub_would_overflow(8, -100, 100) && !sub_would_overflow(16, -100, 100));
  EXPECT_TRUE(mul_would_overflow(64, INT64_MAX, 2) && !mul_would_overflow(64, INT64_MAX, 1));
}

TEST(SharedRuntime, HasHandlersForAllCalls) {
  static std::string said;
  Var x("x");
  Func f("f"), own("own");
  f(x) = print(x);
  JITHandlers handlers;
  handlers.custom_print = [](JITUserContext*, const char* text) { said += text; };
  const JITHandlers before = JITSharedRuntime::set_default_handlers(handlers);
  f.realize({2});
  EXPECT_EQ(said, "0\n1\n");
  own(x) = print(x + 5);
  own.jit_handlers().custom_print = [](JITUserContext*, const char*) {};
  own.realize({1});
  EXPECT_EQ(said, "0\n1\n");
  JITSharedRuntime::set_default_handlers(before);
  const int threads = JITSharedRuntime::set_num_threads(1);
  EXPECT_EQ(JITSharedRuntime::get_num_threads(), 1);
  EXPECT_GE(threads, 1);
  JITSharedRuntime::set_num_threads(0);
  expect_error({"the number of threads", "it is not negative"},
               [] { JITSharedRuntime::set_num_threads(-1); });
  JITUserContext context;
  JITSharedRuntime::populate_jit_handlers(&context, handlers);
  void* memory = context.handlers.custom_malloc(&context, 100);
  ASSERT_NE(memory, nullptr);
  context.handlers.custom_free(&context, memory);
  EXPECT_EQ(context.handlers.custom_print, handlers.custom_print);
  expect_error({"the context is not null"},
               [&] { JITSharedRuntime::populate_jit_handlers(nullptr, handlers); });
  JITSharedRuntime::memoization_cache_set_size(1 << 16);
  JITSharedRuntime::memoization_cache_set_size(0);
  JITSharedRuntime::memoization_cache_evict(1);
  JITSharedRuntime::reuse_device_allocations(true);
  JITSharedRuntime::release_all();
}

// ---- reports ----

TEST(Warnings, ArePrintedUnlessAHandlerTakesThem) {
  Var x("x");
  Func printed("printed"), told("told"), silent("silent");
  testing::internal::CaptureStderr();
  printed(x) = x;
  printed(x) = 2;
  EXPECT_NE(testing::internal::GetCapturedStderr().find("Warning: "), std::string::npos);

  std::vector<std::string> warnings;
  const retrograde::WarningHandler before =
      retrograde::set_warning_handler([&](const std::string& text) { warnings.push_back(text); });
  told(x) = 0;
  told(x) += 5;
  told.vectorize(x, 8);
  told.realize({16});
  told.realize({16});
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("has no schedule"), std::string::npos);

  retrograde::set_warning_handler({});
  testing::internal::CaptureStderr();
  silent(x) = x;
  silent(x) = 2;
  silent.realize({1});
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  retrograde::set_warning_handler(before);
}

TEST(Reports, ThrowWhatIsWrittenToThem) {
  const Expr undefined;
  expect_error<retrograde::UserError>({"undefined.defined()", "no value 7"}, [&] {
    _halide_user_assert(undefined.defined()) << "no value " << 7;
  });
  int evaluated = 0;
  _halide_user_assert(evaluated == 0) << ++evaluated;
  EXPECT_EQ(evaluated, 0);
}

struct Recorder : CompileTimeErrorReporter {
  void warning(const char* text) override { warnings.push_back(text); }
  void error(const char* text) override { errors.push_back(text); }
  std::vector<std::string> warnings, errors;
};

TEST(Reports, GoToAReporter) {
  Recorder recorder;
  set_custom_compile_time_error_reporter(&recorder);
  Var x("x");
  Func f("twice"), g("never");
  f(x) = x;
  f(x) = 1;
  expect_error({"\"never\""}, [&] { Expr e = g(x); });
  set_custom_compile_time_error_reporter(nullptr);
  EXPECT_EQ(recorder.warnings.size(), 1u);
  ASSERT_EQ(recorder.errors.size(), 1u);
  EXPECT_NE(recorder.errors[0].find("\"never\""), std::string::npos);
  expect_error({"\"never\""}, [&] { Expr e = g(x); });
  EXPECT_EQ(recorder.errors.size(), 1u);
}

// ---- autoschedulers and generators ----

// api: AutoSchedulerResults::autoscheduler_params
TEST(Autoschedulers, AreNamedWithWhatTheyAreTold) {
  Var x("x"), y("y");
  Func f("f");
  f(x, y) = x + y;
  f.set_estimates({{0, 64}, {0, 64}});
  std::vector<std::string> warnings;
  const auto before =
      retrograde::set_warning_handler([&](const std::string& text) { warnings.push_back(text); });
  const AutoSchedulerResults results = Pipeline(f).apply_autoscheduler(
      get_host_target(), {"Mullapudi2016", {{"parallelism", "8"}, {"beam_size", "4"}}});
  retrograde::set_warning_handler(before);
  EXPECT_EQ(results.scheduler_name, "Retrograde");
  EXPECT_EQ(results.autoscheduler_params.name, "Mullapudi2016");
  EXPECT_EQ(results.machine_params_string.rfind("8,", 0), 0u);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("\"beam_size\""), std::string::npos);
  expect_error(
      {"the built-in autoscheduler takes parameters of the machine", "\"beam_size\""}, [&] {
        Pipeline(f).apply_autoscheduler(get_host_target(), {"Retrograde", {{"beam_size", "4"}}});
      });
  expect_error({"\"Nobody\""},
               [&] { Pipeline(f).apply_autoscheduler(get_host_target(), {"Nobody"}); });
  EXPECT_EQ((AutoschedulerParams{"A", {{"k", "v"}}}).to_string(),
            "autoscheduler=A autoscheduler.k=v");
}

// api: AutoschedulerParamsFn
TEST(Autoschedulers, OfAProgramAreGivenAll) {
  Var x("x");
  Func f("f");
  f(x) = x;
  std::string given;
  Pipeline::add_autoscheduler("Echo",
                              [&](const Pipeline&, const Target&, const AutoschedulerParams& params,
                                  AutoSchedulerResults*) { given = params.extra.at("word"); });
  Pipeline(f).apply_autoscheduler(get_host_target(), {"Echo", {{"word", "yes"}}});
  Pipeline::add_autoscheduler("Echo", nullptr);
  EXPECT_EQ(given, "yes");
}

class PairOfTypes : public Generator<PairOfTypes> {
 public:
  Input<Buffer<float, 1>> in{"in"};
  Func* pair = nullptr;
  GeneratorInput<Expr>* bias = nullptr;
  Var x{"x"};
  void configure() {
    bias = add_input<Expr>("bias", Int(8));
    pair = add_output<Func>("pair", {Float(32), UInt(8)}, 1);
  }
  void generate() { (*pair)(x) = Tuple(in(x), cast<uint8_t>(x + *bias)); }
};

TEST(Generators, AddOutputsOfSeveralTypes) {
  const auto generator = PairOfTypes::create(GeneratorContext(get_jit_target_from_environment()));
  Callable pair = generator->compile_to_callable();
  Buffer<float> in(4), copy(4);
  Buffer<uint8_t> sums(4);
  in.fill(2.5f);
  pair(in, int8_t{3}, copy, sums);
  EXPECT_EQ(copy(3), 2.5f);
  EXPECT_EQ(sums(3), 6);
}

class Shouting : public Generator<Shouting> {
 public:
  Output<Buffer<int, 1>> out{"out"};
  Var x{"x"};
  void generate() { out(x) = print(x); }
  void schedule() { out.set_estimates({{0, 64}}); }
};

TEST(Generators, TakeHandlersAndSchedulers) {
  static std::string said;
  JITHandlers handlers;
  handlers.custom_print = [](JITUserContext*, const char* text) { said += text; };
  const auto generator = Shouting::create(GeneratorContext(get_jit_target_from_environment()));
  const std::map<std::string, JITExtern> externs;
  Callable shout = generator->compile_to_callable(&handlers, &externs);
  Buffer<int> out(1);
  shout(out);
  EXPECT_EQ(said, "0\n");

  const auto scheduled = Shouting::create(GeneratorContext(get_jit_target_from_environment()));
  scheduled->set_generator_param_values(
      {{"autoscheduler", "Retrograde"}, {"autoscheduler.parallelism", "4"}});
  EXPECT_TRUE(scheduled->using_autoscheduler());
  EXPECT_EQ(scheduled->get_autoscheduler_params().extra.at("parallelism"), "4");
  scheduled->build_module("scheduled");
  const GeneratorContext context(get_host_target(), AutoschedulerParams("Retrograde"));
  EXPECT_TRUE(Shouting::create(context)->using_autoscheduler());
  EXPECT_EQ(Shouting::create(context)->context().autoscheduler_params().name, "Retrograde");
}

}  // namespace
