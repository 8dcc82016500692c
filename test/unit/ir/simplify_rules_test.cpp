// Each rule of the simplifier once, as IR text before and after.
#include <gtest/gtest.h>
#include <set>

#include "diagnostics/large_stack.h"
#include "ir/build.h"
#include "ir/equal.h"
#include "ir/parse.h"
#include "ir/print.h"
#include "ir/visit.h"
#include "simplify/cse.h"
#include "simplify/simplify.h"

namespace retrograde {
namespace {

using namespace simplification;

struct Rule {
  const char *before, *after;
};

void check(std::initializer_list<Rule> rules) {
  for (const Rule& rule : rules) {
    const Expr after = simplify(parse_expr(rule.before));
    EXPECT_TRUE(equal(after, parse_expr(rule.after)))
        << rule.before << "\n gives " << print(after) << "\n not   " << rule.after;
    EXPECT_TRUE(equal(simplify(after), after)) << "not stable: " << rule.before;
  }
}
// Texts that must not change.
void keep(std::initializer_list<const char*> texts) {
  for (const char* text : texts) check({{text, text}});
}

TEST(Simplify, GathersSums) {
  check({{"x + 3 + y - x", "y + 3"},
         {"(x + y)*3 - x*2 - y*3", "x"},
         {"x - (y - 2)", "x - y + 2"},
         {"5 - (x + 5)", "0 - x"},
         {"x*2*(y*3)", "x * y * 6"},
         {"(x + 1)*y - x*y", "y"},
         {"(y - m)*s + m*s", "s * y"},
         {"a:uint8 + 200_u8 + 100_u8", "a:uint8 + 44_u8"},
         {"select(c:bool, 3, 4)*2 + 1", "select(c:bool, 7, 9)"},
         {"min(x, y + 3) - y", "min(x - y, 3)"},
         {"min(x, y) - x", "min(y - x, 0)"}});
}

TEST(Simplify, DividesByConstants) {
  check({{"(x*4 + y)/4", "x + y/4"},
         {"(x*4 + y)%4", "y % 4"},
         {"(x + 5)/4", "(x + 1)/4 + 1"},
         {"(x*6 + 4)/8", "(x*3 + 2)/4"},
         {"(x*6 + 4)%8", "(x*3 + 2)%4*2"},
         {"x/3/5", "x/15"},
         {"(x/3 + 2)/5", "(x + 6)/15"},
         {"x/4*4 + x%4", "x"},
         {"x - x/8*8", "x % 8"},
         {"x/-4", "0 - x/4"},
         {"x%-4", "x%4"},
         {"x%8%4", "x%4"},
         {"(x%8 + y)%4", "(x + y)%4"},
         {"int32(a:uint8)/256", "0"},
         {"int32(a:uint8)%256", "int32(a:uint8)"},
         {"(x%8)/8", "0"},
         {"min(x*8, n*8 - 8)/8", "min(x, n - 1)"}});
  keep({"x/0 + 0*x", "x/y", "x%y", "(x + 1)/4"});
}

TEST(Simplify, DecidesMinAndMax) {
  check({{"max(a, a - 1)", "a"},
         {"min(x + 3, y + 3)", "min(x, y) + 3"},
         {"min(x*4 + y, x*4 + z)", "x*4 + min(y, z)"},
         {"min(min(x, 5), 7)", "min(x, 5)"},
         {"min(x, max(x, y))", "x"},
         {"max(min(x, y), x)", "x"},
         {"min(min(x, y), x + 1)", "min(x, y)"},
         {"max(int32(a:uint8), -3)", "int32(a:uint8)"},
         {"min(x, likely(x))", "x"}});
  keep({"max(min(x + 1, n - 1), 0)", "min(f:float32, g:float32)"});
}

// Regions of stencils that read each other within their domains.
TEST(Simplify, MakesOneClampOfClampsInOneAnother) {
  check({{"min(max(x - 1, 0), max(x - 2, 0))", "max(x - 2, 0)"},
         {"max(min(max(x, 0), 9), min(max(x - 1, 0), 9))", "min(max(x, 0), 9)"},
         {"max(max(x, 0) - 1, y)", "max(max(y, x - 1), -1)"},
         {"max(min(max(x - 1, 0), 9) - 1, 0)", "min(max(x - 2, 0), 8)"},
         {"min(max(min(max(max(x - 1, 0) - 1, 0), 9) - 1, 0), 7)", "min(max(x - 3, 0), 7)"},
         {"min(x, 9) <= min(x - 1, 9) + 1", "true"},
         {"min(max(x - 1, 0), 9) <= min(max(x, 0), 9)", "true"}});
  keep({"max(min(n, max(x - 1, 0)) - 1, 0)", "min(max(y, 0), max(x - 1, 0))"});
}

TEST(Simplify, JoinsClampsOfOneValue) {
  check({{"n - min(max(x, 0), 9) + max(min(x, 9), 0)", "n"},
         {"max(min(x, 2), 0) - max(min(x, 2), 1)", "max(min(x, 1), 0) - 1"},
         {"max(min(x, 2), 1) - max(min(x, 2), 0)", "1 - max(min(x, 1), 0)"},
         {"y + max(min(x - 1, 1), -1) - max(min(x, 2), 1)", "y + max(min(x, 1), 0) - 2"},
         {"max(min(x, 9), 0) - max(min(x, 3), 0)", "max(min(x, 9), 3) - 3"},
         {"min(x, 9) - max(min(x, 9), 0)", "min(x, 0)"},
         {"3 * max(x, 2) - 3 * max(min(x, 7), 2)", "max(x, 7) * 3 - 21"}});
  keep({"max(min(x, 9), 0) - max(min(y, 9), 0)", "max(min(x, 9), 0) - max(min(x, 6), 3)"});
}

TEST(Simplify, DecidesComparisons) {
  check({{"x + 3 < y + 5", "x <= y + 1"},
         {"x*8 + 7 <= x*8", "false"},
         {"max(min(x, 10), 0) < 11", "true"},
         {"min(x, y) <= x", "true"},
         {"min(n - 8, x*8) + 7 <= n - 1", "true"},
         {"((n + 7)/8 - 1)*8 + 7 < n + 7", "true"},
         {"x/8*8 <= x", "true"},
         {"x < x/8*8 + 8", "true"},
         {"x*4 == 6", "false"},
         {"x*3 == x*2 + y", "x == y"},
         {"x*4 < 6", "x < 2"},
         {"x/2 < 5", "x < 10"},
         {"3 < x/2", "7 < x"},
         {"x >= y", "y <= x"},
         {"!(x < y)", "y <= x"},
         {"!(x == y)", "x != y"},
         {"int32(a:uint8) < 256", "true"},
         {"a:uint8 < 0_u8", "false"},
         {"select(c:bool, 1, 0) == 1", "c:bool"},
         {"select(c:bool, 1, 0) < 1", "!c:bool"},
         {"f:float32 < f:float32", "false"}});
  keep({"x <= 2147483647 - y", "f:float32 == f:float32", "!(f:float32 < g:float32)",
        "f:float32 <= f:float32"});
}

TEST(Simplify, CombinesConditions) {
  check({{"x < 5 && x < 7", "x < 5"},
         {"x < 5 || x < 7", "x < 7"},
         {"x < 5 && x > 7", "false"},
         {"x < 5 || x > 3", "true"},
         {"c:bool && d:bool && c:bool", "c:bool && d:bool"},
         {"c:bool && !c:bool", "false"},
         {"(x < y && c:bool) || true", "true"},
         {"select(x < y, x, y)", "min(x, y)"},
         {"select(f:float32 < g:float32, f:float32, g:float32)", "min(f:float32, g:float32)"},
         {"select(!c:bool, x, y)", "select(c:bool, y, x)"},
         {"select(c:bool, select(c:bool, x, y), z)", "select(c:bool, x, z)"},
         {"select(c:bool, true, false)", "c:bool"},
         {"select(c:bool, d:bool, false)", "c:bool && d:bool"}});
}

TEST(Simplify, KeepsFloatsExact) {
  check({{"f:float32 * 1f", "f:float32"},
         {"2f * f:float32", "f:float32 * 2f"},
         {"f:float32 + (-0f - g:float32)", "f:float32 - g:float32"},
         {"f:float32 - (-0f - g:float32)", "f:float32 + g:float32"}});
  keep({"f:float32 + 0f", "f:float32 * 0f", "f:float32 - f:float32", "f:float32 / f:float32",
        "f:float32 + 1f - 1f", "max(f:float32, f:float32 - 1f)"});
}

TEST(Simplify, LinesOfLanes) {
  check({{"ramp(x, 1, 8) + broadcast(y, 8)", "ramp(x + y, 1, 8)"},
         {"ramp(x, 1, 8)*broadcast(3, 8) - ramp(y, 2, 8)", "ramp(x*3 - y, 1, 8)"},
         {"ramp(x, 1, 8) - ramp(y, 1, 8)", "broadcast(x - y, 8)"},
         {"broadcast(x, 4)*ramp(y, 2, 4)", "ramp(x*y, x*2, 4)"},
         {"ramp(x*8, 1, 8)/broadcast(8, 8)", "broadcast(x, 8)"},
         {"ramp(x*8, 1, 8)%broadcast(8, 8)", "ramp(0, 1, 8)"},
         {"ramp(x*2, 2, 8)/broadcast(2, 8)", "ramp(x, 1, 8)"},
         {"(let b = n*n*16 in ramp(b, 1, 16)/broadcast(128, 16) + broadcast(b, 16))",
          "(let b = n*n*16 in broadcast(b + b/128, 16))"},
         {"(let b = n*n*16 + 8 in ramp(b, 1, 8)%broadcast(128, 8) + broadcast(b, 8))",
          "(let b = n*n*16 + 8 in ramp(b + b % 128, 1, 8))"},
         {"(let b = n*n*16 + 8 in ramp(b, 1, 9)/broadcast(128, 9) + broadcast(b, 9))",
          "(let b = n*n*16 + 8 in ramp(b, 1, 9)/broadcast(128, 9) + broadcast(b, 9))"},
         {"ramp(x, 1, 8) < broadcast(x + 8, 8)", "broadcast(true, 8)"},
         {"broadcast(x, 8) < broadcast(y, 8)", "broadcast(x < y, 8)"},
         {"select(broadcast(c:bool, 8), ramp(x, 1, 8), ramp(y, 1, 8))",
          "select(c:bool, ramp(x, 1, 8), ramp(y, 1, 8))"},
         {"sqrt(broadcast(f:float32, 4))", "broadcast(sqrt(f:float32), 4)"},
         {"a[broadcast(x, 4)]:float32x4", "broadcast(a[x]:float32, 4)"},
         {"reduce(or, ramp(x, 1, 8) < broadcast(y, 8), 1)", "x < y"},
         {"reduce(or, ramp(x, -1, 8) <= broadcast(y, 8), 1)", "x <= y + 7"},
         {"reduce(or, broadcast(y, 8) < ramp(x, 2, 8), 1)", "y <= x + 13"},
         {"reduce(or, broadcast(c:bool, 8) && (broadcast(y, 8) <= ramp(x, 1, 8)), 1)",
          "c:bool && y <= x + 7"},
         {"reduce(max, broadcast(x, 8), 1)", "x"},
         {"reduce(add, broadcast(x, 8), 1)", "x*8"}});
}

TEST(Simplify, CastsAndHints) {
  check({{"uint8(int32(b:uint8))", "b:uint8"},
         {"float32(int32(b:uint8))", "float32(b:uint8)"},
         {"uint8(int16(x))", "uint8(x)"},
         {"likely(5) + x", "x + 5"},
         {"likely(x < x + 1)", "true"},
         {"promise_clamped(x%4, 0, 7)", "x%4"}});
  keep({"likely(x)", "int32(float32(x))", "int32(uint8(x))", "promise_clamped(x, 0, 7)",
        "float64(float32(g:float64))"});
}

TEST(Simplify, Lets) {
  check({{"(let t = x*y in t*t + t - t*t)", "x*y"},
         {"(let t = x + 1 in t - 1)", "x"},
         {"(let t = x*y in (let u = t*t in 3))", "3"},
         {"(let t = x*y in t*t)", "(let t = x*y in t*t)"},
         {"(let t = y*4 in t < y*4 + 1)", "true"}});
}

TEST(Simplify, UsesBoundsOfVariables) {
  const BoundsMap bounds = {{"x", {Expr(0), parse_expr("n - 1")}},
                            {"y", {parse_expr("x"), parse_expr("x + 7")}},
                            {"k", {Expr(2), Expr(5)}}};
  EXPECT_TRUE(can_prove(parse_expr("x < n"), bounds));
  EXPECT_TRUE(can_prove(parse_expr("y < n + 7"), bounds));
  EXPECT_TRUE(can_prove(parse_expr("0 <= y"), bounds));
  EXPECT_TRUE(can_prove(parse_expr("min(x, n) == x"), bounds));
  EXPECT_TRUE(can_prove(parse_expr("x*4 + k < n*4 + 2"), bounds));
  EXPECT_FALSE(can_prove(parse_expr("x < n - 1"), bounds));
  EXPECT_FALSE(can_prove(parse_expr("y < n"), bounds));
  EXPECT_TRUE(equal(simplify(parse_expr("k/8 + max(k, 1)"), bounds), parse_expr("k")));
}

void check_stmt(const std::string& before, const std::string& after) {
  const Stmt result = simplify(parse_stmt(before));
  EXPECT_TRUE(equal(result, parse_stmt(after))) << before << "\n gives\n"
                                                << print(result) << " not\n"
                                                << after;
}

TEST(SimplifyStmt, DropsWhatNeverRuns) {
  check_stmt("for (x, 0, 0) { a[x] = 1 }\na[0] = 2", "a[0] = 2");
  check_stmt("for (x, 0, min(n, 0)) { a[x] = 1 }", "");
  check_stmt("for (x, 3, 1) { a[x] = x }", "a[3] = 3");
  check_stmt("for (x, m*m, 1) { a[x*x] = x }", "let x = m*m\na[x*x] = x");
  check_stmt("if (1 < 2) { a[0] = 1 } else { a[0] = 2 }", "a[0] = 1");
  check_stmt("if (n < n) { a[0] = 1 }", "");
  check_stmt("a[0 if n < n] = 1", "");
  check_stmt("produce f { if (false) { a[0] = 1 } }", "");
  check_stmt("assert(n <= n, 3)\na[0] = 1", "a[0] = 1");
  check_stmt("evaluate n*n\na[0] = 1", "a[0] = 1");
}

TEST(SimplifyStmt, Lets) {
  check_stmt("let x = n*n\nlet y = x\nlet z = y + 2\na[z] = y", "let x = n*n\na[x + 2] = x");
  check_stmt("let x = n*n\nlet y = x*x\na[0] = 1", "a[0] = 1");
  check_stmt("let x = print(n)\na[0] = 1", "let x = print(n)\na[0] = 1");
}

TEST(SimplifyStmt, KnowsLetsModuloConstants) {
  const std::string even = "let e = (n + 1)/2*2 - 2\n", odd = "let o = m*4 + 1\n";
  check_stmt(even + "a[e] = e % 2", even + "a[e] = 0");
  check_stmt(even + "a[e] = (e + 1) % 2", even + "a[e] = 1");
  check_stmt(even + "a[e] = (e + 3)/2", even + "a[e] = e/2 + 1");
  check_stmt(even + "a[e] = e/2*2", even + "a[e] = e");
  check_stmt(even + "a[e] = (e + x*6 + 5) % 2", even + "a[e] = 1");
  check_stmt(even + "a[e] = (e*3) % 4", even + "a[e] = e*3 % 4");
  check_stmt(odd + "a[o] = (o*o + 6) % 4", odd + "a[o] = 3");
  check_stmt(odd + "a[o] = o % 8", odd + "a[o] = o % 8");
  check_stmt(even + odd + "for (x, 0, (o - e + 1)/2) { a[min(x*2, o - e - 1)] = 1 }",
             even + odd + "for (x, 0, (o - e)/2 + 1) { a[x*2] = 1 }");
  check_stmt(even + odd + "a[e + o] = min(e, o) % 2", even + odd + "a[e + o] = min(e, o) % 2");
  check_stmt("let e = select(c:bool, k*6, k*10 + 4)\na[e] = e % 2",
             "let e = select(c:bool, k*6, k*10 + 4)\na[e] = 0");
}

TEST(SimplifyStmt, UsesLoopBoundsConditionsAndAsserts) {
  check_stmt("for (x, 0, n) { if (x < n) { a[max(x, 0)] = 1 } }", "for (x, 0, n) { a[x] = 1 }");
  check_stmt("for (x, 0, (n + 7)/8) { for (y, 0, 8) { if (x*8 + y < n + 7) { a[x*8 + y] = 1 } } }",
             "for (x, 0, (n + 7)/8) { for (y, 0, 8) { a[x*8 + y] = 1 } }");
  check_stmt("if (n < m) { a[min(n, m)] = 1\n if (m < n) { a[1] = 1 } } else { a[max(n, m)] = 1 }",
             "if (n < m) { a[n] = 1 } else { a[n] = 1 }");
  check_stmt("assert(0 < n, 3)\na[max(n, 1)] = 1", "assert(0 < n, 3)\na[n] = 1");
  check_stmt("if (c:bool) { assert(0 < n, 3) }\na[max(n, 1)] = 1",
             "if (c:bool) { assert(0 < n, 3) }\na[max(n, 1)] = 1");
  check_stmt("if (c:bool && 0 < n) { a[0] = select(c:bool, 1, 2) }",
             "if (c:bool && 0 < n) { a[0] = 1 }");
}

TEST(SimplifyStmt, OpensNamesWhereTermsCancel) {
  check_stmt("let m = t*64 - q*64\na[x + t*64 - m] = 1", "a[q*64 + x] = 1");
  check_stmt("let m = t*64 - q\nlet k = t*64 + p\na[k - m + x] = 1", "a[p + q + x] = 1");
  check_stmt("let m = min(p*8, q)\nlet k = m + r\na[k - min(p*8, q)] = 1", "a[r] = 1");
  const std::string loaded = "let m = b[0]:int32*3\n";
  check_stmt(loaded + "a[x + b[0]:int32*3 - m] = 1", loaded + "a[x + b[0]:int32*3 - m] = 1");
  const std::string long_way = "let m = p*8 + q\n";
  check_stmt(long_way + "a[m + p] = m", long_way + "a[m + p] = m");
}

TEST(SimplifyStmt, BranchesKnowNumbers) {
  check_stmt("if (s == 1) { a[x*s] = 1 } else { a[x*s] = 2 }",
             "if (s == 1) { a[x] = 1 } else { a[s*x] = 2 }");
  check_stmt("if (c:bool && n == 3) { for (i, 0, n) { a[i] = n } }",
             "if (c:bool && n == 3) { for (i, 0, 3) { a[i] = 3 } }");
  const std::string ends = "let e = m + n*2\n";
  check_stmt(ends + "if (n == 3) { for (i, m, e - m) { a[i] = e } } else { a[e] = e }",
             ends + "if (n == 3) { for (i, m, 6) { a[i] = e } } else { a[e] = e }");
  const std::string twice = "let t = n*2\n";
  check_stmt(twice + "if (n == 3) { a[t] = t } else { a[t] = t }",
             twice + "if (n == 3) { a[6] = 6 } else { a[t] = t }");
  check_stmt("if (n != 3) { a[n] = 1 } else { a[n] = 2 }",
             "if (n != 3) { a[n] = 1 } else { a[3] = 2 }");
  // Lanes of a loop remain lanes.
  check_stmt("for (x, 0, n) { if (x == 3) { a[x] = 1 } }",
             "for (x, 0, n) { if (x == 3) { a[x] = 1 } }");
}

TEST(SimplifyStmt, BranchesKnowMultiples) {
  const std::string tiles = "for (x, 0, (n + 7)/8) { a[min(x*8, n - 8)] = 1 }";
  check_stmt("if (n % 8 == 0) { " + tiles + " }",
             "if (n % 8 == 0) { for (x, 0, n/8) { a[x*8] = 1 } }");
  const std::string last = "let l = m + n\n";
  check_stmt(last + "if (n % 4 == 0 && m % 4 == 1) { a[l] = l % 4 } else { a[l] = l % 4 }",
             last + "if (n % 4 == 0 && m % 4 == 1) { a[l] = 1 } else { a[l] = l % 4 }");
  check_stmt("if ((n + 3) % 4 == 0) { a[n] = n % 2 }", "if ((n + 3) % 4 == 0) { a[n] = 1 }");
}

// So that they are not allocated in each iteration.
TEST(SimplifyStmt, SmallBlocksInLoopsHaveTheirLargestSize) {
  const auto in_loop = [](const std::string& elements, const char* memory = "auto") {
    return "for (x, 0, n) { let l = min(m, x*2 + 1)\n allocate b[" + elements + "]:float32 " +
           memory + " { b[0] = float32(l)\n a[x] = b[0]:float32 } }";
  };
  const std::string two = "int64(l - x*2 + 1)";
  check_stmt(in_loop(two), in_loop("2_i64"));
  check_stmt(in_loop(two + " * 16_i64"), in_loop("32_i64"));
  check_stmt(in_loop("int64(max(min(n, 4), 0)) * " + two), in_loop("8_i64"));
  const std::string large = "int64(l - x*2 + 1) * 2049_i64";
  check_stmt(in_loop(large), in_loop(large));
  check_stmt(in_loop(two, "heap"), in_loop(two, "heap"));
}

// Values between one multiple and the next.
TEST(SimplifyStmt, DividesInsideTiles) {
  const std::string tile = "let m = min(k, l)*8\n";
  check_stmt(tile + "for (i, m, 8) { a[i/8] = i % 8 }", tile + "for (i, m, 8) { a[m/8] = i - m }");
  check_stmt(tile + "for (i, m + 2, 4) { a[(i + 1)/8] = (i + 1) % 8 }",
             tile + "for (i, m + 2, 4) { a[m/8] = i - m + 1 }");
  check_stmt(tile + "for (i, m + 2, 7) { a[i/8] = i % 8 }",
             tile + "for (i, m + 2, 7) { a[i/8] = i % 8 }");
}

TEST(SimplifyStmt, GivesTheSameHandleWhenNothingChanges) {
  const Stmt s = parse_stmt("for (x, 0, n) { let t = x*x\n a[t] = t\n if (x < m) { a[x] = 1 } }");
  const Stmt once = simplify(s);
  EXPECT_TRUE(simplify(once).same_as(once));
}

// If a rule doubled its work at each level, this would not end.
TEST(SimplifyCost, SharedTowersOfEveryOperator) {
  for (const Kind kind :
       {Kind::Add, Kind::Sub, Kind::Mul, Kind::Min, Kind::Max, Kind::Div, Kind::Mod}) {
    Expr e = variable("x");
    for (int i = 0; i < 400; ++i) {
      const Expr y = variable("y" + std::to_string(i % 7));
      e = binary(kind, select(y < e, e, e + y), binary(Kind::Max, e - y, y * e)) + e;
    }
    run_on_large_stack([&] { EXPECT_TRUE(simplify(e).defined()); });
  }
}

TEST(SimplifyCost, LongSumsAndLongChainsOfLets) {
  Expr sum = variable("x0"), least = sum;
  for (int i = 1; i < 3000; ++i) {
    sum = sum + variable("x" + std::to_string(i)) * i;
    least = min(least, variable("x" + std::to_string(i)) + i);
  }
  run_on_large_stack([&] { EXPECT_TRUE(simplify(sum < least).defined()); });
  Stmt s = make_store("a", variable("t0"), variable("t2999"));
  for (int i = 2999; i > 0; --i) {
    const Expr previous = variable("t" + std::to_string(i - 1));
    s = make_let("t" + std::to_string(i), min(previous * 3, previous + variable("n")) / 2, s);
  }
  run_on_large_stack([&] { EXPECT_TRUE(simplify(s).defined()); });
}

TEST(Cse, SharedPartsBecomeLets) {
  const Expr e = introduce_lets(parse_expr("(x*y + 1)*(x*y + 1)"));
  const auto* let = e.as<Let>();
  ASSERT_TRUE(let) << e;
  EXPECT_TRUE(equal(let->value, parse_expr("x*y + 1")));
  EXPECT_FALSE(let->body.as<Let>()) << e;
  EXPECT_TRUE(equal(expand_lets(e), parse_expr("(x*y + 1)*(x*y + 1)")));
}

TEST(Cse, LeavesTrivialThingsAndUnsharedThingsAlone) {
  for (const char* text : {"x + x", "a[x] + a[x + 1]", "ramp(x, 1, 4)*ramp(x, 1, 4)",
                           "undef<int32>() + undef<int32>()"}) {
    EXPECT_TRUE(equal(introduce_lets(parse_expr(text)), parse_expr(text))) << text;
  }
}

TEST(Cse, NamesInArmsAreBoundOnceThoughBothArmsHaveThem) {
  const Expr e = introduce_lets(
      parse_expr("if_then_else<int32>(y < 3, if_then_else<int32>(x < 3, (y/x)*(y/x), 1) + 1, "
                 "if_then_else<int32>(x < 3, (y/x)*(y/x), 1) + 2)"));
  std::set<std::string> names;
  walk(e, [&](const Let& let) { EXPECT_TRUE(names.insert(let.name).second) << let.name; });
  EXPECT_EQ(names.size(), 2U);
}

TEST(Cse, WhatOnlyAnArmComputesStaysInTheArm) {
  const Expr e = introduce_lets(parse_expr("if_then_else<int32>(x < 3, (y/x)*(y/x), 1)"));
  const auto* branch = e.as<Call>();
  ASSERT_TRUE(branch) << e;
  EXPECT_EQ(branch->args[1].kind(), Kind::Let);
}

TEST(Cse, SeveralExpressionsShareTheirLets) {
  const SharedLets shared =
      introduce_lets({parse_expr("x*y + 1"), parse_expr("x*y + 2"), parse_expr("x*y*2")});
  ASSERT_EQ(shared.lets.size(), 1u);
  EXPECT_EQ(shared.values.size(), 3u);
  EXPECT_TRUE(uses_variable(shared.values[2], shared.lets[0].first));
}

// A sum is not: outside, it might be contracted.
TEST(Cse, StrictArgumentsShareTheElementsThatTheyRead) {
  const Expr e = introduce_lets(
      parse_expr("strict_float(float32(a[x*3])*2f + 1f) + strict_float(float32(a[x*3])*2f + 2f)"));
  const auto* let = e.as<Let>();
  ASSERT_TRUE(let) << e;
  EXPECT_TRUE(equal(let->value, parse_expr("a[x*3]"))) << e;
  EXPECT_FALSE(let->body.as<Let>()) << e;
}

TEST(Cse, IsLinearInTheNumberOfNodes) {
  Expr e = parse_expr("x"), copy = parse_expr("x");
  for (int i = 0; i < 1000; ++i) {
    e = e * e + 1;
    copy = copy * copy + 1;
  }
  Expr lets;
  run_on_large_stack([&] { lets = introduce_lets(e + copy); });
  int count = 0;
  walk(lets, [&](const Expr& node) { return count += node.kind() == Kind::Let, true; });
  EXPECT_LE(count, 1001);
  run_on_large_stack([&] { EXPECT_TRUE(equal(expand_lets(lets), e + copy)); });
}

TEST(Cse, ArmsInsideArmsAreBoundOnce) {
  const Expr x = parse_expr("x");
  Expr e = x;
  for (int i = 0; i < 100; ++i) {
    const Expr square = e * e + i;
    e = ir::call_op(ir::Op::if_then_else, Int(32), {x > i, square * square, x * i});
  }
  Expr lets;
  run_on_large_stack([&] { lets = introduce_lets(e); });
  int count = 0;
  walk(lets, [&](const Expr& node) { return count += node.kind() == Kind::Let, true; });
  EXPECT_EQ(count, 199) << "square everywhere, and each arm but the last inside one";
  run_on_large_stack([&] { EXPECT_TRUE(equal(expand_lets(lets), e)); });
}

}  // namespace
}  // namespace retrograde
