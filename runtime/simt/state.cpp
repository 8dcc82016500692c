#include "simt/state.h"

namespace retrograde::simt {

// Never destroyed: threads may still be in the driver when the process exits.
State& state() {
  static State& all = *new State;
  return all;
}

std::mutex& driver_mutex() {
  static std::mutex& mutex = *new std::mutex;
  return mutex;
}

ContextState*& current_context() {
  thread_local ContextState* current = nullptr;
  return current;
}

const void* this_thread() {
  thread_local char place = 0;
  return &place;
}

int& capture_mode_of_this_thread() {
  thread_local int mode = 0;
  return mode;
}

namespace {
std::string& last_finding() {
  static std::string& text = *new std::string;
  return text;
}
}  // namespace

void set_finding(const std::string& text) { last_finding() = text; }
const std::string& finding() { return last_finding(); }

}  // namespace retrograde::simt
