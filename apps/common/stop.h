// stop.h -- lets Ctrl-C end a run cleanly.
//
// The first SIGINT or SIGTERM only sets a flag. Loops check stop_requested() after each step; the program then writes
// its best result so far and its report, and exits with status 0. A second signal, at least 0.2 s later, ends the
// program at once, as if signals were not caught.
#pragma once

namespace apps {

// Called by run_app.
void catch_stop_signals();

bool stop_requested();

// Acts like a signal, for tests and for programs that stop themselves; false cancels it.
void request_stop(bool stop = true);

}  // namespace apps
