// unlocked.h -- compiles and runs without the GIL, so that other Python threads continue and Ctrl-C works.
//
// Only Python's main thread handles signals, and only while it executes Python code. So work that the main thread
// requests runs on a worker thread, while the main thread waits and polls for signals. If a signal handler raises
// (KeyboardInterrupt), the work is abandoned: it owns everything that it accesses, so it can finish later, and its
// results are discarded. Parallel loops stop at their next task (see `Interruption`). Other threads run their work
// themselves.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>

namespace retrograde::python {

namespace py = pybind11;

// A reference that may be released on any thread, with or without the GIL.
using Kept = std::shared_ptr<void>;
Kept keep(py::object object);

// Set when the caller has abandoned the work.
using Interruption = std::shared_ptr<std::atomic<bool>>;

// Runs `work` and rethrows its exceptions; throws error_already_set for an interruption.
void run_unlocked(std::function<void(const Interruption&)> work);

// The result of `work`, which must not use Python.
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
