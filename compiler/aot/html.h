// A page that shows what became of a schedule.
#pragma once

#include <string>
#include <vector>

namespace retrograde::aot {

struct PageFunction {
  std::string name, schedule, statement;  // the loop nest; the lowered statement
};

// One self-contained file. The loops of the statement lead to the machine code that they became.
std::string html_page(const std::string& title, const std::vector<PageFunction>& functions,
                      const std::string& assembly);

}  // namespace retrograde::aot
