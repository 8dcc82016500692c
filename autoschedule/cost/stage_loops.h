// stage_loops.h -- how often the loops of a stage execute what is inside.
#pragma once

#include <algorithm>
#include <cmath>

#include "autoschedule/cost/group.h"

namespace retrograde::planning {

class StageLoops {
 protected:
  StageLoops(const StageRun& run, const Group& group, const Machine& machine)
      : run_(run), group_(group), m_(machine), lanes_(run.nest.lanes) {
    for (size_t d = 0; d < depth(); ++d) {
      if (is_serial(d) && run.nest.trips[d] > 1) innermost_ = static_cast<int>(d);
    }
  }
  const StageRun& run_;
  const Group& group_;
  const Machine& m_;
  const LaneLoop& lanes_;
  int innermost_ = -1;  // the serial loop that runs innermost

  size_t depth() const { return run_.nest.trips.size(); }
  const LoopNode& node(size_t d) const {
    return group_.nodes[static_cast<size_t>(run_.node_of(d))];
  }
  ForType kind(size_t d) const { return node(d).kind; }
  bool is_serial(size_t d) const {
    return kind(d) != ForType::Unrolled && kind(d) != ForType::Vectorized;
  }
  double place_times() const {
    return run_.share * group_.nodes[static_cast<size_t>(run_.path[run_.place - 1])].times;
  }
  bool moves(size_t d, IteratorSet depends) const { return (run_.nest.moves[d] & depends) != 0; }
  bool is_vector(IteratorSet depends) const { return (lanes_.moves & depends) != 0; }

  // How often something is executed that these iterators change; lanes count as one. Each unrolled copy moves out of the
  // loops around it by itself.
  double times(IteratorSet depends) const {
    double result = place_times();
    bool is_moved = false;  // by a serial loop that is deeper
    for (size_t d = depth(); d-- > 0;) {
      const bool is_mover = moves(d, depends);
      if (kind(d) != ForType::Vectorized && (is_mover || is_moved)) result *= run_.nest.trips[d];
      is_moved = is_moved || (is_mover && is_serial(d));
    }
    return result;
  }
  // Iterations of the innermost serial loop, of which each copy that is unrolled around it has its own.
  double iterations() const {
    double result = place_times();
    for (size_t d = 0; d < depth(); ++d) {
      const bool is_copied = kind(d) == ForType::Unrolled && static_cast<int>(d) < innermost_;
      if (is_serial(d) || is_copied) result *= run_.nest.trips[d];
    }
    return result;
  }
  // Whether no other stage runs in the innermost serial loop.
  bool is_alone() const {
    for (size_t d = depth(); d-- > 0 && static_cast<int>(d) >= innermost_;)
      if (node(d).children.size() + node(d).stages.size() > 1) return false;
    return true;
  }
  // The unrolled copies that these iterators tell apart.
  double copies(IteratorSet depends, bool moved) const {
    double result = 1;
    for (size_t d = 0; d < depth(); ++d) {
      const bool is_inside = static_cast<int>(d) > innermost_;
      if (kind(d) == ForType::Unrolled && is_inside && moves(d, depends) == moved)
        result *= run_.nest.trips[d];
    }
    return result;
  }
  // The same, of all unrolled loops.
  double all_copies(IteratorSet depends) const {
    double result = 1;
    for (size_t d = 0; d < depth(); ++d)
      if (kind(d) == ForType::Unrolled && moves(d, depends)) result *= run_.nest.trips[d];
    return result;
  }
  double vectors(double element_bytes, IteratorSet depends) const {
    if (!is_vector(depends)) return 1;
    return std::max(1.0, std::ceil(lanes_.count * element_bytes / m_.vector_bytes));
  }
  // The time of an instruction. Lanes that fill a part of a register take no more than their part of it, but narrow
  // elements are widened sooner or later.
  double lanes_ns(double element_bytes, double vector_ns, double scalar_ns) const {
    if (lanes_.iterator < 0) return scalar_ns;
    const double share =
        std::min(1.0, lanes_.count * std::max(element_bytes, 4.0) / m_.vector_bytes);
    return std::max(scalar_ns, vector_ns * share);
  }

  // Whether each copy of the body has one point of these iterators.
  bool are_constants(IteratorSet iterators) const {
    for (size_t d = 0; d < depth(); ++d)
      if (moves(d, iterators) && kind(d) != ForType::Unrolled && run_.nest.trips[d] > 1)
        return false;
    return true;
  }
};

}  // namespace retrograde::planning
