#include "autoschedule/plan/split_history.h"

#include <algorithm>
#include <limits>
#include <map>
#include <string>

#include "autoschedule/plan/nest.h"
#include "graph/names.h"
#include "ir/build.h"

namespace retrograde::planning {

namespace {

using graph::Split;

// A loop of the schedule so far: `step` points of its iterator at a time, within `range` points; 0: all of them.
struct Piece {
  int16_t iterator = 0;
  int64_t step = 1, range = 0;
};

// A split at a step of an iterator, in the order of the schedule.
struct Cut {
  int16_t iterator = 0;
  int64_t step = 1;
  TailStrategy tail = TailStrategy::Auto;
};

class HistoryReader {
 public:
  HistoryReader(const graph::FuncContents& f, int stage)
      : schedule_(f.stage(stage).schedule), iterators_(iterators_of(f, stage)) {
    for (const std::string& name : iterators_) pieces_[name] = {next_++};
  }

  History run() {
    for (const Split& split : schedule_.splits) {
      if (const Opacity why = apply(split); why != Opacity::None) return {{}, why};
    }
    for (auto dim = schedule_.dims.rbegin(); dim != schedule_.dims.rend(); ++dim) {
      if (dim->partition != Partition::Auto) return {{}, Opacity::Partition};
      nest_.loops.push_back(loop_of(*dim));
    }
    for (int16_t iterator = 0; iterator < next_; ++iterator) {
      if (!is_canonical(iterator)) return {{}, Opacity::SplitHistory};
    }
    return {with_ordered_fusions(nest_, static_cast<int>(iterators_.size()))};
  }

 private:
  const graph::StageLoops& schedule_;
  const std::vector<std::string> iterators_;
  std::map<std::string, Piece> pieces_;
  std::vector<Cut> cuts_;
  Nest nest_;
  int16_t next_ = 0;  // the number of iterators so far

  Piece take(const std::string& loop) {
    const auto found = pieces_.find(loop);
    const Piece piece = found->second;
    pieces_.erase(found);
    return piece;
  }

  Opacity apply(const Split& split) {
    if (split.kind == Split::Kind::Rename) {
      pieces_[split.outer] = take(split.old_var);
      return Opacity::None;
    }
    if (split.kind == Split::Kind::Split) return apply_split(split);
    const Piece outer = take(split.outer), inner = take(split.inner);
    nest_.fusions.push_back({{inner.iterator, inner.step}, {outer.iterator, outer.step}});
    pieces_[split.old_var] = {next_++};
    return Opacity::None;
  }

  // The steps of an iterator decrease if the factor is larger than 1 and smaller than the extent of a split loop.
  Opacity apply_split(const Split& split) {
    const auto factor = as_const_int(split.factor);
    if (!factor) return Opacity::SymbolicFactor;
    const Piece old = take(split.old_var);
    const int64_t step = old.step * *factor;
    const bool decreases = *factor > 1 && (old.range == 0 || step < old.range);
    if (!decreases || step > std::numeric_limits<int32_t>::max()) return Opacity::SplitHistory;
    cuts_.push_back({old.iterator, step, split.tail});
    pieces_[split.outer] = {old.iterator, step, old.range};
    pieces_[split.inner] = {old.iterator, old.step, step};
    return Opacity::None;
  }

  Loop loop_of(const graph::Dim& dim) const {
    Loop loop;
    loop.kind = dim.runs;
    if (dim.var == graph::outermost_loop) {
      loop.iterator = once;
      return loop;
    }
    const Piece& piece = pieces_.at(dim.var);
    loop.iterator = piece.iterator;
    loop.step = piece.step;
    loop.align = value_or(schedule_.fuse_alignment, dim.var, LoopAlignStrategy::Auto);
    return loop;
  }

  // The position in the history of the split at this step.
  size_t cut_at(int iterator, int64_t step) const {
    const auto found = std::ranges::find_if(
        cuts_, [&](const Cut& cut) { return cut.iterator == iterator && cut.step == step; });
    return static_cast<size_t>(found - cuts_.begin());
  }

  void mark(Part& part, int iterator, int64_t step, int64_t smaller) const {
    if (part.iterator != iterator || part.step != step) return;
    const size_t cut = cut_at(iterator, step), next = cut_at(iterator, smaller);
    part.tail = cuts_[cut].tail;
    part.in_blocks = next < cuts_.size() && next < cut;
  }

  // Sets the tails of the iterator's parts and which are in blocks. Whether the order of splits that follows from these
  // makes the same pieces: of all splits between two others, the same one is the first.
  bool is_canonical(int iterator) {
    std::vector<Part> parts = parts_of(nest_, iterator);
    const size_t count = parts.empty() ? 0 : parts.size() - 1;
    for (size_t i = 0; i < count; ++i) {
      const auto mark_part = [&](Part& part) {
        mark(part, iterator, parts[i].step, parts[i + 1].step);
      };
      for (Loop& loop : nest_.loops) mark_part(loop);
      for (Fusion& fusion : nest_.fusions) {
        mark_part(fusion.inner);
        mark_part(fusion.outer);
      }
    }
    parts = parts_of(nest_, iterator);
    std::vector<size_t> rank(count), wanted(count);
    const std::vector<size_t> order = split_order(parts);
    for (size_t i = 0; i < count; ++i) {
      rank[order[i]] = i;
      wanted[i] = cut_at(iterator, parts[i].step);
    }
    for (size_t first = 0; first < count; ++first) {
      for (size_t last = first + 1; last <= count; ++last) {
        const auto earliest = [&](const std::vector<size_t>& when) {
          return std::min_element(when.begin() + static_cast<std::ptrdiff_t>(first),
                                  when.begin() + static_cast<std::ptrdiff_t>(last)) -
                 when.begin();
        };
        if (earliest(rank) != earliest(wanted)) return false;
      }
    }
    return true;
  }
};

}  // namespace

History history_of(const graph::FuncContents& f, int stage) {
  return HistoryReader(f, stage).run();
}

}  // namespace retrograde::planning
