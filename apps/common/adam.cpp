// adam.cpp -- see adam.h.
#include "common/adam.h"

#include <algorithm>
#include <cmath>

#include "diagnostics/error.h"

namespace apps {

std::function<double(long)> exponential_schedule(long steps, double last) {
  return [steps, last](long step) {
    return std::pow(last, static_cast<double>(step) / static_cast<double>(std::max(steps - 1, 1L)));
  };
}

Adam::Adam(std::vector<AdamGroup> groups, AdamOptions options)
    : groups_(std::move(groups)), options_(std::move(options)) {
  size_t size = 0;
  for (const AdamGroup& group : groups_) size += group.size;
  first_.assign(size, 0.0);
  second_.assign(size, 0.0);
}

bool Adam::step(std::span<double> x, double loss, std::span<const double> gradient) {
  return step_of(x, loss, gradient);
}

bool Adam::step(std::span<float> x, double loss, std::span<const float> gradient) {
  return step_of(x, loss, gradient);
}

double Adam::rate_factor() const {
  return halvings_ * (options_.schedule ? options_.schedule(steps_) : 1.0);
}

template <typename T>
bool Adam::step_of(std::span<T> x, double loss, std::span<const T> gradient) {
  RETROGRADE_ASSERT(x.size() == first_.size() && gradient.size() == first_.size(),
                    "Adam is one of ", first_.size(), " numbers");
  if (options_.safeguard) {
    const bool explodes = lowest_ > 0 && loss > options_.explosion * lowest_;
    const bool finite = std::isfinite(loss) && !explodes &&
                        std::all_of(gradient.begin(), gradient.end(),
                                    [](T g) { return std::isfinite(static_cast<double>(g)); });
    if (!finite) {
      refuse(x);
      return false;
    }
    before_.assign(x.begin(), x.end());
    lowest_ = std::min(lowest_, loss);
  }
  const double factor = rate_factor();
  const auto t = static_cast<double>(++steps_);
  const double first_weight = 1 / (1 - std::pow(options_.beta1, t));
  const double second_weight = 1 / (1 - std::pow(options_.beta2, t));
  size_t n = 0;
  for (const AdamGroup& group : groups_) {
    const double rate = factor * group.rate;
    for (const size_t end = n + group.size; n < end; ++n) {
      const double g = gradient[n];
      first_[n] = options_.beta1 * first_[n] + (1 - options_.beta1) * g;
      second_[n] = options_.beta2 * second_[n] + (1 - options_.beta2) * g * g;
      const double scale = std::sqrt(second_[n] * second_weight) + options_.epsilon;
      x[n] = static_cast<T>(x[n] - rate * first_[n] * first_weight / scale);
    }
  }
  return true;
}

template <typename T>
void Adam::refuse(std::span<T> x) {
  ++refused_;
  halvings_ /= 2;
  for (double& m : first_) m /= 2;
  for (size_t n = 0; n < before_.size(); ++n) x[n] = static_cast<T>(before_[n]);
}

void Adam::save(State& state, const std::string& name) const {
  state.arrays[name + ".first"] = first_;
  state.arrays[name + ".second"] = second_;
  state.arrays[name + ".before"] = before_.empty() ? first_ : before_;
  state.arrays[name + ".counts"] = {static_cast<double>(steps_), static_cast<double>(refused_),
                                    halvings_, lowest_};
}

void Adam::restore(const State& state, const std::string& name) {
  const std::vector<double>& counts = state.array(name + ".counts", 4);
  first_ = state.array(name + ".first", first_.size());
  second_ = state.array(name + ".second", second_.size());
  if (counts[0] > 0) before_ = state.array(name + ".before", first_.size());
  steps_ = static_cast<long>(counts[0]);
  refused_ = static_cast<long>(counts[1]);
  halvings_ = counts[2];
  lowest_ = counts[3];
}

}  // namespace apps
