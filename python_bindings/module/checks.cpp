// checks.cpp -- binds check_gradients, check_stability and their reports.
#include "bind_all.h"
#include "binding.h"
#include "checks/check_gradients.h"
#include "checks/check_stability.h"
#include "unlocked.h"

namespace retrograde::python {

namespace {

using py::arg;

void bind_gradient_parts(py::class_<GradientReport>& report) {
  using Step = GradientReport::Step;
  Class<Step>(report, "Step", {"GradientReport::Step"})
      .def_readonly("step", &Step::step)
      .def_readonly("central_error", &Step::central_error)
      .def_readonly("richardson_error", &Step::richardson_error)
      .def_readonly("seconds", &Step::seconds);
  using Method = GradientReport::Method;
  Class<Method>(report, "Method", {"GradientReport::Method"})
      .def_readonly("name", &Method::name)
      .def_readonly("error", &Method::error)
      .def_readonly("seconds", &Method::seconds);
  using Input = GradientReport::Input;
  Class<Input>(report, "Input", {"GradientReport::Input"})
      .def_readonly("name", &Input::name)
      .def_readonly("adjoint_error", &Input::adjoint_error)
      .def_readonly("complex_step_error", &Input::complex_step_error)
      .def_readonly("dot_product_error", &Input::dot_product_error)
      .def_readonly("own_precision_error", &Input::own_precision_error)
      .def_readonly("steps", &Input::steps)
      .def_readonly("methods", &Input::methods);
  using FuncError = GradientReport::FuncError;
  Class<FuncError>(report, "FuncError", {"GradientReport::FuncError"})
      .def_readonly("name", &FuncError::name)
      .def_readonly("error", &FuncError::error)
      .def_readonly("lost", &FuncError::lost);
}

void bind_gradient_report(py::module_& m) {
  Class<GradientReport> report(m, "GradientReport");
  bind_gradient_parts(report);
  report.def_readonly("inputs", &GradientReport::inputs)
      .def_readonly("funcs", &GradientReport::funcs)
      .def_readonly("loses_digits", &GradientReport::loses_digits)
      .def_readonly("complex_step_refused", &GradientReport::complex_step_refused)
      .def_readonly("worst_error", &GradientReport::worst_error)
      .def_readonly("primal_seconds", &GradientReport::primal_seconds)
      .def_readonly("adjoint_seconds", &GradientReport::adjoint_seconds)
      .def("to_json", &GradientReport::to_json)
      .def("__repr__", [](const GradientReport& r) {
        return text("<retrograde.GradientReport of ", r.inputs.size(), " inputs, worst error ",
                    r.worst_error, ">");
      });
}

void bind_gradient_check(py::module_& m) {
  using Options = GradientCheckOptions;
  Class<Options>(m, "GradientCheckOptions")
      .def(py::init([](int directions, unsigned seed, int smallest_step,
                       std::vector<AdjointInput> wrt, std::vector<int> mins) {
             return Options{directions, seed, smallest_step, std::move(wrt), std::move(mins)};
           }),
           py::kw_only(), arg("directions") = 3, arg("seed") = 1, arg("smallest_step") = 24,
           arg("wrt") = std::vector<AdjointInput>(), arg("mins") = std::vector<int>())
      .def_readwrite("directions", &Options::directions)
      .def_readwrite("seed", &Options::seed)
      .def_readwrite("smallest_step", &Options::smallest_step)
      .def_readwrite("wrt", &Options::wrt)
      .def_readwrite("mins", &Options::mins);
  def(
      m, "check_gradients",
      [](const Func& output, const std::vector<int>& sizes, const Options& options) {
        return unlocked(
            [=](const Interruption&) { return check_gradients(output, sizes, options); });
      },
      arg("output"), arg("sizes") = std::vector<int>(), arg("options") = Options());
}

void bind_stability_parts(py::class_<StabilityReport>& report) {
  using FuncResult = StabilityReport::FuncResult;
  Class<FuncResult>(report, "FuncResult", {"StabilityReport::FuncResult"})
      .def_readonly("name", &FuncResult::name)
      .def_readonly("is_adjoint", &FuncResult::is_adjoint)
      .def_readonly("value", &FuncResult::value)
      .def_readonly("worst_error", &FuncResult::worst_error)
      .def_readonly("condition", &FuncResult::condition)
      .def_readonly("rounding", &FuncResult::rounding)
      .def_readonly("non_finite", &FuncResult::non_finite)
      .def_readonly("lost", &FuncResult::lost);
  using Place = StabilityReport::Place;
  Class<Place>(report, "Place", {"StabilityReport::Place"})
      .def_readonly("func", &Place::func)
      .def_readonly("is_adjoint", &Place::is_adjoint)
      .def_readonly("value", &Place::value)
      .def_readonly("at", &Place::at)
      .def_readonly("own", &Place::own)
      .def_readonly("in_double", &Place::in_double)
      .def_readonly("operation", &Place::operation);
  using Case = StabilityReport::Case;
  Class<Case>(report, "Case", {"StabilityReport::Case"})
      .def_readonly("name", &Case::name)
      .def_readonly("funcs", &Case::funcs)
      .def_readonly("first_lost", &Case::first_lost)
      .def_readonly("first_non_finite", &Case::first_non_finite);
  using LeftOut = StabilityReport::LeftOut;
  Class<LeftOut>(report, "LeftOut", {"StabilityReport::LeftOut"})
      .def_readonly("name", &LeftOut::name)
      .def_readonly("reason", &LeftOut::reason);
}

void bind_stability_options(py::module_& m) {
  py::enum_<Extreme> extreme(m, "Extreme", documentation("Extreme"));
  extreme.value("Zeros", Extreme::Zeros)
      .value("Denormals", Extreme::Denormals)
      .value("Huge", Extreme::Huge)
      .value("Tiny", Extreme::Tiny)
      .value("Infinities", Extreme::Infinities)
      .value("NaNs", Extreme::NaNs);
  Class<InputRange>(m, "InputRange")
      .def(py::init<AdjointInput, double, double>(), arg("input"), arg("low"), arg("high"))
      .def_readonly("input", &InputRange::input)
      .def_readonly("low", &InputRange::low)
      .def_readonly("high", &InputRange::high);
  using Options = StabilityOptions;
  Class<Options>(m, "StabilityOptions")
      .def(py::init([](std::vector<Extreme> extremes, std::vector<InputRange> ranges, int samples,
                       int perturbations, unsigned seed, std::vector<int> mins) {
             return Options{std::move(extremes), std::move(ranges), samples, perturbations, seed,
                            std::move(mins)};
           }),
           py::kw_only(), arg("extremes") = Options().extremes,
           arg("ranges") = std::vector<InputRange>(), arg("samples") = 3, arg("perturbations") = 3,
           arg("seed") = 1, arg("mins") = std::vector<int>())
      .def_readwrite("extremes", &Options::extremes)
      .def_readwrite("ranges", &Options::ranges)
      .def_readwrite("samples", &Options::samples)
      .def_readwrite("perturbations", &Options::perturbations)
      .def_readwrite("seed", &Options::seed)
      .def_readwrite("mins", &Options::mins);
}

void bind_stability(py::module_& m) {
  bind_stability_options(m);
  Class<StabilityReport> report(m, "StabilityReport");
  bind_stability_parts(report);
  report.def_readonly("cases", &StabilityReport::cases)
      .def_readonly("left_out", &StabilityReport::left_out)
      .def("to_json", &StabilityReport::to_json);
  def(
      m, "check_stability",
      [](const Func& output, const std::vector<int>& sizes, const StabilityOptions& options) {
        return unlocked(
            [=](const Interruption&) { return check_stability(output, sizes, options); });
      },
      arg("output"), arg("sizes") = std::vector<int>(), arg("options") = StabilityOptions());
}

}  // namespace

void bind_checks(py::module_& m) {
  bind_gradient_report(m);
  bind_gradient_check(m);
  bind_stability(m);
}

}  // namespace retrograde::python
