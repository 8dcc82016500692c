// Values that a loop does not change are computed outside of it, and those that unrolled copies have in common once. So an
// operation is executed as often as the loops run that are outside of the innermost loop that changes it, and that loop.
// Functions in arms of selects run behind branches: each copy has its own.
#include <algorithm>
#include <cmath>

#include "autoschedule/cost/assumptions.h"
#include "autoschedule/cost/stage_loops.h"
#include "autoschedule/cost/terms.h"
#include "autoschedule/machine/reference.h"

namespace retrograde::planning {

double UnitTimes::all() const {
  const double slowest = std::max({arithmetic, loads, stores, scalars, loops, fetches});
  const double sum = arithmetic + loads + stores + scalars + loops + fetches;
  const double apart = std::max(slowest + not_overlapped * (sum - slowest), chain);
  return apart + equal_neighbours * std::max(0.0, meeting - apart) + starts;
}

namespace {

bool has_own_read(const StageFacts& facts) {
  return std::ranges::any_of(facts.touches, [](const Touch& t) { return t.is_own; });
}

// A Func that is computed in the loops of its consumer, in memory: vectors of the consumer lie across those that were just
// stored.
double slice_ns(const StageRun& run, const Group& group, const Machine& m) {
  const bool is_slice = run.place > 1 && run.id.stage == 0;
  const double in_memory = 1 - group.buffers.at(run.id.func).register_share;
  return is_slice ? in_memory * slice_iterations * m.iteration_ns : 0;
}

// Vectors that each iteration loads and stores as there is no register for them.
struct Spills {
  double loads = 0, stores = 0;
};
// Lowering keeps sums in registers if there is room for all of them and no other stage runs in their loop
// (compiler/lower/loops/keep_accumulators.cpp). Otherwise, it leaves all of them in memory.
Spills spills_of(double accumulators, bool are_alone, double invariants, double registers) {
  const bool are_kept = are_alone && accumulators <= registers;
  const double kept = (are_kept ? accumulators : 0) + invariants;
  const double excess = std::clamp(kept + passing_operands - registers, 0.0, kept);
  const double sums = are_kept ? std::min(excess, accumulators) : accumulators;
  return {are_kept ? excess : excess + sums, sums};
}

// Operations of which each waits for the one before.
struct Chain {
  double ns;
  double independent;  // chains like it
};
double longest(const std::vector<Chain>& chains, double instructions) {
  double ns = 0;
  for (const Chain& chain : chains) {
    const double overlap = core.reorder_window * chain.independent / std::max(instructions, 1.0);
    ns = std::max(ns, chain.ns / std::max(overlap, 1.0));
  }
  return ns;
}

// The share of tiles whose unrolled copies run behind conditions, as a border cuts them.
double guarded_share(const StageRun& run, const Group& group) {
  IteratorSet copied = 0;
  for (size_t d = 0; d < run.nest.trips.size(); ++d) {
    const ForType kind = group.nodes[static_cast<size_t>(run.node_of(d))].kind;
    if (kind == ForType::Unrolled && run.nest.trips[d] > 1) copied |= run.nest.moves[d];
  }
  double share = 0;
  for (const Touch& touch : run.facts->touches) {
    if (!touch.writes) continue;
    for (size_t d = 0; d < run.cut.size(); ++d) {
      const auto is_copied = [&](const auto& move) { return copied & set_of(move.iterator); };
      if (std::ranges::any_of(touch.sides[d].moves, is_copied)) share = std::max(share, run.cut[d]);
    }
  }
  return share;
}

// Whether both move alike, though they end at other borders.
bool is_alike(Touch a, const Touch& b) {
  if (a.sides.size() != b.sides.size()) return false;
  for (size_t d = 0; d < a.sides.size(); ++d) a.sides[d].most = b.sides[d].most;
  return a == b;
}

class StageWork : StageLoops {
 public:
  StageWork(const StageRun& run, const Group& group, const Machine& machine)
      : StageLoops(run, group, machine) {}

