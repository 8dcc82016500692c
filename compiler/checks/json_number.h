// JSON has no NaN and no infinity, so they are written as text.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

namespace retrograde::checks {

inline nlohmann::json json_number(double v) {
  if (std::isfinite(v)) return v;
  return std::isnan(v) ? "nan" : v > 0 ? "inf" : "-inf";
}

}  // namespace retrograde::checks
