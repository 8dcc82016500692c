// inject_tracing -- insert trace events for loads, stores and realizations.
#pragma once

#include <string>

#include "ir/target.h"
#include "lower/program.h"

namespace retrograde::lower {

// Nests to Nests: changes the loops of a root statement (root_statement.h).
Stmt inject_tracing(const Stmt& s, const Program& program, const std::string& pipeline,
                    const Target& target);

}  // namespace retrograde::lower
