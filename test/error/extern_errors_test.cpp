// define_extern: one test for each message of its own, by kind and key phrase.
#include <gtest/gtest.h>

#include "retrograde/retrograde.h"
#include "support/errors.h"
#include "testing/interpreter.h"

namespace retrograde {
namespace {

class ExternErrors : public testing::Test {
 protected:
  Var x{"x"}, y{"y"};
  Func f{"f"}, in{"in"}, out{"out"};

  std::string definition_error(const std::string& function,
                               const std::vector<ExternFuncArgument>& args,
                               const std::vector<Type>& types, const std::vector<Var>& vars) {
    return error_of([&] { f.define_extern(function, args, types, vars); });
  }
  // in(x) = x at root, read by the C function that defines f(x), read by out.
  void build(NameMangling mangling = NameMangling::C) {
    in(x) = x;
    in.compute_root();
    f.define_extern("nobody", {in}, {Int(32)}, {x}, mangling);
    f.compute_root();
    out(x) = f(x);
  }
  template <class Kind>
  std::string compile_error() {
    return error_of<Kind>([&] { out.compile_jit(); });
  }
};

TEST_F(ExternErrors, AFuncIsDefinedOnce) {
  f(x) = x;
  expect_mentions(definition_error("g", {}, {Int(32)}, {x}),
                  {"define \"f", "by the C function \"g\"", "a Func is defined once"});
}

TEST_F(ExternErrors, TheFunctionHasAName) {
  expect_mentions(definition_error("", {}, {Int(32)}, {x}), {"the C function has a name"});
}

TEST_F(ExternErrors, ThereIsAValue) {
  expect_mentions(definition_error("g", {}, {}, {x}), {"it has at least one value"});
}

TEST_F(ExternErrors, VariablesDiffer) {
  expect_mentions(definition_error("g", {}, {Int(32)}, {x, y, x}),
                  {"its arguments are different Vars", "\"x\" appears twice"});
}

TEST_F(ExternErrors, FuncsAmongTheArgumentsAreDefined) {
  expect_mentions(definition_error("g", {in}, {Int(32)}, {x}),
                  {"every Func among the arguments has a definition", "\"in", "has none"});
}

TEST_F(ExternErrors, ArgumentsAreDefined) {
  expect_mentions(definition_error("g", {Expr()}, {Int(32)}, {x}),
                  {"every argument is a defined expression"});
  expect_mentions(definition_error("g", {ExternFuncArgument()}, {Int(32)}, {x}),
                  {"every argument is a Func, an image or an Expr"});
}

TEST_F(ExternErrors, ArgumentsAreMadeOfParameters) {
  expect_mentions(definition_error("g", {Expr(x) + 1}, {Int(32)}, {x}),
                  {"define \"f", "by the C function \"g\"", "\"x\" is a variable of loops"});
}

TEST_F(ExternErrors, TheNameOfTheFunctionOfAnOrdinaryFunc) {
  f(x) = x;
  expect_error({"take the name of the C function of \"f", "define_extern"},
               [&] { f.extern_function_name(); });
}

// rule: the function's symbol is its plain name
TEST_F(ExternErrors, MangledNames) {
  build(NameMangling::CPlusPlus);
  expect_mentions(compile_error<Unsupported>(),
                  {"compute \"f", "by the C function \"nobody\"", "mangled as C++ does"});
}

// rule: what a C function reads or writes lies in memory as one box
TEST_F(ExternErrors, FoldedStorage) {
  build();
  in.fold_storage(x, 4);
  expect_mentions(compile_error<UserError>(), {"the storage of \"in", "is folded over \"x\""});
}

TEST_F(ExternErrors, TheInterpreterCallsNothing) {
  build();
  expect_error<Unsupported>({"interpret \"f", "a Func is evaluated by its definitions"}, [&] {
    oracle::Interpreter interpreter;
    interpreter.realize(out.function(), {{0}, {4}});
  });
}

}  // namespace
}  // namespace retrograde
