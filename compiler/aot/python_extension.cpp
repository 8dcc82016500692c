// python_extension.cpp -- see python_extension.h. The text consists of fixed parts and, at the end, the parts that
// depend on the functions.
#include "aot/python_extension.h"

#include "aot/mangle.h"
#include "diagnostics/error.h"
#include "ir/print.h"

namespace retrograde::aot {

namespace {

using codegen::ExportArgument;

const char* const includes = R"(
#define PY_SSIZE_T_CLEAN
#include <Python.h>

#include <HalideRuntime.h>

#include <cstring>
#include <limits>
#include <string>
#include <vector>
)";

const char* const buffers = R"(
namespace {

// The element type for a format letter of the struct module, in native or standard sizes.
inline bool element_type_of(const Py_buffer &view, halide_type_t *type) {
  const char *format = view.format ? view.format : "B";
  if (*format == '@' || *format == '=' || *format == '<') ++format;
  if (*format == '\0' || format[1] != '\0') return false;
  const uint8_t bits = static_cast<uint8_t>(8 * view.itemsize);
  if (*format == '?') {
    *type = halide_type_t(halide_type_uint, 1);
  } else if (std::strchr("bhilqn", *format)) {
    *type = halide_type_t(halide_type_int, bits);
  } else if (std::strchr("BHILQN", *format)) {
    *type = halide_type_t(halide_type_uint, bits);
  } else if (std::strchr("efd", *format)) {
    *type = halide_type_t(halide_type_float, bits);
  } else {
    return false;
  }
  return true;
}

// An argument in the form that the function takes, for the duration of a call.
class BufferArgument {
 public:
  BufferArgument() = default;
  BufferArgument(const BufferArgument &) = delete;
  BufferArgument &operator=(const BufferArgument &) = delete;
  ~BufferArgument() {
    if (is_viewed_) PyBuffer_Release(&view_);
  }

  // Returns false with a Python error set.
  bool take(PyObject *object, const char *name, bool is_written, bool is_bfloat) {
    if (PyObject_HasAttrString(object, "_get_raw_halide_buffer_t")) return take_raw(object, name);
    if (PyObject_GetBuffer(object, &view_, PyBUF_FORMAT | PyBUF_STRIDES | (is_written ? PyBUF_WRITABLE : 0)) < 0)
      return false;
    is_viewed_ = true;
    if (!element_type_of(view_, &own_.type)) {
      PyErr_Format(PyExc_TypeError, "%s holds elements of format \"%s\", which is not a supported element type", name,
                   view_.format);
      return false;
    }
    if (is_bfloat && own_.type == halide_type_t(halide_type_uint, 16)) own_.type = halide_type_t(halide_type_bfloat, 16);
    own_.host = static_cast<uint8_t *>(view_.buf);
    own_.dimensions = view_.ndim;
    dims_.resize(view_.ndim > 0 ? view_.ndim : 1);
    own_.dim = dims_.data();
    const bool as_it_is = PyBuffer_IsContiguous(&view_, 'F') && !PyBuffer_IsContiguous(&view_, 'C');
    for (int d = 0; d < view_.ndim; ++d) {
      const int axis = as_it_is ? d : view_.ndim - 1 - d;
      const Py_ssize_t extent = view_.shape[axis], stride = view_.strides[axis] / view_.itemsize;
      if (view_.strides[axis] % view_.itemsize != 0) {
        PyErr_Format(PyExc_ValueError, "the strides of %s are no multiples of its elements", name);
        return false;
      }
      const Py_ssize_t most = std::numeric_limits<int32_t>::max();
      if (extent > most || stride > most || stride < -most) {
        PyErr_Format(PyExc_OverflowError, "%s has sizes or strides beyond 2^31 - 1 elements", name);
        return false;
      }
      dims_[d] = halide_dimension_t(0, static_cast<int32_t>(extent), static_cast<int32_t>(stride));
    }
    return true;
  }

  halide_buffer_t *get() { return raw_ ? raw_ : &own_; }
  void is_new_on_host() {
    if (!raw_) own_.set_host_dirty(true);
  }
  // Copies a written array back from the device, and frees the device memory that the call allocated for it.
  int back_to_host(bool is_written) {
    const int result = is_written ? halide_copy_to_host(nullptr, get()) : 0;
    if (!raw_) halide_device_free(nullptr, get());
    return result;
  }

 private:
  bool take_raw(PyObject *object, const char *name) {
    PyObject *address = PyObject_CallMethod(object, "_get_raw_halide_buffer_t", nullptr);
    if (!address) return false;
    raw_ = static_cast<halide_buffer_t *>(PyLong_AsVoidPtr(address));
    Py_DECREF(address);
    if (!raw_ && !PyErr_Occurred()) PyErr_Format(PyExc_ValueError, "%s is a Buffer without memory", name);
    return raw_ != nullptr;
  }

