// func_class.h -- the Python class Func, whose methods are bound in several files.
#pragma once

#include "binding.h"

namespace retrograde::python {

using FuncClass = Class<Func>;

// The result of f[x] += e, which Python then assigns to f[x].
struct Updated {
  graph::FuncPtr func;
};

// The class that bind_func created, to add methods to.
template <class T>
Class<T> reopened(py::module_& module, const char* name,
                  std::initializer_list<const char*> inherited) {
  return Class<T>(typename Class<T>::Made{module.attr(name)}, name, inherited);
}

}  // namespace retrograde::python
