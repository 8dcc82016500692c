// custom_derivative.cpp -- binds custom_adjoint and custom_tangent, whose rules are Python functions.
#include "autodiff/custom_derivative.h"

#include "bind_all.h"
#include "binding.h"
#include "callback.h"

namespace retrograde::python {

namespace {

using py::arg;

// A contribution from (input, Func), or a zero derivative from (input, None).
std::optional<AdjointContribution> contribution_from(py::handle object) {
  if (py::isinstance<AdjointContribution>(object)) return object.cast<AdjointContribution>();
  if (!py::isinstance<py::tuple>(object) || py::len(object) != 2) return {};
  const auto pair = py::reinterpret_borrow<py::tuple>(object);
  const auto input = pair[0].cast<AdjointInput>();
  if (pair[1].is_none()) return AdjointContribution::zero(input);
  return AdjointContribution(input, pair[1].cast<Func>());
}

std::vector<AdjointContribution> contributions_of(const py::object& objects) {
  std::vector<AdjointContribution> result;
  for (py::handle one : objects) {
    std::optional<AdjointContribution> contribution = contribution_from(one);
    if (!contribution)
      throw py::type_error("a rule gives AdjointContributions, or pairs of an input and a Func");
    result.push_back(std::move(*contribution));
  }
  return result;
}

CustomAdjoint adjoint_rule(const py::function& rule) {
  return [rule = Callback(rule)](const AdjointContext& context) {
    const py::gil_scoped_acquire acquire;
    return contributions_of(rule.call<py::object>(context));
  };
}

ExternReads reads_of(const std::optional<py::function>& reads) {
  if (!reads) return nullptr;
  return [reads = Callback(*reads)](const AdjointInput& argument, const Region& of_func) {
    return reads.call<Region>(argument, of_func);
  };
}

void bind_adjoints(py::module_& m) {
  Class<AdjointContext>(m, "AdjointContext")
      .def("func", &AdjointContext::func)
      .def("adjoint", &AdjointContext::adjoint)
      .def("region", &AdjointContext::region)
      .def("wants", &AdjointContext::wants, arg("input"))
      .def("region_of", &AdjointContext::region_of, arg("input"));
  Class<AdjointContribution>(m, "AdjointContribution")
      .def(py::init<AdjointInput, const Func&>(), arg("input"), arg("adjoint"))
      .def_static("zero", &AdjointContribution::zero, arg("input"))
      .def_readonly("input", &AdjointContribution::input)
      .def_readonly("adjoint", &AdjointContribution::adjoint)
      .def_readonly("is_zero", &AdjointContribution::is_zero);
  def(
      m, "custom_adjoint",
      [](const Func& func, const std::vector<AdjointInput>& inputs, const py::function& rule,
         const std::optional<py::function>& reads) {
        custom_adjoint(func, inputs, adjoint_rule(rule), reads_of(reads));
      },
      arg("func"), arg("inputs"), arg("rule"), arg("reads") = py::none());
}

void bind_tangents_of(py::module_& m) {
  Class<TangentContext>(m, "TangentContext")
      .def("func", &TangentContext::func)
      .def("moves", &TangentContext::moves, arg("input"))
      .def("tangent", &TangentContext::tangent, arg("input"));
  def(
      m, "custom_tangent",
      [](const Func& func, const std::vector<AdjointInput>& inputs, const py::function& rule) {
        custom_tangent(func, inputs, [rule = Callback(rule)](const TangentContext& context) {
          return rule.call<Func>(context);
        });
      },
      arg("func"), arg("inputs"), arg("rule"));
}

}  // namespace

void bind_custom_derivative(py::module_& m) {
  bind_adjoints(m);
  bind_tangents_of(m);
}

}  // namespace retrograde::python
