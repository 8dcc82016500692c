// Rules of the language and its schedules that no other test covers: one short program against
// each.
#include "error/rules.h"

#include <limits>

#include "graph/definitions/define.h"
#include "support/errors.h"

namespace retrograde {
namespace {

// ---- expressions ----

TEST_F(Rules, OperandsOfOperators) {
  const Expr handle = ir::reinterpret_as(Handle(), Expr(uint64_t{5}));
  expect("operands must be numbers", [&] { handle + 1; });
  expect("operands must be bool", [&] { Expr(x) && Expr(true); });
  expect("both operands must have a common type",
         [&] { cast(Float(16), x) + cast(BFloat(16), x); });
  expect("it takes a number", [&] { abs(handle); });
  expect("it takes a number", [&] { exp(handle); });
  expect("it takes float32", [&] { fast_log(cast<double>(x)); });
  expect("it takes float32", [&] { fast_pow(cast<double>(x), 2.5f); });
  expect("it takes float32", [&] { fast_pow(2.5f, cast<double>(x)); });
  expect("its condition is of type bool", [&] { print_when(Expr(x), 1); });
  expect("its condition is of type bool", [&] { require(Expr(x), 1); });
  expect("it returns its first argument", [&] { print(std::vector<Expr>{}); });
  expect("only numbers have one", [&] { Handle().max(); });
  expect("only numbers have one", [&] { Handle().min(); });
}

TEST_F(Rules, BitsThatAreConcatenated) {
  expect("there is at least one part", [&] { concat_bits({}); });
  expect("every part is a defined expression", [&] { concat_bits({Expr()}); });
  expect("all parts have one type", [&] { concat_bits({cast<uint8_t>(x), cast<uint16_t>(x)}); });
}

TEST_F(Rules, ElementsOfTuples) {
  expect("elements are numbered from 0", [&] { Tuple(1, 2)[2]; });
  expect("all Tuples have one size",
         [&] { select(Tuple(Expr(true), Expr(true)), Tuple(1, 2), Tuple(1, 2, 3)); });
  expect("a Func of several values is a Tuple at each point", [&] { two(x) + 1; });
  expect("the values of a point are numbered from 0", [&] { two(x)[2]; });
}

TEST_F(Rules, SeveralPointsInOneDefinition) {
  expect("at least one point is named", [&] { scatter(std::vector<Expr>{}); });
  expect("each point is a defined Expr", [&] { gather(x, Expr()); });
  expect("all points are of one type", [&] { gather(x, 1.0f); });
  Func g("g");
  expect("a first definition is for all points", [&] { g(scatter(x, y)) = gather(1, 2); });
  g(x) = 0;
  expect("scatter() names the places on the left-hand side", [&] { g(gather(1, 2)) = 3; });
  expect("scatter() and gather() of an update have the same number of points",
         [&] { g(scatter(1, 2)) = gather(1, 2, 3); });
}

// ---- Funcs ----

TEST_F(Rules, ValuesOfAFunc) {
  expect("it has one value only if it is no Tuple", [&] { two.value(); });
  two(x) = Tuple(two(x)[0] + 1, 3);
  expect("it has one value only if it is no Tuple", [&] { two.update_value(); });
  expect("it has one only if it is no Tuple", [&] { two.output_buffer(); });
  expect("updates are numbered from 0", [&] { f.update_args(0); });
  expect("updates are numbered from 0", [&] { two.update(1); });
}

TEST_F(Rules, ValuesOfAnExternFunc) {
  Func outside("outside");
  outside.define_extern("somewhere", {}, Int(32), 1);
  expect("its values are expressions", [&] { outside.value(); });
  expect("its values are expressions", [&] { outside.values(); });
  expect("a Func that define_extern defines has one", [&] { f.extern_function_name(); });
  expect<Unsupported>("extern stages run on the CPU", [&] {
    Func g("g");
    g.define_extern("somewhere", {}, Int(32), 1, NameMangling::Default, DeviceAPI::CUDA);
  });
}

TEST_F(Rules, FuncsThatDependOnEachOther) {
  Func a("a"), b("b");
  a(x) = 0;
  b(x) = a(x);
  expect("a Func is complete when another Func uses it", [&] { a(x) += b(x); });
}

TEST_F(Rules, InlineReductions) {
  RDom r(0, 3), s(0, 4);
  expect("it runs over one RDom", [&] { sum(f(r, s)); });
}

TEST_F(Rules, VariablesOfADomain) {
  RDom r(0, 3);
  expect("variables are numbered from 0", [&] { r[1]; });
  expect("a predicate is of type bool", [&] { r.where(r); });
  expect("the RDom was given a domain", [&] { RDom().where(Expr(true)); });
}

TEST_F(Rules, LevelsAreLoopsOrSetOnce) {
  LoopLevel level = LoopLevel::root();
  expect("the level is a loop of a Func", [&] { level.func(); });
  level.lock();
  expect("a locked level does not change", [&] { level.set(LoopLevel(f, x)); });
}

TEST_F(Rules, EvaluatedExpressions) {
  expect("it must be of that type", [&] { evaluate<float>(Expr(3)); });
}

// ---- schedules ----

TEST_F(Rules, FactorsAndLoops) {
  Var xo("xo"), xi("xi"), t("t");
  expect("a factor fits an int32", [&] { f.split(x, xo, xi, Expr(int64_t{1} << 40)); });
  expect("it takes two loops", [&] { f.fuse(x, x, t); });
  expect("vectors have at most", [&] {
    Func g("g");
    g(x) = x;
    g.vectorize(x, 1 << 20).realize({1 << 20});
  });
}

TEST_F(Rules, StagesWithoutLoops) {
  Func outside("outside");
  outside.define_extern("somewhere", {}, Int(32), 1);
  f.compute_root();
  expect("the stage has loops", [&] { outside.compute_with(f, x); });
}

TEST_F(Rules, Prefetches) {
  Func g("g");
  g(x, y) = f(x, y);
  expect("the offset is an integer", [&] { g.prefetch(f, x, x, 0.5f); });
  expect("the offset is an integer", [&] { g.prefetch(f, x, x, Expr()); });
}

TEST_F(Rules, SpecializationsHaveConditions) {
  expect("the condition is a defined expression", [&] { f.specialize(Expr()); });
  expect("the condition is of type bool", [&] { f.specialize(Expr(3)); });
  expect("the message says something", [&] { f.specialize_fail(""); });
}

TEST_F(Rules, Devices) {
  expect<Unsupported>("loops run on the CPU or a CUDA device", [&] { f.hexagon(x); });
  expect<Unsupported>("code for GPUs is generated for CUDA",
                      [&] { f.gpu_blocks(x, DeviceAPI::OpenCL); });
  expect<Unsupported>("storage lies in memory that a CPU or a CUDA device has", [&] {
    Func g("g");
    g(x, y) = f(x, y);
    f.compute_root().store_in(MemoryType::GPUTexture);
    g.realize({4, 4});
  });
}

TEST_F(Rules, SizesOfStorageAndBounds) {
  expect(" is an integer", [&] { f.align_storage(x, 1.5f); });
  expect("each dimension is named once", [&] { f.reorder_storage({x, x}); });
  expect("bounds are integers", [&] { f.bound(x, 0, 1.5f); });
  expect("the remainder is an integer", [&] { f.align_bounds(x, 4, 0.5f); });
  expect(" is the remainder ", [&] { f.bound(x, 0, 8).align_bounds(x, 4, 1); });
}

TEST_F(Rules, FactoredLoops) {
  RDom r(0, 8, 0, 8);
  Func g("g");
  g(y) = 0;
  g(y) += f(r.x, r.y);
  Var u("u");
  expect("only reduction loops are factored", [&] { g.update().rfactor(RVar("y"), u); });
  expect("only an update that reduces is factored",
         [&] { Stage(g.function(), 0).rfactor(r.x, u); });
}

TEST_F(Rules, FusedBeforeFactoring) {
  RDom r(0, 8, 0, 8);
  Func g("g");
  g(y) = 0;
  g(y) += f(r.x, r.y);
  Var u("u"), t("t");
  g.update().reorder(r.x, y, r.y).fuse(r.x, y, t);
  expect("reduction variables are fused only with each other", [&] { g.update().rfactor(r.y, u); });
}

TEST_F(Rules, Wrappers) {
  Func reader("reader"), other("other");
  reader(x, y) = x;
  other(x, y) = reader(x, y);
  expect("a Func is wrapped in the Funcs that read it", [&] { f.in(reader); });
  expect("a Func is wrapped in the Funcs that read it", [&] { f.in(f); });
  expect("an input is copied for a Func that reads it", [&] { f.copy_input(Buffer<int>(4)); });
  expect("an input has a type and dimensions", [&] { f.copy_input(ImageParam()); });
}

TEST_F(Rules, RegionsThatDataDecide) {
  Func index("index"), g("g");
  index(x) = x * x;
  index.compute_root();
  g(x) = f(index(x), 0);
  f.compute_root();
  expect("the region of a Func that its consumers read must be bounded", [&] { g.realize({4}); });
  ImageParam in(Int(32), 1, "in");
  Func h("h");
  h(x) = in(index(x));
  in.set(Buffer<int>(4));
  expect("the region that a pipeline reads of its input must be bounded", [&] { h.realize({4}); });
}

TEST_F(Rules, KeysOfMemoizedFuncs) {
  Buffer<int> image(8);
  image.fill(1);
  Func g("g"), h("h");
  g(x) = memoize_tag(image(x), x);
  h(x) = g(x);
  g.compute_root().memoize();
  expect("must be made of Params and constants", [&] { h.realize({4}); });
}

TEST_F(Rules, AtomicTuplesThatRequire) {
  Func g("g");
  RDom r(0, 64);
  g(x) = Tuple(0, 0);
  const Expr at = r % 4;
  g(at) = Tuple(require(g(at)[1] < 100, g(at)[0] + 1, "too many"), g(at)[1] + 1);
  g.update().atomic(true).parallel(r);
  expect<Unsupported>("updated under a lock, which must not be left", [&] { g.realize({4}); });
}

TEST_F(Rules, FilesOfTheFormatsThatAreKnown) {
  Func g("g");
  g(x, y) = f(x, y);
  f.compute_root().debug_to_file("f.jpg");
  expect<Unsupported>("the name's end says in which format", [&] { g.realize({4, 4}); });
}

// ---- data and calls ----

TEST_F(Rules, BuffersFitMemory) {
  expect("its elements must fit the memory of this machine",
         [&] { Buffer<uint8_t> huge(1 << 30, 1 << 30); });
}

TEST_F(Rules, ParamsKeepTheirLimits) {
  Param<int> p("p");
  Func g("g");
  g(x) = x + p;
  expect<RuntimeError>(" needs a value", [&] { g.realize({4}); });
  p.set_range(0, 10);
  p.set(11);
  expect<RuntimeError>(" must keep its limits", [&] { g.realize({4}); });
  p.set(-1);
  expect<RuntimeError>(" must keep its limits", [&] { g.realize({4}); });
}

TEST_F(Rules, ValuesOfParams) {
  Param<uint8_t> p("p");
  expect("a value must have been set", [&] { p.get(); });
  expect("the value must fit the parameter's type", [&] { p.set(300); });
  expect("limits are numbers",
         [&] { p.set_max_value(ir::reinterpret_as(Handle(), Expr(uint64_t{5}))); });
}

TEST_F(Rules, ImagesHaveBuffers) {
  ImageParam in(Int(32), 1, "in");
  Func g("g");
  g(x) = in(x);
  expect<RuntimeError>(" needs a buffer", [&] { g.realize({4}); });
  expect("the buffer's elements are of the parameter's type", [&] { in.set(Buffer<float>(4)); });
  expect("sizes and strides are integers", [&] { in.dim(0).set_stride(0.5f); });
  Buffer<int> image(4);
  image.raw_buffer()->dim[0].extent = -1;
  in.set(image);
  expect<RuntimeError>("must not have negative extents", [&] { g.realize({4}); });
}

TEST_F(Rules, HandlersThatComeInPairs) {
  Pipeline p(f);
  expect("allocation and release come together",
         [&] { p.set_custom_allocator(nullptr, [](void*, void*) {}); });
  p.jit_handlers().custom_malloc = [](JITUserContext*, size_t) -> void* { return nullptr; };
  expect("custom_malloc and custom_free come together", [&] { p.realize({4, 4}); });
}

TEST_F(Rules, ExternsAreCFunctions) {
  expect("its arguments have the types that it was declared with",
         [&] { frontend::checked_extern_call("abs", Int(32), {Int(32)}, {Expr(1.5f)}); });
}

TEST_F(Rules, SizesOfArraysFitTheirNumbers) {
  Func three("three");
  three(x, y, z) = cast<uint8_t>(x + y + z);
  expect<UserError>("strides must fit 31 bits", [&] { three.realize({1 << 16, 1 << 15, 2}); });
  ImageParam in(UInt(8), 3, "in");
  Func reads("reads");
  RDom r(0, 1 << 16, 0, 1 << 15);
  reads(x) = sum(cast<int>(in(r.x, r.y, x)));
  try {  // from the runtime, whose messages are a single text
    reads.infer_input_bounds({2});
    ADD_FAILURE() << "no error";
  } catch (const RuntimeError& error) {
    EXPECT_NE(std::string(error.what()).find("at most 2147483647 elements"), std::string::npos)
        << error.what();
  }
}

TEST_F(Rules, CallablesTakeWhatTheyWereCompiledFor) {
  Param<int> p("p");
  Func g("g");
  g(x) = x + p;
  expect("its arguments are all that the outputs need", [&] { g.compile_to_callable({}); });
  const Callable call = g.compile_to_callable({p});
  Buffer<int> out(4);
  expect<RuntimeError>("it takes its arguments, then its output buffers", [&] { call(out); });
  expect<RuntimeError>(" must be of type ", [&] { call(1.5f, out); });
  expect<RuntimeError>(" must be a scalar", [&] { call(out, out); });
  expect<RuntimeError>(" must have the dimensions that it was compiled for",
                       [&] { call.make_std_function<int, Buffer<int, 2>>(); });
  expect("only what was compiled can be called", [&] { Callable()(out); });
}

TEST_F(Rules, RealizationsHoldBuffers) {
  expect("it holds at least one Buffer", [&] { Realization r(std::vector<Buffer<>>{}); });
  const Realization both = two.realize({4});
  expect("its Buffers are numbered from 0", [&] { both[2]; });
  expect("it must hold exactly one", [&] { Buffer<int> one = both; });
}

TEST_F(Rules, BuffersOfATuple) {
  Buffer<int> a(4), b(5), shifted(4);
  shifted.set_min(1);
  const std::string rule = "the buffers of one Func cover one region";
  expect<RuntimeError>(rule, [&] { two.realize({a, b}); });
  expect<RuntimeError>(rule, [&] { two.realize({a, shifted}); });
}

TEST_F(Rules, FuncsOfAPipeline) {
  const Pipeline p(f);
  expect("Funcs are numbered from 0", [&] { p.get_func(7); });
  expect("a requirement is a condition of type bool",
         [&] { Pipeline(f).add_requirement(Expr(3), std::vector<Expr>{}); });
}

TEST_F(Rules, RegionsThatDoNotSettle) {
  ImageParam in(Int(32), 1, "in");
  Func g("g");
  RDom r(0, in.dim(0).extent() + 1);
  g(x) = sum(in(r)) + x;
  const char* const rule = "the regions of buffers settle within 64 bounds queries";
  expect<RuntimeError>(rule, [&] { g.infer_input_bounds({4}); });
  Func h("h");
  h(x) = x;
  h.output_buffer().dim(0).set_bounds(0, h.output_buffer().dim(0).extent() + 1);
  expect<RuntimeError>(rule, [&] { h.realize({4}); });
}

TEST_F(Rules, AnErrorCodeWithoutWords) {
  Func g("g");
  g(x) = x;
  g.parallel(x);
  g.set_custom_do_par_for(
      [](void*, int (*)(void*, int, uint8_t*), int, int, uint8_t*) { return -42; });
  expect<RuntimeError>("the compiled code must succeed", [&] { g.realize({4}); });
}

TEST_F(Rules, FuncsInACircle) {
  Func a("a"), b("b");
  a(x) = 0;
  b(x) = a(x);
  a.function()->pure->values[0] = b(x);  // cannot be written as a definition
  expect("Funcs may not depend on each other in a circle", [&] { b.realize({4}); });
  a.function()->pure->values[0] = 0;
}

TEST_F(Rules, ParamsOfTypesThatAreNoNumber) {
  expect("its type is a scalar", [&] { Param<> p(Int(32, 4)); });
}

// ---- miscellaneous ----

TEST_F(Rules, BuffersAndTheirDimensions) {
  Buffer<int> b(4, 4);
  expect("a storage order names each dimension once", [&] {
    Buffer<int> c(std::vector<int>{4, 4}, std::vector<int>{0, 0});
  });
  expect("a dimension is numbered from 0", [&] { b.dim(3); });
  expect("dimensions are not negative", [&] { ImageParam(Int(32), -1); });
  const std::string said = error_of([&] { b.copy_from(Buffer<int>(4)); });
  expect_mentions(said, {"both Buffers have the same type and number of dimensions"});
}

TEST_F(Rules, ArgumentsOfCompiledFunctions) {
  Param<int> p("p"), q("q");
  Func g("g");
  g(x) = x + p + q;
  const auto compile = [&](const std::vector<Argument>& args) { g.compile_to_module(args, "g"); };
  expect("every argument is listed once", [&] { compile({p, q, p}); });
  expect("the list of arguments holds every Param and ImageParam that it uses",
         [&] { compile({p}); });
  expect("an argument agrees with what the pipeline uses under its name", [&] {
    compile({Argument("p", Argument::InputScalar, Float(32), 0, ArgumentEstimates()), q});
  });
}

TEST_F(Rules, CallsOfFuncsWithoutDefinition) {
  const Func nobody("nobody");
  Func g("g");
  g(x) = x;
  g.function()->pure->values[0] =  // cannot be written as a definition
      ir::call_func("nobody", Int(32), {x}, 0, ir::SymbolRef(nobody.function()));
  expect("every Func that is used needs a definition", [&] { g.realize({4}); });
  expect("a Func is updated after its first definition",
         [&] { graph::define_update(nobody.function(), {x}, {1}); });
}

TEST_F(Rules, StagesThatShareLoops) {
  RDom r(0, 8);
  Func a("a"), b("b"), outside("outside"), both("both");
  a(x) = x;
  b(x) = 0;
  b(x) += r;
  outside.define_extern("somewhere", {}, Int(32), 1);
  both(x) = a(x) + outside(x);
  b.update().compute_with(Stage(a.function(), 0), x);
  expect("a stage in the loops of another one keeps its own",
         [&] { b.update().rfactor(r, Var("u")); });
  a.compute_root();
  outside.compute_root();
  a.compute_with(outside, Var("_0"));
  expect("both stages have loops", [&] { both.compile_jit(); });
}

TEST_F(Rules, CastsToWhatIsNoNumber) {
  expect("the new type must be a number", [&] { cast(Handle(), x); });
}

}  // namespace
}  // namespace retrograde
