// trainer.cpp -- see trainer.h. Compiled once with each language.
#include "trainer.h"

#include <cmath>
#include <vector>

namespace bilateral_slice {

Trainer::State Trainer::zeros(const std::vector<int>& sizes) {
  State state;
  for (Moments& copy : state) {
    for (Buffer* buffer : {&copy.value, &copy.moment, &copy.square}) {
      *buffer = Buffer(sizes);
      buffer->fill(0.0f);
    }
  }
  return state;
}

Trainer::Trainer(const Shape& shape, float* photo, float* target, int threads)
    : training_(shape),
      photo_(photo, shape.width, shape.height, 4),
      target_(target, shape.width, shape.height, 3),
      loss_(Buffer::make_scalar()),
      grid_(zeros({4, 3, shape.grid_z, shape.grid_x, shape.grid_y})),
      mix_(zeros({4})),
      curve_(zeros({shape.knots})) {
  schedule(training_, threads);
  training_.model.photo.set(photo_);
  training_.model.target.set(target_);
  start_from_identity();
}

void Trainer::start_from_identity() {
  Buffer& grid = grid_[0].value;
  grid.for_each_element(
      [&](int i, int o, int gz, int gx, int gy) { grid(i, o, gz, gx, gy) = i == o ? 1.0f : 0.0f; });
  for (int i = 0; i < 3; ++i) mix_[0].value(i) = 1.0f / 3.0f;
  curve_[0].value(0) = 1.0f;
}

void Trainer::set_pair(float* photo, float* target) {
  const Shape& shape = training_.model.shape;
  photo_ = Buffer(photo, shape.width, shape.height, 4);
  target_ = Buffer(target, shape.width, shape.height, 3);
  training_.model.photo.set(photo_);
  training_.model.target.set(target_);
}

std::vector<Trainer::Buffer> Trainer::state() const {
  std::vector<Buffer> all;
  for (const State* state : {&grid_, &mix_, &curve_}) {
    const Moments& now = (*state)[now_];
    all.insert(all.end(), {now.value, now.moment, now.square});
  }
  return all;
}

void Trainer::bind(Learned& learned, const State& state) {
  learned.value.set(state[now_].value);
  learned.moment.set(state[now_].moment);
  learned.square.set(state[now_].square);
}

double Trainer::step(float rate) {
  ++steps_;
  training_.rate.set(rate);
  training_.m_scale.set(static_cast<float>(1.0 / (1.0 - std::pow(0.9, steps_))));
  training_.v_scale.set(static_cast<float>(1.0 / (1.0 - std::pow(0.999, steps_))));
  bind(training_.grid, grid_);
  bind(training_.mix, mix_);
  bind(training_.curve, curve_);
  const Moments &g = grid_[1 - now_], &m = mix_[1 - now_], &c = curve_[1 - now_];
  std::vector<lang::Buffer<>> outputs{loss_,    g.value,  g.moment, g.square, m.value,
                                      m.moment, m.square, c.value,  c.moment, c.square};
  training_.pipeline.realize(lang::Realization(outputs));
  now_ = 1 - now_;
  return loss_();
}

}  // namespace bilateral_slice
