// c_address.h -- the address of a C function, given as an int or as a ctypes function.
#pragma once

#include <cstdint>

#include "binding.h"

namespace retrograde::python {

inline void* address_of(const py::object& function) {
  if (function.is_none()) return nullptr;
  if (PyLong_Check(function.ptr())) return reinterpret_cast<void*>(function.cast<uintptr_t>());
  const py::module_ ctypes = py::module_::import("ctypes");
  if (!py::isinstance(function, ctypes.attr("_CFuncPtr")))
    throw py::type_error("a C function is an address or a function of ctypes");
  return reinterpret_cast<void*>(
      ctypes.attr("cast")(function, ctypes.attr("c_void_p")).attr("value").cast<uintptr_t>());
}

}  // namespace retrograde::python
