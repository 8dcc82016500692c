// func_class.h -- the class Func, which several files bind.
#pragma once

#include "binding.h"

namespace retrograde::python {

using FuncClass = Class<Func>;

// What f[x] += e gives back, for Python to "store" in f[x].
struct Updated {
  graph::FuncPtr func;
};

// The class that bind_func made, for those that add to it.
template <class T>
Class<T> reopened(py::module_& module, const char* name,
                  std::initializer_list<const char*> inherited) {
  return Class<T>(typename Class<T>::Made{module.attr(name)}, name, inherited);
}

}  // namespace retrograde::python
