// The JIT around the code generator: cache, threads, targets, symbols, memory protection, objects
// for other machines.
#include "jit/jit.h"

#include <retrograde/retrograde.h>

#include <atomic>
#include <fstream>
#include <sstream>
#include <thread>

#include "codegen/codegen.h"
#include "support/errors.h"
#include "unit/codegen/codegen_testing.h"

namespace retrograde::testing_codegen {
namespace {

// out[x] = x * factor, with selectable names.
LoweredFunction scaled(int factor, const std::string& suffix = "", Type type = Int(32)) {
  LoweredFunction f;
  f.name = "scaled" + suffix;
  f.args = {output("out" + suffix, type)};
  const Expr x = variable("x" + suffix);
  const Expr t = variable("t" + suffix);
  f.body =
      make_for("x" + suffix, 0, 16, ForType::Serial,
               make_let("t" + suffix, x * factor, make_store("out" + suffix, cast_to(type, t), x)));
  return f;
}

TEST(JitCache, TheSameProgramIsCompiledOnceWhateverItsNames) {
  jit::clear_cache();
  const auto first = compile_test(scaled(3, "$1"));
  EXPECT_EQ(compile_test(scaled(3, "$1")), first);
  EXPECT_EQ(compile_test(scaled(3, "$2")), first);
  EXPECT_EQ(jit::cache_statistics().size, 1u);
}

TEST(JitCache, DifferentProgramsAreKeptApart) {
  jit::clear_cache();
  const auto first = compile_test(scaled(3));
  EXPECT_NE(compile_test(scaled(4)), first);
  EXPECT_NE(compile_test(scaled(3, "", Int(64))), first);
  if (test_target().arch == Target::X86) {
    EXPECT_NE(compile_test(scaled(3), Target("x86-64-linux")), first);
  }
  jit::Options fresh;
  fresh.use_cache = false;
  EXPECT_NE(jit::compile(scaled(3), test_target(), fresh), first);
  // The same loads from other buffers.
  LoweredFunction a;
  a.name = "a";
  a.args = {input("p", Int(32)), input("q", Int(32)), output("out", Int(32))};
  LoweredFunction b = a;
  a.body = make_store("out", make_load(Int(32), "p", 0) - make_load(Int(32), "q", 0), 0);
  b.body = make_store("out", make_load(Int(32), "q", 0) - make_load(Int(32), "p", 0), 0);
  EXPECT_NE(compile_test(a), compile_test(b));
}

TEST(JitCache, IsBoundedAndEvictedFunctionsLiveOn) {
  jit::clear_cache();
  const auto first = compile_test(scaled(0));
  for (int factor = 1; factor <= static_cast<int>(jit::cache_capacity); factor++)
    compile_test(scaled(factor));
  EXPECT_EQ(jit::cache_statistics().size, jit::cache_capacity);
  EXPECT_NE(compile_test(scaled(0)), first) << "the oldest should have gone";
  Array out(Int(32), 16);
  void* args[] = {out.raw()};
  EXPECT_EQ(first->call(nullptr, args), 0);
  jit::clear_cache();
}

TEST(Jit, CompilesOnManyThreads) {
  jit::clear_cache();
  std::vector<std::thread> threads;
  std::vector<int> wrong(4, 0);
  for (int t = 0; t < 4; t++) {
    threads.emplace_back([t, &wrong] {
      for (int i = 0; i < 12; i++) {
        const int factor = (i * 5 + t) % 16;
        Array out(Int(32), 16);
        void* args[] = {out.raw()};
        compile_test(scaled(factor))->run(args);
        for (int x = 0; x < 16; x++)
          wrong[static_cast<size_t>(t)] += out.data<int32_t>()[x] != x * factor;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, std::vector<int>(4, 0));
  EXPECT_EQ(jit::cache_statistics().size, 16u);
}

TEST(Jit, RunThrowsWithCodeAndMessage) {
  LoweredFunction f;
  f.name = "fails";
  f.args = {scalar_argument("k", Int(32))};
  f.body = make_assert(variable("k") > 0,
                       call_op(Op::error, Int(32), {Expr(-9), Expr("k = "), variable("k")}));
  int32_t k = -2;
  void* args[] = {&k};
  try {
    compile_test(f)->run(args);
    FAIL() << "nothing was thrown";
  } catch (const RuntimeError& error) {
    EXPECT_EQ(error.code(), -9);
    expect_mentions(error.what(), {"k = -2"});
  }
  k = 1;
  EXPECT_NO_THROW(compile_test(f)->run(args));
}

TEST(Jit, RunHandsPrintsOn) {
  LoweredFunction f;
  f.name = "prints";
  f.body = make_for("x", 0, 100, ForType::Parallel,
                    make_evaluate(call_op(Op::print, Int(32), {variable("x"), Expr("seen")})));
  int lines = 0;
  jit::CallOptions options;
  options.thread_limit = 2;
  options.on_print = [&](const std::string&) { lines++; };
  compile_test(f)->run(nullptr, options);
  EXPECT_EQ(lines, 100);
}

// Three parallel loops, so four functions; the first reads a text that the others read, too.
LoweredFunction three_loops() {
  LoweredFunction f;
  f.name = "three_loops";
  f.args = {input("in", Float(32)), output("out", Float(32))};
  std::vector<Stmt> loops;
  for (int i = 0; i < 3; i++) {
    const std::string name = "x" + std::to_string(i);
    const Expr x = variable(name), index = make_ramp((x + i * 20) * 4, 1, 4);
    const Expr in = make_load(Float(32, 4), "in", index);
    const Expr shown = call_op(Op::error, Int(32), {Expr(-9), Expr("x = "), x});
    loops.push_back(
        make_for(name, 0, 20, ForType::Parallel,
                 make_block({make_assert(x >= 0, shown),
                             make_store("out", call_op(Op::exp, {in}) + in * float(i), index)})));
  }
  f.body = make_block(loops);
  return f;
}

TEST(Jit, PartsGiveWhatTheWholeGives) {
  const auto results = [](unsigned parts) {
    jit::Options options;
    options.use_cache = false;
    options.parts = parts;
    Array in(Float(32), 240), out(Float(32), 240);
    for (int i = 0; i < 240; i++) in.data<float>()[i] = 0.01f * float(i);
    void* args[] = {in.raw(), out.raw()};
    jit::compile(three_loops(), test_target(), options)->run(args);
    return std::vector<float>(out.data<float>(), out.data<float>() + 240);
  };
  const std::vector<float> whole = results(1);
  EXPECT_NEAR(whole[239], std::exp(2.39) + 2.39 * 2, 1e-4);
  for (unsigned parts : {2u, 3u, 5u, 9u}) EXPECT_EQ(results(parts), whole) << parts;
}

TEST(Jit, CallsOfUnknownFunctionsAreUserErrors) {
  LoweredFunction f;
  f.name = "escapes";
  f.args = {output("out", Int(32))};
  f.body = make_store("out", call_extern("nowhere_in_this_process", Int(32), {}), 0);
  expect_error<UserError>({"\"nowhere_in_this_process\""}, [&] { compile_test(f); });
}

TEST(Jit, ForeignTargetsAreRefused) {
  const char* foreign = test_target().arch == Target::X86 ? "arm-64-linux" : "x86-64-linux";
  EXPECT_THROW(compile_test(scaled(1), Target(foreign)), Unsupported);
}

TEST(Jit, NoPageIsWritableAndExecutable) {
  std::vector<std::shared_ptr<const jit::CompiledFunction>> functions;
  for (int factor = 0; factor < 5; factor++) functions.push_back(compile_test(scaled(factor)));
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    EXPECT_EQ(line.find("rwx"), std::string::npos) << line;
  }
}

TEST(JitMemory, IsNeverWritableAndExecutableWhileItIsWritten) {
  std::atomic<bool> done{false};
  std::thread compiling([&] {
    jit::Options fresh;
    fresh.use_cache = false;
    for (int factor = 0; factor < 12; factor++) jit::compile(scaled(factor), test_target(), fresh);
    done = true;
  });
  int looks = 0;
  std::string bad;
  while (!done || looks == 0) {
    std::ifstream maps("/proc/self/maps");
    for (std::string line; std::getline(maps, line);) {
      if (line.find("rwx") != std::string::npos) bad = line;
    }
    looks++;
  }
  compiling.join();
  EXPECT_EQ(bad, "");
}

TEST(Jit, TimesAreMeasured) {
  jit::Options options;
  options.use_cache = false;
  const auto times = jit::compile(scaled(2), test_target(), options)->times();
  EXPECT_GT(times.generate_seconds, 0);
  EXPECT_GT(times.optimize_seconds, 0);
  EXPECT_GT(times.emit_seconds, 0);
  EXPECT_GT(times.link_seconds, 0);
  EXPECT_LT(times.total(), 60);
}

// ---- objects ----

LoweredFunction vector_sum() {
  LoweredFunction f;
  f.name = "vector_sum";
  f.args = {input("in", Float(32)), output("out", Float(32))};
  const Expr x = variable("x"), index = make_ramp(x * 4, 1, 4);
  const Expr in = make_load(Float(32, 4), "in", index);
  f.body = make_for("x", 0, 64, ForType::Parallel,
                    make_store("out", call_op(Op::sin, {in}) + in * in, index));
  return f;
}

codegen::Options options_for(const std::string& target) {
  codegen::Options options;
  options.target = Target(target);
  return options;
}

TEST(Codegen, WritesObjectsForBothMachines) {
  for (const auto& [target, machine] :
       {std::pair<std::string, int>{"x86-64-linux", 62}, {"arm-64-linux", 183}}) {
    const codegen::Module module = codegen::compile_object(vector_sum(), options_for(target));
    ASSERT_GT(module.object.size(), 64u);
    EXPECT_EQ(std::string(module.object.begin(), module.object.begin() + 4),
              "\x7f"
              "ELF")
        << target;
    EXPECT_EQ(module.object[18] | module.object[19] << 8, machine) << target;  // e_machine
    EXPECT_NE(
        std::find(module.externals.begin(), module.externals.end(), "retrograde_parallel_for"),
        module.externals.end());
  }
}

TEST(Codegen, Aarch64UsesNeonAndItsSleef) {
  const std::string assembly = codegen::compile_assembly(vector_sum(), options_for("arm-64-linux"));
  expect_mentions(assembly, {"fmla\tv", "Sleef_finz_sinf4_u10advsimd"});
}

TEST(Codegen, X86WidthFollowsTheTarget) {
  LoweredFunction f = vector_sum();
  const Expr index = make_ramp(variable("x") * 16, 1, 16);
  const Expr in = make_load(Float(32, 16), "in", index);
  f.body = make_for("x", 0, 16, ForType::Serial, make_store("out", in * in + in, index));
  const std::string avx512 =
      codegen::compile_assembly(f, options_for("x86-64-linux-avx512_skylake"));
  expect_mentions(avx512, {"zmm", "vfmadd"});
  const std::string avx2 = codegen::compile_assembly(f, options_for("x86-64-linux-sse41-avx-avx2"));
  expect_mentions(avx2, {"ymm"});
  EXPECT_EQ(avx2.find("zmm"), std::string::npos) << avx2;
  const std::string sse2 = codegen::compile_assembly(f, options_for("x86-64-linux"));
  EXPECT_EQ(sse2.find("ymm"), std::string::npos) << sse2;
}

TEST(Codegen, StrictTargetsDoNotFuse) {
  LoweredFunction f = vector_sum();
  const Expr in = make_load(Float(32), "in", 0);
  f.body = make_store("out", in * in + in, 0);
  const std::string base = "x86-64-linux-sse41-avx-fma-avx2";
  expect_mentions(codegen::compile_assembly(f, options_for(base)), {"vfmadd"});
  EXPECT_EQ(codegen::compile_assembly(f, options_for(base + "-strict_float")).find("vfmadd"),
            std::string::npos);
}

TEST(Codegen, StrongMultiplicationIsMasked) {
  LoweredFunction f = vector_sum();
  const Expr index = make_ramp(variable("x") * 16, 1, 16);
  const Expr in = make_load(Float(32, 16), "in", index);
  f.body = make_for("x", 0, 16, ForType::Serial,
                    make_store("out", call_op(Op::strong_mul, {in, in + 1.0f}), index));
  const std::string assembly =
      codegen::compile_assembly(f, options_for("x86-64-linux-avx512_skylake"));
  expect_mentions(assembly, {"{z}"});
}

// A costly arm that no lane selects is skipped by a branch.
TEST(Codegen, CostlyArmsAreBehindABranch) {
  LoweredFunction f = vector_sum();
  const Expr index = make_ramp(variable("x") * 16, 1, 16);
  const Expr in = make_load(Float(32, 16), "in", index);
  const Expr is_wanted = binary(Kind::LT, in, make_zero(in.type()));
  const auto tests_a_mask = [&](const Expr& arm) {
    f.body = make_for("x", 0, 16, ForType::Serial,
                      make_store("out", make_select(is_wanted, arm, in), index));
    return codegen::compile_assembly(f, options_for("x86-64-linux-avx512_skylake"))
               .find("kortest") != std::string::npos;
  };
  EXPECT_TRUE(tests_a_mask(call_op(Op::pow, {in, in + 1.0f})));
  EXPECT_FALSE(tests_a_mask(in * in + 1.0f));
}

// acc + strong_mul(a, b) and acc - strong_mul(a, b) need no separate multiplication.
TEST(Codegen, SumsOfStrongProductsFuse) {
  LoweredFunction f = vector_sum();
  const Expr index = make_ramp(variable("x") * 16, 1, 16);
  const Expr in = make_load(Float(32, 16), "in", index);
  const Expr product = call_op(Op::strong_mul, {in, in + 1.0f});
  f.body =
      make_for("x", 0, 16, ForType::Serial,
               make_store("out", in + product - call_op(Op::strong_mul, {in + 3.0f, in}), index));
  for (const std::string target :
       {"x86-64-linux-avx512_skylake", "x86-64-linux-sse41-avx-fma-avx2"}) {
    const std::string assembly = codegen::compile_assembly(f, options_for(target));
    expect_mentions(assembly, {"vfmadd", "vfnmadd"});
    EXPECT_EQ(assembly.find("vmulps"), std::string::npos) << target;
    EXPECT_NE(codegen::compile_assembly(f, options_for(target + "-strict_float")).find("vmulps"),
              std::string::npos);
  }
}

// The difference of two equal products must be zero, without even a rounding error of one of them.
TEST(Codegen, DifferencesOfStrongProductsDoNotFuse) {
  LoweredFunction f = vector_sum();
  const Expr index = make_ramp(variable("x") * 16, 1, 16);
  const Expr in = make_load(Float(32, 16), "in", index);
  const Expr product = call_op(Op::strong_mul, {in, in + 1.0f});
  f.body = make_for("x", 0, 16, ForType::Serial,
                    make_store("out", product - call_op(Op::strong_mul, {in + 1.0f, in}), index));
  const std::string assembly =
      codegen::compile_assembly(f, options_for("x86-64-linux-avx512_skylake"));
  EXPECT_EQ(assembly.find("vfmsub"), std::string::npos);
  EXPECT_EQ(assembly.find("vfnmadd"), std::string::npos);
}

TEST(Codegen, OutputIsDeterministic) {
  const auto object = [] {
    return codegen::compile_object(vector_sum(), options_for("x86-64-linux")).object;
  };
  EXPECT_EQ(object(), object());
}

TEST(Codegen, PartsAreAnArchiveAndDeterministic) {
  codegen::Options options = options_for("x86-64-linux");
  options.parts = 3;
  const std::vector<uint8_t> object = codegen::compile_object(three_loops(), options).object;
  EXPECT_EQ(std::string(object.begin(), object.begin() + 7), "!<arch>");
  EXPECT_EQ(codegen::compile_object(three_loops(), options).object, object);
}

// A long block is compiled as several functions; values, masks and fused products pass between
// them. The reference has the same statements in Funcs of 100, whose blocks are short.
TEST(Codegen, LongStraightCodeGivesTheNumbersOfShortCode) {
  constexpr int statements = 3000, width = 64;
  Buffer<float> in(width + statements), whole_out, parts_out;
  for (int i = 0; i < width + statements; i++)
    in(i) = static_cast<float>(i * 7919 % 1009) / 1009.0f - 0.25f;
  Var x("x");
  Func start("start"), whole("whole");
  start(x) = in(x)*1.5f;
  start.compute_root();
  const auto statement = [&](const Expr& a, int i) {
    const Expr first = start(x);
    return select(first > 0.5f, a * 0.5f, a * 0.25f) + first * in(x + i);
  };
  Expr all = start(x);
  for (int i = 0; i < statements; i++) all = statement(all, i);
  whole(x) = all;
  whole.vectorize(x, 8);
  Func part = start;
  for (int i = 0; i < statements;) {
    Expr some = part(x);
    for (const int end = i + 100; i < end; i++) some = statement(some, i);
    part = Func("part");
    part(x) = some;
    part.compute_root().vectorize(x, 8);
  }
  whole_out = whole.realize({width});
  parts_out = part.realize({width});
  for (int i = 0; i < width; i++) EXPECT_EQ(whole_out(i), parts_out(i)) << i;
}

TEST(Codegen, UnknownTargetsAreUnsupported) {
  codegen::Options options;
  options.target = Target(Target::Windows, Target::X86, 64);
  EXPECT_THROW(codegen::compile_object(vector_sum(), options), Unsupported);
  options.target = Target(Target::Linux, Target::ARM, 32);
  EXPECT_THROW(codegen::compile_object(vector_sum(), options), Unsupported);
}

}  // namespace
}  // namespace retrograde::testing_codegen
