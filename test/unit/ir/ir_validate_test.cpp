// Every rule of the validator, with one program that satisfies it and one that violates it.
#include "ir/validate.h"

#include <gtest/gtest.h>

#include "ir/build.h"
#include "ir/parse.h"
#include "ir/print.h"
#include "support/errors.h"

namespace retrograde {
namespace {

using namespace ir;

void expect_valid(const Stmt& s, Phase phase) {
  EXPECT_NO_THROW(validate(s, phase, "some_pass", {"n"}));
}
void expect_broken(const Stmt& s, Phase phase, const std::string& rule) {
  const Stmt before = parse_stmt("evaluate 17");
  try {
    validate(s, phase, "some_pass", {"n"}, before);
    FAIL() << "the validator accepts: " << rule;
  } catch (const InternalError& error) {
    EXPECT_EQ(error.pass(), "some_pass");
    expect_mentions(error.what(), {rule});
    EXPECT_EQ(error.ir_before(), print(before));
  }
}
void expect_broken(const std::string& text, Phase phase, const std::string& rule) {
  expect_broken(parse_stmt(text), phase, rule);
}

TEST(Validate, AcceptsProgramsOfEachPhase) {
  expect_valid(
      parse_stmt(
          "realize f(float32) auto [0, n] {\n produce f {\n for (x, 0, n) { f(x) = {image "
          "a(x):float32} "
          "}\n }\n consume f { for (y, 0, n) { g(y) = {f(y):float32 + f(y - 1):float32} } }\n }"),
      Phase::Loops);
  const char* flat =
      "let m = n * 2\nassert(m < 9, error(3, \"too many\"))\nallocate f[int64(m)]:float32 heap {\n"
      "for (x, 0, m) { f[x if x < 3] = 1f }\n free f\n}";
  expect_valid(parse_stmt(flat), Phase::FlatStorage);
  expect_valid(parse_stmt(flat), Phase::Vector);
}

TEST(Validate, NamesAreBoundBeforeUseAndOnce) {
  expect_broken("evaluate y", Phase::Loops, "bound before use: \"y\"");
  expect_broken("for (x, 0, x) { evaluate n }", Phase::Loops, "bound before use: \"x\"");
  expect_broken("{ let x = n\n evaluate x }\nevaluate x", Phase::Loops, "bound before use: \"x\"");
  expect_broken("for (x, 0, n) { for (x, 0, n) { evaluate x } }", Phase::Loops,
                "\"x\" is bound twice");
  expect_broken("for (x, 0, n) { evaluate x }\nfor (x, 0, n) { evaluate x }", Phase::Loops,
                "\"x\" is bound twice");
  expect_broken("let n = 3\nevaluate n", Phase::Loops, "\"n\" is bound twice");
}

TEST(Validate, KindsBelongToTheirPhase) {
  expect_broken("f(n) = {1}", Phase::FlatStorage, "Provide belongs to the phase Loops");
  expect_broken("realize f(int32) auto [0, n] { evaluate n }", Phase::FlatStorage,
                "Realize belongs to");
  expect_broken("evaluate f(n)", Phase::Vector, "calls of Funcs and images");
  expect_broken("f[n] = 1", Phase::Loops, "Store belongs to the phase FlatStorage");
  expect_broken("evaluate f[n]", Phase::Loops, "Load belongs to the phase FlatStorage");
  expect_broken("allocate f[3_i64]:int32 heap { evaluate n }", Phase::Loops, "Allocate belongs to");
  expect_broken("free f", Phase::Loops, "Free belongs to");
  expect_broken("vectorized for (x, 0, 8) { f[x] = 1 }", Phase::Vector,
                "no vectorized or unrolled loop");
  expect_broken("unrolled for (x, 0, 8) { f[x] = 1 }", Phase::Vector,
                "no vectorized or unrolled loop");
}

TEST(Validate, AllocationsAreUsedWhileAlive) {
  expect_broken("allocate f[3_i64]:int32 heap { f[0] = 1 }\nf[0] = 2", Phase::FlatStorage,
                "\"f\" is not alive");
  expect_broken("allocate f[3_i64]:int32 heap { free f\nf[0] = 1 }", Phase::FlatStorage,
                "\"f\" is not alive");
  expect_broken("allocate f[3_i64]:int32 heap { evaluate f[0]\nfree f\nevaluate f[0] }",
                Phase::FlatStorage, "\"f\" is not alive");
  expect_broken("allocate f[3_i64]:int32 heap { if (n < 3) { free f }\nf[0] = 1 }",
                Phase::FlatStorage, "\"f\" is not alive");
  expect_broken("free f", Phase::FlatStorage, "a Free ends an allocation that is alive");
  expect_broken("allocate f[3_i64]:int32 heap { allocate f[3_i64]:int32 heap { f[0] = 1 } }",
                Phase::FlatStorage, "two allocations");
}

TEST(Validate, TypesAgree) {
  const Expr n = variable("n"), f = variable("n", Float(32));
  const Type type = Int(32);
  const auto broken = [](Expr e, const char* rule) {
    expect_broken(make_evaluate(std::move(e)), Phase::Vector, rule);
  };
  broken(new Add(type, n, f), "both operands have one type");
  broken(new LT(type, n, n), "type of a binary node");
  broken(new And(type, n, n), "And and Or take bool");
  broken(make_node<Not>(n.type(), n), "Not takes bool");
  broken(make_node<Select>(type, n, n, n), "condition of a select is bool");
  broken(make_node<Select>(type, n < 3, n, f), "both arms");
  broken(make_node<Select>(type, make_broadcast(n, 2) < 3, n, n),
         "condition of a select is scalar");
  broken(make_node<Ramp>(Int(32, 4), n, f, 4), "base and stride");
  broken(make_node<Cast>(Int(8), make_broadcast(n, 2)), "a cast keeps");
  broken(make_node<Call>(type, CallType::Operator, Op::floor, "floor", std::vector<Expr>{n, n}, 0,
                         SymbolRef()),
         "arguments of its arity");
  broken(make_node<Load>(type, "a", f, Expr(), SymbolRef()), "indices are integers");
  broken(make_node<Load>(Int(32, 2), "a", n, Expr(), SymbolRef()), "lanes of its index");
  broken(make_node<Load>(type, "a", n, n, SymbolRef()), "a predicate is bool");
}

TEST(Validate, StatementsTakeTheirTypes) {
  const Expr n = variable("n"), f = variable("n", Float(32));
  const Stmt body = make_evaluate(n);
  const auto broken = [](const Stmt& s, Phase phase, const char* rule) {
    expect_broken(s, phase, rule);
  };
  broken(make_for("x", f, n, ForType::Serial, body), Phase::Loops, "loop bounds are int32");
  broken(make_assert(n, n), Phase::Loops, "conditions are scalar bool");
  broken(make_assert(n < 3, f), Phase::Loops, "error of an Assert");
  broken(make_if(n, body), Phase::Loops, "conditions are scalar bool");
  broken(make_store("a", make_broadcast(n, 2), n), Phase::Vector, "a store's value");
  broken(make_store("a", n, n, n), Phase::Vector, "a predicate is bool");
  broken(make_provide("a", {n}, {n}, n), Phase::Loops, "a predicate is bool");
  broken(make_provide("a", {}, {n}), Phase::Loops, "a Provide has values");
  broken(make_provide("a", {n}, {f}), Phase::Loops, "indices are integers");
  broken(make_realize("a", {}, MemoryType::Auto, {}, body), Phase::Loops, "a Realize has types");
  broken(make_realize("a", {Int(32)}, MemoryType::Auto, {{f, n}}, body), Phase::Loops,
         "bounds of a Realize");
  const auto realized = [&](const StorageLayout& layout) {
    return make_realize("a", {Int(32)}, MemoryType::Auto, {{n, n}, {n, n}}, body, layout);
  };
  broken(realized({.folds = {f}}), Phase::Loops, "folds and the first element");
  broken(realized({.first = f}), Phase::Loops, "folds and the first element");
  broken(realized({.order = {0, 0}}), Phase::Loops, "names each dimension once");
  broken(realized({.order = {0}}), Phase::Loops, "names each dimension once");
  broken(make_allocate("a", Int(32), MemoryType::Auto, n, body), Phase::Vector, "an int64");
  broken(make_allocate("a", Int(32, 4), MemoryType::Auto, make_const(Int(64), 3), body),
         Phase::Vector, "holds scalars");
}

}  // namespace
}  // namespace retrograde
