// Generators: pipelines as classes, with params that a build file sets. The program is linked with
// the main() that comes with the compiler. generators_use.cpp calls the libraries that it writes.
#include "Halide.h"

namespace {

enum class Border { Repeat, Zero };

class LocalMean : public Halide::Generator<LocalMean> {
 public:
  GeneratorParam<int> radius{"radius", 1, 0, 16};
  GeneratorParam<bool> parallel{"parallel", true};
  GeneratorParam<Border> border{
      "border", Border::Repeat, {{"repeat", Border::Repeat}, {"zero", Border::Zero}}};
  GeneratorParam<Halide::Type> accumulator{"accumulator", Halide::Int(32)};

  Input<Buffer<uint8_t>> input{"input", 2};
  Input<int> bias{"bias", 0, -64, 64};
  Output<Buffer<uint8_t>> output{"output", 2};

  void generate() {
    Func source = border == Border::Repeat
                      ? Halide::BoundaryConditions::repeat_edge(input)
                      : Halide::BoundaryConditions::constant_exterior(input, 0);
    const int side = 2 * radius + 1;
    RDom r(-radius.value(), side, -radius.value(), side);
    total(x, y) = cast(accumulator, 0);
    total(x, y) += cast(accumulator, source(x + r.x, y + r.y));
    output(x, y) = cast<uint8_t>(clamp(cast<int>(total(x, y)) / (side * side) + bias, 0, 255));
  }

  void schedule() {
    output.vectorize(x, natural_vector_size<uint8_t>());
    if (parallel) output.parallel(y);
    total.compute_at(output, y).vectorize(x, natural_vector_size<float>());
    total.update().vectorize(x, natural_vector_size<float>());
  }

 private:
  Var x{"x"}, y{"y"};
  Func total{"total"};
};

// Arrays of images, a Tuple, an output that is one value, and an input added by configure().
class Blend : public Halide::Generator<Blend> {
 public:
  GeneratorParam<int> extra{"extra", 0};
  Input<Buffer<float>[]> images { "images", 1 };
  Input<float> weight{"weight", 0.5f};
  Output<Func> blended{"blended", {Halide::Float(32), Halide::Int(32)}, 1};
  Output<float> largest{"largest"};

  void configure() {
    for (int i = 0; i < extra; i++) {
      added.push_back(add_input<Buffer<float>>("extra_" + std::to_string(i), 1));
    }
  }

  void generate() {
    Expr sum = 0.0f;
    for (size_t i = 0; i < images.size(); i++) sum += images[i](x) * weight;
    for (auto* image : added) sum += (*image)(x);
    blended(x) = Halide::Tuple(sum, (int)(images.size() + added.size()));
    RDom r(0, images[0].dim(0).extent());
    largest() = -1e30f;
    largest() = Halide::max(largest(), images[0](r));
  }

 private:
  Var x{"x"};
  std::vector<Input<Buffer<float>>*> added;
};

}  // namespace

HALIDE_REGISTER_GENERATOR(LocalMean, local_mean)
HALIDE_REGISTER_GENERATOR(Blend, blend)
