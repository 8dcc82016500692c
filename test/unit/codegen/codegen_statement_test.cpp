// Control flow, allocations, failures, parallel loops, effects and buffers in machine code.
#include <atomic>
#include <mutex>
#include <set>
#include <string>

#include "codegen/codegen.h"
#include "ir/random.h"
#include "support/errors.h"
#include "unit/codegen/codegen_testing.h"

namespace retrograde::testing_codegen {
namespace {

// A context that counts memory, fails from the n-th request on, and records messages.
struct Host {
  Host() {
    context.user_data = this;
    context.malloc_handler = [](retrograde_context* c, size_t bytes) -> void* {
      Host& host = of(c);
      if (host.requests++ >= host.allowed) return nullptr;
      const std::lock_guard lock(host.mutex);
      void* block = std::aligned_alloc(128, (bytes + 127) / 128 * 128);
      host.live.insert(block);
      return block;
    };
    context.free_handler = [](retrograde_context* c, void* block) {
      Host& host = of(c);
      const std::lock_guard lock(host.mutex);
      EXPECT_EQ(host.live.erase(block), 1u) << "freed twice or never allocated";
      std::free(block);
    };
    context.error_handler = [](retrograde_context* c, int code, const char* message) {
      of(c).errors.push_back(std::to_string(code) + ": " + message);
    };
    context.print_handler = [](retrograde_context* c, const char* message) {
      const std::lock_guard lock(of(c).mutex);
      of(c).printed += message;
    };
  }
  ~Host() {
    EXPECT_TRUE(live.empty()) << live.size() << " blocks leaked";
    for (void* block : live) std::free(block);
  }
  static Host& of(retrograde_context* c) { return *static_cast<Host*>(c->user_data); }

