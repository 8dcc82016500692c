// call_site.h -- file and line of the calling Python code, for messages that name the declaration of a Func.
#pragma once

#include <pybind11/pybind11.h>

#include "frontend/language/func.h"

namespace retrograde::python {

inline void set_call_site(Func& f) {
  PyFrameObject* frame = PyEval_GetFrame();
  if (!frame) return;
  PyCodeObject* code = PyFrame_GetCode(frame);
  const char* file = PyUnicode_AsUTF8(code->co_filename);
  f.function()->declared_at = {file ? file : "", PyFrame_GetLineNumber(frame)};
  Py_DECREF(code);
}

}  // namespace retrograde::python
