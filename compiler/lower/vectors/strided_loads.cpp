#include "lower/vectors/strided_loads.h"

#include "ir/build.h"
#include "simplify/simplify.h"

namespace retrograde::lower {

namespace {

bool joins(StridedLoad& load, const StridedLoad& first) {
  const bool is_alike = load.node().name == first.node().name &&
                        load.load.type() == first.load.type() && load.stride == first.stride;
  const auto offset =
      is_alike ? as_const_int(simplify(binary(Kind::Sub, load.base, first.base))) : std::nullopt;
  load.offset = offset.value_or(0);
  return offset.has_value();
}

}  // namespace

std::optional<StridedLoad> as_strided(const Expr& e) {
  const auto* load = e.as<Load>();
  const auto* ramp = load && !load->predicate.defined() ? load->index.as<Ramp>() : nullptr;
  if (!ramp || !ramp->base.type().is_scalar()) return std::nullopt;
  const auto stride = as_const_int(ramp->stride);
  return stride ? std::optional(StridedLoad{e, ramp->base, *stride}) : std::nullopt;
}

void add_to_family(StridedLoad load, std::vector<StridedFamily>& families) {
  for (StridedFamily& family : families) {
    if (joins(load, family[0])) return family.push_back(load);
  }
  families.push_back({load});
}

}  // namespace retrograde::lower
