// externs.cpp -- binds extern stages and calls of C functions in expressions.
//
// A C function is given as an address or as a ctypes function, which stays alive as long as it is referred to.
#include "bind_all.h"
#include "binding.h"
#include "c_address.h"
#include "frontend/language/extern_function.h"
#include "frontend/run/pipeline.h"
#include "func_class.h"
#include "unlocked.h"

namespace retrograde::python {

namespace {

using py::arg;

ExternFuncArgument argument_of(py::handle object) {
  if (py::isinstance<Func>(object)) return ExternFuncArgument(object.cast<Func&>().function());
  if (py::isinstance<OutputImageParam>(object)) return object.cast<const OutputImageParam&>();
  if (const std::optional<Expr> expr = expr_from(object)) return *expr;
  return object.cast<Buffer<>>();
}

std::vector<ExternFuncArgument> arguments_of(const py::iterable& objects) {
  std::vector<ExternFuncArgument> result;
  for (py::handle one : objects) result.push_back(argument_of(one));
  return result;
}

std::vector<Type> types_of(const py::object& objects) {
  if (py::isinstance<py::list>(objects) || py::isinstance<py::tuple>(objects))
    return objects.cast<std::vector<Type>>();
  return {objects.cast<Type>()};
}

void bind_argument(py::module_& m) {
  Class<ExternFuncArgument>(m, "ExternFuncArgument")
      .def(py::init(&argument_of), arg("argument"))
      .def("defined", &ExternFuncArgument::defined)
      .def("is_func", &ExternFuncArgument::is_func)
      .def("is_expr", &ExternFuncArgument::is_expr)
      .def("is_buffer", &ExternFuncArgument::is_buffer)
      .def("is_image_param", &ExternFuncArgument::is_image_param);
}

void bind_define_extern(py::module_& m) {
  reopened<Func>(m, "Func", {})
      .def(
          "define_extern",
          [](Func& f, const std::string& name, const py::iterable& args, const py::object& types,
             int dimensionality, NameMangling mangling) {
            f.define_extern(name, arguments_of(args), types_of(types), dimensionality, mangling);
          },
          arg("function_name"), arg("args"), arg("types"), arg("dimensionality"),
          arg("mangling") = NameMangling::Default)
      .def(
          "define_extern",
          [](Func& f, const std::string& name, const py::iterable& args, const py::object& types,
             const std::vector<Var>& arguments, NameMangling mangling) {
            f.define_extern(name, arguments_of(args), types_of(types), arguments, mangling);
          },
          arg("function_name"), arg("args"), arg("types"), arg("arguments"),
          arg("mangling") = NameMangling::Default);
}

void bind_signature(py::module_& m) {
  Class<ExternSignature>(m, "ExternSignature")
      .def(py::init([](const std::optional<Type>& result, const std::vector<Type>& args) {
             return ExternSignature(result.value_or(Type()), !result, args);
           }),
           arg("ret_type"), arg("arg_types"))
      .def("ret_type", &ExternSignature::ret_type)
      .def("is_void_return", &ExternSignature::is_void_return)
      .def("arg_types", &ExternSignature::arg_types);
  Class<ExternCFunction>(m, "ExternCFunction")
      .def(py::init([](const py::object& function, const ExternSignature& signature) {
             return ExternCFunction(address_of(function), signature);
           }),
           arg("function"), arg("signature"), py::keep_alive<1, 2>())
      .def("address",
           [](const ExternCFunction& f) { return reinterpret_cast<uintptr_t>(f.address()); })
      .def("signature", &ExternCFunction::signature);
}

// The Pipeline or Func keeps the functions that are set alive, including ctypes functions.
template <class Self>
void bind_externs_of(Class<Self> c) {
  c.def(
      "set_jit_externs",
      [](Self& self, const std::map<std::string, JITExtern>& externs) {
        self.set_jit_externs(externs);
      },
      arg("externs"), py::keep_alive<1, 2>());
  c.def("get_jit_externs", [](Self& self) { return self.get_jit_externs(); });
}

void bind_jit_extern(py::module_& m) {
  Class<JITExtern>(m, "JITExtern")
      .def(py::init([](const Func& f) { return JITExtern(f); }), arg("func"))
      .def(py::init<Pipeline>(), arg("pipeline"))
      .def(py::init<ExternCFunction>(), arg("function"), py::keep_alive<1, 2>())
      .def("pipeline", &JITExtern::pipeline)
      .def("extern_c_function", &JITExtern::extern_c_function);
  bind_externs_of(reopened<Func>(m, "Func", {"Runnable"}));
  bind_externs_of(reopened<Pipeline>(m, "Pipeline", {"Runnable"}));
}

}  // namespace

void bind_externs(py::module_& m) {
  bind_argument(m);
  bind_define_extern(m);
  bind_signature(m);
  bind_jit_extern(m);
  // The types of the arguments determine the C signature.
  def(
      m, "call_c_function",
      [](const std::string& function, Type result, const std::vector<Expr>& args) {
        std::vector<Type> types;
        for (const Expr& e : args) types.push_back(e.type());
        return frontend::checked_extern_call(function, result, types, args);
      },
      arg("function"), arg("result"), arg("args"));
}

}  // namespace retrograde::python
