// plan.h -- a plan: how each stage of a graph runs, as an immutable value.
//
// A plan describes the loops of each stage, where each Func is computed and stored, and how its storage is laid out. It
// names Funcs, stages and loops by number and creates no names. Two plans of one program are equal if and only if they
// give the same loops in the same places.
//
// Loops are steps, not splits. A loop advances its iterator by `step` points, and the loops of one iterator have
// different steps, of which the smallest is 1:
//
//   y:8, x:16, y, x     a loop over strips of eight rows, one over blocks of 16 columns, and the loops over the rows of
//                       a strip and the columns of a block
//
// The iterators of a stage are numbered: first its pure variables, then its reduction variables, each innermost first. A
// fusion of two loops is an iterator of its nest, too, whose loops have steps of their own: `(x:16 y):4, (x:16 y)`.
//
//   import_plan   reads the directives of a scheduled graph into a plan          import.cpp
//   emit_plan, emit_changes   give the directives of a plan to a copy of the graph   emit.cpp
//   to_text, parse_plan   the text form                                          print.cpp, parse.cpp
//   validate      checks the invariants of plans                                 validate.cpp
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "autoschedule/access/stage_id.h"
#include "graph/function.h"
#include "graph/schedule.h"

namespace retrograde::planning {

using namespace graph;

// A loop of a nest; 0 is the outermost, and -1 stands for a place around all loops of the stage.
struct LoopRef {
  StageId stage;
  int16_t depth = 0;
  bool operator==(const LoopRef&) const = default;
};
inline constexpr int16_t around_all_loops = -1;

// The points that a loop runs over: an iterator in steps.
struct Part {
  int16_t iterator = 0;  // of the stage, or a fusion of the nest; or `once`
  int64_t step = 1;      // points of the iterator that one iteration covers
  // Whether the loop counts iterations of the next smaller step, not points: where those do not fill its last
  // iteration, `tail` is about whole iterations.
  bool in_blocks = false;
  TailStrategy tail = TailStrategy::Auto;  // where `step` does not divide the extent
  bool operator==(const Part&) const = default;
};
// The iterator of a loop that runs once, around all others. It exists on devices, where it makes a kernel.
inline constexpr int16_t once = -1;

// Two loops that run as one: each iteration of `outer` runs all iterations of `inner`.
struct Fusion {
  Part inner, outer;
  bool operator==(const Fusion&) const = default;
};

struct Loop : Part {
  ForType kind = ForType::Serial;
  LoopAlignStrategy align = LoopAlignStrategy::Auto;  // of a loop that belongs to another nest
  bool operator==(const Loop&) const = default;
};

// Whether iterations of one update that access one element may run concurrently.
enum class Concurrency : uint8_t {
  Independent,  // only those that access different elements may
  Atomic,       // the update is atomic, and proven to be associative and commutative
  Vouched,      // the update is atomic, and its user vouches for the rest
  Racing,       // its user, or the compiler, vouches that no race changes the result
  AtomicRacing  // both: it is atomic, and nothing is proven
};

// The loops of one stage.
struct Nest {
  std::vector<Loop> loops;      // outermost first
  std::vector<Fusion> fusions;  // their iterators have the numbers after those of the stage
  // Loop fusion: the loops down to this one are those of the other nest.
  std::optional<LoopRef> shared_with;
  Concurrency concurrency = Concurrency::Independent;
  bool operator==(const Nest&) const = default;
};

// A circular window: coordinates of the dimension are stored modulo the extent.
struct Fold {
  int16_t dimension = 0;
  int64_t extent = 1;
  bool forward = true;  // the coordinate increases from one iteration to the next
  bool operator==(const Fold&) const = default;
};

struct Storage {
  std::vector<int16_t> order;  // dimensions, innermost first
  std::vector<Fold> folds;
  MemoryType memory = MemoryType::Auto;
  bool operator==(const Storage&) const = default;
};

struct Level {
  enum class Kind : uint8_t { Undecided, Inline, Root, At };
  Kind kind = Kind::Undecided;
  LoopRef loop;  // of At
  // The Func is computed in the loop alike of each stage that has one, not of `loop`'s stage alone.
  bool in_each_stage = false;
  bool operator==(const Level&) const = default;
};

struct Placement {
  Level compute;
  Level store;  // undecided: where it is computed
  Level hoist;  // where memory is allocated; undecided: where it is stored
  bool operator==(const Placement&) const = default;
};

// Why a plan cannot express the directives of a Func, which then keeps them.
enum class Opacity : uint8_t {
  None,
  Extern,  // a C function computes it
  Prefetch,
  Async,
  Memoize,
  Ring,  // ring_buffer
  Specialize,
  Partition,       // of a loop
  SymbolicFactor,  // a split whose factor is no constant
  SplitHistory,  // splits that are no decreasing steps, such as one of an inner loop by more than its extent
  SymbolicFold,   // fold_storage by an expression
  SharedLoops,    // an opaque Func shares its loops
  UnknownLoop,    // it is computed in a loop that only a specialization has
  DifferentLoops  // it is computed in loops of several stages that are not alike
};
const char* opacity_name(Opacity opacity);
inline constexpr int opacity_count = static_cast<int>(Opacity::DifferentLoops) + 1;

struct FuncPlan {
  Placement placement;
  Storage storage;
  std::vector<Nest> nests;  // by stage; none when opaque
  Opacity opacity = Opacity::None;
  bool operator==(const FuncPlan&) const = default;
};
uint64_t hash_of(const FuncPlan& plan);

// The program of a plan: its outputs, and all Funcs in the order of their numbers. No Func has wrappers
// that are not applied yet.
struct Program {
  std::vector<graph::FuncPtr> outputs, funcs;
  std::vector<std::vector<StageId>> readers;  // of each Func: the stages of others that read it
  std::vector<std::vector<std::vector<std::string>>> iterators;  // their names, by Func and stage
};
using ProgramPtr = std::shared_ptr<const Program>;
ProgramPtr make_program(const std::vector<graph::FuncPtr>& outputs);
bool is_output(const Program& program, FuncId func);

struct Plan {
  ProgramPtr program;
  std::vector<std::shared_ptr<const FuncPlan>> funcs;  // by number; shared between plans

