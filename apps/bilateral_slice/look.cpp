// look.cpp -- see look.h.
#include "look.h"

#include <algorithm>

#include "common/state.h"
#include "diagnostics/error.h"
#include "render.h"
#include "trainer.h"

namespace bilateral_slice {

namespace {

constexpr const char* look_program = "bilateral_slice look";

std::vector<float> floats(const apps::State& state, const char* name, size_t size) {
  std::vector<float> values(size);
  state.get(name, values);
  return values;
}

lang::Buffer<float> filled(const std::vector<int>& sizes, const std::vector<float>& values) {
  lang::Buffer<float> buffer(sizes);
  std::copy(values.begin(), values.end(), buffer.begin());
  return buffer;
}

}  // namespace

Shape Look::shape(int width, int height) const {
  return {.width = width,
          .height = height,
          .grid_x = grid_x,
          .grid_y = grid_y,
          .grid_z = grid_z,
          .knots = knots,
          .channels = channels};
}

Look look_of(const Shape& shape, const Trainer& trainer) {
  Look look{shape.grid_x, shape.grid_y, shape.grid_z, shape.knots, shape.channels, {}, {}, {}};
  look.grid.assign(trainer.grid().begin(), trainer.grid().end());
  look.mix.assign(trainer.mix().begin(), trainer.mix().end());
  look.curve.assign(trainer.curve().begin(), trainer.curve().end());
  return look;
}

void start_from(const Look& look, Trainer& trainer) {
  const auto set = [](Trainer::Buffer to, const std::vector<float>& values) {
    std::copy(values.begin(), values.end(), to.begin());
  };
  set(trainer.grid(), look.grid);
  set(trainer.mix(), look.mix);
  set(trainer.curve(), look.curve);
}

std::vector<float> through_look(const Look& look, const Shape& photo_shape,
                                std::vector<float>& photo) {
  const Shape shape = look.shape(photo_shape.width, photo_shape.height);
  const std::vector<int> grid_sizes{shape.coefficients(), shape.channels, shape.grid_z,
                                    shape.grid_x, shape.grid_y};
  std::vector<float> result(shape.samples());
  render(shape, photo.data(), filled(grid_sizes, look.grid),
         filled({shape.coefficients()}, look.mix), filled({shape.knots}, look.curve),
         result.data());
  return result;
}

void require_fits(const Look& look, const std::string& look_name, int photo_channels,
                  const std::string& photo_name) {
  if (photo_channels <= look.channels) return;
  retrograde::call_error(
      retrograde::text("give the look ", retrograde::quoted(look_name), " to ",
                       retrograde::quoted(photo_name)),
      "a look has as many channels as what it is given to, and gray goes with colours",
      retrograde::text("the look has ", look.channels, ", the photo ", photo_channels),
      "Make the photo gray, or learn a look from photographs in colour");
}

void write_look(const std::filesystem::path& path, const Look& look) {
  apps::State state;
  state.program = look_program;
  state.arrays["sizes"] = {static_cast<double>(look.grid_x), static_cast<double>(look.grid_y),
                           static_cast<double>(look.grid_z), static_cast<double>(look.knots)};
  state.arrays["channels"] = {static_cast<double>(look.channels)};
  state.put("grid", look.grid);
  state.put("mix", look.mix);
  state.put("curve", look.curve);
  apps::write_state(path, state);
}

Look read_look(const std::filesystem::path& path) {
  const apps::State state = apps::read_state(path, look_program);
  const auto& sizes = state.array("sizes", 4);
  Look look;
  look.grid_x = static_cast<int>(sizes[0]);
  look.grid_y = static_cast<int>(sizes[1]);
  look.grid_z = static_cast<int>(sizes[2]);
  look.knots = static_cast<int>(sizes[3]);
  // Looks of earlier versions have no such entry: they are in colour.
  if (state.arrays.contains("channels"))
    look.channels = static_cast<int>(state.array("channels", 1)[0]);
  look.grid = floats(state, "grid", look.shape(1, 1).grid_elems());
  look.mix = floats(state, "mix", look.shape(1, 1).coefficients());
  look.curve = floats(state, "curve", static_cast<size_t>(look.knots));
  return look;
}

}  // namespace bilateral_slice