  UnitTimes find() {
    for (const OperationRow& row : run_.facts->operations) add_operation(row);
    for (const Touch& touch : run_.facts->touches) {
      if (!is_loaded_before(touch)) add_touch(touch);
    }
    add_interleaving();
    const Spills spills = spills_of(accumulators_, is_alone(), invariants_, m_.registers);
    units_.loads += iterations() * spills.loads * m_.load_ns;
    units_.stores += iterations() * spills.stores * m_.store_ns;
    if (run_.nest.is_atomic)
      units_.scalars += iterations() * atomic_add_operations * m_.operation_ns;
    units_.chain = longest(chains_, instructions_);
    const double code_bytes = instructions_ * instruction_bytes;
    if (code_bytes > iterations() * code_cache_bytes)
      units_.fetches = code_bytes / line_bytes * far_code_line_ns;
    const double taken = run_.facts->taken * (1 + guarded_copies * guarded_share(run_, group_));
    for (double UnitTimes::*part :
         {&UnitTimes::arithmetic, &UnitTimes::loads, &UnitTimes::stores, &UnitTimes::scalars,
          &UnitTimes::fetches, &UnitTimes::chain, &UnitTimes::meeting})
      units_.*part *= taken;
    units_.starts = place_times() * slice_ns(run_, group_, m_);
    add_loops();
    return units_;
  }

 private:
  UnitTimes units_;
  double accumulators_ = 0, invariants_ = 0;  // registers of the innermost serial loop
  double instructions_ = 0;                   // of all iterations
  double bent_ = 0;                           // vectors whose lanes are computed in parts
  std::vector<Chain> chains_;

  void add_operation(const OperationRow& row) {
    if (row.decided_by && are_constants(row.decided_by)) return;
    const double shared = row.behind_branch ? copies(row.depends, false) : 1;
    units_.code +=
        row.count * all_copies(row.depends) * shared * vectors(row.element_bytes, row.depends);
    const double count = row.count * times(row.depends) * shared;
    instructions_ += count * vectors(row.element_bytes, row.depends);
    if (is_vector(row.depends))
      units_.arithmetic += count * vectors(row.element_bytes, row.depends) *
                           lanes_ns(row.element_bytes, row.time.vector_ns, row.time.scalar_ns);
    else
      (row.time.is_integer ? units_.scalars : units_.arithmetic) += count * row.time.scalar_ns;
  }

  // ---- memory ----

  int innermost_serial_node(const StageRun& run) const {
    const auto is_body = [&](int n) {
      const ForType kind = group_.nodes[static_cast<size_t>(n)].kind;
      return kind == ForType::Unrolled || kind == ForType::Vectorized;
    };
    return *std::ranges::find_if_not(run.path.rbegin(), run.path.rend(), is_body);
  }
  // Whether an earlier stage loads the same in the same iteration of all loops.
  bool is_loaded_before(const Touch& touch) const {
    if (touch.writes || touch.is_own || touch.carried) return false;
    const int loop = innermost_serial_node(run_);
    const auto end = std::ranges::find(group_.runs, run_.id, &StageRun::id);
    return std::any_of(group_.runs.begin(), end, [&](const StageRun& other) {
      return loop > 0 && innermost_serial_node(other) == loop &&
             other.nest.lanes.count == lanes_.count && other.nest.lanes.moves == lanes_.moves &&
             std::ranges::any_of(other.facts->touches,
                                 [&](const Touch& known) { return is_alike(known, touch); });
    });
  }

  void add_touch(const Touch& touch) {
    const StoredBuffer& stored = group_.buffers.at(touch.buffer);
    const bool is_sum = touch.is_own || (touch.writes && has_own_read(*run_.facts));
    note_registers(touch, is_sum);
    if (touch.is_own) {
      add_sum(touch);
      add_end_of_lanes(touch);
    }
    if (touch.carried) add_recurrence(touch);
    if (is_carried_in_register(touch)) return;
    const double count = touch.count * times(touch.moved) * (1 - stored.register_share);
    if (count > 0) add_moves(touch, stored, count);
  }

