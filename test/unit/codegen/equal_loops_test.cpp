// Loops that are equal up to names share one function of machine code.
#include "codegen/codegen.h"
#include "ir/equal.h"
#include "ir/shifted_renaming.h"
#include "unit/codegen/codegen_testing.h"

namespace retrograde::testing_codegen {
namespace {

constexpr int n = 32;

std::string number(const std::string& name, int k) { return name + std::to_string(k); }

// for x, in parallel: to[x] = from[x] * factor + x
Stmt step(int k, const std::string& from, const std::string& to, Expr factor) {
  const Expr x = variable(number("x", k));
  return make_for(number("x", k), 0, n, ForType::Parallel,
                  make_store(to, make_load(Int(32), from, x) * std::move(factor) + x, x));
}

// Steps from `in` to `out` through blocks of memory.
LoweredFunction steps(int count, const std::function<Expr(int)>& factor) {
  LoweredFunction f;
  f.name = "steps";
  f.args = {input("in", Int(32)), output("out", Int(32)), scalar_argument("k", Int(32))};
  const auto memory = [&](int k) { return k == 0 ? "in" : k == count ? "out" : number("step", k); };
  Stmt body;
  for (int k = count; k-- > 0;) {
    const Stmt now = step(k, memory(k), memory(k + 1), factor(k));
    body = body.defined() ? make_block({now, body}) : now;
    if (k + 1 < count)
      body = make_allocate(memory(k + 1), Int(32), MemoryType::Heap, make_const(Int(64), n), body);
  }
  f.body = body;
  return f;
}

int tasks_of(const LoweredFunction& f) {
  codegen::Options options;
  options.target = test_target();
  const std::string code = codegen::compile_llvm_ir(f, options);
  int count = 0;
  for (size_t at = 0; (at = code.find("define internal", at)) != std::string::npos; ++at)
    count += code.substr(at, code.find('\n', at) - at).find(".parallel") != std::string::npos;
  return count;
}

void expect_computes(const LoweredFunction& f, int count, const std::function<int(int)>& factor) {
  Array in(Int(32), n), out(Int(32), n);
  for (int x = 0; x < n; ++x) in.data<int32_t>()[x] = x % 5;
  int32_t k = 3;
  void* args[] = {in.raw(), out.raw(), &k};
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  for (int x = 0; x < n; ++x) {
    int32_t value = x % 5;
    for (int s = 0; s < count; ++s) value = value * factor(s) + x;
    EXPECT_EQ(out.data<int32_t>()[x], value) << x;
  }
}

TEST(EqualLoops, OfManyStepsShareAFunction) {
  const auto factor = [](int) { return variable("k", Int(32)); };
  EXPECT_EQ(tasks_of(steps(4, factor)), tasks_of(steps(12, factor)));
  expect_computes(steps(6, factor), 6, [](int) { return 3; });
}

TEST(EqualLoops, WithOtherConstantsHaveTheirOwn) {
  const auto factor = [](int s) { return Expr(s + 1); };
  EXPECT_EQ(tasks_of(steps(5, factor)), 5);
  expect_computes(steps(5, factor), 5, [](int s) { return s + 1; });
}

// Step s reads element s of a table of parameters, and writes row s of a history.
TEST(EqualLoops, AtConstantDistancesShareAFunction) {
  const auto program = [](int count) {
    LoweredFunction f;
    f.name = "distances";
    f.args = {input("table", Int(32)), output("out", Int(32))};
    std::vector<Stmt> loops;
    for (int k = 0; k < count; ++k) {
      const Expr x = variable(number("x", k));
      const Expr value = make_load(Int(32), "table", k) * x + make_load(Int(32), "table", k + 1);
      loops.push_back(
          make_for(number("x", k), 0, n, ForType::Parallel, make_store("out", value, x + k * n)));
    }
    f.body = make_block(std::move(loops));
    return f;
  };
  EXPECT_EQ(tasks_of(program(2)), 1);
  EXPECT_EQ(tasks_of(program(7)), 1);
  constexpr int count = 7;
  Array table(Int(32), count + 1), out(Int(32), count * n);
  for (int k = 0; k <= count; ++k) table.data<int32_t>()[k] = 10 * k + 3;
  void* args[] = {table.raw(), out.raw()};
  ASSERT_EQ(compile_test(program(count))->call(nullptr, args), 0);
  for (int i = 0; i < count * n; ++i) {
    const int k = i / n;
    EXPECT_EQ(out.data<int32_t>()[i], (10 * k + 3) * (i % n) + 10 * (k + 1) + 3) << i;
  }
}

TEST(EqualLoops, AtOtherDistancesOfOneMemoryHaveTheirOwn) {
  LoweredFunction f;
  f.name = "strides";
  f.args = {input("table", Int(32)), output("out", Int(32))};
  const auto loop = [](int k) {
    const Expr x = variable(number("x", k));
    const Expr value = make_load(Int(32), "table", k) + make_load(Int(32), "table", 2 * k + 1);
    return make_for(number("x", k), 0, 4, ForType::Parallel, make_store("out", value, x + 4 * k));
  };
  f.body = make_block({loop(0), loop(1)});
  EXPECT_EQ(tasks_of(f), 2);
}

TEST(EqualLoops, OverOtherTypesHaveTheirOwn) {
  LoweredFunction f;
  f.name = "types";
  f.args = {scalar_argument("a", Int(32)), scalar_argument("b", Int(64)), output("out", Int(32))};
  const auto loop = [](int k, const Expr& value) {
    const Expr x = variable(number("x", k));
    return make_for(number("x", k), 0, 4, ForType::Parallel,
                    make_store("out", cast_to(Int(32), value) + x, x + 4 * k));
  };
  f.body = make_block({loop(0, variable("a", Int(32))), loop(1, variable("b", Int(64)))});
  EXPECT_EQ(tasks_of(f), 2);
}

// One reads what it writes; in the other the memories differ, which the code may rely on.
TEST(EqualLoops, InPlaceAndNotHaveTheirOwn) {
  LoweredFunction f;
  f.name = "in_place";
  f.args = {input("in", Int(32)), output("out", Int(32))};
  f.body = make_block({step(0, "in", "out", 2), step(1, "out", "out", 2)});
  EXPECT_EQ(tasks_of(f), 2);
}

TEST(EqualLoops, NameTheirOwnMemoryInErrors) {
  LoweredFunction f;
  f.name = "blocks";
  f.args = {output("out", Int(32)), scalar_argument("bytes", Int(64))};
  const auto loop = [](int k, const Expr& elements) {
    const Expr x = variable(number("x", k));
    const std::string block = number("block", k);
    const Stmt body =
        make_block({make_store(block, x, 0), make_store("out", make_load(Int(32), block, 0), x)});
    return make_for(number("x", k), 0, 4, ForType::Parallel,
                    make_allocate(block, Int(32), MemoryType::Heap, elements, body));
  };
  f.body = make_let(
      "small", make_const(Int(64), 100),
      make_block({loop(0, variable("small", Int(64))), loop(1, variable("bytes", Int(64)))}));
  EXPECT_EQ(tasks_of(f), 1);
  std::string message;
  retrograde_context context = {};
  context.user_data = &message;
  context.error_handler = [](retrograde_context* c, int, const char* text) {
    *static_cast<std::string*>(c->user_data) = text;
  };
  Array out(Int(32), 4);
  int64_t bytes = INT64_MAX / 2;
  void* args[] = {out.raw(), &bytes};
  EXPECT_NE(compile_test(f)->call(&context, args), 0);
  EXPECT_NE(message.find("\"block1\""), std::string::npos) << message;
}

TEST(Renaming, PairsNamesBothWays) {
  const auto copy = [](const char* to, const char* from) {
    return make_store(to, make_load(Int(32), from, variable("i")), variable("i"));
  };
  const auto names = renaming(copy("a", "b"), copy("c", "d"));
  ASSERT_TRUE(names);
  EXPECT_EQ(*names, (Renaming{{"a", "c"}, {"b", "d"}, {"i", "i"}}));
  EXPECT_FALSE(renaming(copy("a", "b"), copy("c", "c")));
  EXPECT_FALSE(renaming(copy("a", "a"), copy("c", "d")));
  EXPECT_TRUE(renaming(copy("a", "b"), copy("b", "a")));
  EXPECT_FALSE(renaming(copy("a", "b"), copy("c", "d"), {{"a", "d"}}));
  EXPECT_FALSE(renaming(make_evaluate(Expr("a text")), make_evaluate(Expr("another"))));
}

TEST(ShiftedRenaming, FindsTheDistanceOfEachMemory) {
  const auto copy = [](const char* to, const Expr& at, const Expr& from) {
    return make_store(to, make_load(Int(32), "table", from), at);
  };
  const Expr i = variable("i"), j = variable("j");
  const auto found = shifted_renaming(copy("a", i, i * 2), copy("b", j + 5, j * 2 - 3));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->names.at("a"), "b");
  ASSERT_EQ(found->shifts.size(), 2u);
  EXPECT_EQ(found->shifts.at("a").elements, 5);
  EXPECT_EQ(found->shifts.at("table").elements, -3);
  EXPECT_EQ(found->shifts.at("table").type, Int(32));
  EXPECT_TRUE(shifted_renaming(copy("a", i, 0), copy("a", j, 0))->shifts.empty());
  EXPECT_FALSE(shifted_renaming(copy("a", i, 0), copy("a", j, j)));
  EXPECT_FALSE(shifted_renaming(copy("table", i, i), copy("table", i + 1, i + 2)));
  const Expr vector = make_ramp(i, 2, 8);
  EXPECT_TRUE(equal(shifted_index(vector, 3), make_ramp(i + 3, 2, 8)));
  EXPECT_EQ(shifted_renaming(copy("a", i, 0), copy("a", i, 4))->shifts.at("table").elements, 4);
}

}  // namespace
}  // namespace retrograde::testing_codegen