  const FuncPlan& of(FuncId func) const { return *funcs[static_cast<size_t>(func)]; }
  const Nest& nest(StageId stage) const {
    return of(stage.func).nests[static_cast<size_t>(stage.stage)];
  }
};
// Whether both are about the same program, and all Funcs run alike.
bool operator==(const Plan& a, const Plan& b);
uint64_t hash_of(const Plan& plan);
// The same, from that of a plan of which a few Funcs differ.
uint64_t hash_of(const Plan& plan, const Plan& before, uint64_t hash_before);

// Whether the values of the Func are computed wherever they are read: also if nothing is decided, but not for outputs.
bool is_inlined(const Plan& plan, FuncId func);

// The plan of a program without directives.
Plan undecided_plan(const ProgramPtr& program);

// Reads the directives of all Funcs. Users' directives about sizes (bounds, estimates, alignment) and tracing stay with
// the Funcs. Requires: wrappers are applied (graph/directives/wrappers.h).
Plan import_plan(const std::vector<graph::FuncPtr>& outputs);
// Gives the plan's directives to a copy of the program and returns the outputs of that. Opaque Funcs keep theirs.
// Directives check that the stages allow the loops; what they cannot know is left to `validate`.
std::vector<graph::FuncPtr> emit_plan(const Plan& plan);
// The same, but Funcs that run alike in `kept`, the plan that was imported from the program, keep the directives that they
// have there, among them those that made other Funcs (rfactor, wrappers).
std::vector<graph::FuncPtr> emit_changes(const Plan& plan, const Plan& kept);

// One line for each Func, consumers first, and one for each stage where there are several.
std::string to_text(const Plan& plan);
// The text of one nest, and of one loop: `parallel y:8 GuardWithIf`.
std::string to_text(const Plan& plan, StageId stage);
std::string to_text(const Plan& plan, const LoopRef& loop);
// Requires: the text of a plan, as to_text gives it; messages name line and column.
Plan parse_plan(const std::string& text, const ProgramPtr& program);

// The first invariant that the plan breaks, with the Func, the loop and the rule; empty when it keeps all of them.
std::string broken_invariant(const Plan& plan);
// The same without P5, which takes as long as emitting the plan. P1 and P4 are checked for the Funcs that differ from
// those of `before`, which keeps all invariants.
std::string broken_structure(const Plan& plan, const Plan& before);
// InternalError when the plan breaks one.
void validate(const Plan& plan);

}  // namespace retrograde::planning
