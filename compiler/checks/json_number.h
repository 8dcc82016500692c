// json_number.h -- numbers as JSON. NaN and infinities, which JSON lacks, become strings.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

namespace retrograde::checks {

inline nlohmann::json json_number(double v) {
  if (std::isfinite(v)) return v;
  return std::isnan(v) ? "nan" : v > 0 ? "inf" : "-inf";
}

}  // namespace retrograde::checks
