// directive_text.h -- directives as IR text: split(x, xo, xi, 8, Auto).
#pragma once

#include <optional>
#include <string>

#include "graph/directives/directive.h"
#include "ir/text.h"

namespace retrograde::graph {

std::string to_text(const Directive& directive);

// Parses a line such as "split(x, xo, xi, 8, Auto)"; returns nothing when no directive has that
// name.
// Requires: its arguments are those of directive.h.
std::optional<Directive> parse_directive(const std::string& line);

bool equal(const Directive& a, const Directive& b);

// The arguments of a line such as "name(a, b, _)"; _ gives an undefined one.
std::vector<Expr> parse_arguments(const std::string& line, const NameTypes& declared = {});
std::string print_argument(const Expr& e);  // "_" when undefined

}  // namespace retrograde::graph
