// docs/stability.md: the suite's errors as bounds that hold on every machine.
#pragma once

#include <functional>
#include <string>

#include "stability/measure.h"

namespace retrograde::stability {

std::string render(const std::function<Row(const Problem&)>& measured);
// The page with the figures of its rows left out.
std::string without_figures(const std::string& page);
// Empty when the page's row for the program says what was measured: bounds hold and are not slack.
std::string disagreement_with(const std::string& page, const std::string& program, const Row& row);

}  // namespace retrograde::stability
