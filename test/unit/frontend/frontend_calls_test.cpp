// Calls of compiled code: what the front end passes, checks and reports, recorded by a mock
// compiler.
#include <gtest/gtest.h>
#include <retrograde/retrograde.h>

#include <cstring>

#include "frontend/run/compiler_interface.h"
#include "support/errors.h"

using namespace retrograde;

namespace {

// A mock of compiled code. `body` gets the arguments by name.
struct FakePipeline : CompiledPipeline {
  std::vector<ir::LoweredArgument> args;
  std::function<int(const std::map<std::string, void*>&, CallContext&)> body;
  const std::vector<ir::LoweredArgument>& arguments() const override { return args; }
  int run(void* const* argv, CallContext& context) const override {
    std::map<std::string, void*> by_name;
    for (size_t i = 0; i < args.size(); i++) by_name[args[i].name] = argv[i];
    return body(by_name, context);
  }
};

struct FakeCompiler : Compiler {
  int compilations = 0;
  Target target;
  std::function<int(const std::map<std::string, void*>&, CallContext&)> body = [](auto&, auto&) {
    return 0;
  };

  std::shared_ptr<CompiledPipeline> compile(const PipelineSpec& pipeline,
                                            const Target& wanted) override {
    compilations++;
    target = wanted;
    auto result = std::make_shared<FakePipeline>();
    for (const auto& p : graph::parameters_of(pipeline.outputs)) {
      using Kind = ir::LoweredArgument::Kind;
      result->args.push_back({p->name, p->is_buffer ? Kind::InputBuffer : Kind::Scalar, p->type,
                              p->dimensions, ir::SymbolRef(p)});
    }
    for (const auto& f : pipeline.outputs) {
      for (const auto& value : f->outputs) {
        result->args.push_back({value->name, ir::LoweredArgument::Kind::OutputBuffer, value->type,
                                f->dimensions(), ir::SymbolRef(value)});
      }
    }
    result->body = [this](const auto& args, CallContext& context) { return body(args, context); };
    return result;
  }
  std::string loop_nest(const PipelineSpec& pipeline, const Target&) override {
    return "loops of " + pipeline.name;
  }
};

FakeCompiler& fake() {
  static FakeCompiler compiler;
  return compiler;
}

class Calls : public testing::Test {
 protected:
  void SetUp() override { fake() = FakeCompiler(); }
};

}  // namespace

namespace retrograde {
Compiler& default_compiler() { return fake(); }
}  // namespace retrograde

