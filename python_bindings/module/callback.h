// callback.h -- functions of Python that the compiler calls back, on whatever thread it works.
#pragma once

#include <utility>

#include "binding.h"
#include "unlocked.h"

namespace retrograde::python {

// May be copied, called and let go without the GIL; what it raises goes through the C++ code to who called that.
class Callback {
 public:
  explicit Callback(py::function function) : function_(keep(std::move(function))) {}

  // The result is converted while the GIL is held.
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
