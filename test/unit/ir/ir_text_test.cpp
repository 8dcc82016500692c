// parse(print(x)) equals x; malformed text is a UserError with its position.
#include <gtest/gtest.h>

#include "diagnostics/large_stack.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/parse.h"
#include "ir/print.h"
#include "support/errors.h"
#include "support/random_ir.h"

namespace retrograde {
namespace {

using namespace ir;

void expect_round_trip(const Expr& e) {
  const std::string text = print(e);
  EXPECT_TRUE(equal(parse_expr(text), e)) << text << "\nread back as\n" << print(parse_expr(text));
}
void expect_round_trip(const Stmt& s) {
  const std::string text = print(s);
  EXPECT_TRUE(equal(parse_stmt(text), s)) << text << "\nread back as\n" << print(parse_stmt(text));
}

TEST(IrText, RandomExpressionsRoundTrip) {
  for (uint32_t seed = 1; seed <= 3000; ++seed) {
    test::RandomIr random(seed);
    const Type type = random.scalar_type().with_lanes(seed % 3 ? 1 : 4);
    expect_round_trip(random.expr(type, static_cast<int>(seed % 7)));
    ASSERT_FALSE(testing::Test::HasFailure()) << "seed " << seed;
  }
}

Stmt random_stmt(test::RandomIr& random, int depth) {
  const auto e = [&](Type type = Int(32)) { return random.expr(type, 2); };
  const auto inner = [&] { return random_stmt(random, depth - 1); };
  const std::string name = "n" + std::to_string(random.below(1000));
  if (depth <= 0)
    return make_store(name, e(Float(32)), e(), random.chance(30) ? e(Bool()) : Expr());
  switch (random.below(18)) {
    case 0:
      return ir::make_let(name, e(), inner());
    case 1:
      return make_assert(e(Bool()),
                         call_op(Op::error, Int(32), {Expr(3), Expr("said \"no\"\n"), e()}));
    case 2:
      return make_producer_consumer(name, random.chance(50), inner());
    case 3:
      return make_for(name, e(), e(), static_cast<ForType>(random.below(7)), inner(),
                      static_cast<Partition>(random.below(3)));
    case 4:
      return make_store(name, e(Int(32, 4)), e(Int(32, 4)),
                        random.chance(50) ? e(Bool(4)) : Expr());
    case 5:
      return make_provide(name, {e(Float(32)), e()}, {e(), e()},
                          random.chance(50) ? e(Bool()) : Expr());
    case 6:
      return make_realize(name, {Float(32), UInt(8)}, MemoryType::Stack, {{e(), e()}, {e(), e()}},
                          inner(), {{1, 0}, {Expr(), e()}, "place", e(), random.below(3)});
    case 7:
      return make_allocate(name, Float(32), MemoryType::Heap, e(Int(64)), inner());
    case 8:
      return make_free(name);
    case 9:
      return make_if(e(Bool()), inner(), random.chance(50) ? inner() : Stmt());
    case 10:
      return make_evaluate(e(Float(64)));
    case 11:
      return make_realize(name, {Int(32)}, MemoryType::Auto, {}, inner());
    case 12:
      return make_atomic(name, inner());
    case 13:
      return make_fork(inner(), inner());
    case 14:
      return make_prefetch(name, Float(32), {{e(), e()}});
    case 15:
      return make_launch(name, {e(), e(), e()}, {1 + random.below(64), 2, 1}, e(), inner());
    case 16:
      return make_allocate(name, Float(32), MemoryType::GPUShared, e(), inner(), e());
    default:
      return make_block({inner(), inner(), inner()});
  }
}

TEST(IrText, RandomStatementsRoundTrip) {
  for (uint32_t seed = 1; seed <= 2000; ++seed) {
    test::RandomIr random(seed);
    expect_round_trip(random_stmt(random, 4));
    ASSERT_FALSE(testing::Test::HasFailure()) << "seed " << seed;
  }
}

TEST(IrText, ImmediatesOfEveryTypeRoundTrip) {
  for (Type type : {Int(8), Int(16), Int(32), Int(64), UInt(8), UInt(16), UInt(32), UInt(64)}) {
    expect_round_trip(make_const(type, type.min_int()));
    expect_round_trip(make_uint_const(type, type.max_uint()));
  }
  for (Type type : {Float(16), BFloat(16), Float(32), Float(64)}) {
    for (double value : std::initializer_list<double>{0.0, -0.0, 0.1, -1e-40, 1e30, 65504.0,
                                                      INFINITY, -INFINITY, NAN}) {
      expect_round_trip(make_const(type, value));
    }
  }
  EXPECT_EQ(print(Expr(2.5f)), "2.5f");
  EXPECT_EQ(print(make_const(UInt(8), 7)), "7_u8");
}

TEST(IrText, OddAndReservedNamesRoundTrip) {
  for (const char* name : {"a b", "select", "floor", "float32", "`", "3d", "x.min.0", "f$3", "in",
                           "", "é", "nan_f32"}) {
    expect_round_trip(variable(name) + variable(name, Float(64)));
    expect_round_trip(call_func(name, Float(32), {Expr(1)}, 2, {}));
    expect_round_trip(call_extern(name, Float(32), {Expr(1)}));
    expect_round_trip(make_load(UInt(8), name, Expr(1)));
  }
}

TEST(IrText, SharedNodesKeepTheTextSmall) {
  Expr e = variable("x");
  for (int i = 0; i < 300; ++i) e = e * e + 1;
  EXPECT_LT(print(e).size(), 20000u);
  expect_round_trip(e);
}

void expect_text(const Expr& e, const std::string& text) {
  EXPECT_EQ(print(e), text);
  expect_round_trip(e);
}

TEST(IrText, ParenthesesStandOnlyWherePrecedenceNeedsThem) {
  const Expr x = variable("x"), y = variable("y"), c = variable("c", Bool());
  expect_text(x + y * 2 < y - 1 - x && !(x == y), "x + y * 2 < y - 1 - x && !(x == y)");
  expect_text(x - (y - 1), "x - (y - 1)");
  expect_text((x + y) * (x / (y * 2)), "(x + y) * (x / (y * 2))");
  expect_text((c || x < y) && c, "(c:bool || x < y) && c");
  expect_text((x < y) == c, "(x < y) == c:bool");
  expect_text(x * Expr(-3) - Expr(-2), "x * -3 - -2");
}

TEST(IrText, TheFirstMentionGivesANameItsType) {
  const Expr i = variable("i");
  const Expr load = make_load(Float(32), "a", i), next = make_load(Float(32), "a", i + 1);
  expect_text(load + next, "a[i]:float32 + a[i + 1]");
  expect_text(make_load(Int(32), "b", make_load(Int(32), "b", i)), "b[b[i]]");
  // The lanes of a load are those of its index; one name may have two types.
  const Expr lanes = make_ramp(i, Expr(1), 4);
  expect_text(make_load(Float(32, 4), "a", lanes) * make_broadcast(load, 4),
              "a[ramp(i, 1, 4)]:float32x4 * broadcast(a[i], 4)");
  expect_text(cast(Float(64), load) + make_load(Float(64), "a", i),
              "float64(a[i]:float32) + a[i]:float64");
  expect_text(call_func("f", Float(32), {i}, 1, {}) + call_func("f", Float(32), {i + 1}, 1, {}),
              "f(i).1:float32 + f(i + 1).1");
}

TEST(IrText, DeclarationsAndStoresGiveNamesTheirTypes) {
  const std::string text =
      "realize f(uint8, float32) auto [0, n] {\n"
      "  f(0) = {f(1) + 1_u8, f(1).1 * 2f}\n"
      "}\n"
      "let t = 2f\n"
      "for (x, 0, n) {\n"
      "  b[x] = t * 3f\n"
      "  b[x] = b[x] - c[x]:float32\n"
      "}\n";
  EXPECT_EQ(print(parse_stmt(text)), text);
}

TEST(IrText, AStatementReadsAsItWasWritten) {
  const std::string text =
      "let n = a.extent.0 + 3\n"
      "allocate buf[10_i64]:float32 heap {\n"
      "  parallel for (x, 0, n) {\n"
      "    buf[x if x < 5] = floor(buf[x]) * 2f\n"
      "  }\n"
      "  free buf\n"
      "}\n";
  EXPECT_EQ(print(parse_stmt(text)), text);
}

void expect_syntax_error(const std::string& text, const std::string& place) {
  expect_error<UserError>({place}, [&] { parse_stmt(text); });
}

TEST(IrText, ErrorsSayWhere) {
  expect_syntax_error("evaluate (x + 1", "line 1, column 16");
  expect_syntax_error("free a\nfor (x, 0) {}", "line 2, column 10");
  expect_syntax_error("evaluate x + 1f", "line 1, column 12");
  expect_syntax_error("evaluate 300_u8", "fits its type");
  expect_syntax_error("evaluate floor(1f, 2f)", "line 1, column 10");
  expect_syntax_error("evaluate \"abc", "closing quote");
  expect_syntax_error("evaluate `abc", "closing back quote");
  expect_syntax_error("a[1] = ~", "line 1, column 8");
  expect_syntax_error("evaluate #3", "shared node");
  expect_syntax_error("}", "a statement");
  run_on_large_stack(
      [] { expect_syntax_error("evaluate " + std::string(100000, '('), "nests less deeply"); });
}

}  // namespace
}  // namespace retrograde
