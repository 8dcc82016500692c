// control.cpp -- see control.h.
#include "control.h"

#include <algorithm>
#include <array>
#include <utility>

#include "checkpoints.h"

namespace fluid {

template <typename T>
Control<T>::Control(const Scene& scene, int slots)
    : scene_(scene),
      variables_(scene),
      simulation_(scene),
      physics_(scene.physics),
      force_(static_cast<size_t>(scene.frames) * scene.shape.force_elems()),
      by_force_(scene.shape.force_elems()),
      now_(scene.shape),
      next_(scene.shape),
      seed_(scene.shape),
      before_(scene.shape) {
  std::copy(scene.force.begin(), scene.force.end(), force_.begin());
  kept_.push_back(start_state<T>(scene));
  keep_states(slots);
}

template <typename T>
void Control<T>::keep_states(int slots) {
  const int wanted = std::clamp(slots, 1, scene_.frames);
  while (this->slots() > wanted) kept_.pop_back();
  while (this->slots() < wanted) kept_.emplace_back(scene_.shape);
  kept_.shrink_to_fit();
}

template <typename T>
void Control<T>::start_from(const Physics& physics, bool logarithms) {
  scene_.physics = physics;
  variables_ = Variables(scene_, logarithms);
}

template <typename T>
void Control<T>::compile() {
  simulation_.compile();
  now_.copy_from(kept_[0]);
  turn_around(0);
  std::array<double, 3> by_physics{};
  simulation_.reverse(physics_, now_, force_of(0), seed_, before_, by_force_.data(), by_physics);
}

template <typename T>
void Control<T>::take(std::span<const double> x) {
  physics_ = variables_.physics(x);
  std::transform(x.begin(), x.begin() + static_cast<long>(variables_.force_size()), force_.begin(),
                 [](double f) { return static_cast<T>(f); });
}

// Uses the force as rounded for the simulation, so that the gradient is that of the computed loss.
template <typename T>
double Control<T>::effort(std::span<double> gradient) const {
  const size_t size = variables_.force_size();
  if (size == 0) return 0;
  const double weight = scene_.effort / static_cast<double>(size);
  double sum = 0;
  for (size_t n = 0; n < size; ++n) {
    const double f = force_[n];
    sum += f * f;
    if (!gradient.empty()) gradient[n] += 2 * weight * f;
  }
  return weight * sum;
}

template <typename T>
double Control<T>::loss(std::span<const double> x) {
  play(x, [](const State<T>&) {});
  const auto distance = simulation_.compare(now_);
  difference_ = distance.difference;
  return distance.loss + effort({});
}

// The last frame: computes the loss from the current state, and the adjoint of that state.
template <typename T>
double Control<T>::turn_around(int frame) {
  simulation_.advance(physics_, now_, force_of(frame), next_);
  seed_.x.fill(0);
  seed_.y.fill(0);
  const auto distance = simulation_.compare(next_, seed_.density);
  difference_ = distance.difference;
  return distance.loss;
}

template <typename T>
double Control<T>::loss(std::span<const double> x, std::span<double> gradient) {
  if (gradient.empty()) return loss(x);
  take(x);
  std::fill(gradient.begin(), gradient.end(), 0.0);
  std::array<double, 3> by_physics{};
  double found = effort(gradient);
  const bool wants_force = variables_.force_size() > 0;
  run_backward(scene_.frames, slots(), [&](const Action& action) {
    switch (action.kind) {
      case Action::Kind::Load:
        now_.copy_from(kept_[action.slot]);
        break;
      case Action::Kind::Save:
        kept_[action.slot].copy_from(now_);
        break;
      case Action::Kind::Advance:
        simulation_.advance(physics_, now_, force_of(action.frame), next_);
        std::swap(now_, next_);
        break;
      case Action::Kind::Reverse:
        if (action.frame == scene_.frames - 1) found += turn_around(action.frame);
        simulation_.reverse(physics_, now_, force_of(action.frame), seed_, before_,
                            by_force_.data(), by_physics);
        std::swap(seed_, before_);
        if (!wants_force) break;
        for (size_t n = 0; n < by_force_.size(); ++n) {
          gradient[action.frame * by_force_.size() + n] += by_force_[n];
        }
        break;
    }
  });
  variables_.add_gradient(x, by_physics, gradient);
  return found;
}

template <typename T>
void Control<T>::play(std::span<const double> x, const std::function<void(const State<T>&)>& show) {
  take(x);
  now_.copy_from(kept_[0]);
  show(now_);
  for (int frame = 0; frame < scene_.frames; ++frame) {
    simulation_.advance(physics_, now_, force_of(frame), next_);
    std::swap(now_, next_);
    show(now_);
  }
}

template class Control<float>;
template class Control<double>;

}  // namespace fluid
