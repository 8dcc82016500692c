// training_pipeline.cpp -- see training_pipeline.h. Compiled once with each language.
#include "training_pipeline.h"

#include <string>
#include <utility>

namespace bilateral_slice {

using lang::Expr;

namespace {
// Kingma and Ba's constants. `tiny` lies between the gradients (1e-7 to 1e-4 per grid node, because the loss is a mean
// over all samples) and their rounding errors, which must not move anything.
constexpr float b1 = 0.9f, b2 = 0.999f, tiny = 1e-8f;
// The guide shifts the depth of every pixel at once, so it learns more slowly than a grid node.
constexpr float guide_rate = 0.1f;
}  // namespace

Learned::Learned(const lang::ImageParam& value, const lang::Func& gradient,
                 std::vector<lang::Var> at, float rate)
    : value(value),
      moment(value.type(), value.dimensions(), value.name() + "_moment"),
      square(value.type(), value.dimensions(), value.name() + "_square"),
      gradient(gradient),
      at(std::move(at)),
      rate(rate),
      next(value.name() + "_next") {}

TrainingPipeline::TrainingPipeline(const Shape& shape, const Groups& moves)
    : model(shape, lang::Float(32)), adjoints(model.adjoints(moves)) {
  const Model& m = model;
  if (moves.grid) grid = learn(m.grid, m.affine, {m.i, m.o, m.gz, m.gx, m.gy}, 1);
  if (moves.mix) mix = learn(m.mix, m.mixture, {m.i}, guide_rate);
  if (moves.curve) curve = learn(m.curve, m.slopes, {m.k}, guide_rate);
  std::vector<lang::Func> outputs{m.loss};
  for (const auto* learned : {&grid, &mix, &curve}) {
    if (*learned) outputs.push_back((*learned)->next);
  }
  pipeline = lang::Pipeline(outputs);
}

Learned TrainingPipeline::learn(const lang::ImageParam& value, const lang::Func& parameter,
                                std::vector<lang::Var> variables, float rate_factor) {
  Learned learned(value, adjoints(parameter), std::move(variables), rate_factor);
  const auto& at = learned.at;
  const Expr g = learned.gradient(at);
  const Expr m = b1 * learned.moment(at) + (1 - b1) * g;
  const Expr v = b2 * learned.square(at) + (1 - b2) * g * g;
  const Expr move = m * m_scale / (lang::sqrt(v * v_scale) + tiny);
  learned.next(at) = lang::Tuple(learned.value(at) - learned.rate * rate * move, m, v);
  return learned;
}

}  // namespace bilateral_slice
