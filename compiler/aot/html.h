// Generates a page that shows a schedule, the lowered code and the machine code side by side.
#pragma once

#include <string>
#include <vector>

namespace retrograde::aot {

struct PageFunction {
  std::string name, schedule, statement;  // the loop nest; the lowered statement
};

// Returns one self-contained HTML file. Loops of the statement link to their machine code.
std::string html_page(const std::string& title, const std::vector<PageFunction>& functions,
                      const std::string& assembly);

}  // namespace retrograde::aot
