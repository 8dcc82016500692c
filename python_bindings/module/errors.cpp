// errors.cpp -- translates exceptions of the library to Python exceptions with the four parts of their messages.
//
// The classes are defined in Python (retrograde/_errors.py), so that they can be pickled and inherit from built-in
// exceptions.
#include "bind_all.h"
#include "binding.h"
#include "diagnostics/error.h"

namespace retrograde::python {

namespace {

void raise(const char* type, const Error& error, const py::dict& more) {
  const py::object cls = py::module_::import("retrograde._errors").attr(type);
  const py::object exception = cls(error.what());
  const Message& message = error.message();
  exception.attr("asked") = message.asked;
  exception.attr("rule") = message.rule;
  exception.attr("evidence") = message.evidence;
  exception.attr("instead") = message.instead;
  for (const auto& [name, value] : more) py::setattr(exception, name, value);
  PyErr_SetObject(cls.ptr(), exception.ptr());
}

void translate(std::exception_ptr pending) {
  using namespace py::literals;
  try {
    std::rethrow_exception(pending);
  } catch (const RuntimeError& error) {
    raise("RuntimeError", error, py::dict("code"_a = error.code()));
  } catch (const CompileError& error) {
    raise("CompileError", error, {});
  } catch (const UserError& error) {
    raise("UserError", error, {});
  } catch (const Unsupported& error) {
    raise("Unsupported", error, {});
  } catch (const InternalError& error) {
    raise("InternalError", error,
          py::dict("pass_name"_a = error.pass(), "ir_before"_a = error.ir_before()));
  } catch (const Error& error) {
    raise("Error", error, {});
  }
}

}  // namespace

void bind_errors(py::module_&) { py::register_local_exception_translator(&translate); }

}  // namespace retrograde::python
