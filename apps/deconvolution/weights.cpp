// weights.cpp -- see weights.h.
#include "weights.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "cleaning.h"
#include "common/files.h"
#include "common/weight_files.h"

namespace deconvolution {

namespace {

constexpr const char *learned_name = "learned.json", *tuned_name = "tuned.json";
constexpr int derivatives = 5, first_derivatives = 2;
// A threshold far above all derivatives of samples in [0, 1], so that shrinkage removes them completely.
constexpr double no_derivative = 1e4;
// Initially, cosines have less weight than derivatives, which by themselves are a good start.
constexpr double cosine_share = 0.1;
constexpr double most_filters = 256, most_size = 15, most_bumps = 32, most_stages = 64;

struct Tap {
  int u, v;
  double value;
};

const std::vector<std::vector<Tap>>& derivative_taps() {
  const double half = 0.5, one = 1 / std::numbers::sqrt2, two = 2 / std::numbers::sqrt2;
  const double mixed = std::numbers::sqrt2;
  static const std::vector<std::vector<Tap>> taps{
      {{-1, 0, -half}, {1, 0, half}},
      {{0, -1, -half}, {0, 1, half}},
      {{-1, 0, -one}, {0, 0, two}, {1, 0, -one}},
      {{0, -1, -one}, {0, 0, two}, {0, 1, -one}},
      {{0, 0, -mixed}, {1, 0, mixed}, {0, 1, mixed}, {1, 1, -mixed}}};
  return taps;
}

void set_derivative(Weights& weights, int stage, int f) {
  const int middle = weights.shape.size / 2;
  for (const Tap& tap : derivative_taps()[static_cast<size_t>(f)]) {
    weights.filter(stage, f, middle + tap.u, middle + tap.v) = static_cast<float>(tap.value);
  }
}

// The n-th basis function of the discrete cosine transform, ordered by the sum of its frequencies, without the constant
// one.
std::pair<int, int> wave(int n, int size) {
  int sum = 1, along = 0;
  for (;; ++sum, along = 0) {
    for (; along <= sum; ++along) {
      if (along >= size || sum - along >= size) continue;
      if (n-- == 0) return {along, sum - along};
    }
  }
}

void set_cosine(Weights& weights, int stage, int f) {
  const int size = weights.shape.size;
  const auto [a, b] = wave((f - derivatives) % (size * size - 1), size);
  const auto value = [&](int frequency, int at) {
    const double scale = std::sqrt((frequency == 0 ? 1.0 : 2.0) / size);
    return scale * std::cos(std::numbers::pi * frequency * (at + 0.5) / size);
  };
  for (int v = 0; v < size; ++v) {
    for (int u = 0; u < size; ++u) {
      weights.filter(stage, f, u, v) = static_cast<float>(value(a, u) * value(b, v));
    }
  }
}

void set_smoothing(Weights& weights, int stage, double mix) {
  const auto smoothing = weights.of(stage, Array::Smoothing);
  smoothing[0] = static_cast<float>(mix);
  smoothing[1] = smoothing[2] = static_cast<float>(usual_blur);
}

// d (1 - exp(-d^2 / 2 tau^2)) with the width that best approximates a threshold.
void set_mixture(Weights& weights, int stage, int f, double threshold) {
  const auto numbers = weights.of(stage, Array::Shrinkage);
  const int each = 1 + weights.shape.bumps;
  int nearest = 0;
  for (int j = 1; j < weights.shape.bumps; ++j) {
    if (std::abs(std::log(bump_width(j) / threshold)) <
        std::abs(std::log(bump_width(nearest) / threshold)))
      nearest = j;
  }
  const auto at = [&](int j) -> float& { return numbers[static_cast<size_t>(f * each + j)]; };
  at(0) = 1;
  at(1 + nearest) = -1;
}

void require_shape(const apps::WeightFile& file, const Shape& s, int stages) {
  if (s.filters >= 1 && s.filters <= most_filters && s.size >= 1 && s.size <= most_size &&
      s.size % 2 == 1 && s.bumps >= 0 && s.bumps <= most_bumps && stages >= 1 &&
      stages <= most_stages)
    return;
  file.refuse(retrograde::text("it has ", stages, " stages of ", s.filters, " filters of size ",
                               s.size, " and ", s.bumps, " bumps"));
}

Weights shipped(const char* name) {
  return read_weights(apps::shipped_weights_path("deconvolution", name));
}

}  // namespace

std::string name_of(Array array) { return group_names[static_cast<size_t>(array)]; }

std::vector<Array> arrays_of(const std::vector<std::string>& groups) {
  std::vector<Array> arrays;
  for (const Array array : all_arrays) {
    if (std::find(groups.begin(), groups.end(), name_of(array)) != groups.end())
      arrays.push_back(array);
  }
  return arrays;
}

Weights::Weights(const Shape& shape, int stages)
    : shape(shape), stages(stages), values(elements_of(shape) * static_cast<size_t>(stages)) {}

std::span<float> Weights::of(int stage) {
  const size_t each = elements_of(shape);
  return std::span(values).subspan(static_cast<size_t>(stage) * each, each);
}

std::span<const float> Weights::of(int stage) const {
  const size_t each = elements_of(shape);
  return std::span(values).subspan(static_cast<size_t>(stage) * each, each);
}

std::span<float> Weights::of(int stage, Array array) {
  size_t from = 0;
  for (const Array before : all_arrays) {
    if (before == array) break;
    from += elements_of(shape, before);
  }
  return of(stage).subspan(from, elements_of(shape, array));
}

float& Weights::filter(int stage, int f, int u, int v) {
  return of(stage, Array::Filters)[static_cast<size_t>((f * shape.size + v) * shape.size + u)];
}

Weights original(const Priors& priors) {
  Weights weights({.filters = derivatives, .size = 3, .bumps = 0}, 2);
  for (int stage = 0; stage < 2; ++stage) {
    for (int f = 0; f < derivatives; ++f) {
      set_derivative(weights, stage, f);
      const auto n = static_cast<size_t>(f);
      const double threshold =
          f < first_derivatives ? priors.first_threshold : priors.second_threshold;
      weights.of(stage, Array::LogWeights)[n] =
          static_cast<float>(std::log(stage == 0 ? priors.first_weight : priors.second_weight));
      weights.of(stage, Array::Shrinkage)[n] =
          static_cast<float>(stage == 0 ? no_derivative : threshold);
    }
    set_smoothing(weights, stage, stage == 0 ? 0 : priors.mix);
  }
  return weights;
}

Weights learning_start(const Shape& shape, int stages) {
  constexpr Priors priors{.first_weight = 0.002, .second_weight = 0.01};
  constexpr double threshold = 0.03;
  Weights weights(shape, stages);
  for (int stage = 0; stage < stages; ++stage) {
    const double weight = stage == 0 ? priors.first_weight : priors.second_weight;
    for (int f = 0; f < shape.filters; ++f) {
      const bool cosine = f >= derivatives;
      cosine ? set_cosine(weights, stage, f) : set_derivative(weights, stage, f);
      weights.of(stage, Array::LogWeights)[static_cast<size_t>(f)] =
          static_cast<float>(std::log(cosine ? cosine_share * weight : weight));
      if (stage > 0) set_mixture(weights, stage, f, threshold);
    }
    set_smoothing(weights, stage, stage == 0 ? 0 : 0.5);
  }
  return weights;
}

void write_weights(const std::filesystem::path& path, const Weights& weights,
                   const std::string& origin) {
  Weights of = weights;
  nlohmann::json json{{"filters", of.shape.filters},
                      {"size", of.shape.size},
                      {"bumps", of.shape.bumps},
                      {"origin", origin},
                      {"stages", nlohmann::json::array()}};
  for (int stage = 0; stage < of.stages; ++stage) {
    nlohmann::json arrays;
    for (const Array array : all_arrays)
      arrays[name_of(array)] = apps::array_of_weights(of.of(stage, array));
    json["stages"].push_back(arrays);
  }
  apps::write_file(path, json.dump() + "\n");
}

Weights read_weights(const std::filesystem::path& path) {
  const apps::WeightFile file("deconvolution", path);
  return file.parse([&](const nlohmann::json& json) {
    const Shape shape{json.at("filters").get<int>(), json.at("size").get<int>(),
                      json.at("bumps").get<int>()};
    const nlohmann::json& stages = json.at("stages");
    const auto count = static_cast<int>(stages.size());
    require_shape(file, shape, count);
    Weights weights(shape, count);
    for (int stage = 0; stage < count; ++stage) {
      for (const Array array : all_arrays) {
        file.read_array(stages[static_cast<size_t>(stage)], name_of(array),
                        weights.of(stage, array));
      }
    }
    return weights;
  });
}

Weights learned_weights() { return shipped(learned_name); }
Weights tuned_weights() { return shipped(tuned_name); }

}  // namespace deconvolution
