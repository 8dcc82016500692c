#include "training.h"

#include <algorithm>

#include "demosaicker.h"

namespace demosaic {

using lang::Expr;
using lang::RDom;

namespace {

constexpr double last_rate_factor = 0.02;

// Adam's rates. Windows and biases are sums of many small influences on a score of a few units; filters must sum to one
// within a thousandth.
double rate_of(Array array) {
  switch (array) {
    case Array::Green:
      return 2e-3;
    case Array::Closeness:
    case Array::Selection:
    case Array::Bias:
      return 2e-2;
    case Array::Cross:
    case Array::Near:
    case Array::Steepness:
      return 1e-2;
    case Array::Chroma:
      return 1e-3;
  }
  return 0;
}

std::vector<Array> arrays_of(const std::vector<std::string>& groups) {
  std::vector<Array> result;
  for (Array array : all_arrays) {
    if (std::find(groups.begin(), groups.end(), group_of(array)) != groups.end()) {
      result.push_back(array);
    }
  }
  return result;
}

// An array that is not learned has no rate, and its gradient stays zero.
std::vector<apps::AdamGroup> adam_groups(const Shape& shape,
                                         const std::vector<std::string>& groups) {
  const auto learned = arrays_of(groups);
  std::vector<apps::AdamGroup> result;
  for (Array array : all_arrays) {
    const bool moves = std::find(learned.begin(), learned.end(), array) != learned.end();
    result.push_back({elements_of(shape, array), moves ? rate_of(array) : 0.0});
  }
  return result;
}

}  // namespace

Batch::Batch(const Shape& shape, const BatchShape& batch)
    : margin(Relaxed::reach(shape)),
      mosaic(
          std::vector<int>{2 * (batch.cells + margin), 2 * (batch.cells + margin), batch.pieces}),
      truth(std::vector<int>{2 * batch.cells, 2 * batch.cells, 3, batch.pieces}) {
  mosaic.set_min(-margin, -margin, 0);
}

Objective::Objective(const Shape& shape, const BatchShape& batch, lang::Type scalar)
    : batch(batch),
      mosaic(scalar, 3, "mosaic"),
      truth(scalar, 4, "truth"),
      model(shape, seen(), {lang::Var("piece")}, scalar) {
  const lang::Var &x = model.x, &y = model.y, &c = model.c, &piece = model.batch[0];
  lang::Func error("error");
  error(x, y, c, piece) = model.image(x, y, c, piece) - truth(x, y, c, piece);
  const int side = 2 * batch.cells;
  const RDom r(0, side, 0, side, 0, 3, 0, batch.pieces, "sample");
  const double count = 3.0 * side * side * batch.pieces;
  const Expr e = error(r.x, r.y, r.z, r.w);
  loss() = lang::cast(scalar, 0);
  loss() += e * e * lang::cast(scalar, Expr(1 / count));
}

lang::Func Objective::seen() const {
  const lang::Var x("x"), y("y"), piece("piece");
  lang::Func seen("seen");
  seen(x, y, piece) = mosaic(x, y, piece);
  return seen;
}

void Objective::bind(const Batch& from) {
  if (model.scalar == lang::Float(32)) {
    mosaic.set(from.mosaic);
    truth.set(from.truth);
    return;
  }
  const auto widened = [](const lang::Buffer<float>& buffer) {
    std::vector<int> sizes;
    for (int d = 0; d < buffer.dimensions(); ++d) sizes.push_back(buffer.dim(d).extent());
    lang::Buffer<double> wide(sizes);
    for (int d = 0; d < buffer.dimensions(); ++d) wide.translate(d, buffer.dim(d).min());
    wide.for_each_element([&](const int* at) { wide(at) = buffer(at); });
    return wide;
  };
  mosaic.set(widened(from.mosaic));
  truth.set(widened(from.truth));
}

TrainingPipeline::TrainingPipeline(const Shape& shape, const BatchShape& batch,
                                   const std::vector<std::string>& groups)
    : learned(arrays_of(groups)), objective(shape, batch), adjoints(differentiate()) {
  std::vector<lang::Func> outputs{objective.loss};
  for (Array array : learned) outputs.push_back(adjoints(learned_func(objective.model, array)));
  pipeline = lang::Pipeline(outputs);
}

void TrainingPipeline::compile(int threads) { schedule_and_compile(pipeline, threads); }

// Only by the learned arrays, so that explain() describes the program that runs.
lang::Derivative TrainingPipeline::differentiate() const {
  lang::AdjointOptions options;
  for (Array array : learned) options.wrt.emplace_back(learned_func(objective.model, array));
  return lang::propagate_adjoints(objective.loss, options);
}

size_t TrainingPipeline::stages() const {
  size_t count = 0;
  for (const lang::Func& f : adjoints.funcs()) count += f.defined() ? 1 : 0;
  return count;
}

// A square of a photograph, in one of eight orientations and with changed colours.
struct Sampler::Piece {
  const Photograph* photograph;
  int left, top, side;
  bool turned, flip_x, flip_y;
  ColourMatrix colours;

