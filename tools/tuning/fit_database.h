// fit_database.h -- the machine's figures, corrected by what was measured.
#pragma once

#include <iosfwd>

#include "database.h"
#include "tuning/machine.h"

namespace retrograde::tune {

// From the figures that are in use (machine_for). Tells on `out` how wrong predictions are before and
// after, and how wrong for programs that the fit did not see: half of them at a time.
// Requires: the database has measurements of this machine with so many threads.
tuning::Machine fit_database(Database& database, int threads, std::ostream& out);

}  // namespace retrograde::tune
