// stability_inputs.h -- the inputs of a stability check, and the sets of values that they take during it.
//
// Each input exists in its own precision and in double. Extremes and samples are set in both; roundings of the values
// are drawn in double alone, since the input's own precision does not resolve them.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "checks/arrays.h"
#include "checks/check_stability.h"

namespace retrograde::checks {

class StabilityInputs {
 public:
  explicit StabilityInputs(const StabilityOptions& options)
      : ranges_(options.ranges), random_(options.seed) {}

  void add(const Input& input);
  // Throws CompileError unless each range has two finite ends, the lower first, and belongs to one of the inputs.
  // `asked` begins the message.
  void check_ranges(const std::string& asked) const;

  // Back to the bound values.
  void restore();
  // Sets a random quarter of each input's elements, at least one, to the extreme with random signs.
  void replace_some(Extreme extreme);
  // Sets each element of an input with a range to a random value in the range, or to a random end of it.
  void draw_in_ranges();
  void draw_ends_of_ranges();

  // Changes the values in double by random roundings to float32.
  void round_at_random();
  void undo_rounding();

 private:
  template <class Pick>
  void draw(Pick pick);
  double inside(const InputRange& range);
  void set(size_t i, const Values& values);

  const std::vector<InputRange> ranges_;
  std::mt19937_64 random_;
  std::vector<Input> inputs_;
  std::vector<Values> now_;  // current values of the inputs
};

}  // namespace retrograde::checks
