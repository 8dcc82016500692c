#include "run_gen/inputs.h"

#include <charconv>
#include <cstring>
#include <random>

namespace retrograde::run_gen {

namespace {

bool read_shape(const std::string& text, BufferSpec& spec) {
  if (text.empty()) return false;
  if (text.front() == '[') {
    spec.extents = read_extents(text);
    return true;
  }
  spec.from_estimate = text == "estimate" || text == "estimate_then_auto";
  spec.from_query = text == "auto" || text == "estimate_then_auto";
  return spec.from_estimate || spec.from_query;
}

bool read_seed(const std::string& text, uint64_t& seed) {
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, seed);
  return error == std::errc() && stop == end;
}

template <typename T>
T random_value(std::mt19937_64& random) {
  if constexpr (std::is_floating_point_v<T>) return std::uniform_real_distribution<T>(0, 1)(random);
  return static_cast<T>(std::is_same_v<T, bool> ? random() & 1 : random());
}

// 1 for elements whose first two coordinates are equal, else 0.
template <typename T>
void fill_identity(Halide::Runtime::Buffer<T>& image) {
  image.for_each_element([&](const int* at) {
    const bool is_one =
        image.dimensions() < 2 ? image.dimensions() == 0 || at[0] == 0 : at[0] == at[1];
    image(at) = static_cast<T>(is_one);
  });
}

}  // namespace

BufferSpec read_buffer_spec(const std::string& text) {
  using Kind = BufferSpec::Kind;
  BufferSpec spec;
  const std::vector<std::string> parts = split(text, ':');
  const Problem problem("\"" + text + "\" is not an input; see --help");
  if (parts.size() == 1 && (text.front() == '[' || text == "auto" || text == "estimate" ||
                            text == "estimate_then_auto")) {
    spec.kind = Kind::Random;
    read_shape(text, spec);
  } else if ((parts[0] == "zero" || parts[0] == "identity") && parts.size() == 2) {
    spec.kind = parts[0] == "zero" ? Kind::Zero : Kind::Identity;
    if (!read_shape(parts[1], spec)) throw problem;
  } else if ((parts[0] == "constant" || parts[0] == "random") && parts.size() == 3) {
    spec.kind = parts[0] == "constant" ? Kind::Constant : Kind::Random;
    spec.constant = parts[1];
    if (spec.kind == Kind::Random && !read_seed(parts[1], spec.seed)) throw problem;
    if (!read_shape(parts[2], spec)) throw problem;
  } else {
    spec.path = text;
  }
  return spec;
}

Shape estimated_shape(const halide_filter_argument_t& argument) {
  Shape shape;
  if (!argument.buffer_estimates) return shape;
  for (int d = 0; d < argument.dimensions; d++) {
    const int64_t* min = argument.buffer_estimates[2 * d];
    const int64_t* extent = argument.buffer_estimates[2 * d + 1];
    if (!min || !extent) return {};
    shape.mins.push_back(static_cast<int>(*min));
    shape.extents.push_back(static_cast<int>(*extent));
  }
  return shape;
}

void fill(Image& image, const BufferSpec& spec) {
  using Kind = BufferSpec::Kind;
  with_type(image.type(), [&](auto element) {
    using T = decltype(element);
    auto& values = image.as<T>();
    if (spec.kind == Kind::Identity) return fill_identity(values);
    std::mt19937_64 random(spec.seed);
    T constant{};
    if (spec.kind == Kind::Constant) {
      const halide_scalar_value_t value = read_scalar(image.type(), spec.constant);
      std::memcpy(&constant, &value, sizeof constant);
    }
    values.for_each_value(
        [&](T& out) { out = spec.kind == Kind::Random ? random_value<T>(random) : constant; });
  });
}

}  // namespace retrograde::run_gen