  float at(int x, int y, int c) const {
    if (flip_x) x = side - 1 - x;
    if (flip_y) y = side - 1 - y;
    if (turned) std::swap(x, y);
    const int column = mirrored(left + x, photograph->width);
    const int row = mirrored(top + y, photograph->height);
    float value = 0;
    for (int from = 0; from < 3; ++from) {
      value += colours[static_cast<size_t>(c)][static_cast<size_t>(from)] *
               photograph->at(column, row, from);
    }
    return std::clamp(value, 0.0f, 1.0f);
  }
};

Sampler::Sampler(const std::vector<Photograph>& photographs, uint64_t seed)
    : photographs_(photographs), random_(seed) {}

// Used instead of the standard library's distributions, whose numbers differ between implementations.
size_t Sampler::below(size_t n) { return random_() % n; }

float Sampler::between(float least, float most) {
  constexpr size_t steps = 1 << 20;
  return least + (most - least) * static_cast<float>(below(steps + 1)) / static_cast<float>(steps);
}

// Changes lighting and saturation and, in half of all cases, exchanges red and blue, which the mosaic treats alike.
Sampler::ColourMatrix Sampler::other_colours() {
  constexpr float grey[3] = {0.299f, 0.587f, 0.114f};  // luma of ITU-R BT.601
  const float saturation = between(0.8f, 1.5f);
  const bool exchange = below(2) == 1;
  ColourMatrix matrix;
  for (size_t c = 0; c < 3; ++c) {
    const float gain = between(0.8f, 1.1f);
    for (size_t from = 0; from < 3; ++from) {
      const size_t source = exchange ? 2 - from : from;
      matrix[c][source] = gain * ((1 - saturation) * grey[from] + (c == from ? saturation : 0));
    }
  }
  return matrix;
}

Sampler::Piece Sampler::piece(int side) {
  const Photograph& photograph = photographs_[below(photographs_.size())];
  const auto place = [&](int size) {
    return size > side ? static_cast<int>(below(static_cast<size_t>(size - side + 1))) : 0;
  };
  const int left = place(photograph.width), top = place(photograph.height);
  const size_t way = below(8);
  return {&photograph,    left,           top, side, (way & 1) != 0, (way & 2) != 0,
          (way & 4) != 0, other_colours()};
}

Batch Sampler::draw(const Shape& shape, const BatchShape& size) {
  Batch batch(shape, size);
  const int margin = batch.margin, side = 2 * size.cells;
  for (int n = 0; n < size.pieces; ++n) {
    const Piece from = piece(side + 2 * margin);
    for (int y = -margin; y < side + margin; ++y) {
      for (int x = -margin; x < side + margin; ++x) {
        batch.mosaic(x, y, n) = from.at(x + margin, y + margin, colour_at(x, y));
      }
    }
    for (int c = 0; c < 3; ++c) {
      for (int y = 0; y < side; ++y) {
        for (int x = 0; x < side; ++x) {
          batch.truth(x, y, c, n) = from.at(x + margin, y + margin, c);
        }
      }
    }
  }
  return batch;
}

Trainer::Trainer(const Weights& start, const std::vector<Photograph>& photographs,
                 const Options& options)
    : weights_(start),
      gradient_(start.shape),
      batch_(options.batch),
      training_(start.shape, options.batch, options.common.optimize),
      sampler_(photographs, options.common.seed),
      adam_(adam_groups(start.shape, options.common.optimize),
            {.schedule = apps::exponential_schedule(options.common.steps, last_rate_factor)}),
      loss_(lang::Buffer<float>::make_scalar()) {
  training_.compile(options.common.threads);
  std::fill(gradient_.values.begin(), gradient_.values.end(), 0.0f);
  weights_.bind(training_.objective.model.parameters);
}

double Trainer::step() {
  training_.objective.bind(sampler_.draw(weights_.shape, batch_));
  std::vector<lang::Buffer<>> outputs{loss_};
  for (Array array : training_.learned) outputs.push_back(gradient_.buffer(array));
  training_.pipeline.realize(lang::Realization(outputs));
  const double loss = loss_();
  adam_.step(std::span<float>(weights_.values), loss, std::span<const float>(gradient_.values));
  return loss;
}

void Trainer::save(apps::State& state) {
  state.put("weights", weights_.values);
  state.put("random", sampler_.random());
  adam_.save(state, "adam");
}

void Trainer::restore(const apps::State& state) {
  state.get("weights", std::span<float>(weights_.values));
  state.get("random", sampler_.random());
  adam_.restore(state, "adam");
}

}  // namespace demosaic
