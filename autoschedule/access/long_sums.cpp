#include "autoschedule/access/long_sums.h"

#include <algorithm>

#include "autoschedule/access/lane_form.h"
#include "autoschedule/access/plain_reduction.h"
#include "autoschedule/machine/reference.h"
#include "ir/lets.h"

namespace retrograde::planning {

namespace {

// Extremes are exact.
bool is_plain_sum(const graph::FuncContents& f, const graph::Definition& update) {
  const ir::Kind kind = ir::without_lets(update.values[0]).kind();
  return (kind == ir::Kind::Add || kind == ir::Kind::Sub) && is_plain_reduction(f, update);
}

bool lie_together(const StageNode& stage, int iterator, const SizeModel& sizes) {
  using Kind = LaneForm::Kind;
  const auto kind_of = [&](const Access& read) {
    return lane_form(read, iterator, schedule_lanes, sizes, {line_elements}).kind;
  };
  const auto is_apart = [&](const Access& read) {
    return kind_of(read) == Kind::Strided || kind_of(read) == Kind::Gather;
  };
  const auto is_together = [&](const Access& read) { return kind_of(read) == Kind::Contiguous; };
  return std::ranges::none_of(stage.reads, is_apart) &&
         std::ranges::any_of(stage.reads, is_together);
}

}  // namespace

std::vector<int> reduction_of(const StageNode& stage) {
  std::vector<int> result;
  for (size_t i = 0; i < stage.iterators.size(); ++i) {
    if (stage.iterators[i].kind == Iterator::Kind::Reduction) result.push_back(static_cast<int>(i));
  }
  return result;
}

bool adds_in_place(const StageNode& stage) {
  IteratorSet loops = 0;
  for (const int i : reduction_of(stage)) loops |= set_of(i);
  return std::ranges::none_of(stage.write.index, [&](const IndexForm& form) {
    return form.has_data() || (form.moved_by() & loops) != 0;
  });
}

double terms_of(StageId stage, const SizeModel& sizes) {
  double terms = 1;
  for (const int i : reduction_of(sizes.graph().stage(stage)))
    terms *= static_cast<double>(std::max<int64_t>(sizes.of(stage, i).estimate, 1));
  return terms;
}

bool is_long_sum(StageId stage, const SizeModel& sizes) {
  const graph::FuncContents& f = *sizes.graph().func(stage.func).func;
  if (stage.stage == 0 || f.made || f.types.size() != 1) return false;
  return f.types[0].is_float() && f.types[0].bits() < 64 &&
         terms_of(stage, sizes) > longest_chain && is_plain_sum(f, f.stage(stage.stage));
}

bool is_short_in_lanes(StageId stage, const SizeModel& sizes) {
  const StageNode& node = sizes.graph().stage(stage);
  return terms_of(stage, sizes) <= longest_chain * schedule_lanes &&
         std::ranges::any_of(reduction_of(node), [&](int i) {
           return sizes.of(stage, i).estimate >= schedule_lanes && lie_together(node, i, sizes);
         });
}

}  // namespace retrograde::planning
