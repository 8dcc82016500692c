// training.cpp -- see training.h.
#include "training.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "diagnostics/error.h"

namespace deconvolution {

using retrograde::text;

namespace {

constexpr double last_rate_factor = 0.02;
constexpr double apart_share = 0.25;  // share of the steps in which each stage is learned by itself
// Ranges for a piece's noise, and for the functions that blur it.
constexpr double least_noise = 0.005, most_noise = 0.02;
constexpr double motion_share = 0.65, least_radius = 1.5;
constexpr int least_path = 9;

// Adam's rates of filters, logarithms of weights, shrinkage and smoothing: weights are exponents, filters have a norm of
// about one.
constexpr std::array<double, all_arrays.size()> rates{5e-3, 2e-2, 1e-2, 3e-3};

std::vector<apps::AdamGroup> adam_groups(const Weights& weights,
                                         const std::vector<std::string>& groups) {
  std::vector<apps::AdamGroup> result;
  const auto moving = arrays_of(groups);
  for (int stage = 0; stage < weights.stages; ++stage) {
    for (const Array array : all_arrays) {
      const bool moves = std::find(moving.begin(), moving.end(), array) != moving.end();
      result.push_back(
          {elements_of(weights.shape, array), moves ? rates[static_cast<size_t>(array)] : 0.0});
    }
  }
  return result;
}

// Constant while stages are learned one by one, then falling.
std::function<double(long)> rate_schedule(long steps, long before) {
  return [=, fall = apps::exponential_schedule(steps - before, last_rate_factor)](long step) {
    return step < before ? 1.0 : fall(step - before);
  };
}

}  // namespace

Sampler::Sampler(const std::vector<demosaic::Photograph>& photographs, uint64_t seed)
    : random_(seed) {
  for (const auto& photograph : photographs) {
    planes_.push_back(luma_of(photograph));
    names_.push_back(photograph.name);
  }
}

Plane Sampler::piece(int side) {
  const auto which = static_cast<size_t>(random_.below(static_cast<int>(planes_.size())));
  const Plane& plane = planes_[which];
  if (plane.width < side || plane.height < side) {
    retrograde::call_error(text("learn from ", retrograde::quoted(names_[which])),
                           text("a photograph has a piece of ", side, " x ", side, " pixels"),
                           text("it has ", plane.width, " x ", plane.height),
                           "Give larger photographs");
  }
  Plane part = plane.part(random_.below(plane.width - side + 1),
                          random_.below(plane.height - side + 1), side, side);
  const bool flip_x = random_.below(2) == 1, flip_y = random_.below(2) == 1;
  const bool turned = random_.below(2) == 1;
  Plane result = part;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const int u = flip_x ? side - 1 - x : x, v = flip_y ? side - 1 - y : y;
      result.samples[static_cast<size_t>(y * side + x)] = turned ? part.at(v, u) : part.at(u, v);
    }
  }
  return result;
}

Psf Sampler::psf(int size) {
  if (random_.uniform() < motion_share) {
    const int own = std::min(least_path, size) / 2 * 2 + 1;
    const int grown = own + 2 * random_.below((size - own) / 2 + 1);
    return enlarged(motion_path(std::min(grown, size), random_.engine()()), size);
  }
  const double most = std::max(least_radius, size / 4.0);
  return enlarged(defocus_disc(random_.uniform(least_radius, most)), size);
}

Simulated Sampler::draw(const BatchShape& shape) {
  Simulated batch;
  for (int k = 0; k < shape.pieces; ++k) {
    const Plane sharp = piece(shape.side + 2 * (shape.psf / 2));
    const Psf function = psf(shape.psf);
    const double middle = (random_.uniform() + random_.uniform()) / 2;
    const double noise = least_noise * std::pow(most_noise / least_noise, middle);
    batch.add(sharp, function, noise, random_);
  }
  return batch;
}

long steps_apart(long steps, int stages) {
  return static_cast<long>(apart_share * static_cast<double>(steps) / stages);
}

Range learned_at(long step, long apart, int stages) {
  if (step >= apart * stages) return {0, stages - 1};
  const auto stage = static_cast<int>(step / apart);
  return {stage, stage};
}

Trainer::Trainer(const Weights& start, const std::vector<demosaic::Photograph>& photographs,
                 const Options& options)
    : options_(options),
      apart_(options.from_weights ? 0 : steps_apart(options.common.steps, start.stages)),
      weights_(start),
      gradient_(start.values.size()),
      sampler_(photographs, options.common.seed),
      objective_(std::make_unique<Objective<float>>(start.shape, options.batch.extent(),
                                                    options.common.threads,
                                                    arrays_of(options.common.optimize))),
      adam_(std::make_unique<apps::Adam>(
          adam_groups(start, options.common.optimize),
          apps::AdamOptions{.schedule =
                                rate_schedule(options.common.steps, apart_ * start.stages)})) {
  objective_->set(options.accuracy);
}

// Each stage after the second is initialised with the learned numbers of the previous one.
void Trainer::begin_stage(int stage) {
  if (stage < 2) return;
  const auto from = weights_.of(stage - 1), to = weights_.of(stage);
  std::copy(from.begin(), from.end(), to.begin());
}

double Trainer::step() {
  const Range range = learned_at(step_, apart_, weights_.stages);
  const bool begins = step_ > 0 && range.first == range.last &&
                      range.first != learned_at(step_ - 1, apart_, weights_.stages).first;
  if (begins) begin_stage(range.first);
  objective_->set(sampler_.draw(options_.batch));
  const double loss =
      objective_->evaluate(std::span<const float>(weights_.values), gradient_, range);
  adam_->step(std::span<float>(weights_.values), loss, std::span<const float>(gradient_));
  ++step_;
  return loss;
}

void Trainer::save(apps::State& state) const {
  state.put("weights", weights_.values);
  state.put("random", sampler_.engine());
  adam_->save(state, "adam");
}

void Trainer::restore(const apps::State& state) {
  state.get("weights", std::span<float>(weights_.values));
  state.get("random", sampler_.engine());
  adam_->restore(state, "adam");
  step_ = static_cast<long>(state.step);
}

}  // namespace deconvolution
