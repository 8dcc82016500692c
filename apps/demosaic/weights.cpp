#include "weights.h"

#include <array>
#include <iterator>
#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/weight_files.h"

namespace demosaic {

namespace {

constexpr std::array<const char*, all_arrays.size()> array_names{
    "green", "closeness", "selection", "cross", "bias", "chroma", "near", "steepness"};

// The square root of 1/25: nine neighbours together have about a third of the weight of the difference itself.
constexpr float first_near = 0.2f;

size_t start_of(const Shape& shape, Array array) {
  size_t start = 0;
  for (Array before : all_arrays) {
    if (before == array) break;
    start += elements_of(shape, before);
  }
  return start;
}

// A filter around a red or blue sample: the green on one side, plus half of the second difference of the samples of its
// own colour on that side.
struct Side {
  int dx, dy;
};

// The sides that a candidate averages, and whether it uses its own colour.
struct Start {
  std::vector<Side> sides;
  bool corrected = true;
};

const std::vector<Start>& starts() {
  constexpr Side left{-1, 0}, right{1, 0}, up{0, -1}, down{0, 1};
  static const std::vector<Start> list{{{left, right}},
                                       {{up, down}},
                                       {{left, right, up, down}},
                                       {{left}},
                                       {{right}},
                                       {{up}},
                                       {{down}},
                                       {{left, up}},
                                       {{right, up}},
                                       {{left, down}},
                                       {{right, down}},
                                       {{left, right}, false},
                                       {{up, down}, false},
                                       {{left, right, up, down}, false},
                                       {{left, right, up}}};
  return list;
}

}  // namespace

std::string group_of(Array array) {
  if (array == Array::Green) return "green";
  const bool colour = array == Array::Chroma || array == Array::Near || array == Array::Steepness;
  return colour ? "chroma" : "selection";
}

std::string name_of(Array array) { return array_names[static_cast<size_t>(array)]; }

Weights::Weights(const Shape& shape) : shape(shape) {
  values.assign(start_of(shape, Array::Steepness) + elements_of(shape, Array::Steepness), 0.0f);
  start_green();
  for (Array array : {Array::Closeness, Array::Selection, Array::Steepness}) {
    for (float& value : of(array)) value = 1;
  }
  for (float& value : of(Array::Near)) value = first_near;
  start_cross();
  start_chroma();
}

std::span<float> Weights::of(Array array) {
  return std::span(values).subspan(start_of(shape, array), elements_of(shape, array));
}

lang::Buffer<float> Weights::buffer(Array array) {
  return lang::Buffer<float>(of(array).data(), sizes_of(shape, array));
}

void Weights::bind(Parameters& parameters) {
  for (Array array : all_arrays) parameters.of(array).set(buffer(array));
}

void Weights::start_green() {
  lang::Buffer<float> green = buffer(Array::Green);
  const int middle = shape.size / 2;
  for (int i = 0; i < shape.filters; ++i) {
    const Start& start = starts()[static_cast<size_t>(i) % starts().size()];
    const float part = 1.0f / static_cast<float>(start.sides.size());
    for (int q = 0; q < 2; ++q) {
      for (const Side& side : start.sides) {
        green(middle + side.dx, middle + side.dy, i, q) += part;
        if (!start.corrected) continue;
        green(middle, middle, i, q) += part / 2;
        green(middle + 2 * side.dx, middle + 2 * side.dy, i, q) -= part / 2;
      }
    }
  }
}

// Initially, a candidate's score depends only on its own `seen`.
void Weights::start_cross() {
  lang::Buffer<float> cross = buffer(Array::Cross);
  cross.for_each_element(
      [&](int of, int d, int i, int q) { cross(of, d, i, q) = of == i ? 1.0f : 0.0f; });
}

// Averages the differences of the other colour at the nearest positions: of lattice `from`, at the cells in the given
// ranges of offsets along x and y, inclusive.
void Weights::start_chroma() {
  lang::Buffer<float> chroma = buffer(Array::Chroma);
  const auto average = [&](int t, int from, int x0, int x1, int y0, int y1) {
    const float part = 1.0f / static_cast<float>((x1 - x0 + 1) * (y1 - y0 + 1));
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) chroma(2 + x, 2 + y, from, t) = part;
    }
  };
  average(0, 0, 0, 0, 0, 0);  // at a site: its own
  average(1, 1, 0, 0, 0, 0);
  average(2, 1, -1, 0, -1, 0);  // blue at red: four blue samples around
  average(3, 0, 0, 1, 0, 1);    // red at blue
  average(4, 0, 0, 1, 0, 0);    // red at the green beside red
  average(5, 1, 0, 0, -1, 0);   // blue there: above and below
  average(6, 0, 0, 0, 0, 1);    // red at the green beside blue
  average(7, 1, -1, 0, 0, 0);   // blue there
}

void write_weights(const std::filesystem::path& path, Weights& weights, const std::string& origin) {
  nlohmann::json json;
  json["filters"] = weights.shape.filters;
  json["size"] = weights.shape.size;
  json["origin"] = origin;
  for (Array array : all_arrays) json[name_of(array)] = apps::array_of_weights(weights.of(array));
  apps::write_file(path, json.dump() + "\n");
}

Weights read_weights(const std::filesystem::path& path) {
  const apps::WeightFile file("demosaic", path);
  return file.parse([&](const nlohmann::json& json) {
    const Shape shape{json.at("filters").get<int>(), json.at("size").get<int>()};
    if (shape.filters < 1 || shape.filters > 64 || (shape.size != 5 && shape.size != 7)) {
      file.refuse(retrograde::text("it has ", shape.filters, " filters of size ", shape.size));
    }
    Weights weights(shape);
    for (Array array : all_arrays) file.read_array(json, name_of(array), weights.of(array));
    return weights;
  });
}

}  // namespace demosaic
