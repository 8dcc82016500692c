// Writes and checks docs/stability.md, which states the suite's errors as bounds that hold on every machine.
#pragma once

#include <functional>
#include <string>

#include "stability/measure.h"

namespace retrograde::stability {

std::string render(const std::function<Row(const Problem&)>& measured);
// The page without the numbers in its rows.
std::string without_figures(const std::string& page);
// Returns an empty string if the page's row for the program agrees with the measurement: bounds hold and are not slack.
std::string disagreement_with(const std::string& page, const std::string& program, const Row& row);

}  // namespace retrograde::stability
