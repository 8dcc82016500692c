// boundary_conditions.h -- extends Funcs and images beyond their bounds, so that stencils can read past the border.
//
// Inside the bounds each result equals the source. Outside, for a dimension with the elements abcd:
//   constant_exterior   a constant
//   repeat_edge         the nearest element:                    aaa|abcd|ddd
//   repeat_image        the box again and again:                bcd|abcd|abc
//   mirror_image        the box mirrored, edges twice:          cba|abcd|dcb
//   mirror_interior     the box mirrored, edges once:           dcb|abcd|cba
//                       (a single element: that element everywhere)
// The source is a Func with bounds, or a Buffer or ImageParam, whose own bounds are the default. A dimension without
// bounds, or whose min or extent is an undefined Expr, is not extended. Loop partitioning separates the interior,
// which then costs nothing extra.
#pragma once

#include <type_traits>
#include <utility>

#include "frontend/language/func.h"

namespace retrograde::BoundaryConditions {

// Extends `source` by a constant: points outside of `bounds` have the value `value`.
// Requires: it must have a definition; there are bounds for at most its dimensions; bounds are
// integers; an extent is not negative; there is one constant for each value; the value outside is a
// defined expression; the value outside has the type of the values inside.
Func constant_exterior(const Func& source, const Tuple& value, const Region& bounds);
Func constant_exterior(const Func& source, const Expr& value, const Region& bounds);
// Extends `source` by its border: a point outside has the value of the nearest element inside.
Func repeat_edge(const Func& source, const Region& bounds);
// Extends `source` periodically: the box repeats in every direction.
Func repeat_image(const Func& source, const Region& bounds);
// Extends `source` by mirroring it; the border elements appear twice.
Func mirror_image(const Func& source, const Region& bounds);
// Extends `source` by mirroring it around its border elements, which appear once.
Func mirror_interior(const Func& source, const Region& bounds);

namespace detail {
template <typename T>
concept Image = !std::is_same_v<T, Func> && requires(const T& image) {
  image.dim(0).extent();
};

template <Image T>
Func func_of(const T& image) {
  Func f;
  f(_) = image(_);
  return f;
}
template <Image T>
Region bounds_of(const T& image) {
  return ir::numbered(image.dimensions(), [&](int d) {
    return Range{Expr(image.dim(d).min()), Expr(image.dim(d).extent())};
  });
}
// Reads bounds in the order min, extent, min, extent, ...
inline void collect(Region&) {}
template <typename... Rest>
void collect(Region& bounds, Expr min, Expr extent, Rest&&... rest) {
  bounds.push_back({std::move(min), std::move(extent)});
  collect(bounds, std::forward<Rest>(rest)...);
}
template <typename... Bounds>
Region region_of(Bounds&&... bounds) {
  Region result;
  collect(result, std::forward<Bounds>(bounds)...);
  return result;
}
}  // namespace detail

#define RETROGRADE_BOUNDARY_CONDITION(name)                        \
  template <detail::Image T>                                       \
  Func name(const T& image) {                                      \
    return name(detail::func_of(image), detail::bounds_of(image)); \
  }                                                                \
  template <detail::Image T>                                       \
  Func name(const T& image, const Region& bounds) {                \
    return name(detail::func_of(image), bounds);                   \
  }
// Requires: it must have a definition; there are bounds for at most its dimensions; bounds are
// integers; an extent is not negative.
RETROGRADE_BOUNDARY_CONDITION(repeat_edge)
RETROGRADE_BOUNDARY_CONDITION(repeat_image)
RETROGRADE_BOUNDARY_CONDITION(mirror_image)
RETROGRADE_BOUNDARY_CONDITION(mirror_interior)
#undef RETROGRADE_BOUNDARY_CONDITION

template <detail::Image T>
Func constant_exterior(const T& image, const Tuple& value) {
  return constant_exterior(detail::func_of(image), value, detail::bounds_of(image));
}
template <detail::Image T>
Func constant_exterior(const T& image, const Expr& value) {
  return constant_exterior(image, Tuple(value));
}
template <detail::Image T>
Func constant_exterior(const T& image, const Tuple& value, const Region& bounds) {
  return constant_exterior(detail::func_of(image), value, bounds);
}
template <detail::Image T>
Func constant_exterior(const T& image, const Expr& value, const Region& bounds) {
  return constant_exterior(detail::func_of(image), Tuple(value), bounds);
}
// constant_exterior(f, 0, min_x, extent_x, min_y, extent_y)
template <typename T, typename... Bounds>
requires(sizeof...(Bounds) >= 2 && (std::is_convertible_v<Bounds, Expr> && ...)) Func
    constant_exterior(const T& source, const Expr& value, Bounds&&... bounds) {
  return constant_exterior(source, value, detail::region_of(std::forward<Bounds>(bounds)...));
}
template <typename T, typename... Bounds>
requires(sizeof...(Bounds) >= 2 && (std::is_convertible_v<Bounds, Expr> && ...)) Func
    constant_exterior(const T& source, const Tuple& value, Bounds&&... bounds) {
  return constant_exterior(source, value, detail::region_of(std::forward<Bounds>(bounds)...));
}

}  // namespace retrograde::BoundaryConditions