  bool is_viewed_ = false;
  Py_buffer view_ = {};
  halide_buffer_t own_ = {};
  std::vector<halide_dimension_t> dims_;
  halide_buffer_t *raw_ = nullptr;
};
)";

const char* const scalars = R"(
// Converts a number to the parameter's type. Returns false with a Python error set: OverflowError if it does not fit.
template <typename T>
inline bool take_number(PyObject *object, const char *name, T *value) {
  if constexpr (std::is_same_v<T, bool>) {
    const int truth = PyObject_IsTrue(object);
    *value = truth > 0;
    return truth >= 0;
  } else if constexpr (std::is_pointer_v<T>) {
    *value = object == Py_None ? nullptr : PyLong_AsVoidPtr(object);
    return !PyErr_Occurred();
  } else if constexpr (std::is_floating_point_v<T>) {
    *value = static_cast<T>(PyFloat_AsDouble(object));
    return !PyErr_Occurred();
  } else {
    PyObject *whole = PyNumber_Index(object);
    if (!whole) return false;
    std::conditional_t<std::is_signed_v<T>, long long, unsigned long long> wide;
    if constexpr (std::is_signed_v<T>) {
      wide = PyLong_AsLongLong(whole);
    } else {
      wide = PyLong_AsUnsignedLongLong(whole);
    }
    Py_DECREF(whole);
    if (PyErr_Occurred()) return false;
    *value = static_cast<T>(wide);
    if (static_cast<decltype(wide)>(*value) == wide) return true;
    PyErr_Format(PyExc_OverflowError, "%s has %d bits, which %R does not fit", name, int(8 * sizeof(T)), object);
    return false;
  }
}

)";

const char* const errors = R"(#ifndef HALIDE_PYTHON_EXTENSION_OMIT_ERROR_AND_PRINT_HANDLERS
// Text of the error that the current thread's call reported.
inline thread_local std::string error_text;
#endif

// Sets the Python error for an error code.
inline void raise_error(int code) {
  char message[64];
  PyOS_snprintf(message, sizeof message, "Halide Runtime Error: %d", code);
  PyObject *error = PyObject_CallFunction(PyExc_RuntimeError, "s", message);
  if (!error) return;
#ifndef HALIDE_PYTHON_EXTENSION_OMIT_ERROR_AND_PRINT_HANDLERS
  PyObject *text = PyUnicode_DecodeUTF8(error_text.data(), static_cast<Py_ssize_t>(error_text.size()), "replace");
  if (text) PyObject_SetAttrString(error, "text", text);
  // Tracebacks show the note, since Python 3.11.
  PyObject *note = text ? PyObject_CallMethod(error, "add_note", "O", text) : nullptr;
  PyErr_Clear();
  Py_XDECREF(note);
  Py_XDECREF(text);
#endif
  PyErr_SetObject(PyExc_RuntimeError, error);
  Py_DECREF(error);
}

}  // namespace

)";

const char* const handlers = R"(
#ifndef HALIDE_PYTHON_EXTENSION_OMIT_ERROR_AND_PRINT_HANDLERS
void keep_error(void *, const char *text) { error_text = text; }

void print_to_python(void *, const char *text) {
  const PyGILState_STATE state = PyGILState_Ensure();
  PyObject *out = PySys_GetObject("stdout");  // borrowed
  if (out && PyFile_WriteString(text, out) < 0) PyErr_WriteUnraisable(out);
  PyGILState_Release(state);
}
#endif

}  // namespace

#define RETROGRADE_TEXT_OF(name) #name
#define RETROGRADE_TEXT(name) RETROGRADE_TEXT_OF(name)
#define RETROGRADE_JOINED_OF(a, b) a##b
#define RETROGRADE_JOINED(a, b) RETROGRADE_JOINED_OF(a, b)

PyMODINIT_FUNC RETROGRADE_JOINED(PyInit_, HALIDE_PYTHON_EXTENSION_MODULE_NAME)(void) {
  static PyMethodDef functions[] = {
#define X(name) \
  {#name, reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)(void)>(retrograde_python::name)), \
   METH_VARARGS | METH_KEYWORDS, nullptr},
      HALIDE_PYTHON_EXTENSION_FUNCTIONS
#undef X
      {nullptr, nullptr, 0, nullptr}};
  static PyModuleDef definition = {PyModuleDef_HEAD_INIT, RETROGRADE_TEXT(HALIDE_PYTHON_EXTENSION_MODULE_NAME),
                                   nullptr, -1, functions, nullptr, nullptr, nullptr, nullptr};
#ifndef HALIDE_PYTHON_EXTENSION_OMIT_ERROR_AND_PRINT_HANDLERS
  halide_set_error_handler(keep_error);
  halide_set_custom_print(print_to_python);
#endif
  return PyModule_Create(&definition);
}

#endif
)";

bool is_bfloat(const ExportArgument& argument) { return argument.type.is_bfloat(); }

