// directive.h -- scheduling directives as data, and the schedules that a sequence of them builds.
//
// A directive is a struct of names, sizes and enumerators. `fields` lists them in the order of the
// text, so printing, parsing and comparing are written once for all directives:
//
//   split(x, xo, xi, 8, GuardWithIf)
//
// Only primitive directives are here: tile, vectorize(x, 8) and the like expand to several of them.
// give_directive.h checks whether a directive is legal; applying one only requires that its loops
// exist.
#pragma once

#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "graph/schedule.h"
#include "ir/expr.h"

namespace retrograde::graph {

struct Definition;
struct FuncContents;

// Names of existing entities. Names that a directive introduces are plain strings.
struct NamedLoop : std::string {
  NamedLoop(std::string name = "") : std::string(std::move(name)) {}
};
struct NamedFunc : std::string {  // a Func or an image
  NamedFunc(std::string name = "") : std::string(std::move(name)) {}
};

// The directive's name and its fields.
#define RETROGRADE_DIRECTIVE(name_, ...)     \
  static constexpr const char* name = name_; \
  auto fields() { return std::tie(__VA_ARGS__); }

// ---- directives of a stage ----

struct SplitLoop {
  RETROGRADE_DIRECTIVE("split", old, outer, inner, factor, tail)
  NamedLoop old;
  std::string outer, inner;
  Expr factor;
  TailStrategy tail = TailStrategy::Auto;
};
struct FuseLoops {
  RETROGRADE_DIRECTIVE("fuse", inner, outer, fused)
  NamedLoop inner, outer;
  std::string fused;
};
struct RenameLoop {
  RETROGRADE_DIRECTIVE("rename", old, renamed)
  NamedLoop old;
  std::string renamed;
};
struct ReorderLoops {  // innermost first; unnamed loops keep their positions
  RETROGRADE_DIRECTIVE("reorder", loops)
  std::vector<NamedLoop> loops;
};
struct RunLoop {  // serial, parallel, vectorized, unrolled, or over blocks or threads of a GPU
  RETROGRADE_DIRECTIVE("run", loop, kind)
  NamedLoop loop;
  ForType kind = ForType::Serial;
};
struct PartitionLoop {
  RETROGRADE_DIRECTIVE("partition", loop, how)
  NamedLoop loop;
  Partition how = Partition::Auto;
};
struct MakeAtomic {
  RETROGRADE_DIRECTIVE("atomic", vouched)
  bool vouched = false;  // atomic(true): the user vouches that the update is associative
};
struct AllowRaces {
  RETROGRADE_DIRECTIVE("allow_race_conditions")
};
struct Unscheduled {
  RETROGRADE_DIRECTIVE("unscheduled")
};
struct PrefetchData {
  RETROGRADE_DIRECTIVE("prefetch", source, at, from, offset, strategy)
  NamedFunc source;
  NamedLoop at, from;
  Expr offset;
  PrefetchBoundStrategy strategy = PrefetchBoundStrategy::GuardWithIf;
  SymbolRef symbol = {};  // the contents of the source
};
// A loop of a Func, root, or inlined.
struct AtLevel {
  LoopLevel level;
  // The user's LoopLevel object, which may be set later; null: `level` is final.
  std::shared_ptr<LoopLevelContents> from = {};
  auto fields() { return std::tie(level); }
};
struct ComputeWith : AtLevel {
  RETROGRADE_DIRECTIVE("compute_with", level, align)
  std::vector<std::pair<NamedLoop, LoopAlignStrategy>> align = {};
};
struct Specialize {
  RETROGRADE_DIRECTIVE("specialize", condition)
  Expr condition;
};
struct SpecializeFail {
  RETROGRADE_DIRECTIVE("specialize_fail", message)
  Expr message;
};
struct FactorOut {  // rfactor: keeps these loops as variables of the Func `made`
  RETROGRADE_DIRECTIVE("rfactor", made, preserved)
  std::string made;
  std::vector<std::pair<NamedLoop, std::string>> preserved;
};

// ---- directives of a Func ----

struct ComputeAt : AtLevel {
  static constexpr const char* name = "compute_at";
};
struct StoreAt : AtLevel {
  static constexpr const char* name = "store_at";
};
struct HoistStorage : AtLevel {
  static constexpr const char* name = "hoist_storage";
};
struct StoreIn {
  RETROGRADE_DIRECTIVE("store_in", memory)
  MemoryType memory = MemoryType::Auto;
};
struct ReorderStorage {  // all dimensions, innermost first
  RETROGRADE_DIRECTIVE("reorder_storage", dimensions)
  std::vector<std::string> dimensions;
};
struct AlignStorage {
  RETROGRADE_DIRECTIVE("align_storage", dimension, alignment)
  std::string dimension;
  Expr alignment;
};
struct BoundStorage {
  RETROGRADE_DIRECTIVE("bound_storage", dimension, extent)
  std::string dimension;
  Expr extent;
};
struct FoldStorage {
  RETROGRADE_DIRECTIVE("fold_storage", dimension, extent, forward)
  std::string dimension;
  Expr extent;
  bool forward = true;
};
struct RingBuffer {
  RETROGRADE_DIRECTIVE("ring_buffer", copies)
  Expr copies;
};
struct Memoize {
  RETROGRADE_DIRECTIVE("memoize", key)
  Expr key;  // undefined: none
};
struct Async {
  RETROGRADE_DIRECTIVE("async")
};
struct BoundDimension {
  RETROGRADE_DIRECTIVE("bound", dimension, min, extent)
  std::string dimension;
  Expr min, extent;  // min may be undefined
};
struct AlignBounds {
  RETROGRADE_DIRECTIVE("align_bounds", dimension, modulus, remainder)
  std::string dimension;
  Expr modulus, remainder;  // remainder undefined: the min stays as it is
};
struct Estimate {
  RETROGRADE_DIRECTIVE("set_estimate", dimension, min, extent)
  std::string dimension;
  Expr min, extent;
};

struct TraceLoads {
  RETROGRADE_DIRECTIVE("trace_loads")
};
struct TraceStores {
  RETROGRADE_DIRECTIVE("trace_stores")
};
struct TraceRealizations {
  RETROGRADE_DIRECTIVE("trace_realizations")
};
struct AddTraceTag {
  RETROGRADE_DIRECTIVE("add_trace_tag", tag)
  Expr tag;
};
struct DebugToFile {
  RETROGRADE_DIRECTIVE("debug_to_file", file)
  Expr file;
};
struct Wrap {  // no users: wraps for all consumers without another wrapper
  RETROGRADE_DIRECTIVE("in", made, users)
  std::string made;
  std::vector<NamedFunc> users;
};
struct Clone {
  RETROGRADE_DIRECTIVE("clone_in", made, users)
  std::string made;
  std::vector<NamedFunc> users;
};

struct CopyInput {  // an image that this Func reads
  RETROGRADE_DIRECTIVE("copy_input", made, image)
  std::string made;
  NamedFunc image;
};

#undef RETROGRADE_DIRECTIVE

using Directive =
    std::variant<SplitLoop, FuseLoops, RenameLoop, ReorderLoops, RunLoop, PartitionLoop, MakeAtomic,
                 AllowRaces, Unscheduled, PrefetchData, ComputeWith, Specialize, SpecializeFail,
                 FactorOut, ComputeAt, StoreAt, HoistStorage, StoreIn, ReorderStorage, AlignStorage,
                 BoundStorage, FoldStorage, RingBuffer, Memoize, Async, BoundDimension, AlignBounds,
                 Estimate, TraceLoads, TraceStores, TraceRealizations, AddTraceTag, DebugToFile,
                 Wrap, Clone, CopyInput>;
bool is_of_stage(const Directive& directive);  // false for directives of the Func as a whole
const char* name_of(const Directive& directive);
std::vector<std::string> directive_names();
// The Func that the directive creates; empty for most.
std::string made_by(const Directive& directive);

// A directive in the log of a Func, with the stage that it applies to.
struct LoggedDirective {
  int stage = -1;            // -1: the Func
  std::vector<int> special;  // path to a nested specialization: an index for each level
  Directive directive;
  uint64_t order = 0;  // increases with each directive in this process
};

// The loops of an unscheduled definition of `f`, innermost first: its reduction variables, then its
// pure variables.
std::vector<Dim> first_loops(const FuncContents& f, const Definition& definition);

// Applies the directive to a schedule. InternalError when a loop that it names does not exist, and
// for directives that create Funcs.
void apply_directive(const Directive& directive, StageLoops& schedule);
void apply_directive(const Directive& directive, FuncContents& f);

// The directives that turn the first loops into this schedule, specializations excluded.
std::vector<Directive> directives_of(const StageLoops& schedule, const std::vector<Dim>& first);
// The directives that build the schedule of the Func, stages excluded.
std::vector<Directive> directives_of(const FuncContents& f);

}  // namespace retrograde::graph
