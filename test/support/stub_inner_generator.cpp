// The generator that test/unit/generator/generator_stub_test.cpp uses through its stub.
#include "Halide.h"

namespace {

enum class Shape { Square, Ramp };

class Inner : public Halide::Generator<Inner> {
 public:
  GeneratorParam<int> factor{"factor", 2};
  GeneratorParam<float> bias{"bias", 0.5f};
  GeneratorParam<bool> negate{"negate", false};
  GeneratorParam<std::string> word{"word", "a \"word\""};
  GeneratorParam<Shape> shape{
      "shape", Shape::Ramp, {{"square", Shape::Square}, {"ramp", Shape::Ramp}}};
  GeneratorParam<Halide::Type> type{"type", Halide::Int(32)};
  GeneratorParam<LoopLevel> level{"level", LoopLevel::root()};
  // The stub also calls the open type of "scaled" by this name.
  GeneratorParam<Halide::Type> scaled_type{"scaled_type", Halide::Int(32)};

  Input<Func> source{"source", Int(32), 1};
  Input<Buffer<int, 1>> image{"image"};
  Input<Func[]> many{"many", Int(32), 1};
  Input<int> offset{"offset"};

  Output<Func> scaled{"scaled", 1};
  Output<Buffer<float, 1>> shaped{"shaped"};
  Output<Func[2]> pair{"pair", Int(32), 1};
  Output<Buffer<>> open{"open", 1};

  void generate() {
    partial(x) = source(x) * factor + offset;
    scaled(x) = cast(type, negate ? -partial(x) : partial(x));
    const Expr here = cast<float>(image(x));
    shaped(x) = (shape == Shape::Square ? here * here : here) + bias;
    pair[0](x) = many[0](x) + static_cast<int>(word.value().size());
    pair[1](x) = many[1](x) + static_cast<int>(many.size());
    open(x) = cast(open.type(), source(x));
  }
  void schedule() { partial.compute_at(level); }

 private:
  Var x{"x"};
  Func partial{"partial"};
};

// One output, and an input that configure() adds.
class Configured : public Halide::Generator<Configured> {
 public:
  Input<int> offset{"offset"};
  Output<Func> out{"out", Int(32), 1};
  void configure() { added = add_input<int>("added"); }
  void generate() { out(Var("x")) = Var("x") * *added + offset; }

 private:
  Input<int>* added = nullptr;
};

}  // namespace

HALIDE_REGISTER_GENERATOR(Configured, stub_configured)
HALIDE_REGISTER_GENERATOR(Inner, stub_inner, test::inner::InnerStub)