void check_scalar(const DeclaredFunction& function, const ExportArgument& argument) {
  if (argument.is_buffer() || !argument.type.is_float() || argument.type.bits() > 16) return;
  unsupported("write a Python module of " + quoted(function.name),
              "Python supports the scalars' types",
              quoted(argument.name) + " is of type " + to_string(argument.type),
              "Take a float32 and cast it");
}

// The body of `PyObject *function(module, args, kwargs)`.
std::string body_of(const DeclaredFunction& function, const Target& target) {
  const std::vector<ExportArgument>& arguments = function.signature.arguments;
  std::string names, objects, places, format, taken, passed, dirty, back;
  for (size_t i = 0; i < arguments.size(); ++i) {
    const ExportArgument& argument = arguments[i];
    check_scalar(function, argument);
    const std::string at = std::to_string(i), value = "value_" + at;
    const bool is_written = argument.kind == ExportArgument::Kind::OutputBuffer;
    names += quoted(argument.name) + ", ";
    objects += (i ? ", *object_" : "*object_") + at;
    places += ", &object_" + at;
    format += "O";
    passed += (i ? ", " : "") + value + (argument.is_buffer() ? ".get()" : "");
    if (!argument.is_buffer()) {
      // A handle is passed on as an address, whatever it points to.
      const std::string type = argument.type.is_handle() ? "void *" : c_type(argument);
      taken += "  " + type + (type.back() == '*' ? "" : " ") + value +
               " = {};\n  if (!take_number(object_" + at + ", names[" + at + "], &" + value +
               ")) return nullptr;\n";
      continue;
    }
    taken += text("  BufferArgument ", value, ";\n  if (!", value, ".take(object_", at, ", names[",
                  at, "], ", is_written ? "true" : "false", ", ",
                  is_bfloat(argument) ? "true" : "false", ")) return nullptr;\n");
    if (!target.has_gpu_feature()) continue;
    if (!is_written) dirty += "  " + value + ".is_new_on_host();\n";
    back += text("  if (const int code = ", value, ".back_to_host(", is_written ? "true" : "false",
                 "); code && !result) result = code;\n");
  }
  std::string body = "  static const char *const names[] = {" + names + "nullptr};\n";
  if (!arguments.empty()) body += "  PyObject " + objects + ";\n";
  body += "  if (!PyArg_ParseTupleAndKeywords(args, kwargs, \"" + format +
          "\", const_cast<char **>(names)" + places + ")) return nullptr;\n" + taken + dirty;
  body += R"(#ifndef HALIDE_PYTHON_EXTENSION_OMIT_ERROR_AND_PRINT_HANDLERS
  error_text.clear();
#endif
  int result;
  Py_BEGIN_ALLOW_THREADS
  result = ::)" +
          function.name + "(" + passed + ");\n" + back + R"(  Py_END_ALLOW_THREADS
  if (result == 0) Py_RETURN_NONE;
  raise_error(result);
  return nullptr;
)";
  return body;
}

std::string function_text(const DeclaredFunction& function, const Target& target) {
  return "PyObject *" + name_parts(function.name).back() +
         "(PyObject *, PyObject *args, PyObject *kwargs) {\n" + body_of(function, target) + "}\n";
}

std::string module_text(const std::string& module_name,
                        const std::vector<DeclaredFunction>& functions) {
  std::string listed;
  for (const DeclaredFunction& function : functions)
    listed += " X(" + name_parts(function.name).back() + ")";
  std::string result =
      "\n#ifndef HALIDE_PYTHON_EXTENSION_OMIT_MODULE_DEFINITION\n\n"
      "#ifndef HALIDE_PYTHON_EXTENSION_MODULE_NAME\n#define HALIDE_PYTHON_EXTENSION_MODULE_NAME " +
      identifier(module_name) +
      "\n#endif\n#ifndef HALIDE_PYTHON_EXTENSION_FUNCTIONS\n"
      "#define HALIDE_PYTHON_EXTENSION_FUNCTIONS" +
      listed +
      "\n#endif\n\n"
      "namespace retrograde_python {\n"
      "#define X(name) PyObject *name(PyObject *, PyObject *, PyObject *);\n"
      "HALIDE_PYTHON_EXTENSION_FUNCTIONS\n#undef X\n}  // namespace retrograde_python\n\nnamespace "
      "{\n";
  return result + handlers;
}

}  // namespace

std::string python_extension_text(const std::string& module_name, const Target& target,
                                  const std::vector<DeclaredFunction>& functions) {
  std::string result = "// " + module_name + ": its functions as those of a Python module.\n" +
                       includes + "\n" + header_text(module_name, target, functions) + buffers +
                       scalars + errors + "namespace retrograde_python {\n";
  for (const DeclaredFunction& function : functions)
    result += "\n" + function_text(function, target);
  return result + "\n}  // namespace retrograde_python\n" + module_text(module_name, functions);
}

}  // namespace retrograde::aot
