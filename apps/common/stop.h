// stop.h -- Ctrl-C ends a run in good order.
//
// The first SIGINT or SIGTERM only sets a flag: loops ask stop_requested() after each step, and the
// program then writes its best result so far and its report, and ends with status 0. A second one, 0.2 s
// later at least, ends the program at once, as if nobody had asked for signals.
#pragma once

namespace apps {

// Installed by run_app.
void catch_stop_signals();

bool stop_requested();

// As a signal would, for tests and for programs that stop themselves; false takes it back.
void request_stop(bool stop = true);

}  // namespace apps
