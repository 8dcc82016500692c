// fit_database.h -- fits the machine's figures to the measurements.
#pragma once

#include <iosfwd>

#include "database.h"
#include "tuning/machine.h"

namespace retrograde::tune {

// Starts from the figures in use (machine_for). Prints to `out` the prediction error before and after, and by two-fold
// cross-validation: for programs that the fit did not use.
// Requires: the database has measurements of this machine with so many threads.
tuning::Machine fit_database(Database& database, int threads, std::ostream& out);

}  // namespace retrograde::tune
