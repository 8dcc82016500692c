// callback.h -- Python functions that the compiler calls, on any thread.
#pragma once

#include <utility>

#include "binding.h"
#include "unlocked.h"

namespace retrograde::python {

// May be copied, called and destroyed without the GIL. A Python exception passes through the C++ code to its caller.
class Callback {
 public:
  explicit Callback(py::function function) : function_(keep(std::move(function))) {}

  // Converts the result while it holds the GIL.
  template <class Result, class... Args>
  Result call(const Args&... args) const {
    const py::gil_scoped_acquire acquire;
    const py::handle function(static_cast<PyObject*>(function_.get()));
    const py::object result = function(args...);
    if constexpr (!std::is_void_v<Result>) return result.template cast<Result>();
  }

 private:
  Kept function_;
};

}  // namespace retrograde::python
