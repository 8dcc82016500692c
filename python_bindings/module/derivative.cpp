// derivative.cpp -- binds propagate_adjoints, its options and its results.
#include "autodiff/derivative.h"

#include "autodiff/sweeps/residuals.h"
#include "bind_all.h"
#include "binding.h"
#include "frontend/data/image_param.h"
#include "unlocked.h"

namespace retrograde::python {

namespace {

using py::arg;

void bind_explanations(py::module_& m) {
  Class<Explanation> c(m, "Explanation");
  py::enum_<Explanation::Kind> kind(c, "Kind");
#define RETROGRADE_VALUE(name) kind.value(#name, Explanation::Kind::name)
  RETROGRADE_VALUE(Built);
  RETROGRADE_VALUE(Scattered);
  RETROGRADE_VALUE(Privatised);
  RETROGRADE_VALUE(Zero);
  RETROGRADE_VALUE(NotRequested);
  RETROGRADE_VALUE(Version);
  RETROGRADE_VALUE(Performance);
  RETROGRADE_VALUE(Stored);
  RETROGRADE_VALUE(Recomputed);
  RETROGRADE_VALUE(LeftOut);
  RETROGRADE_VALUE(Cost);
  RETROGRADE_VALUE(Custom);
#undef RETROGRADE_VALUE
  c.def_readonly("kind", &Explanation::kind)
      .def_readonly("subject", &Explanation::subject)
      .def_readonly("detail", &Explanation::detail)
      .def_readonly("bytes", &Explanation::bytes)
      .def("__repr__", [](const Explanation& e) {
        return text("<retrograde.Explanation ", to_string(e.kind), " ", quoted(e.subject), ": ",
                    e.detail, ">");
      });
  py::enum_<Detail>(m, "Detail", documentation("Detail"))
      .value("Summary", Detail::Summary)
      .value("All", Detail::All);
}

void bind_operation_counts(py::module_& m) {
  using autodiff::OperationCount;
  // A number, or None if it depends on sizes that are known only in a call.
  const auto value = [](auto part) {
    return [part](const OperationCount& c) { return (c.*part)().value(); };
  };
  Class<OperationCount>(m, "OperationCount")
      .def("moves", value(&OperationCount::moves))
      .def("adds", value(&OperationCount::adds))
      .def("mults", value(&OperationCount::mults))
      .def("nonlinear", value(&OperationCount::nonlinear))
      .def("operations", value(&OperationCount::operations))
      .def("bytes", value(&OperationCount::bytes));
  Class<GradientOperations>(m, "GradientOperations")
      .def_readonly("primal", &GradientOperations::primal)
      .def_readonly("gradient", &GradientOperations::gradient)
      .def("ratio", &GradientOperations::ratio);
}

void bind_class(py::module_& m) {
  Class<Derivative> c(m, "Derivative");
  const auto of = [](const Derivative& d, const py::object& input, int update_id) {
    if (py::isinstance<Func>(input)) return d(input.cast<const Func&>(), update_id);
    return d.of(input.cast<AdjointInput>());
  };
  c.def("__call__", of, arg("input"), arg("update_id") = -1)
      .def(
          "__getitem__",
          [of](const Derivative& d, const py::object& input) {
            if (!py::isinstance<py::tuple>(input)) return of(d, input, -1);
            const auto [func, update_id] = input.cast<std::pair<Func, int>>();  // d[f, 0]
            return d(func, update_id);
          },
          arg("input"))
      .def("adjoint", &Derivative::adjoint, arg("func"))
      .def("of", &Derivative::of, arg("input"))
      .def("has", &Derivative::has, arg("input"))
      .def("accumulator", &Derivative::accumulator, arg("adjoint"))
      .def("funcs", &Derivative::funcs)
      .def("explanations", &Derivative::explanations)
      .def("costs", &Derivative::costs)
      .def("explain", &Derivative::explain, arg("detail") = Detail::Summary)
      .def("operations", &Derivative::operations)
      .def("__repr__", [](const Derivative& d) {
        return "<retrograde.Derivative of " + text(d.funcs().size()) + " Funcs>";
      });
}

void bind_options(py::module_& m) {
  py::enum_<Overwritten>(m, "Overwritten", documentation("Overwritten"))
      .value("Auto", Overwritten::Auto)
      .value("Refuse", Overwritten::Refuse)
      .value("Store", Overwritten::Store)
      .value("Error", Overwritten::Error);
  Class<AdjointOptions>(m, "AdjointOptions")
      .def(py::init([](Overwritten overwritten, std::optional<int64_t> version_bytes,
                       std::vector<AdjointInput> wrt, std::optional<int> states,
                       std::optional<int64_t> bytes) {
             AdjointOptions options;
             options.overwritten = overwritten;
             options.version_bytes = version_bytes.value_or(options.version_bytes);
             options.wrt = std::move(wrt);
             options.checkpoint_states = states;
             options.checkpoint_bytes = bytes;
             return options;
           }),
           py::kw_only(), arg("overwritten") = Overwritten::Auto, arg("version_bytes") = py::none(),
           arg("wrt") = std::vector<AdjointInput>(), arg("checkpoint_states") = py::none(),
           arg("checkpoint_bytes") = py::none())
      .def_readwrite("overwritten", &AdjointOptions::overwritten)
      .def_readwrite("version_bytes", &AdjointOptions::version_bytes)
      .def_readwrite("wrt", &AdjointOptions::wrt)
      .def_readwrite("checkpoint_states", &AdjointOptions::checkpoint_states)
      .def_readwrite("checkpoint_bytes", &AdjointOptions::checkpoint_bytes);
}

// Only a list: a Func has elements, too.
std::vector<OutputAdjoint> outputs_from(const py::list& outputs) {
  std::vector<OutputAdjoint> result;
  for (const py::handle& output : outputs) {
    if (!py::isinstance<py::tuple>(output) || py::len(output) != 3)
      throw py::type_error("propagate_adjoints: each output is a tuple (output, adjoint, bounds)");
    auto [func, adjoint, bounds] = output.cast<std::tuple<Func, Func, Region>>();
    result.push_back({func, adjoint, bounds});
  }
  return result;
}

void bind_propagation(py::module_& m) {
  def(
      m, "propagate_adjoints",
      [](const Func& output, const AdjointOptions& options) {
        return unlocked([=](const Interruption&) { return propagate_adjoints(output, options); });
      },
      arg("output"), arg("options") = AdjointOptions());
  def(
      m, "propagate_adjoints",
      [](const Func& output, const Func& adjoint, const Region& bounds,
         const AdjointOptions& options) {
        return unlocked([=](const Interruption&) {
          return propagate_adjoints(output, adjoint, bounds, options);
        });
      },
      arg("output"), arg("adjoint"), arg("output_bounds"), arg("options") = AdjointOptions());
  def(
      m, "propagate_adjoints",
      [](const Func& output, const Buffer<>& adjoint, const AdjointOptions& options) {
        return unlocked([=](const Interruption&) {
          return propagate_adjoints(output, adjoint.as<float>(), options);
        });
      },
      arg("output"), arg("adjoint"), arg("options") = AdjointOptions());
  def(
      m, "propagate_adjoints",
      [](const py::list& outputs, const AdjointOptions& options) {
        const std::vector<OutputAdjoint> given = outputs_from(outputs);
        return unlocked([=](const Interruption&) { return propagate_adjoints(given, options); });
      },
      arg("outputs"), arg("options") = AdjointOptions());
}

std::vector<graph::FuncPtr> contents_of(const std::vector<Func>& funcs) {
  std::vector<graph::FuncPtr> result;
  for (const Func& f : funcs) result.push_back(f.function());
  return result;
}

// For operators of PyTorch: Funcs with their extents, and gradients that read images instead.
void bind_residuals(py::module_& m) {
  using Residuals = std::vector<std::pair<Func, std::vector<int64_t>>>;
  m.def("_may_have_residuals", [](const std::vector<Func>& outputs) {
    return unlocked([funcs = contents_of(outputs)](const Interruption&) {
      return autodiff::may_have_residuals(funcs);
    });
  });
  m.def("_residuals", [](const std::vector<Func>& outputs, const std::vector<Func>& gradients) {
    return unlocked([=](const Interruption&) {
      Residuals result;
      for (const auto& [f, extents] :
           autodiff::residuals_of(contents_of(outputs), contents_of(gradients)))
        result.emplace_back(Func(f), extents);
      return result;
    });
  });
  m.def("_reading_residuals", [](const std::vector<Func>& gradients,
                                 const std::vector<Func>& residuals,
                                 const std::vector<ImageParam>& images) {
    std::vector<std::shared_ptr<graph::ParameterContents>> parameters;
    for (const ImageParam& image : images) parameters.push_back(image.parameter());
    std::vector<Func> result;
    for (const graph::FuncPtr& f :
         autodiff::reading_residuals(contents_of(gradients), contents_of(residuals), parameters))
      result.emplace_back(f);
    return result;
  });
}

}  // namespace

void bind_derivative(py::module_& m) {
  bind_explanations(m);
  bind_operation_counts(m);
  Class<AdjointInput>(m, "AdjointInput")
      .def(py::init([](const AdjointInput& input) { return input; }), arg("input"));
  bind_options(m);
  bind_class(m);
  bind_propagation(m);
  bind_residuals(m);
}

}  // namespace retrograde::python
