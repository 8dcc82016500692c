#include "checks/stability_inputs.h"

#include <cmath>
#include <limits>

#include "diagnostics/error.h"

namespace retrograde::checks {

namespace {

using Limits = std::numeric_limits<float>;

// The largest, the smallest normal and the smallest number of a type. Inputs in double are limited to the range of
// float32, since nothing exists to compare larger values with.
struct Ends {
  double max, min, denormal;
};
Ends ends_of(Type type) {
  if (type == Float(16)) return {65504.0, std::ldexp(1.0, -14), std::ldexp(1.0, -24)};
  if (type == BFloat(16))
    return {std::ldexp(255.0, 120), std::ldexp(1.0, -126), std::ldexp(1.0, -133)};
  return {Limits::max(), Limits::min(), Limits::denorm_min()};
}
double magnitude(Extreme extreme, Type type) {
  const Ends ends = ends_of(type);
  switch (extreme) {
    case Extreme::Zeros:
      return 0;
    case Extreme::Denormals:
      return ends.denormal * 100;
    case Extreme::Huge:
      return ends.max / 4;
    case Extreme::Tiny:
      return ends.min * 2;
    case Extreme::Infinities:
      return std::numeric_limits<double>::infinity();
    case Extreme::NaNs:
      return std::numeric_limits<double>::quiet_NaN();
  }
  return 0;
}

}  // namespace

void StabilityInputs::add(const Input& input) {
  inputs_.push_back(input);
  now_.push_back(input.values);
}

void StabilityInputs::check_ranges(const std::string& asked) const {
  for (const InputRange& r : ranges_) {
    if (!(std::isfinite(r.low) && std::isfinite(r.high) && r.low <= r.high)) {
      user_error(asked, "a range has two finite ends, the lower first",
                 text("there is one from ", r.low, " to ", r.high),
                 "Give the lower end first, and leave infinities to StabilityOptions::extremes");
    }
    bool found = false;
    for (const Input& input : inputs_) found |= input.own == r.input.symbol();
    if (!found) {
      user_error(asked, "a range belongs to a floating input that the output depends on",
                 "there is one of something else", "Give an ImageParam, a Buffer or a Param");
    }
  }
}

// ---- values in both precisions ----

void StabilityInputs::set(size_t i, const Values& values) {
  now_[i] = values;
  inputs_[i].set_own(values);
  inputs_[i].set_wide(values);
}

void StabilityInputs::restore() {
  for (size_t i = 0; i < inputs_.size(); ++i) set(i, inputs_[i].values);
}

void StabilityInputs::replace_some(Extreme extreme) {
  for (size_t k = 0; k < inputs_.size(); ++k) {
    Values values = inputs_[k].values;
    bool any = false;
    for (size_t i = 0; i < values.size(); ++i) {
      bool chosen = random_() % 4 == 0 || (i + 1 == values.size() && !any);
      if (!chosen) continue;
      any = true;
      values[i] = magnitude(extreme, inputs_[k].own->type) * (random_() % 2 ? 1 : -1);
    }
    set(k, values);
  }
}

void StabilityInputs::draw_in_ranges() {
  draw([&](const InputRange& r) { return inside(r); });
}

void StabilityInputs::draw_ends_of_ranges() {
  draw([&](const InputRange& r) { return random_() % 2 ? r.low : r.high; });
}

template <class Pick>
void StabilityInputs::draw(Pick pick) {
  for (const InputRange& range : ranges_) {
    for (size_t k = 0; k < inputs_.size(); ++k) {
      if (inputs_[k].own != range.input.symbol()) continue;
      Values values = inputs_[k].values;
      for (double& v : values) v = held_by(inputs_[k].own->type, pick(range));
      set(k, values);
    }
  }
}

double StabilityInputs::inside(const InputRange& range) {
  std::uniform_real_distribution<double> at(0, 1);
  const double t = at(random_);
  if (range.low > 0 && range.high > 1000 * range.low)
    return range.low * std::pow(range.high / range.low, t);
  return range.low + (range.high - range.low) * t;
}

// ---- roundings in double ----

void StabilityInputs::round_at_random() {
  const double eps = Limits::epsilon();
  std::uniform_real_distribution<double> rounding(-eps, eps);
  for (size_t k = 0; k < inputs_.size(); ++k) {
    Values moved = now_[k];
    for (double& v : moved) v *= 1 + rounding(random_);
    inputs_[k].set_wide(moved);
  }
}

void StabilityInputs::undo_rounding() {
  for (size_t k = 0; k < inputs_.size(); ++k) inputs_[k].set_wide(now_[k]);
}

}  // namespace retrograde::checks
