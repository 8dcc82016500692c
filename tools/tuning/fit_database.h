// fit_database.h -- fits the machine's figures to the measurements.
#pragma once

#include <iosfwd>

#include "autoschedule/machine/kept_machine.h"
#include "database.h"

namespace retrograde::tune {

// Fits the parameters of the machine model to the measurements of this machine, starting from the parameters in use
// (machine_for). Prints to `out` the prediction error before and after, and the error by two-fold cross-validation,
// that is, for programs that the fit did not use.
// Requires: the database has measurements of this machine with that number of threads.
planning::Machine fit_database(Database& database, int threads, std::ostream& out);

}  // namespace retrograde::tune
