// unlocked.h -- compiling and running without the GIL, so that other threads of Python go on, and so that Ctrl-C
// is seen.
//
// Signals reach Python's main thread only, and only while it is in Python: a main thread that computes for an hour
// sees nothing. So what it asks for runs on a thread of ours, while it waits and looks for signals. Where one raises
// (KeyboardInterrupt), the work is left to itself: it owns all that it touches, so it ends when it ends, and its
// results go nowhere. Parallel loops end with their next task (see `Interruption`). Other threads compute themselves.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>

namespace retrograde::python {

namespace py = pybind11;

// A reference that may be let go on any thread, with or without the GIL.
using Kept = std::shared_ptr<void>;
Kept keep(py::object object);

// Whether the caller of work went away.
using Interruption = std::shared_ptr<std::atomic<bool>>;

// Rethrows what `work` throws; error_already_set for an interruption.
void run_unlocked(std::function<void(const Interruption&)> work);

// What `work`, which may not touch Python, returns.
template <class Work>
auto unlocked(Work work) {
  using Result = std::invoke_result_t<Work, const Interruption&>;
  if constexpr (std::is_void_v<Result>) {
    run_unlocked(std::move(work));
  } else {
    auto result = std::make_shared<std::optional<Result>>();
    run_unlocked(
        [result, work = std::move(work)](const Interruption& i) { result->emplace(work(i)); });
    return std::move(**result);
  }
}

}  // namespace retrograde::python
