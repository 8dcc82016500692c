// gradient_report.cpp -- GradientReport as JSON.
#include <nlohmann/json.hpp>

#include "checks/check_gradients.h"
#include "checks/json_number.h"

namespace retrograde {

namespace {

using checks::json_number;

nlohmann::json json_of(const GradientReport::Input& input) {
  nlohmann::json steps = nlohmann::json::array(), methods = nlohmann::json::array();
  for (const GradientReport::Step& s : input.steps) {
    steps.push_back({{"step", s.step},
                     {"central_error", json_number(s.central_error)},
                     {"richardson_error", json_number(s.richardson_error)},
                     {"seconds", s.seconds}});
  }
  for (const GradientReport::Method& m : input.methods)
    methods.push_back({{"name", m.name}, {"error", json_number(m.error)}, {"seconds", m.seconds}});
  return {{"name", input.name},
          {"adjoint_error", json_number(input.adjoint_error)},
          {"complex_step_error", json_number(input.complex_step_error)},
          {"dot_product_error", json_number(input.dot_product_error)},
          {"own_precision_error", json_number(input.own_precision_error)},
          {"steps", steps},
          {"methods", methods}};
}

}  // namespace

std::string GradientReport::to_json() const {
  nlohmann::json result{{"check", "gradients"},
                        {"worst_error", json_number(worst_error)},
                        {"loses_digits", loses_digits},
                        {"complex_step_refused", complex_step_refused},
                        {"primal_seconds", primal_seconds},
                        {"adjoint_seconds", adjoint_seconds},
                        {"inputs", nlohmann::json::array()},
                        {"funcs", nlohmann::json::array()}};
  for (const Input& i : inputs) result["inputs"].push_back(json_of(i));
  for (const FuncError& f : funcs) {
    result["funcs"].push_back(
        {{"name", f.name}, {"adjoint_error", json_number(f.error)}, {"lost", json_number(f.lost)}});
  }
  return result.dump(2);
}

}  // namespace retrograde