namespace {

const halide_buffer_t& buffer(void* arg) { return *static_cast<const halide_buffer_t*>(arg); }

TEST_F(Calls, ScalarsArePassedByTheirBytes) {
  Var x("x");
  Param<float> gain("gain_c", 0.5f);
  Param<int8_t> offset("offset_c", int8_t{-3});
  Param<bool> flag("flag_c", true);
  Param<double> precise("precise_c", 0.1);
  Func f("scalars");
  f(x) = select(flag, precise * gain + offset, 0.0);
  int calls = 0;
  fake().body = [&](const auto& args, CallContext&) {
    calls++;
    EXPECT_EQ(*static_cast<float*>(args.at("gain_c")), 0.5f);
    EXPECT_EQ(*static_cast<int8_t*>(args.at("offset_c")), -3);
    EXPECT_EQ(*static_cast<uint8_t*>(args.at("flag_c")), 1);
    EXPECT_EQ(*static_cast<double*>(args.at("precise_c")), 0.1);
    return 0;
  };
  f.realize({4});
  EXPECT_EQ(calls, 2);  // a bounds query for the output, and the run
}

TEST_F(Calls, OutputsAreAllocatedWithTheSizesGiven) {
  Var x("x"), y("y");
  Func f("pair_out");
  f(x, y) = Tuple(x, cast<float>(y));
  std::vector<bool> has_memory;
  fake().body = [&](const auto& args, CallContext&) {
    EXPECT_EQ(buffer(args.at("pair_out.0")).dim[0].extent, 7);
    EXPECT_EQ(buffer(args.at("pair_out.1")).dim[1].extent, 3);
    has_memory.push_back(buffer(args.at("pair_out.1")).host != nullptr);
    return 0;
  };
  Realization r = f.realize({7, 3});
  EXPECT_EQ(has_memory, (std::vector<bool>{false, true}));  // a bounds query for both, and the run
  ASSERT_EQ(r.size(), 2u);
  EXPECT_EQ(r[0].type(), Int(32));
  EXPECT_EQ(r[1].type(), Float(32));
  EXPECT_THROW((Buffer<int>(r)), CompileError);
}

TEST_F(Calls, GivenBuffersAreUsedAsTheyAre) {
  Var x("x");
  Func f("given");
  f(x) = x;
  Buffer<int> out(10);
  out.set_min(5);
  fake().body = [&](const auto& args, CallContext&) {
    EXPECT_EQ(buffer(args.at("given")).host, reinterpret_cast<const uint8_t*>(out.data()));
    EXPECT_EQ(buffer(args.at("given")).dim[0].min, 5);
    return 0;
  };
  f.realize(out);
  f.realize({out});
  Runtime::Buffer<int> raw(out);
  f.realize(raw);
  f.realize(raw.raw_buffer());
  EXPECT_EQ(fake().compilations, 1);
}

TEST_F(Calls, SeveralOutputsShareACall) {
  Var x("x");
  Func f("several_f"), g("several_g");
  f(x) = x;
  g(x) = f(x) * 2.0f;
  Pipeline both({f, g});
  Buffer<int> a(4);
  Buffer<float> b(4);
  int calls = 0;
  fake().body = [&](const auto& args, CallContext&) {
    calls++;
    EXPECT_EQ(args.size(), 2u);
    return 0;
  };
  both.realize({a, b});
  Realization r = both.realize({4});
  EXPECT_EQ(r.size(), 2u);
  EXPECT_EQ(calls, 3);  // one with buffers; for sizes, a bounds query of the outputs and the run
  EXPECT_THROW(both.realize({b, a}), RuntimeError);
}

TEST_F(Calls, CodeIsCompiledOnceUntilSomethingChanges) {
  Var x("x");
  ImageParam in(Float(32), 1, "in_stale");
  Func f("stale_f"), g("stale_g");
  f(x) = in(x);
  g(x) = f(x) + f(x + 1);
  Buffer<float> data(32);
  in.set(data);
  g.realize({8});
  g.realize({16});
  EXPECT_EQ(fake().compilations, 1);
  in.set(Buffer<float>(64));
  g.realize({8});
  EXPECT_EQ(fake().compilations, 1);
  f.compute_root();
  g.realize({8});
  EXPECT_EQ(fake().compilations, 2);
  in.dim(0).set_min(0);
  g.realize({8});
  EXPECT_EQ(fake().compilations, 3);
  g.output_buffer().dim(0).set_stride(1);
  g.realize({8});
  EXPECT_EQ(fake().compilations, 4);
  g(x) += 1.0f;
  g.realize({8});
  EXPECT_EQ(fake().compilations, 5);
}

TEST_F(Calls, TheTargetOfAnExplicitCompilationIsKept) {
  Var x("x");
  Func f;
  f(x) = x;
  const Target target("x86-64-linux");
  f.compile_jit(target);
  f.realize({3});
  EXPECT_EQ(fake().compilations, 1);
  EXPECT_EQ(fake().target, target);
}

TEST_F(Calls, ErrorsOfTheCodeCarryItsMessageAndCode) {
  Var x("x");
  Func f;
  f(x) = x;
  fake().body = [](const auto&, CallContext& context) {
    context.error = "input \"in\" is too small";
    return -4;
  };
  try {
    f.realize({3});
    FAIL() << "no error";
  } catch (const RuntimeError& error) {
    EXPECT_EQ(error.code(), -4);
    EXPECT_STREQ(error.what(), "input \"in\" is too small");
  }
  fake().body = [](const auto&, CallContext&) { return -7; };
  EXPECT_THROW(f.realize({3}), RuntimeError);
}

TEST_F(Calls, MissingInputsAreNamed) {
  Var x("x");
  ImageParam in(Float(32), 1, "missing_in");
  Param<int> k("missing_k");
  Func f;
  f(x) = in(x) + k;
  expect_error<RuntimeError>({"missing_in"}, [&] { f.realize({3}); });
  in.set(Buffer<float>(10));
  expect_error<RuntimeError>({"missing_k"}, [&] { f.realize({3}); });
}

TEST_F(Calls, LimitsOfParametersAreChecked) {
  Var x("x");
  Param<int> k("limited_k", 3, 0, 5);
  Func f;
  f(x) = x + k;
  f.realize({3});
  k.set(6);
  EXPECT_THROW(f.realize({3}), RuntimeError);
  k.set(-1);
  EXPECT_THROW(f.realize({3}), RuntimeError);
}

TEST_F(Calls, InputsWithoutMemoryAreNoQuery) {
  Var x("x");
  ImageParam in(Float(32), 1);
  Func f;
  f(x) = in(x);
  in.set(Buffer<>(Runtime::Buffer<float>(nullptr, 8)));
  EXPECT_THROW(f.realize({3}), RuntimeError);
}

TEST_F(Calls, InputBoundsAreAskedForUntilTheySettle) {
  Var x("x");
  ImageParam a(Float(32), 1, "query_a"), b(UInt(8), 2, "query_b"), bound(Int(32), 1, "query_set");
  Func f("query_f");
  f(x) = a(x) + b(x, 3) + bound(x);
  bound.set(Buffer<int>(100));
  int rounds = 0;
  fake().body = [&](const auto& args, CallContext&) {
    rounds++;
    auto& in_a = *static_cast<halide_buffer_t*>(args.at("query_a"));
    auto& in_b = *static_cast<halide_buffer_t*>(args.at("query_b"));
    EXPECT_FALSE(in_a.host);
    EXPECT_TRUE(buffer(args.at("query_set")).host);
    // b's region follows from a's, so it is right one round later.
    in_b.dim[0].min = in_a.dim[0].min;
    in_b.dim[0].extent = in_a.dim[0].extent;
    in_b.dim[1].extent = 4;
    in_a.dim[0].min = -1;
    in_a.dim[0].extent = buffer(args.at("query_f")).dim[0].extent + 2;
    return 0;
  };
  f.infer_input_bounds({10});
  EXPECT_EQ(rounds, 3);
  EXPECT_EQ(a.get().dim(0).min(), -1);
  EXPECT_EQ(a.get().dim(0).extent(), 12);
  EXPECT_EQ(b.get().dim(0).extent(), 12);
  EXPECT_EQ(b.get().dim(1).extent(), 4);
  EXPECT_TRUE(a.get().data());
  EXPECT_EQ(bound.get().extent(0), 100);
}

TEST_F(Calls, RegionsThatNeverSettleAreAnError) {
  Var x("x");
  ImageParam a(Float(32), 1, "growing");
  Func f;
  f(x) = a(x);
  fake().body = [](const auto& args, CallContext&) {
    static_cast<halide_buffer_t*>(args.at("growing"))->dim[0].extent++;
    return 0;
  };
  EXPECT_THROW(f.infer_input_bounds({10}), RuntimeError);
}

TEST_F(Calls, PrintedTextGoesToTheHandler) {
  Var x("x");
  Func f;
  f(x) = print(x);
  std::string printed;
  f.jit_handlers().print = [&](const char* text) { printed += text; };
  fake().body = [&](const auto& args, CallContext& context) {
    if (buffer(args.at(f.name())).host) context.print("3 4\n");
    return 0;
  };
  f.realize({1});
  EXPECT_EQ(printed, "3 4\n");
}

TEST_F(Calls, LoopNestsComeFromTheCompiler) {
  Var x("x");
  Func f("nest_f");
  f(x) = x;
  EXPECT_EQ(f.loop_nest(), "loops of nest_f");
}

// ---- buffers ----

TEST(Buffers, ElementsAndShape) {
  Buffer<float> b(4, 3, "named_buffer");
  EXPECT_EQ(b.name(), "named_buffer");
  EXPECT_EQ(b.dimensions(), 2);
  b.fill(1.0f);
  b(2, 1) = 5.0f;
  EXPECT_EQ(b(2, 1), 5.0f);
  EXPECT_EQ(b.data()[6], 5.0f);
  EXPECT_EQ(b.width() * b.height() * b.channels(), 12);
  EXPECT_EQ(b.number_of_elements(), 12u);
  EXPECT_TRUE(b.contains(3, 2));
  EXPECT_FALSE(b.contains(4, 2));
}

TEST(Buffers, CopiesShareMemoryAndShape) {
  Buffer<int> a(8), b = a;
  a(3) = 7;
  EXPECT_EQ(b(3), 7);
  a.crop(0, 2, 4);
  EXPECT_EQ(b.min(0), 2);
  Buffer<int> c = a.cropped(0, 3, 1);
  EXPECT_EQ(a.extent(0), 4);
  EXPECT_EQ(c.extent(0), 1);
  EXPECT_EQ(c(3), 7);
  Buffer<int> d = a.copy();
  d(3) = 8;
  EXPECT_EQ(a(3), 7);
}

TEST(Buffers, ShiftedSlicedAndTransposedViews) {
  Buffer<uint8_t> b(4, 3, 2);
  b.for_each_element([&](int x, int y, int c) { b(x, y, c) = x + 10 * y + 100 * c; });
  b.set_min(-1, 5, 0);
  EXPECT_EQ(b(-1, 5, 1), 100);
  Buffer<uint8_t> plane = b.sliced(2, 1);
  EXPECT_EQ(plane.dimensions(), 2);
  EXPECT_EQ(plane(0, 6), 111);
  plane.translate(0, 1);
  EXPECT_EQ(plane(1, 6), 111);
  Buffer<uint8_t> turned = plane.transposed(0, 1);
  EXPECT_EQ(turned(6, 1), 111);
  Buffer<uint8_t> taller = plane.embedded(2, 9);
  EXPECT_EQ(taller(1, 6, 9), 111);
}

TEST(Buffers, InterleavedMemory) {
  auto b = Buffer<uint8_t>::make_interleaved(4, 3, 2);
  EXPECT_EQ(b.stride(2), 1);
  EXPECT_EQ(b.stride(0), 2);
  EXPECT_EQ(b.stride(1), 8);
  auto c = Buffer<>::make_interleaved(UInt(16), 4, 3, 2);
  EXPECT_EQ(c.type(), UInt(16));
}

TEST(Buffers, AroundMemoryOfSomeoneElse) {
  float values[3][4] = {};
  Buffer<float> a(values);
  EXPECT_EQ(a.width(), 4);
  a(1, 2) = 3.0f;
  EXPECT_EQ(values[2][1], 3.0f);
  std::vector<int> more(6);
  Buffer<int> b(more.data(), 2, 3);
  b(1, 2) = 9;
  EXPECT_EQ(more[5], 9);
  Buffer<int> c(more.data(), std::vector<int>{3, 2});
  EXPECT_EQ(c(2, 1), 9);
  Buffer<const int> d = c;
  EXPECT_EQ(d(2, 1), 9);
}

TEST(Buffers, ScalarsAndHalfFloats) {
  auto s = Buffer<double>::make_scalar();
  s() = 2.5;
  EXPECT_EQ(s(), 2.5);
  EXPECT_EQ(s.dimensions(), 0);
  Buffer<float16_t> h(3);
  EXPECT_EQ(h.type(), Float(16));
  h(1) = float16_t(1.5f);
  EXPECT_EQ(static_cast<float>(h(1)), 1.5f);
  EXPECT_EQ(Buffer<bfloat16_t>(2).type(), BFloat(16));
  EXPECT_EQ(Buffer<bool>(2).type(), Bool());
}

TEST(Buffers, TypedAndUntypedHandles) {
  Buffer<> any(Int(16), {3, 4});
  Buffer<int16_t> typed = any;
  Buffer<int16_t, 2> fixed = any.as<int16_t, 2>();
  typed(2, 3) = 5;
  EXPECT_EQ(fixed(2, 3), 5);
  EXPECT_TRUE(typed.same_as(any));
  Runtime::Buffer<int16_t> runtime = typed;
  EXPECT_EQ(runtime(2, 3), 5);
  Runtime::Buffer<int16_t, 2> own(2, 2);
  own.fill(4);
  Buffer<int16_t> adopted(own);
  EXPECT_EQ(adopted(1, 1), 4);
}

TEST(Buffers, ForEachValueWalksSeveralTogether) {
  Buffer<int> a(4, 4), b(4, 4);
  a.fill(2);
  b.fill(3);
  int total = 0;
  a.for_each_value([&](int& x, int y) { total += x * y; }, b);
  EXPECT_EQ(total, 16 * 6);
  EXPECT_TRUE(a.all_equal(2));
}

TEST(Buffers, InExpressionsTheyAreLoads) {
  Var x("x");
  Buffer<uint8_t> b(4, 4, "loaded");
  Expr e = b(x, 2);
  EXPECT_EQ(e.type(), UInt(8));
  const ir::Call* call = e.as<ir::Call>();
  ASSERT_TRUE(call);
  EXPECT_EQ(call->call_type, ir::CallType::Image);
  auto parameter = std::dynamic_pointer_cast<graph::ParameterContents>(call->symbol.lock());
  ASSERT_TRUE(parameter);
  EXPECT_EQ(parameter->buffer, b.raw_buffer());
  EXPECT_EQ(b.parameter(), parameter);
}

TEST(Buffers, AnExprKeepsItsBufferAlive) {
  Var x("x");
  Expr e;
  {
    Buffer<int> b(4);
    b(2) = 11;
    e = b(x);
  }
  auto parameter =
      std::dynamic_pointer_cast<graph::ParameterContents>(e.as<ir::Call>()->symbol.lock());
  EXPECT_EQ(reinterpret_cast<int*>(parameter->buffer->host)[2], 11);
}

}  // namespace
