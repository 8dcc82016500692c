// step_times.cpp -- see step_times.h.
//
// All variants are compiled first and then take steps in turns, so that other load on the machine affects all alike.
#include "step_times.h"

#include <chrono>
#include <memory>

#include "common/timing.h"
#include "trainer.h"
#include "trainer_state.h"

namespace bilateral_slice {

namespace {

constexpr int rounds = 25, untimed_rounds = 2;
constexpr float rate = 0.01f;

Pair gray_of(const Pair& pair) {
  Pair gray = pair;
  gray.shape.channels = 1;
  const long pixels = pair.shape.pixels();
  const auto luminance = [&](const Planes& planes, long p) {
    return 0.2126f * planes[p] + 0.7152f * planes[pixels + p] + 0.0722f * planes[2 * pixels + p];
  };
  gray.photo.assign(2 * pixels, 1.0f);
  gray.target.resize(pixels);
  for (long p = 0; p < pixels; ++p) {
    gray.photo[p] = luminance(pair.photo, p);
    gray.target[p] = luminance(pair.target, p);
  }
  return gray;
}

struct Case {
  Groups moves;
  bool gray = false;
  std::unique_ptr<Trainer> trainer = {};
  double compile_seconds = 0;
  std::vector<double> seconds = {};
};

size_t funcs_of(const lang::Derivative& adjoints) {
  size_t count = 0;
  for (const lang::Func& f : adjoints.funcs()) count += f.defined() ? 1 : 0;
  return count;
}

}  // namespace

apps::Table time_steps(const Pair& pair, int threads) {
  Pair colour = pair, gray = gray_of(pair);
  std::vector<Case> cases;
  const Groups all, grid{true, false, false}, guide{false, true, true}, mix{false, true, false},
      curve{false, false, true};
  for (const Groups& moves : {all, grid, guide, mix, curve}) cases.push_back({moves});
  for (const Groups& moves : {all, grid}) cases.push_back({moves, true});
  for (Case& one : cases) {
    Pair& of = one.gray ? gray : colour;
    const auto start = std::chrono::steady_clock::now();
    one.trainer =
        std::make_unique<Trainer>(of.shape, of.photo.data(), of.target.data(), threads, one.moves);
    one.compile_seconds = apps::seconds_since(start);
  }
  for (int round = -untimed_rounds; round < rounds; ++round) {
    for (Case& one : cases) {
      const auto start = std::chrono::steady_clock::now();
      one.trainer->step(rate);
      if (round >= 0) one.seconds.push_back(apps::seconds_since(start));
    }
  }
  apps::Table table{
      retrograde::text("a step on ", pair.shape.width, " x ", pair.shape.height,
                       " pixels, by what moves"),
      {"what moves", "channels", "Funcs of the gradient", "compiled in s", "ms a step"},
      {}};
  for (Case& one : cases) {
    table.rows.push_back({names_of(one.moves), one.gray ? 1 : 3, funcs_of(one.trainer->adjoints()),
                          one.compile_seconds, 1e3 * apps::median(one.seconds)});
  }
  return table;
}

}  // namespace bilateral_slice
