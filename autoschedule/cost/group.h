// group.h -- the loops of a group of stages as a tree: what runs inside of what, how often, and over which points.
//
//   out   root       parallel y:8, y, x            root -- y:8 -+- y -- x       blur
//   blur  at out/y:8  y, x                                      |
//                                                               +- y -- x       out
#pragma once

#include <map>
#include <vector>

#include "autoschedule/cost/stage_facts.h"
#include "autoschedule/machine/machine.h"
#include "autoschedule/plan/covers.h"
#include "autoschedule/plan/plan.h"

namespace retrograde::planning {

// How often the loops of a nest run, and which iterators they move.
struct NestTrips {
  std::vector<double> trips;       // by depth, of one run of the loops around it
  std::vector<IteratorSet> moves;  // by depth
  LaneLoop lanes;                  // of the loop over lanes, if there is one
  bool is_atomic = false;          // each iteration updates its element by an atomic operation
};

// `extents`: the points of the stage's iterators that all loops together run over.
NestTrips nest_trips(const Nest& nest, const Cover& extents);

struct LoopNode {
  int parent = -1;  // of the root: none
  LoopRef loop;     // of the first stage that has it
  ForType kind = ForType::Serial;
  double trips = 1, times = 1;  // iterations in one run of the loops around it, and in all
  double share = 1;             // of runs that are like that one (StageRun)
  double speedup = 1;           // by threads
  double chunks = 1;            // iterations of the parallel loops, with those around
  bool in_parallel = false;     // it, or a loop around it
  std::vector<int> children;    // in the order in which they run
  std::vector<int> stages;      // of which it is the innermost loop
};

struct StageRun {
  StageId id;
  const StageFacts* facts = nullptr;
  NestTrips nest;
  // By dimension of a Func that is stored outside of its loops: the elements that lowering keeps, in a circular window whose
  // extent is a power of two; 0: all of the box.
  std::vector<int64_t> kept;
  // The points of all runs of the stage's own nest, by those of one that adds to what is kept: the first one computes the
  // whole box, and others may have nothing to add.
  double share = 1;
  std::vector<int> path;     // nodes from the root to the innermost loop
  size_t place = 1;          // how many of them are around the stage's own nest
  size_t storage_place = 1;  // and around the storage of its Func
  // The points that the loops from path[k] inwards run over are cover[k]. All 1 at the end.
  std::vector<Cover> cover;
  // By dimension of a Func that is computed in loops: the share of its runs in which a border of its readers cuts its box.
  std::vector<double> cut;

  int node_of(size_t depth) const { return path[place + depth]; }
};

// Where the elements of a buffer are.
struct StoredBuffer {
  Layout layout;
  size_t inside =
      0;  // loops of a path around the allocation: its elements are used again in each iteration
  double register_share = 0;   // the part of it that registers hold
  double allocated_bytes = 0;  // in one group at once, for all threads
  double heap_blocks = 0;      // that are allocated in each iteration of the loop around them
};

struct Group {
  std::vector<LoopNode> nodes;          // parents before children; the first is the root
  std::vector<StageRun> runs;           // by StageId
  std::map<int, StoredBuffer> buffers;  // that the stages touch
};

// Adds the points of all lanes.
void cover_lanes(const LaneLoop& lanes, Cover& cover);
// Gives lanes to innermost loops that code generation vectorises although the plan does not.
void add_inner_lanes(const SizeModel& sizes, const Machine& machine, Group& group);
// Finds the buffers of the stages.
void add_buffers(const Plan& plan, const SizeModel& sizes, const Machine& machine, Group& group);
// By dimension, of a Func at root; less in folded dimensions.
std::vector<double> stored_extents(FuncId func, const FuncPlan& plan, const SizeModel& sizes);

// Funcs whose loops are nested.
struct PlannedGroup {
  std::vector<FuncId> funcs;
  std::vector<std::vector<FuncId>> inlined;  // into each of their stages, in order
  std::vector<FuncId> reads;  // Funcs of other groups, also through inlined ones; each once
};

// The groups of one plan after another. A group has the number of its last Func, and they run in the order of their
// numbers: all that a group reads is before it.
class ProgramGroups {
 public:
  explicit ProgramGroups(const AccessGraph& graph);
  // Goes on to a plan that differs in these Funcs. Returns the numbers of the groups of both plans whose prices may
  // differ, in order.
  std::vector<FuncId> update(const Plan& plan, const std::vector<FuncId>& changed);
  // By number; empty where no group has it.
  const std::vector<PlannedGroup>& all() const { return groups_; }

 private:
  static constexpr FuncId none = -1;  // of a Func that is inlined
  const AccessGraph& graph_;
  std::vector<PlannedGroup> groups_;
  std::vector<FuncId> number_;  // by Func: of its group

  FuncId& number_of(FuncId func) { return number_[static_cast<size_t>(func)]; }
  void join(const Plan& plan, const std::vector<FuncId>& funcs);
  void add_reads(const StageNode& stage, PlannedGroup& group) const;
};

// The bytes that a Func allocates at root; 0 if it is computed in loops, or an output.
double allocated_bytes(FuncId func, const Plan& plan, const SizeModel& sizes);
// The place of each Func in the order in which lowering computes them (graph/computing_order.h) if all are at root.
std::vector<size_t> places_in_order(const AccessGraph& graph);
// The bytes alive at once. `root`: what each Func allocates at root; `own`: what each group allocates in its loops.
double peak_bytes(const std::vector<PlannedGroup>& groups, const std::vector<size_t>& places,
                  const std::vector<double>& root, const std::vector<double>& own);

Group group_of(const Plan& plan, const PlannedGroup& planned, Covers& covers,
               const SizeModel& sizes, const Machine& machine, FactsOfStages& facts);

}  // namespace retrograde::planning
