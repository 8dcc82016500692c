// Requirements of handles, compiled functions, schedules and derivatives whose words no other test
// expects: one short program against each.
#include "error/rules.h"

namespace retrograde {
namespace {

struct RequirementsOfParts : Rules {
  ImageParam image{Float(32), 1, "image"}, other{Float(32), 1, "other"};
  Func line{"line"}, loss{"loss"};
  RequirementsOfParts() {
    line(x) = image(x) * image(x);
    RDom r(0, 4);
    loss() += line(r);
  }
};

// ---- expressions and definitions ----

TEST_F(RequirementsOfParts, Operands) {
  const Expr handle = ir::reinterpret_as(Handle(), Expr(uint64_t{5}));
  const Expr byte = cast<uint8_t>(x);
  const char* no_text = nullptr;
  expect("it takes and gives numbers", [&] { saturating_cast<uint8_t>(handle); });
  expect("a constant takes the type of the other operand and must fit it", [&] { byte + 300; });
  expect("a constant takes the type of the other operand and must fit it",
         [&] { halving_add(byte, 300); });
  expect("a text is not null", [&] { Expr e(no_text); });
  expect("a target is a text such as \"host\"", [&] { Target t(no_text); });
}

TEST_F(RequirementsOfParts, Definitions) {
  Func g("g");
  expect("the arguments of a first definition are different Vars", [&] { g(x, x) = 1; });
}

// ---- handles ----

TEST_F(RequirementsOfParts, Handles) {
  expect("the handle must have a buffer", [&] { Buffer<int>().width(); });
  expect("they are the threads, the bytes of the last-level cache and the cost of a load",
         [&] { MachineParams("16,huge"); });
  expect("options of the autoscheduler are parts of a name and a value",
         [&] { AutoscheduleOptions::from_string("speed=high"); });
  expect("the decisions of the autoscheduler have names",
         [&] { AutoscheduleOptions::from_string("without=stripes"); });
  expect("threads and bytes are whole numbers, 0 or more",
         [&] { AutoscheduleOptions::from_string("threads=-1"); });
  expect("it refers to a Param or an ImageParam", [&] { Parameter().name(); });
  Param<int> gain("gain");
  expect("this is for buffers", [&] { Parameter(gain.parameter()).buffer(); });
  expect("it needs outputs", [&] { Pipeline().outputs(); });
  expect("its outputs are different Funcs", [&] { Pipeline({f, f}); });
  expect("it is a Func or an image that is prefetched",
         [&] { f.prefetch(std::shared_ptr<graph::ParameterContents>(), x, x); });
}

// ---- compiled functions ----

TEST_F(RequirementsOfParts, CompiledFunctions) {
  expect("the list of arguments holds inputs, and outputs are appended automatically",
         [&] { f.compile_to_module({Argument("out", Argument::OutputBuffer, Int(32), 2)}, "f"); });
  expect("a C function that it calls must be in this process, or among its JIT externs", [&] {
    Func g("g");
    g(x) = call_c_function<int, int>("nobody_wrote_this", x);
    g.realize({4});
  });
  expect<Unsupported>("a pipeline exists only in the process that defines it",
                      [&] { serialize_pipeline(Pipeline(f)); });
}

// ---- schedules ----

TEST_F(RequirementsOfParts, Schedules) {
  expect("the extent of a vectorized loop must be a constant, or have a constant above it", [&] {
    Func g("g");
    g(x) = x;
    g.vectorize(x).realize({4});
  });
  expect("only what is computed somewhere has loops", [&] {
    Func g("g"), h("h");
    g(x) = x;
    h(x) = g(x);
    g.parallel(x);
    h.realize({4});
  });
}

TEST_F(RequirementsOfParts, WhatIsMemoizedIsComputedWhole) {
  Func g("g"), h("h");
  g(x, y) = x + y;
  h(x, y) = g(x, y) + g(x, y + 1);
  g.store_root().compute_at(h, y).memoize();
  expect("a memoized Func must be computed whole, where its storage begins", [&] {
    h.realize({4, 4});
  });
  expect("what an image holds is no part of a memoized Func's key", [&] {
    Func reader("reader"), out("out");
    reader(x) = image(x);
    out(x) = reader(x);
    reader.compute_root().memoize();
    out.realize({4});
  });
}

TEST_F(RequirementsOfParts, HoistedStorage) {
  const auto schedule = [&](const std::function<void(Func & g, Func & h)>& given) {
    Func g("g"), h("h");
    g(x, y) = x + y;
    h(x, y) = g(x, y) + g(x, y + 1);
    given(g, h);
    h.realize({4, 4});
  };
  expect("storage is hoisted to a loop that encloses its store level",
         [&] { schedule([&](Func& g, Func& h) { g.compute_at(h, y).hoist_storage(h, x); }); });
  expect("the size of hoisted storage is known outside of the loops it is hoisted over", [&] {
    Func powers("powers"), sums("sums");
    powers(x) = x;
    sums(x) = powers(x) + powers(1 << x);
    powers.compute_at(sums, x).hoist_storage_root();
    sums.realize({4});
  });
}

// ---- derivatives ----

TEST_F(RequirementsOfParts, BudgetsOfDerivatives) {
  expect("a budget is a number of states or of bytes",
         [&] { propagate_adjoints(loss, {.checkpoint_states = 2, .checkpoint_bytes = 100}); });
  expect("a budget is a number of bytes", [&] { propagate_adjoints(loss, {.version_bytes = -1}); });
}

TEST_F(RequirementsOfParts, WhatIsDifferentiated) {
  expect("something has to move", [&] { propagate_tangents(line, {}); });
  expect("only floating-point values that are defined have derivatives",
         [&] { jacobian(Func("none"), image, {}); });
  Param<int> count("count");
  Func along("along");
  along(x) = 1.0f;
  expect("the input is a float that the loss depends on", [&] {
    hessian_vector_product(loss, count, {{image, along}});
  });
}

TEST_F(RequirementsOfParts, WhatHasNoDerivative) {
  Func along("along"), scaled("scaled"), called("called");
  along(x) = 1.0f;
  scaled(x) = select(x > 3, undef<float>(), image(x)) * 2.0f;
  expect<Unsupported>(
      "the tangent of undef is known where a select chooses it and nothing else is done with it",
      [&] {
        propagate_tangents(scaled, {{image, along}});
      });
  called(x) = call_c_function<float, float>("sinf", image(x));
  Func sum_of_calls("sum_of_calls");
  RDom r(0, 4);
  sum_of_calls() += called(r);
  expect<Unsupported>("a C function has no known derivative",
                      [&] { propagate_adjoints(sum_of_calls, {.wrt = {image}}); });
}

TEST_F(RequirementsOfParts, CustomDerivatives) {
  Func g("g");
  g(x) = line(x) + 1.0f;
  const CustomAdjoint rule = [](const AdjointContext&) {
    return std::vector<AdjointContribution>();
  };
  expect("each input is listed once", [&] { custom_adjoint(g, {line, line}, rule); });
  expect("its inputs are what the Func is computed from",
         [&] { custom_adjoint(g, {other}, rule); });
}

TEST_F(RequirementsOfParts, ReportsOnDerivatives) {
  Buffer<float> values(4);
  values.fill(1.0f);
  image.set(values);
  expect("the output needs a size in each of its dimensions, and a min in each or none", [&] {
    check_gradients(line, {4, 4});
  });
  expect("`wrt` names floating inputs that the output depends on",
         [&] { check_gradients(line, {4}, {.wrt = {other}}); });
  Func whole("whole");
  whole(x) = cast<int>(image(x));
  expect<Unsupported>("derivatives are of floats", [&] { check_gradients(whole, {4}); });
  expect("a range belongs to a floating input that the output depends on", [&] {
    check_stability(line, {4}, {.ranges = {{other, 0, 1}}});
  });
}

// ---- generators ----

class Scaling : public Generator<Scaling> {
 public:
  Input<Buffer<float, 1>> in{"in"};
  Output<Buffer<float, 1>> out{"out"};
  void generate() { out(x) = in(x); }
  void schedule() { in.set_estimate(Var("nobody"), 0, 8); }

 private:
  Var x{"x"};
};

TEST_F(RequirementsOfParts, EstimatesOfInputs) {
  expect("a dimension has the name of one of the input's arguments",
         [&] { GeneratorContext(get_host_target()).create<Scaling>()->build_module("scaling"); });
}

}  // namespace
}  // namespace retrograde
