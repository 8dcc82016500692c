// directive.h -- one scheduling directive as data, and schedules as what a log of them makes.
//
// A directive is a struct of names, sizes and choices; `fields` lists them in the order in which
// text gives them, so that printing, parsing and comparing are written once for all directives:
//
//   split(x, xo, xi, 8, GuardWithIf)
//
// Only primitive directives are here: tile, vectorize(x, 8) and their like are several of them.
// What one may be given to is checked in give_directive.h; applying one here asserts nothing but
// that its loops exist.
#pragma once

#include <string>
#include <tuple>
#include <utility>
#include <variant>
#include <vector>

#include "graph/schedule.h"
#include "ir/expr.h"

namespace retrograde::ir {

struct Definition;
struct FuncContents;

// Names of what is there already; names that a directive makes up are strings.
struct NamedLoop : std::string {
  NamedLoop(std::string name = "") : std::string(std::move(name)) {}
};
struct NamedFunc : std::string {  // of a Func or an image
  NamedFunc(std::string name = "") : std::string(std::move(name)) {}
};

// ---- of a stage ----

struct SplitLoop {
  static constexpr const char* name = "split";
  NamedLoop old;
  std::string outer, inner;
  Expr factor;
  TailStrategy tail = TailStrategy::Auto;
  auto fields() { return std::tie(old, outer, inner, factor, tail); }
};
struct FuseLoops {
  static constexpr const char* name = "fuse";
  NamedLoop inner, outer;
  std::string fused;
  auto fields() { return std::tie(inner, outer, fused); }
};
struct RenameLoop {
  static constexpr const char* name = "rename";
  NamedLoop old;
  std::string renamed;
  auto fields() { return std::tie(old, renamed); }
};
struct ReorderLoops {  // innermost first; loops that are not named keep their places
  static constexpr const char* name = "reorder";
  std::vector<NamedLoop> loops;
  auto fields() { return std::tie(loops); }
};
struct RunLoop {  // serial, parallel, vectorized or unrolled
  static constexpr const char* name = "run";
  NamedLoop loop;
  ForType kind = ForType::Serial;
  auto fields() { return std::tie(loop, kind); }
};
struct PartitionLoop {
  static constexpr const char* name = "partition";
  NamedLoop loop;
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
  NamedFunc source;
  NamedLoop at, from;
  Expr offset;
  PrefetchBoundStrategy strategy = PrefetchBoundStrategy::GuardWithIf;
  SymbolRef symbol = {};  // of the source
  auto fields() { return std::tie(source, at, from, offset, strategy); }
};
// A loop of a Func, root, or inlined.
struct AtLevel {
  LoopLevel level;
  // The user's object that says so, also when it is set later; null: `level` is all.
  std::shared_ptr<LoopLevelContents> from = {};
  auto fields() { return std::tie(level); }
};
struct ComputeWith : AtLevel {
  static constexpr const char* name = "compute_with";
  std::vector<std::pair<NamedLoop, LoopAlignStrategy>> align = {};
  auto fields() { return std::tie(level, align); }
};
struct Specialize {
  static constexpr const char* name = "specialize";
  Expr condition;
  auto fields() { return std::tie(condition); }
};
struct SpecializeFail {
  static constexpr const char* name = "specialize_fail";
  Expr message;
  auto fields() { return std::tie(message); }
};
struct FactorOut {  // rfactor: `made` keeps these loops as these variables
  static constexpr const char* name = "rfactor";
  std::string made;
  std::vector<std::pair<NamedLoop, std::string>> preserved;
  auto fields() { return std::tie(made, preserved); }
};

// ---- of a Func ----

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

struct TraceLoads {
  static constexpr const char* name = "trace_loads";
  auto fields() { return std::tie(); }
};
struct TraceStores {
  static constexpr const char* name = "trace_stores";
  auto fields() { return std::tie(); }
};
struct TraceRealizations {
  static constexpr const char* name = "trace_realizations";
  auto fields() { return std::tie(); }
};
struct AddTraceTag {
  static constexpr const char* name = "add_trace_tag";
  Expr tag;
  auto fields() { return std::tie(tag); }
};
struct DebugToFile {
  static constexpr const char* name = "debug_to_file";
  Expr file;
  auto fields() { return std::tie(file); }
};
struct Wrap {  // no users: all that have no other wrapper
  static constexpr const char* name = "in";
  std::string made;
  std::vector<NamedFunc> users;
  auto fields() { return std::tie(made, users); }
};
struct Clone {
  static constexpr const char* name = "clone_in";
  std::string made;
  std::vector<NamedFunc> users;
  auto fields() { return std::tie(made, users); }
};

using Directive =
    std::variant<SplitLoop, FuseLoops, RenameLoop, ReorderLoops, RunLoop, PartitionLoop, MakeAtomic,
                 AllowRaces, Unscheduled, PrefetchData, ComputeWith, Specialize, SpecializeFail,
                 FactorOut, ComputeAt, StoreAt, HoistStorage, StoreIn, ReorderStorage, AlignStorage,
                 BoundStorage, FoldStorage, Memoize, Async, BoundDimension, AlignBounds, Estimate,
                 TraceLoads, TraceStores, TraceRealizations, AddTraceTag, DebugToFile, Wrap, Clone>;
bool is_of_stage(const Directive& directive);  // not of the Func as a whole
const char* name_of(const Directive& directive);
std::vector<std::string> directive_names();
std::string made_by(const Directive& directive);  // the name of the Func that it makes; empty: none

// A directive that was given, and to what: the Func whose log it is in, or one of its stages.
struct LoggedDirective {
  int stage = -1;            // -1: the Func
  std::vector<int> special;  // of the stage's specializations: which, and of that one which
  Directive directive;
  uint64_t order = 0;  // grows with each directive that this process gives
};

// The loops of a definition that nobody scheduled, innermost first: its reduction variables, then
// its pure variables. `f`: whose.
std::vector<Dim> first_loops(const FuncContents& f, const Definition& definition);

// What the directive makes of a schedule. InternalError when a loop that it names is not there, and
// for those that make Funcs.
void apply_directive(const Directive& directive, StageLoops& schedule);
void apply_directive(const Directive& directive, FuncContents& f);

// Directives that make this schedule out of the first loops, specializations aside.
std::vector<Directive> directives_of(const StageLoops& schedule, const std::vector<Dim>& first);
// Directives that make the schedule of the Func, stages aside, out of none.
std::vector<Directive> directives_of(const FuncContents& f);

}  // namespace retrograde::ir
