// stability_report.cpp -- StabilityReport as JSON.
#include <nlohmann/json.hpp>

#include "checks/check_stability.h"
#include "checks/json_number.h"

namespace retrograde {

namespace {

using checks::json_number;

nlohmann::json json_of(const std::optional<StabilityReport::Place>& place) {
  if (!place) return nullptr;
  return {{"func", place->func},
          {"adjoint", place->is_adjoint},
          {"value", place->value},
          {"at", place->at},
          {"own", json_number(place->own)},
          {"in_double", json_number(place->in_double)},
          {"operation", place->operation}};
}

nlohmann::json json_of(const StabilityReport::FuncResult& f) {
  return {{"name", f.name},
          {"adjoint", f.is_adjoint},
          {"value", f.value},
          {"worst_error", json_number(f.worst_error)},
          {"condition", json_number(f.condition)},
          {"rounding", json_number(f.rounding)},
          {"non_finite", f.non_finite},
          {"lost", f.lost}};
}

}  // namespace

const char* to_string(Extreme extreme) {
  static constexpr const char* names[] = {"zeros", "denormals",  "huge",
                                          "tiny",  "infinities", "NaNs"};
  return names[static_cast<int>(extreme)];
}

std::string StabilityReport::to_json() const {
  nlohmann::json result{{"check", "stability"},
                        {"cases", nlohmann::json::array()},
                        {"left_out", nlohmann::json::array()}};
  for (const Case& c : cases) {
    nlohmann::json funcs = nlohmann::json::array();
    for (const FuncResult& f : c.funcs) funcs.push_back(json_of(f));
    result["cases"].push_back({{"inputs", c.name},
                               {"first_lost", json_of(c.first_lost)},
                               {"first_non_finite", json_of(c.first_non_finite)},
                               {"funcs", funcs}});
  }
  for (const LeftOut& l : left_out)
    result["left_out"].push_back({{"name", l.name}, {"reason", l.reason}});
  return result.dump(2);
}

}  // namespace retrograde