  void add_moves(const Touch& touch, const StoredBuffer& stored, double count) {
    const LaneMoves moved =
        lane_moves(touch, stored.layout, lanes_, vectors(touch.element_bytes, touch.moved));
    double& units = touch.writes ? units_.stores : units_.loads;
    // The lanes of a gather are taken out of a vector of places and put into another one, which is arithmetic.
    const bool is_strided = touch.data == 0 && moved.is_by_lane && !moved.is_bent;
    const double share = is_strided ? known_places : 1;
    const double by_lane =
        share * lanes_.count * (touch.writes ? m_.scatter_lane_ns : m_.gather_lane_ns);
    (touch.writes ? units : units_.arithmetic) +=
        count * by_lane * (moved.is_by_lane ? 1 : moved.border_share);
    const double each = moved.is_by_lane ? lane_instructions * lanes_.count
                                         : vectors(touch.element_bytes, touch.moved);
    instructions_ += count * each;
    units_.code += touch.count * all_copies(touch.moved) * each;
    if (moved.is_by_lane) return;
    if (moved.is_bent) bent_ = std::max(bent_, vectors(touch.element_bytes, touch.moved));
    const double bytes = std::min(double(m_.vector_bytes), lanes_.count * touch.element_bytes);
    const double crossing = moved.is_unaligned ? 1 + bytes / double(line_bytes) : 1;
    const double vector_ns = touch.writes ? m_.store_ns : m_.load_ns;
    const double scalar_ns = std::min(vector_ns, (touch.writes ? 2 : 1) * m_.scalar_ns);
    units += count * moved.vectors * crossing * lanes_ns(touch.element_bytes, vector_ns, scalar_ns);
    units_.arithmetic += count * moved.shuffles * m_.shuffle_ns;
  }

  // Lowering computes every other lane by itself where an index is divided or wraps, and interleaves the results, even
  // those of copies that share the operand.
  void add_interleaving() {
    IteratorSet moved = 0;
    for (const Touch& touch : run_.facts->touches) moved |= touch.moved;
    units_.arithmetic += times(moved) * bent_ * interleave_shuffles * m_.shuffle_ns;
  }

  // Elements that the innermost loop does not move stay in registers.
  void note_registers(const Touch& touch, bool is_sum) {
    if (innermost_ < 0 || moves(static_cast<size_t>(innermost_), touch.moved)) return;
    // Lanes of a sum are partial results.
    const IteratorSet lanes = touch.is_own ? touch.moved | lanes_.moves : touch.moved;
    const double needed =
        touch.count * copies(touch.moved, true) * vectors(touch.element_bytes, lanes);
    if (is_sum && touch.is_own)
      accumulators_ += needed;
    else if (!touch.writes && touch.data == 0)
      invariants_ += needed;
  }
  // ---- chains ----

  // `ns` of each iteration of the innermost serial loop wait for the iteration before, in the loops from `depth` inwards.
  // Short chains of different elements run at the same time, as far as the core looks ahead.
  void add_chain(double iteration_ns, size_t from) {
    double runs = place_times();
    for (size_t d = 0; d < from; ++d)
      if (is_serial(d)) runs *= run_.nest.trips[d];
    chains_.push_back({iterations() * iteration_ns, runs});
  }

