// directive.h -- one scheduling directive as data, and schedules as what a log of them makes.
//
// A directive is a struct of names, sizes and choices; `fields` lists them in the order in which
// text gives them, so that printing, parsing and comparing are written once for all directives:
//
//   split(x, xo, xi, 8, GuardWithIf)
//
// Only primitive directives are here: tile, vectorize(x, 8) and their like are several of them.
// What a directive may be given to is checked where users give it; applying one here asserts
// nothing but that its loops exist.
#pragma once

#include <string>
#include <tuple>
#include <variant>
#include <vector>

#include "graph/schedule.h"
#include "ir/expr.h"

namespace retrograde::ir {

struct Definition;
struct FuncContents;

// ---- of a stage ----

struct SplitLoop {
  static constexpr const char* name = "split";
  std::string old, outer, inner;
  Expr factor;
  TailStrategy tail = TailStrategy::Auto;
  auto fields() { return std::tie(old, outer, inner, factor, tail); }
};
struct FuseLoops {
  static constexpr const char* name = "fuse";
  std::string inner, outer, fused;
  auto fields() { return std::tie(inner, outer, fused); }
};
struct RenameLoop {
  static constexpr const char* name = "rename";
  std::string old, renamed;
  auto fields() { return std::tie(old, renamed); }
};
struct ReorderLoops {  // innermost first; loops that are not named keep their places
  static constexpr const char* name = "reorder";
  std::vector<std::string> loops;
  auto fields() { return std::tie(loops); }
};
struct RunLoop {  // serial, parallel, vectorized or unrolled
  static constexpr const char* name = "run";
  std::string loop;
  ForType kind = ForType::Serial;
  auto fields() { return std::tie(loop, kind); }
};
struct PartitionLoop {
  static constexpr const char* name = "partition";
  std::string loop;
  Partition how = Partition::Auto;
  auto fields() { return std::tie(loop, how); }
};
struct MakeAtomic {
  static constexpr const char* name = "atomic";
  bool vouched = false;  // the user answers for its being associative
  auto fields() { return std::tie(vouched); }
};
struct AllowRaces {
  static constexpr const char* name = "allow_race_conditions";
  auto fields() { return std::tie(); }
};
struct Unscheduled {
  static constexpr const char* name = "unscheduled";
  auto fields() { return std::tie(); }
};
struct PrefetchData {
  static constexpr const char* name = "prefetch";
  std::string source, at, from;  // source: a Func or an image
  Expr offset;
  PrefetchBoundStrategy strategy = PrefetchBoundStrategy::GuardWithIf;
  auto fields() { return std::tie(source, at, from, offset, strategy); }
};
struct ComputeWith {
  static constexpr const char* name = "compute_with";
  LoopLevel level;
  auto fields() { return std::tie(level); }
};
struct AlignLoop {  // of a stage that is computed with another
  static constexpr const char* name = "align_loop";
  std::string loop;
  LoopAlignStrategy how = LoopAlignStrategy::Auto;
  auto fields() { return std::tie(loop, how); }
};

// ---- of a Func ----

struct ComputeAt {
  static constexpr const char* name = "compute_at";
  LoopLevel level;
  auto fields() { return std::tie(level); }
};
struct StoreAt {
  static constexpr const char* name = "store_at";
  LoopLevel level;
  auto fields() { return std::tie(level); }
};
struct HoistStorage {
  static constexpr const char* name = "hoist_storage";
  LoopLevel level;
  auto fields() { return std::tie(level); }
};
struct StoreIn {
  static constexpr const char* name = "store_in";
  MemoryType memory = MemoryType::Auto;
  auto fields() { return std::tie(memory); }
};
struct ReorderStorage {  // all dimensions, innermost first
  static constexpr const char* name = "reorder_storage";
  std::vector<std::string> dimensions;
  auto fields() { return std::tie(dimensions); }
};
struct AlignStorage {
  static constexpr const char* name = "align_storage";
  std::string dimension;
  Expr alignment;
  auto fields() { return std::tie(dimension, alignment); }
};
struct BoundStorage {
  static constexpr const char* name = "bound_storage";
  std::string dimension;
  Expr extent;
  auto fields() { return std::tie(dimension, extent); }
};
struct FoldStorage {
  static constexpr const char* name = "fold_storage";
  std::string dimension;
  Expr extent;
  bool forward = true;
  auto fields() { return std::tie(dimension, extent, forward); }
};
struct Memoize {
  static constexpr const char* name = "memoize";
  Expr key;  // undefined: none
  auto fields() { return std::tie(key); }
};
struct Async {
  static constexpr const char* name = "async";
  auto fields() { return std::tie(); }
};
struct BoundDimension {
  static constexpr const char* name = "bound";
  std::string dimension;
  Expr min, extent;  // min may be undefined
  auto fields() { return std::tie(dimension, min, extent); }
};
struct AlignBounds {
  static constexpr const char* name = "align_bounds";
  std::string dimension;
  Expr modulus, remainder;  // remainder undefined: the min stays
  auto fields() { return std::tie(dimension, modulus, remainder); }
};
struct Estimate {
  static constexpr const char* name = "set_estimate";
  std::string dimension;
  Expr min, extent;
  auto fields() { return std::tie(dimension, min, extent); }
};

using StageDirective =
    std::variant<SplitLoop, FuseLoops, RenameLoop, ReorderLoops, RunLoop, PartitionLoop, MakeAtomic,
                 AllowRaces, Unscheduled, PrefetchData, ComputeWith, AlignLoop>;
using FuncDirective =
    std::variant<ComputeAt, StoreAt, HoistStorage, StoreIn, ReorderStorage, AlignStorage,
                 BoundStorage, FoldStorage, Memoize, Async, BoundDimension, AlignBounds, Estimate>;

// The loops of a definition that nobody scheduled, innermost first: its reduction variables, then
// its pure variables. `f`: whose.
std::vector<Dim> first_loops(const FuncContents& f, const Definition& definition);

// What the directive makes of a schedule. InternalError when a loop that it names is not there.
void apply_directive(const StageDirective& directive, StageSchedule& schedule);
void apply_directive(const FuncDirective& directive, FuncSchedule& schedule);

// Directives that make this schedule out of the first loops, specializations aside.
std::vector<StageDirective> directives_of(const StageSchedule& schedule,
                                          const std::vector<Dim>& first);
// Directives that make this schedule out of that of a Func with these dimensions.
std::vector<FuncDirective> directives_of(const FuncSchedule& schedule,
                                         const std::vector<std::string>& dimensions);

}  // namespace retrograde::ir
