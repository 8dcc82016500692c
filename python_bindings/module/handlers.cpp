// handlers.cpp -- binds JITHandlers. `print` is a Python function; the others are C functions, given as ctypes
// functions or addresses.
#include "frontend/run/jit_handlers.h"

#include "bind_all.h"
#include "binding.h"
#include "c_address.h"
#include "callback.h"
#include "frontend/run/warnings.h"
#include "func_class.h"
#include "numbers.h"
#include "runnable.h"

namespace retrograde::python {

namespace {

// A handler as an attribute: an address, or None for the runtime's own. A function that is set is kept alive forever,
// because compiled code may call it as long as any C++ object holds the Func or Pipeline.
template <class Pointer>
void bind_pointer(Class<JITHandlers>& c, const char* name, Pointer JITHandlers::*field) {
  c.def_property(
      name,
      [field](const JITHandlers& h) -> std::optional<uintptr_t> {
        if (!(h.*field)) return std::nullopt;
        return reinterpret_cast<uintptr_t>(h.*field);
      },
      [field](JITHandlers& h, const py::object& function) {
        h.*field = reinterpret_cast<Pointer>(address_of(function));
        py::object(function).release();
      });
}

// A Python print function may run on any thread; realize() raises its exception after the call.
std::function<void(const char*)> printer_of(const std::optional<py::function>& print) {
  if (!print) return nullptr;
  return [print = Callback(*print)](const char* message) {
    try {
      print.call<void>(std::string(message));
    } catch (py::error_already_set& error) {
      const py::gil_scoped_acquire acquire;
      error.discard_as_unraisable("the print handler of a pipeline");
    }
  };
}

void bind_class(py::module_& m) {
  Class<JITHandlers> c(m, "JITHandlers");
  bind_pointer(c, "custom_print", &JITHandlers::custom_print);
  bind_pointer(c, "custom_malloc", &JITHandlers::custom_malloc);
  bind_pointer(c, "custom_free", &JITHandlers::custom_free);
  bind_pointer(c, "custom_do_task", &JITHandlers::custom_do_task);
  bind_pointer(c, "custom_do_par_for", &JITHandlers::custom_do_par_for);
  bind_pointer(c, "custom_error", &JITHandlers::custom_error);
  bind_pointer(c, "custom_trace", &JITHandlers::custom_trace);
  bind_pointer(c, "custom_get_symbol", &JITHandlers::custom_get_symbol);
  bind_pointer(c, "custom_load_library", &JITHandlers::custom_load_library);
  bind_pointer(c, "custom_get_library_symbol", &JITHandlers::custom_get_library_symbol);
  bind_pointer(c, "custom_cuda_acquire_context", &JITHandlers::custom_cuda_acquire_context);
  bind_pointer(c, "custom_cuda_release_context", &JITHandlers::custom_cuda_release_context);
  bind_pointer(c, "custom_cuda_get_stream", &JITHandlers::custom_cuda_get_stream);
  c.def_readwrite("thread_limit", &JITHandlers::thread_limit);
  c.def_property(
      "print", [](const JITHandlers& h) { return static_cast<bool>(h.print); },
      [](JITHandlers& h, const std::optional<py::function>& print) {
        h.print = printer_of(print);
      });
}

// Process-wide handlers for the package `halide` (retrograde/compat), which prints like Halide's package.
void bind_defaults(py::module_& m) {
  m.def("_set_default_print", [](const std::optional<py::function>& print) {
    JITHandlers handlers = frontend::default_handlers();
    handlers.print = printer_of(print);
    frontend::set_default_handlers(handlers);
  });
  m.def("_warn_of_rounding", &warn_of_rounding);
  m.def("_set_warning_handler", [](const std::optional<py::function>& tell) {
    const std::function<void(const char*)> printer = printer_of(tell);
    set_warning_handler(printer ? [printer](const std::string& text) { printer(text.c_str()); }
                                : WarningHandler());
  });
}

}  // namespace

void bind_handlers(py::module_& m) {
  bind_class(m);
  bind_defaults(m);
  constexpr auto inside = py::return_value_policy::reference_internal;
  reopened<Func>(m, "Func", {"Pipeline"}).def("jit_handlers", &Func::jit_handlers, inside);
  reopened<Pipeline>(m, "Pipeline", {}).def("jit_handlers", &Pipeline::jit_handlers, inside);
}

}  // namespace retrograde::python