  bool is_by_lane(const Touch& touch) const {
    return lane_moves(touch, group_.buffers.at(touch.buffer).layout, lanes_, 1).is_by_lane;
  }
  // The iterators that move dimensions in which data decide nothing: their iterations never meet.
  static IteratorSet moves_apart(const Touch& touch) {
    IteratorSet result = 0;
    for (const TouchedSide& side : touch.sides)
      if (side.data == 0)
        for (const TouchedSide::Move& move : side.moves) result |= set_of(move.iterator);
    return result;
  }
  // The iterators whose iterations access elements that lie whole pages apart. A core takes such a load for one of what was
  // just stored, as it compares the low bits of addresses first.
  IteratorSet moves_by_pages(const Touch& touch) const {
    const Layout& layout = group_.buffers.at(touch.buffer).layout;
    IteratorSet result = 0;
    double row = touch.element_bytes;
    for (const int16_t dimension : layout.order) {
      const TouchedSide& side = touch.sides[static_cast<size_t>(dimension)];
      for (const TouchedSide::Move& move : side.moves) {
        const double step = std::abs(move.slope) / side.divisor * row;
        if (side.data == 0 && step > 0 && std::fmod(step, page_bytes) == 0)
          result |= set_of(move.iterator);
      }
      row *= layout.extents[static_cast<size_t>(dimension)];
    }
    return result;
  }
  // A sum waits for the last one to the same element: in a register, or through memory where neighbours meet.
  void add_sum(const Touch& touch) {
    if (innermost_ < 0) return;
    const auto innermost = static_cast<size_t>(innermost_);
    if (touch.data != 0) {
      const double alike = copies(moves_by_pages(touch), true);
      const double loads = touch.count * times(touch.moved) * lanes_.count;
      if (lanes_.iterator < 0 || is_by_lane(touch))
        units_.stores += loads * (1 - 1 / alike) * m_.memory_latency_ns;
      const IteratorSet apart = moves_apart(touch);
      if (moves(innermost, apart)) return;
      const double in_vector = is_vector(touch.data) && !is_vector(apart) ? lanes_.count : 1;
      units_.meeting += iterations() * copies(apart, false) * in_vector * m_.memory_latency_ns;
    } else if (!moves(innermost, touch.moved)) {
      size_t from = innermost;
      while (from > 0 && !(is_serial(from - 1) && moves(from - 1, touch.moved))) --from;
      add_chain(copies(touch.moved, false) * m_.latency_ns, from);
    }
  }
  // Partial results of lanes are combined after the loops of the reduction: the registers, and then the halves of one. A
  // shuffle and a sum of a half as many lanes take half as long.
  void add_end_of_lanes(const Touch& touch) {
    if (lanes_.iterator < 0 || is_vector(touch.moved)) return;
    const double registers = vectors(touch.element_bytes, lanes_.moves);
    const double halves = 2 - 2 / std::max(1.0, lanes_.count / registers);
    const double count = touch.count * times(touch.moved);
    units_.arithmetic +=
        count * ((registers - 1) * m_.operation_ns + halves * (m_.shuffle_ns + m_.operation_ns));
  }
  // Whether lanes that lie apart compete for a few sets of the first cache, so that their lines are gone from one
  // iteration to the next.
  bool loses_lines(const Touch& touch) const {
    const Layout& layout = group_.buffers.at(touch.buffer).layout;
    const Cover& lanes = run_.cover[run_.place + static_cast<size_t>(innermost_) + 1];
    return is_by_lane(touch) &&
           bytes_by_sets(touch, layout, lanes, page_bytes) > m_.levels[0].bytes;
  }
  // Lowering keeps what a loop over several chains reads of its last iterations (compiler/lower/loops/carry_elements.cpp).
  bool is_carried_in_register(const Touch& touch) const {
    const bool has_chains = lanes_.count > 1 || copies(0, false) > 1;
    return touch.carried && touch.data == 0 && innermost_ >= 0 && has_chains &&
           touch.carried == run_.nest.moves[static_cast<size_t>(innermost_)] && !loses_lines(touch);
  }
  // An element waits for the one before: a product and a sum for each that is carried, or what the last iteration stored.
  void add_recurrence(const Touch& touch) {
    if (innermost_ < 0 || !moves(static_cast<size_t>(innermost_), touch.carried)) return;
    size_t from = 0;
    while (!moves(from, touch.carried)) ++from;
    double in_iteration = loses_lines(touch) ? lanes_.count : 1;
    for (size_t d = static_cast<size_t>(innermost_) + 1; d < depth(); ++d)
      if (kind(d) == ForType::Unrolled && moves(d, touch.carried))
        in_iteration *= run_.nest.trips[d];
    const double carried = double(std::ranges::count_if(
        run_.facts->touches, [&](const Touch& t) { return is_carried_in_register(t); }));
    const double wait_ns =
        is_carried_in_register(touch) ? carried * m_.latency_ns : m_.memory_latency_ns;
    add_chain(in_iteration * wait_ns, from);
  }
  void add_loops() {
    for (size_t d = 0; d < depth(); ++d) {
      const bool is_own = node(d).loop.stage == run_.id;
      if (is_own && is_serial(d)) units_.code += code_of_loop;
      if (is_own && is_serial(d)) units_.loops += node(d).times * m_.iteration_ns;
      if (is_own && runs_at_once(kind(d))) units_.starts += node(d).times * task_ns;
    }
  }
};

}  // namespace

UnitTimes work_of(const StageRun& run, const Group& group, const Machine& machine) {
  return StageWork(run, group, machine).find();
}

}  // namespace retrograde::planning
