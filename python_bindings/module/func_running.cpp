// func_running.cpp -- binds running Funcs and compiling them to files.
#include "bind_all.h"
#include "func_class.h"
#include "runnable.h"

namespace retrograde::python {

void bind_func_running(py::module_& m) {
  FuncClass c = reopened<Func>(m, "Func", {"LoopDirectives", "Runnable"});
  bind_running(c);
}

}  // namespace retrograde::python
