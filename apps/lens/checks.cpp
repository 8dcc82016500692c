// checks.cpp -- see checks.h.
#include "checks.h"

#include <cmath>
#include <random>

#include "evaluator.h"

namespace lens {

namespace {

std::vector<double> beside_kinks(const Scene& scene) {
  std::mt19937_64 random(20);
  std::uniform_real_distribution<double> noise(0.05, 0.25);
  std::vector<double> x = start_of(scene);
  for (double& v : x) v += noise(random);
  return x;
}

bool has_group(const Lens& lens, const std::string& group) {
  for (const Surface& surface : lens.surfaces) {
    if (group != "indices" || surface.index > 1.0001) return true;
  }
  return false;
}

// A lens that is hard to trace, as a change of the initial lens.
struct HardCase {
  const char* name;
  std::function<void(const Scene&, Lens&)> change;
};

size_t first_glass(const Lens& lens) {
  for (size_t k = 0; k < lens.surfaces.size(); ++k) {
    if (lens.surfaces[k].index > 1.0001) return k;
  }
  return 0;
}

const std::vector<HardCase>& hard_cases() {
  static const std::vector<HardCase> cases{
      {"as given", [](const Scene&, Lens&) {}},
      {"grazing incidence at the first surface",
       [](const Scene& s, Lens& l) { l.surfaces[0].curvature = 1 / (1.002 * s.pupil_radius); }},
      {"half of the rays miss the first surface",
       [](const Scene& s, Lens& l) { l.surfaces[0].curvature = 1 / (0.7 * s.pupil_radius); }},
      {"total reflection inside the first glass",
       [](const Scene& s, Lens& l) {
         l.surfaces[first_glass(l) + 1].curvature = -1 / (1.2 * s.pupil_radius);
       }},
      {"first glass concentric to 1e-6",
       [](const Scene&, Lens& l) {
         const Surface& front = l.surfaces[first_glass(l)];
         l.surfaces[first_glass(l) + 1].curvature =
             (1 + 1e-6) / (1 / front.curvature - front.spacing);
       }},
      {"all surfaces plane",
       [](const Scene&, Lens& l) {
         for (Surface& surface : l.surfaces) surface.curvature = 0;
       }},
      {"all gaps 1e-9 mm but the last",
       [](const Scene&, Lens& l) {
         for (size_t k = 0; k + 1 < l.surfaces.size(); ++k) l.surfaces[k].spacing = 1e-9;
       }},
      {"a first radius of 1 um", [](const Scene&, Lens& l) { l.surfaces[0].curvature = 1e3; }}};
  return cases;
}

std::vector<double> numbers_of(const Scene& scene, Lens lens) {
  std::vector<double> x;
  for (const Variable& variable : scene.variables)
    x.push_back(number_of(lens, variable) / variable.scale);
  return x;
}

}  // namespace

std::vector<apps::GradientRow> check_gradients(const Lens& lens, const SceneOptions& options) {
  std::vector<apps::GradientRow> rows;
  for (const std::string& group : groups) {
    if (!has_group(lens, group)) continue;
    SceneOptions one = options;
    one.optimize = {group};
    const Scene scene = make_scene(lens, one);
    LensModel model(scene, retrograde::Float(32));
    const std::vector<double> x = beside_kinks(scene);
    retrograde::Buffer<float> variables(static_cast<int>(x.size())), goal(1);
    for (size_t n = 0; n < x.size(); ++n) variables(static_cast<int>(n)) = static_cast<float>(x[n]);
    goal(0) = static_cast<float>(0.97 * lens.length());
    model.variables.set(variables);
    model.goal.set(goal);
    auto checked = apps::gradient_rows(
        retrograde::check_gradients(model.loss, {}, {.wrt = {model.variables}}));
    checked.at(0).input = group;
    rows.push_back(checked[0]);
  }
  return rows;
}

std::vector<apps::StabilityRow> check_stability(const Scene& scene) {
  Evaluator in_double(scene, retrograde::Float(64)), in_float(scene, retrograde::Float(32));
  const apps::Problem problem{
      .size = scene.variables.size(),
      .evaluate = [&](auto x, auto gradient) { return in_float.loss(x, gradient); }};
  std::vector<apps::StabilityRow> rows;
  for (const HardCase& hard : hard_cases()) {
    Lens lens = scene.lens;
    hard.change(scene, lens);
    // Rounded to float32, so that both precisions get the same input.
    std::vector<double> x = numbers_of(scene, lens);
    for (double& v : x) v = static_cast<float>(v);
    std::vector<double> exact(x.size()), own(x.size());
    const double loss = in_double.loss(x, exact), own_loss = in_float.loss(x, own);
    apps::StabilityRow row{hard.name, apps::relative_error({&own_loss, 1}, {&loss, 1}),
                           apps::relative_error(own, exact)};
    apps::measure_divergence(row, problem, x, apps::large_steps(60, 10, 100));
    rows.push_back(row);
  }
  return rows;
}

}  // namespace lens
