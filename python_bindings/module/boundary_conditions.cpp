// boundary_conditions.cpp -- binds the submodule BoundaryConditions.
#include "frontend/language/boundary_conditions.h"

#include "bind_all.h"
#include "binding.h"

namespace retrograde::python {

namespace {

// Bounds are optional for a Buffer or an ImageParam, which has its own, and required for a Func.
template <class Make>
Func bounded(const py::object& source, const std::optional<Region>& bounds, Make make) {
  if (py::isinstance<Func>(source)) {
    if (!bounds)
      throw py::type_error(
          "a Func has no bounds of its own: give min and extent of each dimension");
    return make(source.cast<const Func&>(), *bounds);
  }
  if (py::isinstance<ImageParam>(source)) {
    const auto& image = source.cast<const ImageParam&>();
    return bounds ? make(image, *bounds) : make(image);
  }
  const auto buffer = source.cast<Buffer<>>();
  return bounds ? make(buffer, *bounds) : make(buffer);
}

}  // namespace

#define RETROGRADE_BOUNDARY_CONDITION(name)                                                      \
  def(                                                                                           \
      sub, #name,                                                                                \
      [](const py::object& source, const std::optional<Region>& bounds) {                        \
        return bounded(source, bounds,                                                           \
                       [](const auto&... given) { return BoundaryConditions::name(given...); }); \
      },                                                                                         \
      py::arg("f"), py::arg("bounds") = py::none())

void bind_boundary_conditions(py::module_& m) {
  py::module_ sub =
      m.def_submodule("BoundaryConditions",
                      "Funcs that are defined everywhere, made from what is defined in a box.");
  def(
      sub, "constant_exterior",
      [](const py::object& source, const py::object& value, const std::optional<Region>& bounds) {
        return bounded(source, bounds, [&](const auto& image, const auto&... region) {
          // A plain number takes the type of the source.
          Func f;
          if constexpr (std::is_same_v<std::decay_t<decltype(image)>, Func>)
            f = image;
          else
            f = BoundaryConditions::detail::func_of(image);
          const bool is_number = is_plain_number(value) && f.types().size() == 1;
          const Tuple outside =
              is_number ? Tuple(operand_for(f.types()[0], value)) : tuple_for(f.types(), value);
          if constexpr (sizeof...(region) == 0 &&
                        !std::is_same_v<std::decay_t<decltype(image)>, Func>) {
            return BoundaryConditions::constant_exterior(image, outside);
          } else {
            return BoundaryConditions::constant_exterior(image, outside, region...);
          }
        });
      },
      py::arg("f"), py::arg("exterior"), py::arg("bounds") = py::none());
  RETROGRADE_BOUNDARY_CONDITION(repeat_edge);
  RETROGRADE_BOUNDARY_CONDITION(repeat_image);
  RETROGRADE_BOUNDARY_CONDITION(mirror_image);
  RETROGRADE_BOUNDARY_CONDITION(mirror_interior);
}

}  // namespace retrograde::python
