// tangents.cpp -- binds forward mode, Hessian-vector products, Jacobians and Hessians.
#include "autodiff/tangents.h"

#include "autodiff/jacobian.h"
#include "autodiff/second_order.h"
#include "bind_all.h"
#include "binding.h"
#include "unlocked.h"

namespace retrograde::python {

namespace {

using py::arg;

void bind_tangents_class(py::module_& m) {
  Class<Direction>(m, "Direction")
      .def(py::init<AdjointInput, const Func&>(), arg("input"), arg("tangent"))
      .def(py::init([](AdjointInput input, const Buffer<>& tangent) {
             return Direction(input, tangent);
           }),
           arg("input"), arg("tangent"))
      .def_readonly("input", &Direction::input)
      .def_readonly("tangent", &Direction::tangent)
      .def_static("as_func", &Direction::as_func, arg("buffer"));
  Class<Tangents>(m, "Tangents")
      .def("__call__", &Tangents::operator(), arg("func"))
      .def("__getitem__", &Tangents::operator(), arg("func"))
      .def("funcs", &Tangents::funcs)
      .def("explanations", &Tangents::explanations)
      .def("explain", &Tangents::explain, arg("detail") = Detail::Summary);
  def(
      m, "propagate_tangents",
      [](const Func& output, const std::vector<Direction>& directions) {
        return unlocked(
            [=](const Interruption&) { return propagate_tangents(output, directions); });
      },
      arg("output"), arg("directions"));
  def(
      m, "hessian_vector_product",
      [](const Func& loss, const AdjointInput& wrt, const std::vector<Direction>& directions,
         Overwritten overwritten) {
        return unlocked([=](const Interruption&) {
          return hessian_vector_product(loss, wrt, directions, overwritten);
        });
      },
      arg("loss"), arg("wrt"), arg("directions"), arg("overwritten") = Overwritten::Store);
}

void bind_jacobian_class(py::module_& m) {
  py::enum_<Compression>(m, "Compression", documentation("Compression"))
      .value("Auto", Compression::Auto)
      .value("Columns", Compression::Columns)
      .value("Rows", Compression::Rows);
  Class<JacobianOptions>(m, "JacobianOptions")
      .def(py::init([](Compression compression, Overwritten overwritten) {
             return JacobianOptions{compression, overwritten};
           }),
           py::kw_only(), arg("compression") = Compression::Auto,
           arg("overwritten") = Overwritten::Store)
      .def_readwrite("compression", &JacobianOptions::compression)
      .def_readwrite("overwritten", &JacobianOptions::overwritten);
  Class<Jacobian>(m, "Jacobian")
      .def("colours", &Jacobian::colours)
      .def("by_rows", &Jacobian::by_rows)
      .def("colour", &Jacobian::colour, arg("element"))
      .def("compressed", &Jacobian::compressed)
      .def("dense", &Jacobian::dense)
      .def("band", &Jacobian::band)
      .def("band_offsets", &Jacobian::band_offsets)
      .def("explain", &Jacobian::explain);
  Class<HessianDiagonal>(m, "HessianDiagonal")
      .def_readonly("diagonal", &HessianDiagonal::diagonal)
      .def_readonly("colours", &HessianDiagonal::colours)
      .def_readonly("compressed", &HessianDiagonal::compressed);
}

void bind_matrices(py::module_& m) {
  bind_jacobian_class(m);
  constexpr auto store = Overwritten::Store;
  def(
      m, "jacobian",
      [](const Func& output, const AdjointInput& input, const Region& bounds,
         const JacobianOptions& options) {
        return unlocked(
            [=](const Interruption&) { return jacobian(output, input, bounds, options); });
      },
      arg("output"), arg("input"), arg("output_bounds"), arg("options") = JacobianOptions());
  def(
      m, "hessian",
      [](const Func& loss, const AdjointInput& wrt, Overwritten overwritten) {
        return unlocked([=](const Interruption&) { return hessian(loss, wrt, overwritten); });
      },
      arg("loss"), arg("wrt"), arg("overwritten") = store);
  def(
      m, "hessian",
      [](const Func& loss, const AdjointInput& rows, const AdjointInput& columns,
         Overwritten overwritten) {
        return unlocked(
            [=](const Interruption&) { return hessian(loss, rows, columns, overwritten); });
      },
      arg("loss"), arg("rows"), arg("columns"), arg("overwritten") = store);
  def(
      m, "hessian_diagonal",
      [](const Func& loss, const AdjointInput& wrt, Overwritten overwritten) {
        return unlocked(
            [=](const Interruption&) { return hessian_diagonal(loss, wrt, overwritten); });
      },
      arg("loss"), arg("wrt"), arg("overwritten") = store);
}

}  // namespace

void bind_tangents(py::module_& m) {
  bind_tangents_class(m);
  bind_matrices(m);
}

}  // namespace retrograde::python
