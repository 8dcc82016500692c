// trainer.cpp -- see trainer.h. Compiled once with each language.
#include "trainer.h"

#include <cmath>
#include <vector>

namespace bilateral_slice {

Trainer::State Trainer::zeros(const std::vector<int>& sizes, bool moves) {
  const auto zero = [&] {
    Buffer buffer(sizes);
    buffer.fill(0.0f);
    return buffer;
  };
  if (!moves) {
    const Moments fixed{zero(), {}, {}};
    return {fixed, fixed};
  }
  State state;
  for (Moments& copy : state) copy = {zero(), zero(), zero()};
  return state;
}

Trainer::Trainer(const Shape& shape, float* photo, float* target, int threads, const Groups& moves)
    : training_(shape, moves),
      loss_(Buffer::make_scalar()),
      grid_(zeros({shape.coefficients(), shape.channels, shape.grid_z, shape.grid_x, shape.grid_y},
                  moves.grid)),
      mix_(zeros({shape.coefficients()}, moves.mix)),
      curve_(zeros({shape.knots}, moves.curve)) {
  schedule(training_, threads);
  set_pair(photo, target);
  start_from_identity();
}

void Trainer::start_from_identity() {
  Buffer& grid = grid_[0].value;
  grid.for_each_element(
      [&](int i, int o, int gz, int gx, int gy) { grid(i, o, gz, gx, gy) = i == o ? 1.0f : 0.0f; });
  const int channels = shape().channels;
  for (int i = 0; i < channels; ++i) mix_[0].value(i) = 1.0f / static_cast<float>(channels);
  curve_[0].value(0) = 1.0f;
}

void Trainer::set_pair(float* photo, float* target) {
  const Shape& sizes = shape();
  photo_ = Buffer(photo, sizes.width, sizes.height, sizes.coefficients());
  target_ = Buffer(target, sizes.width, sizes.height, sizes.channels);
  training_.model.photo.set(photo_);
  training_.model.target.set(target_);
}

Groups Trainer::moves() const {
  return {training_.grid.has_value(), training_.mix.has_value(), training_.curve.has_value()};
}

std::vector<Trainer::Buffer> Trainer::state() const {
  std::vector<Buffer> all;
  for (const State* state : {&grid_, &mix_, &curve_}) {
    const Moments& now = (*state)[now_];
    all.insert(all.end(), {now.value, now.moment, now.square});
  }
  return all;
}

void Trainer::bind(lang::ImageParam& value, std::optional<Learned>& learned, const State& state) {
  value.set(state[now_].value);
  if (!learned) return;
  learned->moment.set(state[now_].moment);
  learned->square.set(state[now_].square);
}

double Trainer::step(float rate) {
  ++steps_;
  training_.rate.set(rate);
  training_.m_scale.set(static_cast<float>(1.0 / (1.0 - std::pow(0.9, steps_))));
  training_.v_scale.set(static_cast<float>(1.0 / (1.0 - std::pow(0.999, steps_))));
  Model& model = training_.model;
  bind(model.grid, training_.grid, grid_);
  bind(model.mix, training_.mix, mix_);
  bind(model.curve, training_.curve, curve_);
  std::vector<lang::Buffer<>> outputs{loss_};
  for (const State* state : {&grid_, &mix_, &curve_}) {
    const Moments& next = (*state)[1 - now_];
    if (next.moment.defined())
      outputs.insert(outputs.end(), {next.value, next.moment, next.square});
  }
  training_.pipeline.realize(lang::Realization(outputs));
  now_ = 1 - now_;
  return loss_();
}

}  // namespace bilateral_slice
