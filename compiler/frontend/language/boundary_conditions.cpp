// boundary_conditions.cpp -- maps coordinates into the bounds, one map for each condition.
//
// The branch for coordinates inside the bounds is marked likely, and also clamped. So the map simplifies to the
// coordinate itself in the steady state of a loop, and its range is never larger than the bounds.
#include "frontend/language/boundary_conditions.h"

#include "ir/literal.h"
#include "ir/print.h"

namespace retrograde::BoundaryConditions {

namespace {

using CoordinateMap = Expr (*)(const Expr& x, const Expr& min, const Expr& extent);

Expr clamp_into(const Expr& x, const Expr& min, const Expr& extent) {
  return clamp(x, min, min + extent - 1);
}

// x inside the bounds, `outside` elsewhere.
Expr inside_or(const Expr& x, const Expr& min, const Expr& extent, const Expr& outside) {
  return select(x < min || x > min + extent - 1, outside, clamp_into(likely(x), min, extent));
}

Expr edge(const Expr& x, const Expr& min, const Expr& extent) {
  return clamp_into(likely(x), min, extent);
}

Expr wrap(const Expr& x, const Expr& min, const Expr& extent) {
  return inside_or(x, min, extent, min + (x - min) % extent);
}

Expr mirror(const Expr& x, const Expr& min, const Expr& extent) {
  const Expr within_two = (x - min) % (2 * extent);
  const Expr reflected = select(within_two >= extent, 2 * extent - 1 - within_two, within_two);
  return inside_or(x, min, extent, clamp_into(min + reflected, min, extent));
}

// With a single element the period is 0, and the remainder by 0 is 0.
Expr mirror_inside(const Expr& x, const Expr& min, const Expr& extent) {
  const Expr last = extent - 1;
  const Expr within_two = (x - min) % (2 * last);
  const Expr reflected = last - cast<int>(absd(last, within_two));
  return inside_or(x, min, extent, clamp_into(min + reflected, min, extent));
}

void check_range(const Range& range, const std::string& asked) {
  for (const Expr& e : {range.min, range.extent}) {
    if (e.defined() && !(e.type().is_int_or_uint() && e.type().is_scalar())) {
      user_error(asked, "bounds are integers", text(e, " has type ", to_string(e.type())),
                 "Convert it: cast<int>(...)");
    }
  }
  const auto extent = range.extent.defined() ? ir::as_const_int(range.extent) : std::nullopt;
  if (extent && *extent < 0)
    user_error(asked, "an extent is not negative", text("it is ", *extent), "Give 0 or more");
}

void check(const Func& source, const Region& bounds, const char* name) {
  const std::string asked = text("apply ", name, " to ", quoted(source.name()));
  if (!source.defined())
    user_error(asked, "it must have a definition", "it has none", "Define it first");
  if (bounds.size() > static_cast<size_t>(source.dimensions())) {
    user_error(asked, "there are bounds for at most its dimensions",
               text("it has ", source.dimensions(), " dimensions and was given ", bounds.size(),
                    " bounds"),
               "Drop the bounds beyond");
  }
  for (const Range& range : bounds) check_range(range, asked);
}

bool is_bounded(const Range& range) { return range.min.defined() && range.extent.defined(); }

Expr as_int(const Expr& e) { return ir::int32_literal(e, "apply a boundary condition"); }

Func remap(const Func& source, const Region& bounds, CoordinateMap map, const char* name) {
  check(source, bounds, name);
  const std::vector<Var> args = source.args();
  const std::vector<Expr> at = ir::numbered(args.size(), [&](size_t d) {
    const bool mapped = d < bounds.size() && is_bounded(bounds[d]);
    return mapped ? map(args[d], as_int(bounds[d].min), as_int(bounds[d].extent)) : Expr(args[d]);
  });
  Func result(name);
  result(args) = source(at);
  return result;
}

}  // namespace

Func repeat_edge(const Func& source, const Region& bounds) {
  return remap(source, bounds, edge, "repeat_edge");
}
Func repeat_image(const Func& source, const Region& bounds) {
  return remap(source, bounds, wrap, "repeat_image");
}
Func mirror_image(const Func& source, const Region& bounds) {
  return remap(source, bounds, mirror, "mirror_image");
}
Func mirror_interior(const Func& source, const Region& bounds) {
  return remap(source, bounds, mirror_inside, "mirror_interior");
}

Func constant_exterior(const Func& source, const Expr& value, const Region& bounds) {
  return constant_exterior(source, Tuple(value), bounds);
}

Func constant_exterior(const Func& source, const Tuple& value, const Region& bounds) {
  check(source, bounds, "constant_exterior");
  if (value.size() != source.output_types().size()) {
    user_error("apply constant_exterior to " + quoted(source.name()),
               "there is one constant for each value",
               text("it has ", source.output_types().size(), " values and was given ", value.size(),
                    " constants"),
               "Give a Tuple of that many constants");
  }
  for (const Expr& constant : value.as_vector()) {
    if (constant.defined()) continue;
    user_error("apply constant_exterior to " + quoted(source.name()),
               "the value outside is a defined expression", "it was never assigned",
               "Give the value");
  }
  const std::vector<Var> args = source.args();
  std::vector<Expr> at(args.begin(), args.end());
  Expr outside = ir::const_false();
  for (size_t d = 0; d < bounds.size(); d++) {
    if (!is_bounded(bounds[d])) continue;
    const Expr x = args[d], min = as_int(bounds[d].min), extent = as_int(bounds[d].extent);
    outside = outside || x < min || x >= min + extent;
    at[d] = edge(x, min, extent);
  }
  const Tuple inside = source(at);
  std::vector<Expr> values;
  for (size_t i = 0; i < value.size(); i++) {
    const Expr constant = ir::literal_in(source.output_types()[i], value[i],
                                         "apply constant_exterior to " + quoted(source.name()),
                                         "the value outside has the type of the values inside");
    values.push_back(ir::make_select(outside, constant, likely(inside[i])));
  }
  Func result("constant_exterior");
  result(args) = Tuple(values);
  return result;
}

}  // namespace retrograde::BoundaryConditions
