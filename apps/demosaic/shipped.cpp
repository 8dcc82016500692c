#include "shipped.h"

#include <filesystem>

#include "common/weight_files.h"

namespace demosaic {

namespace {

std::filesystem::path place_of(const Shape& shape) {
  return apps::shipped_weights_path("demosaic", weights_file(shape));
}

}  // namespace

std::vector<Shape> shipped_shapes() {
  std::vector<Shape> shapes;
  for (const int filters : {2, 9, 15}) {
    for (const int size : {5, 7}) {
      const Shape shape{filters, size};
      if (std::filesystem::exists(place_of(shape))) shapes.push_back(shape);
    }
  }
  return shapes;
}

std::string weights_file(const Shape& shape) {
  return retrograde::text("relaxed_", shape.filters, "_", shape.size, ".json");
}

Weights shipped_weights(const Shape& shape) { return read_weights(place_of(shape)); }

}  // namespace demosaic
