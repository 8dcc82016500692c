// rewritable_updates.h -- which updates of the compiler's own copy of a graph may get other loops and other updates in
// their place: plain recurrences over few elements besides.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "graph/function.h"
#include "transform/hosted_funcs.h"
#include "transform/size_estimate.h"

namespace retrograde::transform {

class RewritableUpdates {
 public:
  explicit RewritableUpdates(const std::vector<FuncPtr>& outputs)
      : outputs_(outputs), hosts_(hosts_in(outputs)) {}

  // Whether the update reads other elements than the one it writes, and neither it nor its Func has directives, effects,
  // parts of sums, Funcs in its loops, or more than `most` elements in its pure dimensions.
  bool contain(const FuncContents& f, const Definition& update, int64_t most);

 private:
  bool has_few_pure_elements(const FuncContents& f, const Definition& update, int64_t most);

  const std::vector<FuncPtr>& outputs_;
  const std::set<std::string> hosts_;
  std::optional<SizeEstimate> sizes_;  // computed when it is needed
};

// Whether the extent may be `least` or more, as far as is known.
bool is_long(const Expr& extent, int64_t least);

}  // namespace retrograde::transform