  retrograde_context context = {};
  std::atomic<int> requests{0};
  int allowed = 1 << 30;
  std::mutex mutex;
  std::set<void*> live;
  std::vector<std::string> errors;
  std::string printed;
};

Expr fail_with(int code, std::vector<Expr> parts) {
  parts.insert(parts.begin(), Expr(code));
  return call_op(Op::error, Int(32), parts);
}

Stmt fail_if(Expr condition, int code, const std::string& message) {
  return make_assert(logical_not(condition), fail_with(code, {Expr(message)}));
}

int run(const LoweredFunction& f, std::vector<void*> args, Host& host) {
  return compile_test(f)->call(&host.context, args.data());
}

TEST(CodegenStatement, NestedLoopsAndBranches) {
  LoweredFunction f;
  f.name = "loops";
  f.args = {output("out", Int(32)), scalar_argument("n", Int(32))};
  const Expr x = variable("x"), y = variable("y"), n = variable("n");
  const Stmt branch =
      make_if(x < y, make_store("out", x * 100 + y, y * n + x), make_store("out", -1, y * n + x));
  f.body = make_for("y", 0, n, ForType::Serial, make_for("x", 0, n, ForType::Serial, branch));
  Array out(Int(32), 25);
  for (int32_t count : {0, -3, 5}) {
    void* args[] = {out.raw(), &count};
    ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  }
  for (int j = 0; j < 5; j++) {
    for (int i = 0; i < 5; i++) EXPECT_EQ(out.data<int32_t>()[j * 5 + i], i < j ? i * 100 + j : -1);
  }
}

TEST(CodegenStatement, LoopsAtTheEndsOfInt32) {
  LoweredFunction f;
  f.name = "ends";
  f.args = {output("out", Int(32)), scalar_argument("m", Int(32))};
  const Expr x = variable("x");
  f.body = make_for("x", variable("m"), 3, ForType::Serial,
                    make_store("out", x, binary(Kind::Sub, x, variable("m"))));
  for (int32_t min : {INT32_MAX - 2, INT32_MIN}) {
    Array out(Int(32), 3);
    void* args[] = {out.raw(), &min};
    ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
    for (int i = 0; i < 3; i++) EXPECT_EQ(out.data<int32_t>()[i], min + i);
  }
}

TEST(CodegenStatement, ScalarArgumentsOfEveryType) {
  for (Type type :
       {Bool(), Int(8), UInt(16), Int(64), Float(16), BFloat(16), Float(32), Float(64)}) {
    LoweredFunction f;
    f.name = "scalar";
    f.args = {scalar_argument("k", type), output("out", type)};
    f.body = make_store("out", variable("k", type), 0);
    Array in(type, 1), out(type, 1);
    in.set(0, type.is_float() ? Scalar::of_float(type, 1.25) : Scalar::of_uint(type, 1));
    void* args[] = {in.data<void>(), out.raw()};
    ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
    EXPECT_TRUE(same(in.get(0), out.get(0))) << to_string(type);
  }
}

TEST(CodegenStatement, TypedEntryPointTakesArgumentsByValue) {
  LoweredFunction f;
  f.name = "typed";
  f.args = {scalar_argument("k", Int(32)), scalar_argument("s", Float(32)),
            output("out", Float(32))};
  f.body = make_store("out", cast(Float(32), variable("k")) * variable("s", Float(32)), 0);
  Array out(Float(32), 1);
  const auto function = compile_test(f);
  auto* typed = reinterpret_cast<int (*)(retrograde_context*, int32_t, float, halide_buffer_t*)>(
      function->address());
  EXPECT_EQ(typed(nullptr, 6, 0.5f, out.raw()), 0);
  EXPECT_EQ(out.data<float>()[0], 3.0f);
}

// ---- allocations ----

// out[i] = tmp[i] + 1 with tmp[i] = 2 i, where tmp is in `memory`.
LoweredFunction through_memory(MemoryType memory, Expr elements, bool frees, int fail_code = 0) {
  LoweredFunction f;
  f.name = "through_memory";
  f.args = {output("out", Int(32)), scalar_argument("n", Int(64))};
  const Expr i = variable("i"), j = variable("j");
  std::vector<Stmt> body = {make_for("i", 0, 8, ForType::Serial, make_store("tmp", i * 2, i))};
  body.push_back(
      make_for("j", 0, 8, ForType::Serial, make_store("out", make_load(Int(32), "tmp", j) + 1, j)));
  if (frees) body.push_back(make_free("tmp"));
  if (fail_code)
    body.push_back(
        fail_if(variable("n", Int(64)) > make_const(Int(64), 0), fail_code, "on purpose"));
  f.body = make_allocate("tmp", Int(32), memory, elements, make_block(body));
  return f;
}

TEST(CodegenStatement, AllocationsHoldValuesAndAreFreed) {
  const Expr n = variable("n", Int(64));
  for (bool frees : {false, true}) {
    for (const auto& [memory, elements, requests] :
         {std::tuple{MemoryType::Auto, make_const(Int(64), 8), 0},
          {MemoryType::Heap, make_const(Int(64), 8), 1},
          {MemoryType::Auto, n, 1},
          {MemoryType::Stack, make_const(Int(64), 20000), 0},
          {MemoryType::Auto, make_const(Int(64), 20000), 1}}) {
      Host host;
      Array out(Int(32), 8);
      int64_t count = 8;
      ASSERT_EQ(run(through_memory(memory, elements, frees), {out.raw(), &count}, host), 0);
      for (int i = 0; i < 8; i++) EXPECT_EQ(out.data<int32_t>()[i], 2 * i + 1);
      EXPECT_EQ(host.requests, requests);
    }
  }
}

TEST(CodegenStatement, FailuresFreeWhatIsHeld) {
  for (bool frees : {false, true}) {
    Host host;
    Array out(Int(32), 8);
    int64_t count = 8;
    EXPECT_EQ(run(through_memory(MemoryType::Heap, variable("n", Int(64)), frees, -27),
                  {out.raw(), &count}, host),
              -27);
    EXPECT_EQ(host.errors, std::vector<std::string>{"-27: on purpose"});
  }
}

TEST(CodegenStatement, ImpossibleAllocationsAreErrors) {
  const auto code_for = [](int64_t count, int allowed, std::string* message) {
    Host host;
    host.allowed = allowed;
    Array out(Int(32), 8);
    const int code = run(through_memory(MemoryType::Heap, variable("n", Int(64)), false),
                         {out.raw(), &count}, host);
    *message = host.errors.empty() ? "" : host.errors[0];
    return code;
  };
  std::string message;
  EXPECT_EQ(code_for(8, 0, &message), retrograde_error_out_of_memory);
  expect_mentions(message, {"\"tmp\""});
  EXPECT_EQ(code_for(-1, 9, &message), retrograde_error_extents_negative);
  expect_mentions(message, {"-1"});
  EXPECT_EQ(code_for(INT64_MAX / 2, 9, &message), retrograde_error_allocation_too_large);
}

// for x: allocate a, b; fail at x == 3. Each iteration's blocks must be freed.
Stmt two_blocks(ForType type, Expr fail_at) {
  const Expr x = variable("x");
  const Expr n = make_const(Int(64), 100);
  const Stmt inner = make_block(
      {make_store("a", x, 0), make_store("b", make_load(Int(32), "a", 0) * 3, 0),
       fail_if(fail_at, -4, "at some x"), make_store("out", make_load(Int(32), "b", 0), x)});
  return make_for("x", 0, 50, type,
                  make_allocate("a", Int(32), MemoryType::Heap, n,
                                make_allocate("b", Int(32), MemoryType::Heap, n, inner)));
}

TEST(CodegenStatement, AllocationsInLoopsAreFreedOnEveryPath) {
  const Expr x = variable("x");
  for (ForType type : {ForType::Serial, ForType::Parallel}) {
    for (bool fails : {false, true}) {
      Host host;
      LoweredFunction f;
      f.name = "looped";
      f.args = {output("out", Int(32)), scalar_argument("at", Int(32))};
      f.body = two_blocks(type, x >= variable("at"));
      Array out(Int(32), 50);
      int32_t at = fails ? 33 : 1000;
      EXPECT_EQ(run(f, {out.raw(), &at}, host), fails ? -4 : 0);
      for (int i = 0; i < std::min(at, 50); i++) EXPECT_EQ(out.data<int32_t>()[i], 3 * i);
    }
  }
}

TEST(CodegenStatement, NoMemoryAtAnyPointLeaksNothing) {
  for (int allowed : {0, 1, 2, 7, 60, 99}) {
    for (ForType type : {ForType::Serial, ForType::Parallel}) {
      Host host;
      host.allowed = allowed;
      LoweredFunction f;
      f.name = "scarce";
      f.args = {output("out", Int(32))};
      f.body = two_blocks(type, const_false());
      Array out(Int(32), 50);
      EXPECT_EQ(run(f, {out.raw()}, host), retrograde_error_out_of_memory);
    }
  }
}

// n nested allocations, each used by a parallel loop that may fail.
LoweredFunction nested_allocations(int n, Expr elements) {
  LoweredFunction f;
  f.name = "nested_allocations";
  f.args = {output("out", Int(32)), scalar_argument("n", Int(64))};
  Stmt body = make_store("out", make_load(Int(32), "a0", 0), 0);
  for (int k = n - 1; k >= 0; k--) {
    const std::string name = "a" + std::to_string(k), x = "x" + std::to_string(k);
    const Stmt loop =
        make_for(x, 0, 4, ForType::Parallel, make_store(name, variable(x) + k, variable(x)));
    body = make_allocate(name, Int(32), MemoryType::Auto, elements, make_block({loop, body}));
  }
  f.body = body;
  return f;
}

TEST(CodegenStatement, CodeGrowsLinearlyWithAllocations) {
  const auto size_for = [](int n) {
    codegen::Options options;
    options.target = test_target();
    return codegen::compile_llvm_ir(nested_allocations(n, variable("n", Int(64))), options).size();
  };
  EXPECT_LT(static_cast<double>(size_for(60)), 4.5 * static_cast<double>(size_for(15)));
}

TEST(CodegenStatement, ManySmallAllocationsDoNotExhaustTheStack) {
  Host host;
  Array out(Int(32), 1);
  int64_t count = 0;
  ASSERT_EQ(run(nested_allocations(1000, make_const(Int(64), 4000)), {out.raw(), &count}, host), 0);
  EXPECT_GT(host.requests, 900) << "16 MB of allocations belong on the heap";
  EXPECT_LT(host.requests, 1000) << "the first ones belong on the stack";
}

// ---- parallel loops ----

TEST(CodegenStatement, ParallelBodiesSeeWhatIsAroundThem) {
  LoweredFunction f;
  f.name = "closures";
  f.args = {input("in", Float(32)), output("out", Float(32)), scalar_argument("k", Float(32))};
  const Expr x = variable("x"), y = variable("y");
  const Expr wide = variable("wide", Float(32, 4));
  const Stmt row =
      make_for("x", 0, 4, ForType::Serial,
               make_store("out",
                          make_load(Float(32, 4), "in", make_ramp(y * 16 + x * 4, 1, 4)) * wide +
                              make_load(Float(32, 4), "local", make_ramp(0, 1, 4)),
                          make_ramp(y * 16 + x * 4, 1, 4)));
  Stmt body = make_for("y", 0, 32, ForType::Parallel, row);
  body = make_block(
      {make_store("local", make_ramp(Expr(0.0f), Expr(1.0f), 4), make_ramp(0, 1, 4)), body});
  body = make_allocate("local", Float(32), MemoryType::Auto, make_const(Int(64), 4), body);
  f.body = make_let("wide", make_broadcast(variable("k", Float(32)), 4), body);
  Array in(Float(32), 512), out(Float(32), 512);
  for (int i = 0; i < 512; i++) in.data<float>()[i] = static_cast<float>(i);
  float k = 2;
  void* args[] = {in.raw(), out.raw(), &k};
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  for (int i = 0; i < 512; i++) EXPECT_EQ(out.data<float>()[i], static_cast<float>(2 * i + i % 4));
}

TEST(CodegenStatement, NestedParallelLoops) {
  LoweredFunction f;
  f.name = "nested";
  f.args = {output("out", Int(32))};
  const Expr x = variable("x"), y = variable("y"), z = variable("z");
  const Stmt store = make_store("out", z * 10000 + y * 100 + x, (z * 10 + y) * 10 + x);
  f.body = make_for(
      "z", 0, 10, ForType::Parallel,
      make_for("y", 0, 10, ForType::Serial, make_for("x", 0, 10, ForType::Parallel, store)));
  Array out(Int(32), 1000);
  ASSERT_EQ(call(f, {&out}), 0);
  for (int i = 0; i < 1000; i++) {
    EXPECT_EQ(out.data<int32_t>()[i], i / 100 * 10000 + i / 10 % 10 * 100 + i % 10);
  }
}

TEST(CodegenStatement, TheLowestFailingIterationIsReported) {
  LoweredFunction f;
  f.name = "failing";
  f.args = {output("out", Int(32))};
  const Expr x = variable("x");
  f.body = make_for("x", 0, 1000, ForType::Parallel,
                    make_block({make_store("out", x, x),
                                make_assert(x < 617, fail_with(-27, {Expr("iteration "), x}))}));
  for (int repeat = 0; repeat < 20; repeat++) {
    Host host;
    Array out(Int(32), 1000);
    EXPECT_EQ(run(f, {out.raw()}, host), -27);
    EXPECT_EQ(host.errors, std::vector<std::string>{"-27: iteration 617"});
    for (int i = 0; i <= 617; i++) EXPECT_EQ(out.data<int32_t>()[i], i);
  }
}

// ---- effects ----

TEST(CodegenStatement, PrintsGoToTheHandler) {
  Host host;
  LoweredFunction f;
  f.name = "prints";
  f.args = {output("out", Int(32))};
  const Expr x = variable("x");
  const Expr shown =
      call_op(Op::print, Int(32),
              {x * 2, Expr("100% of"), Expr(0.1f), Expr(2.5), x == 1, Expr(uint8_t{200})});
  const Expr rare = call_op(Op::print_when, Int(32), {x == 1, shown, Expr("rare")});
  f.body = make_for("x", 0, 3, ForType::Serial, make_store("out", rare, x));
  Array out(Int(32), 3);
  ASSERT_EQ(run(f, {out.raw()}, host), 0);
  EXPECT_EQ(host.printed,
            "0 100% of 0.100000 2.500000e+00 false 200\n2 100% of 0.100000 2.500000e+00 true 200\n"
            "2 rare\n4 100% of 0.100000 2.500000e+00 "
            "false 200\n");
  EXPECT_EQ(out.data<int32_t>()[2], 4);
  EXPECT_EQ(call(f, {&out}), 0) << "no handler, no output";
}

TEST(CodegenStatement, VectorsPrintALineForEachLane) {
  Host host;
  LoweredFunction f;
  f.name = "vector_prints";
  f.args = {output("out", Int(32))};
  f.body = make_store("out", call_op(Op::print, Int(32, 3), {make_ramp(5, 2, 3), Expr("!")}),
                      make_ramp(0, 1, 3));
  Array out(Int(32), 3);
  ASSERT_EQ(run(f, {out.raw()}, host), 0);
  EXPECT_EQ(host.printed, "5 !\n7 !\n9 !\n");
}

TEST(CodegenStatement, RequireFailsTheCall) {
  LoweredFunction f;
  f.name = "requires";
  f.args = {output("out", Int(32)), scalar_argument("k", Int(32))};
  const Expr k = variable("k");
  f.body = make_store("out", call_op(Op::require, Int(32), {k > 0, k * 2, Expr("k is"), k}), 0);
  Array out(Int(32), 1);
  for (int32_t value : {21, -5}) {
    Host host;
    EXPECT_EQ(run(f, {out.raw(), &value}, host), value > 0 ? 0 : -27);
    const std::vector<std::string> none, one = {"-27: k is -5"};
    EXPECT_EQ(host.errors, value > 0 ? none : one);
    EXPECT_EQ(out.data<int32_t>()[0], 42);
  }
}

TEST(CodegenStatement, RandomNumbersAreThoseOfTheDefinition) {
  LoweredFunction f;
  f.name = "random";
  f.args = {output("f32", Float(32)), output("u32", UInt(32)), output("i32", Int(32))};
  const Expr x = make_ramp(variable("x") * 8, 1, 8);
  const auto numbers = [&](Type type) {
    return call_op(Op::random, type.with_lanes(8), {make_broadcast(Expr(7), 8), x});
  };
  f.body = make_for(
      "x", 0, 8, ForType::Serial,
      make_block({make_store("f32", numbers(Float(32)), x), make_store("u32", numbers(UInt(32)), x),
                  make_store("i32", numbers(Int(32)), x)}));
  Array f32(Float(32), 64), u32(UInt(32), 64), i32(Int(32), 64);
  ASSERT_EQ(call(f, {&f32, &u32, &i32}), 0);
  std::set<uint32_t> seen;
  for (uint32_t i = 0; i < 64; i++) {
    const uint32_t words[] = {7, i}, bits = random_bits(words, 2);
    EXPECT_EQ(u32.data<uint32_t>()[i], bits);
    EXPECT_EQ(i32.data<int32_t>()[i], static_cast<int32_t>(bits));
    EXPECT_EQ(f32.data<float>()[i], random_float(bits));
    seen.insert(bits);
  }
  EXPECT_EQ(seen.size(), 64u);
}

TEST(CodegenStatement, IfThenElseEvaluatesOneArm) {
  LoweredFunction f;
  f.name = "lazy";
  f.args = {input("in", Int(32)), output("out", Int(32)), scalar_argument("k", Int(32))};
  const Expr k = variable("k");
  // The load of element 2^30 would crash.
  const Expr far = make_load(Int(32), "in", 1 << 30);
  f.body = make_store(
      "out", call_op(Op::if_then_else, Int(32), {k < 0, far, make_load(Int(32), "in", 0)}), 0);
  Array in(Int(32), 1), out(Int(32), 1);
  in.data<int32_t>()[0] = 9;
  int32_t k_value = 1;
  void* args[] = {in.raw(), out.raw(), &k_value};
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  EXPECT_EQ(out.data<int32_t>()[0], 9);
}

TEST(CodegenStatement, ArraysOfUnlikelyCodeStayInMemory) {
  const Expr value = make_load(Float(32), "in", 0);
  const auto branch_on = [&](const Expr& condition) {
    LoweredFunction f;
    f.name = "unlikely";
    f.args = {input("in", Float(32)), output("out", Float(32))};
    const Stmt fill = make_store("first", value + 1, 0), use = make_store("out", value * 2, 0);
    const Stmt again = make_if(condition, make_store("out", make_load(Float(32), "first", 0), 0));
    f.body = make_allocate("first", Float(32), MemoryType::Stack, make_const(Int(64), 4),
                           make_block({fill, use, again}));
    return f;
  };
  // An instruction that may access the array.
  const auto is_kept = [](const LoweredFunction& f) {
    codegen::Options options;
    options.target = test_target();
    return codegen::compile_llvm_ir(f, options).find("~{memory}") != std::string::npos;
  };
  EXPECT_FALSE(is_kept(branch_on(value < 0)));
  const LoweredFunction unlikely = branch_on(call_op(Op::is_nan, Bool(), {value}));
  EXPECT_TRUE(is_kept(unlikely));
  Array in(Float(32), 1), out(Float(32), 1);
  in.data<float>()[0] = 3;
  ASSERT_EQ(call(unlikely, {&in, &out}), 0);
  EXPECT_EQ(out.data<float>()[0], 6);
}

TEST(CodegenStatement, StatementsReloadWhatWasStored) {
  // Both stores share one load node; the second must see the first store.
  LoweredFunction f;
  f.name = "reload";
  f.args = {output("out", Int(32))};
  const Expr load = make_load(Int(32), "out", 0);
  f.body = make_block({make_store("out", load + 1, 0), make_store("out", load + 1, 0),
                       make_store("out", load * 2, 1)});
  Array out(Int(32), 2);
  ASSERT_EQ(call(f, {&out}), 0);
  EXPECT_EQ(out.data<int32_t>()[0], 2);
  EXPECT_EQ(out.data<int32_t>()[1], 4);
}

TEST(CodegenStatement, InputAndOutputMayBeOneBuffer) {
  LoweredFunction f;
  f.name = "aliased";
  f.args = {input("in", Int(32)), output("out", Int(32))};
  const Expr x = variable("x");
  f.body = make_for("x", 0, 7, ForType::Serial,
                    make_store("out", make_load(Int(32), "in", x) + 1, x + 1));
  Array both(Int(32), 8);
  ASSERT_EQ(call(f, {&both, &both}), 0);
  for (int i = 0; i < 8; i++) EXPECT_EQ(both.data<int32_t>()[i], i);
}

TEST(CodegenStatement, AFactIsNoCheck) {
  LoweredFunction f;
  f.name = "fact";
  f.args = {output("out", Int(32))};
  f.body = make_block({make_assert(const_false(), call_op(Op::undef, Int(32), {})),
                       make_store("out", Expr(7), Expr(0))});
  Array out(Int(32), 1);
  Host host;
  EXPECT_EQ(run(f, {out.raw()}, host), 0);
  EXPECT_EQ(out.data<int32_t>()[0], 7);
}

// ---- buffers ----

TEST(CodegenStatement, BufferFieldsAndQueries) {
  LoweredFunction f;
  f.name = "buffers";
  f.args = {input("in", Int(16)), output("out", Int(32))};
  const Expr in = variable("in.buffer", Handle());
  const auto field = [&](Op op, Type type, std::vector<Expr> more = {}) {
    more.insert(more.begin(), in);
    return cast_to(Int(32), call_op(op, type, more));
  };
  const Expr sides =
      call_op(Op::pack, Handle(), {Expr(-4), Expr(20), Expr(1), Expr(2), Expr(30), Expr(20)});
  const Stmt answer = make_evaluate(
      call_op(Op::runtime_call, Int(32), {Expr("retrograde_answer_query"), in, Expr(2), sides}));
  std::vector<Stmt> stores;
  const Expr fields[] = {field(Op::buffer_min, Int(32), {Expr(1)}),
                         field(Op::buffer_extent, Int(32), {Expr(0)}),
                         field(Op::buffer_stride, Int(32), {Expr(1)}),
                         field(Op::buffer_dimensions, Int(32)),
                         field(Op::buffer_type, UInt(32)),
                         field(Op::buffer_is_query, Bool())};
  for (int i = 0; i < 6; i++) stores.push_back(make_store("out", fields[i], i));
  f.body =
      make_block({make_assert(logical_not(call_op(Op::buffer_is_null, Bool(), {in})),
                              fail_with(-12, {Expr("null")})),
                  make_block(stores), make_if(call_op(Op::buffer_is_query, Bool(), {in}), answer)});
  halide_dimension_t dims[2] = {{1, 11, 1}, {5, 7, 16}};
  int16_t pixel = 0;
  halide_buffer_t buffer = {};
  buffer.host = reinterpret_cast<uint8_t*>(&pixel);
  buffer.type = halide_type_of<int16_t>();
  buffer.dimensions = 2;
  buffer.dim = dims;
  Array out(Int(32), 6);
  const auto values = [&] {
    return std::vector<int32_t>(out.data<int32_t>(), out.data<int32_t>() + 6);
  };
  void* args[] = {&buffer, out.raw()};
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  EXPECT_EQ(values(), (std::vector<int32_t>{5, 11, 16, 2, 0 | 16 << 8 | 1 << 16, 0}));
  buffer.host = nullptr;
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  EXPECT_EQ(values()[5], 1);
  EXPECT_EQ(dims[0].min, -4);
  EXPECT_EQ(dims[1].extent, 30);
  EXPECT_EQ(dims[1].stride, 20);
  args[0] = nullptr;
  Host host;
  EXPECT_EQ(compile_test(f)->call(&host.context, args), -12);
}

TEST(CodegenStatement, AddressesOfElements) {
  LoweredFunction f;
  f.name = "addresses";
  f.args = {input("in", Int(16)), output("out", UInt(64))};
  const Expr host = call_op(Op::buffer_host, Handle(), {variable("in.buffer", Handle())});
  const Expr third = call_op(Op::address_of, Handle(), {make_load(Int(16), "in", 3)});
  f.body = make_block({make_store("out", reinterpret_as(UInt(64), host), 0),
                       make_store("out", reinterpret_as(UInt(64), third), 1)});
  Array in(Int(16), 4), out(UInt(64), 2);
  ASSERT_EQ(call(f, {&in, &out}), 0);
  EXPECT_EQ(out.data<uint64_t>()[0], reinterpret_cast<uintptr_t>(in.data<void>()));
  EXPECT_EQ(out.data<uint64_t>()[1], reinterpret_cast<uintptr_t>(in.data<void>()) + 6);
}

TEST(CodegenStatement, ExternCallsReachLibm) {
  LoweredFunction f;
  f.name = "libm";
  f.args = {output("out", Float(64))};
  f.body =
      make_store("out", call_extern("cbrt", Float(64, 3), {make_ramp(Expr(8.0), Expr(19.0), 3)}),
                 make_ramp(0, 1, 3));
  Array out(Float(64), 3);
  ASSERT_EQ(call(f, {&out}), 0);
  EXPECT_DOUBLE_EQ(out.data<double>()[1], 3.0);
}

TEST(CodegenStatement, MarkersAndUndefAreTransparent) {
  LoweredFunction f;
  f.name = "markers";
  f.args = {output("out", Int(32)), scalar_argument("k", Int(32))};
  const Expr k = variable("k");
  std::vector<Stmt> stores;
  int at = 0;
  for (Op op : {Op::likely, Op::likely_if_innermost, Op::stop_gradient}) {
    stores.push_back(make_store("out", call_op(op, {k}), call_op(op, {Expr(at++)})));
  }
  for (Op op : {Op::promise_clamped, Op::unsafe_promise_clamped}) {
    stores.push_back(make_store("out", call_op(op, {k, Expr(0), Expr(9)}), at++));
  }
  stores.push_back(
      make_store("out", binary(Kind::Mul, call_op(Op::undef, Int(32), {}), Expr(0)), at++));
  f.body = make_block(stores);
  Array out(Int(32), 6);
  int32_t value = 8;
  void* args[] = {out.raw(), &value};
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  for (int i = 0; i < 6; i++) EXPECT_EQ(out.data<int32_t>()[i], i < 5 ? 8 : 0);
}

// ---- sizes and misuse ----

TEST(CodegenStatement, SharedExpressionsStayShared) {
  // x = x + x sixty times: 2^60 nodes as a tree.
  LoweredFunction f;
  f.name = "doubling";
  f.args = {scalar_argument("k", UInt(64)), output("out", UInt(64))};
  Expr e = variable("k", UInt(64));
  for (int i = 0; i < 60; i++) e = binary(Kind::Add, e, e);
  f.body = make_store("out", e, 0);
  Array out(UInt(64), 1);
  uint64_t k = 3;
  void* args[] = {&k, out.raw()};
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  EXPECT_EQ(out.data<uint64_t>()[0], uint64_t{3} << 60);
}

TEST(CodegenStatement, LetsThatShareStayShared) {
  // e(k) = (let v = e(k-1) in v + e(k-1)) + e(k-1), twice in one function.
  LoweredFunction f;
  f.name = "lets";
  f.args = {scalar_argument("k", UInt(64)), output("out", UInt(64))};
  Expr e = variable("k", UInt(64));
  for (int i = 0; i < 40; i++) {
    const std::string name = "v" + std::to_string(i);
    e = binary(Kind::Add, make_let(name, e, binary(Kind::Add, variable(name, UInt(64)), e)), e);
  }
  f.body = make_block({make_store("out", e, 0), make_store("out", e, 1)});
  Array out(UInt(64), 2);
  uint64_t k = 1, expected = 1;
  for (int i = 0; i < 40; i++) expected *= 3;
  void* args[] = {&k, out.raw()};
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  EXPECT_EQ(out.data<uint64_t>()[0], expected);
  EXPECT_EQ(out.data<uint64_t>()[1], expected);
}

TEST(CodegenStatement, CopiesOfALetKeepTheirOwnValues) {
  LoweredFunction f;
  f.name = "copies";
  f.args = {scalar_argument("k", Int(32)), output("out", Int(32))};
  const Expr v = variable("v"), shared = v * v;
  const Expr k = variable("k");
  f.body = make_store("out", make_let("v", k + 1, shared) * 1000 + make_let("v", k + 2, shared), 0);
  Array out(Int(32), 1);
  int32_t value = 3;
  void* args[] = {&value, out.raw()};
  ASSERT_EQ(compile_test(f)->call(nullptr, args), 0);
  EXPECT_EQ(out.data<int32_t>()[0], 16 * 1000 + 25);
}

TEST(CodegenStatement, LongSumsCompile) {
  LoweredFunction f;
  f.name = "long_sum";
  f.args = {input("in", UInt(32)), output("out", UInt(32))};
  Expr e = make_load(UInt(32), "in", 0);
  for (int i = 1; i < 20000; i++) e = binary(Kind::Add, e, make_load(UInt(32), "in", i % 16));
  f.body = make_store("out", e, 0);
  Array in(UInt(32), 16), out(UInt(32), 1);
  for (uint32_t i = 0; i < 16; i++) in.data<uint32_t>()[i] = 1;
  ASSERT_EQ(call(f, {&in, &out}), 0);
  EXPECT_EQ(out.data<uint32_t>()[0], 20000u);
}

TEST(CodegenStatement, WhatLoweringMustRemoveIsAnInternalError) {
  LoweredFunction f;
  f.name = "unlowered";
  f.args = {output("out", Int(32))};
  f.body =
      make_for("x", 0, 4, ForType::Vectorized, make_store("out", variable("x"), variable("x")));
  EXPECT_THROW(compile_test(f), InternalError);
  f.body = make_for("x", 0, 4, ForType::Unrolled, make_store("out", variable("x"), variable("x")));
  EXPECT_THROW(compile_test(f), InternalError);
  f.body = make_store("out", variable("nowhere"), 0);
  EXPECT_THROW(compile_test(f), InternalError);
  f.body = make_store("nothing", 1, 0);
  EXPECT_THROW(compile_test(f), InternalError);
}

}  // namespace
}  // namespace retrograde::testing_codegen
