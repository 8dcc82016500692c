// func.h -- Func, a function from integer coordinates to values. Pipelines are graphs of Funcs.
//
// Func blur; Var x; blur(x) = (in(x - 1) + in(x) + in(x + 1)) / 3;   // a pure definition
// Func hist; RDom r(in); hist(x) = 0; hist(in(r)) += 1;              // and an update definition
// A Func is a handle: copies refer to the same function.
#pragma once

#include <algorithm>
#include <concepts>
#include <source_location>
#include <string>
#include <type_traits>
#include <vector>

#include "frontend/data/image_param.h"
#include "frontend/language/extern_argument.h"
#include "frontend/language/func_ref.h"
#include "frontend/language/function_handle.h"
#include "frontend/run/callable.h"
#include "frontend/run/pipeline.h"
#include "frontend/schedule/stage.h"

namespace retrograde {

// The key by which a program removes results of a memoized Func from the cache: an expression over
// parameters.
class EvictionKey {
 public:
  // A key, or none if the Expr is undefined.
  explicit EvictionKey(Expr key = {}) : key_(std::move(key)) {}
  const Expr& key() const { return key_; }  // the expression

 private:
  Expr key_;
};

// A function from integer coordinates to values, defined by a pure definition and optional updates. Func is a
// handle: copies refer to the same function. Directives return the Func, so they chain.
class Func : public LoopDirectives<Func>, public Runnable<Func> {
 public:
  // A Func without a definition, with a name that is generated or made unique.
  Func(std::source_location where = std::source_location::current());
  // Requires: a name is text.
  explicit Func(const std::string& name,
                std::source_location where = std::source_location::current());
  template <frontend::TextPointer T>
  explicit Func(const T& name, std::source_location where = std::source_location::current())
      : Func(frontend::name_from(name, "a Func"), where) {}
  explicit Func(std::nullptr_t) = delete;  // and of a literal 0: Func(Expr(0)) is a constant
  // Declares types and rank, which later definitions must match.
  // Requires: dimensions are not negative; a definition has the dimensions that the Func was
  // declared with; all definitions of a Func have the same types.
  Func(Type required_type, int required_dimensions, const std::string& name = "");
  Func(const std::vector<Type>& required_types, int required_dimensions,
       const std::string& name = "");
  explicit Func(const Expr& e);  // defines f(_) = e
  // A handle to an existing function.
  explicit Func(graph::FuncPtr contents) : func_(std::move(contents)) {}
  explicit Func(const internal::Function& function) : func_(function) { function.name(); }
  // A Func that reads the image point by point.
  template <typename T, int Dims>
  explicit Func(const Buffer<T, Dims>& image) : Func() {
    (*this)(_) = image(_);
  }

  // The Func at a point: an Expr to read, or the left-hand side of a definition.
  template <std::convertible_to<Expr>... Args>
  FuncRef operator()(Args&&... args) const {
    return FuncRef(func_, {Expr(std::forward<Args>(args))...});
  }
  // Requires: a coordinate must be a defined expression; coordinates are integers; an access gives
  // one coordinate for each dimension; sizes and coordinates are of 32 bits.
  FuncRef operator()(const std::vector<Expr>& args) const { return FuncRef(func_, args); }
  // The constraint excludes braced lists such as {x, 0}, whose elements are Exprs.
  template <std::same_as<Var> V>
  FuncRef operator()(const std::vector<V>& args) const {
    return FuncRef(func_, std::vector<Expr>(args.begin(), args.end()));
  }

  // ---- definition ----

  // The name in messages and generated code: the requested one, made unique, or a generated one.
  const std::string& name() const { return func_->name; }
  bool defined() const { return func_->is_defined(); }  // whether it has a first definition
  // Number of coordinates. Before the first definition: the declared number, or 0.
  int dimensions() const {
    return defined() ? func_->dimensions() : std::max(func_->required_dimensions, 0);
  }
  std::vector<Var> args() const;  // Vars of the first definition
  // Right-hand side of the first definition.
  // Requires: the Func needs a definition first; its values are expressions; it has one value only
  // if it is no Tuple.
  Expr value() const;
  Tuple values() const;  // right-hand sides of the first definition
  // Types of the values, as types() gives them.
  const std::vector<Type>& output_types() const { return types(); }
  // Types of the values. Before the first definition: the declared types, or none.
  const std::vector<Type>& types() const {
    return defined() ? func_->types : func_->required_types;
  }
  const Type& type() const;                                         // type of the only value
  int outputs() const { return static_cast<int>(types().size()); }  // number of values
  // Whether there is an update.
  bool has_update_definition() const { return !func_->updates.empty(); }
  // Number of update definitions.
  int num_update_definitions() const { return static_cast<int>(func_->updates.size()); }
  // Left-hand coordinates of an update.
  // Requires: updates are numbered from 0.
  std::vector<Expr> update_args(int index = 0) const;
  Expr update_value(int index = 0) const;                // right-hand side of an update
  Tuple update_values(int index = 0) const;              // right-hand sides of an update
  std::vector<RVar> rvars(int index = 0) const;          // reduction variables of an update
  bool is_extern() const { return func_->is_extern(); }  // whether an extern stage defines it
  // Name of the C function that define_extern() was given.
  // Requires: a Func that define_extern defines has one.
  const std::string& extern_function_name() const;
  std::string source_location() const;  // file and line of its declaration: "blur.cpp:12"
  // The function behind the handle, for code that inspects Func graphs.
  internal::Function function() const { return internal::Function(func_); }
  // Whether both handles refer to one function.
  bool same_as(const Func& other) const { return func_ == other.func_; }

  // ---- running and compiling: see runnable.h ----
  std::string loop_nest(const Target& target = Target());  // the scheduled loops as text
  void print_loop_nest();                                  // prints the scheduled loops to stderr
  std::vector<Argument> infer_arguments() const;           // Params and ImageParams that it uses
  // Handlers that in-process calls of this Func use.
  JITHandlers& jit_handlers();
  // The buffer that a single-valued Func is realized into, for promises about its shape.
  // Requires: it has one only if it is no Tuple.
  OutputImageParam output_buffer() const;
  // The output buffers, one for each value of the Func.
  std::vector<OutputImageParam> output_buffers() const;

  // ---- extern stages ----

  // Defines the Func by a C function, which is called as
  //   int function_name(args..., halide_buffer_t* outputs...)
  // Funcs and images are passed as halide_buffer_t*, Exprs as scalars. The function returns 0 or an error code.
  // The first call is a bounds query: buffers have a null host. The function may enlarge its outputs, and sets the
  // regions of its inputs that it needs for them; outputs of the pipeline keep their size. The next call computes.
  // Inputs and outputs of the function are stored at its compute level, whatever store_at says. One call computes
  // the whole required region, unless serial, parallel or unroll turns a variable, or a part of a split variable,
  // into a loop; then each iteration calls the function on a slice. If the stage is computed inside a loop, the
  // function must not require more for a part of its output than for all of it, or the call fails.
  // Requires: the C function has a name; every argument is a Func, an image or an Expr; every Func
  // among the arguments has a definition; its arguments are different Vars; it has at least one
  // value; a Func is defined once; extern stages run on the CPU (Unsupported); the function's
  // symbol is its plain name (Unsupported); a Func that a C function reads has memory; what a C
  // function reads or writes lies in memory as one box.
  void define_extern(const std::string& function_name, const std::vector<ExternFuncArgument>& args,
                     const std::vector<Type>& types, const std::vector<Var>& arguments,
                     NameMangling mangling = NameMangling::Default,
                     DeviceAPI device = DeviceAPI::Host);
  void define_extern(const std::string& function_name, const std::vector<ExternFuncArgument>& args,
                     Type type, const std::vector<Var>& arguments,
                     NameMangling mangling = NameMangling::Default,
                     DeviceAPI device = DeviceAPI::Host) {
    define_extern(function_name, args, std::vector<Type>{type}, arguments, mangling, device);
  }
  void define_extern(const std::string& function_name, const std::vector<ExternFuncArgument>& args,
                     const std::vector<Type>& types, int dimensionality,
                     NameMangling mangling = NameMangling::Default,
                     DeviceAPI device = DeviceAPI::Host);
  void define_extern(const std::string& function_name, const std::vector<ExternFuncArgument>& args,
                     Type type, int dimensionality, NameMangling mangling = NameMangling::Default,
                     DeviceAPI device = DeviceAPI::Host) {
    define_extern(function_name, args, std::vector<Type>{type}, dimensionality, mangling, device);
  }
  // Passes this Func to an extern stage.
  operator ExternFuncArgument() const { return ExternFuncArgument(func_); }

  // ---- wrappers ----

  // Inserts a wrapper: a new Func that reads this one and replaces it in some consumers, to be scheduled on
  // its own. g.in(f) serves f alone, g.in({f, h}) serves both, and g.in() all consumers without a wrapper of
  // their own.
  //   g(x) = ...                        g(x) = ...
  //   f(x) = g(x) + g(x + 1)      =>    g_in_f(x) = g(x)
  //                                     f(x) = g_in_f(x) + g_in_f(x + 1)
  // A second call returns the same wrapper. A wrapper is inlined unless scheduled, and can be wrapped itself:
  // g.in(f).in(f). Wrappers are applied when the pipeline is compiled; the definition of f does not change.
  // Requires: a Func is wrapped in the Funcs that read it; a user needs a definition first; Funcs
  // that share a wrapper share it in every request; a user has either a wrapper or a clone; at
  // least one user is named.
  Func in(const Func& f);
  Func in(const std::vector<Func>& fs);
  Func in();
  // Inserts a clone: a copy of this Func that replaces it in the given consumers. The clone starts with the
  // directives given so far, and recomputes the values for those consumers.
  //   g(x) = e(x)                       g(x) = e(x)
  //   f(x) = g(x)                 =>    g_clone_in_f(x) = e(x)
  //   h(x) = g(x)                       f(x) = g_clone_in_f(x);  h(x) = g(x)
  Func clone_in(const Func& f);
  Func clone_in(const std::vector<Func>& fs);
  // Inserts a copy of an input image that only this Func reads, to be laid out and scheduled like any Func.
  // It serves this Func alone. (A Buffer that the program names has no in(f).)
  //   f(x) = image(3 * x)         =>    image_in_f(x) = image(x)
  //                                     f(x) = image_in_f(3 * x)
  // A second call returns the same copy.
  // Requires: an input is copied for a Func that reads it; an input has a type and dimensions.
  Func copy_input(const ImageParam& image);
  Func copy_input(const Buffer<>& image);
  // Always throws: there is no directive that stores a copy of a Func on a device.
  // Requires: storage lies in the memory of the CPU (Unsupported).
  Func copy_to_device(DeviceAPI device = DeviceAPI::Default_GPU);
  // Computes this Func on the host. It must be a plain copy of another Func: g.in().copy_to_host().
  // Requires: a copy has the same values at the same coordinates.
  Func copy_to_host();

  // ---- compute level, storage level and storage ----

  // Substitutes the definition into the consumers. This is the default, except for Funcs whose inlining would
  // explode code size. A Func with updates is computed in the innermost loop of each consumer.
  //   for x: f(x) = g(x) + 1    =>    for x: f(x) = (x * x) + 1
  // Requires: what is inlined makes an expression that a code generator finishes.
  Func& compute_inline() { return compute_at(LoopLevel::inlined()); }
  // Computes the whole required region before any consumer starts.
  //   for x: f(x) = g(x) + g(x + 1)    =>    for x in [0, n + 1): g(x) = ...
  //                                          for x in [0, n): f(x) = g(x) + g(x + 1)
  Func& compute_root() { return compute_at(LoopLevel::root()); }
  // Computes, inside the loop `var` of `f`, the region that one iteration requires. g.compute_at(f, y):
  //   for y:                       for y:
  //     for x:                =>     for x in [0, n + 1): g(x, y) = ...
  //       f(x, y) = ...              for x in [0, n): f(x, y) = g(x, y) + g(x + 1, y)
  Func& compute_at(const Func& f, const Var& var) { return compute_at(LoopLevel(f, var)); }
  Func& compute_at(const Func& f, const RVar& var) { return compute_at(LoopLevel(f, var)); }
  // Requires: a Func must be stored and computed at a loop that encloses every use of it, and its
  // compute level; the level is set before the pipeline is compiled; the region of a Func that its
  // consumers read must be bounded.
  Func& compute_at(const LoopLevel& level) {
    return give(graph::ComputeAt{{{}, level.contents()}});
  }
  // Stores the whole required region at the outermost level. Values that earlier iterations computed are
  // reused, and storage is folded if fewer lines are alive at once. g.compute_at(f, y).store_root(), with
  // f(x, y) = g(x, y) + g(x, y + 1):
  //   realize g over all rows (folded: two rows)
  //     for y:
  //       for x: g(x, y + 1) = ...     (and row 0 when y == 0)
  //       for x: f(x, y) = g(x, y) + g(x, y + 1)
  Func& store_root() { return store_at(LoopLevel::root()); }
  // Stores at the loop `var` of `f`, which must enclose the compute level; see store_root().
  Func& store_at(const Func& f, const Var& var) { return store_at(LoopLevel(f, var)); }
  Func& store_at(const Func& f, const RVar& var) { return store_at(LoopLevel(f, var)); }
  // Requires: only what is computed somewhere has storage of its own; iterations of a parallel loop
  // must not share the storage of what each of them computes.
  Func& store_at(const LoopLevel& level) { return give(graph::StoreAt{{{}, level.contents()}}); }
  // Allocates memory once, at a level around the store level, instead of in each iteration between the two.
  // The computation does not change.
  //   for y:                            allocate g
  //     allocate g                =>    for y:
  //       g(...) = ...                    g(...) = ...
  Func& hoist_storage(const Func& f, const Var& var) { return hoist_storage(LoopLevel(f, var)); }
  Func& hoist_storage(const Func& f, const RVar& var) { return hoist_storage(LoopLevel(f, var)); }
  // Requires: storage is hoisted to a loop that encloses its store level; the size of hoisted
  // storage is known outside of the loops it is hoisted over.
  Func& hoist_storage(const LoopLevel& level) {
    return give(graph::HoistStorage{{{}, level.contents()}});
  }
  // Allocates memory once, at the outermost level.
  Func& hoist_storage_root() { return hoist_storage(LoopLevel::root()); }
  // Keeps `copies` copies of hoisted storage, which the iterations of the loops between hoist level and store
  // level use in turn. A value stays valid until `copies` more iterations have begun. An async Func computes
  // that far ahead of its consumers.
  //   allocate g                 allocate g[copies]
  //   for y:                =>   for y:
  //     g(...) = ...               g[y % copies](...) = ...
  // Requires: the number of copies must be a defined expression; the number of copies is an integer;
  // the number of copies is at least 1 and fits an int32; the number of copies has one value in each
  // call: it is made of parameters and facts about buffers; a ring buffer lies in storage that is
  // hoisted over serial loops; an async Func has a constant number of copies; an async Func in a ring
  // buffer is computed where it is stored, at one place, in loops of fixed extent (Unsupported).
  Func& ring_buffer(const Expr& copies);
  // Chooses the memory that holds the values: heap, stack, registers, or GPU shared memory.
  // Requires: storage lies in memory that a CPU or a CUDA device has (Unsupported); shared memory is that
  // of the threads of a block; a block has at most as many bytes of it as the target says; a thread
  // reads of its registers what it stored itself.
  Func& store_in(MemoryType memory) { return give(graph::StoreIn{memory}); }
  // Sets the layout in memory: dimensions from innermost to outermost. reorder_storage(c, x, y):
  //   g[x + w * y + w * h * c]    =>    g[c + 3 * x + 3 * w * y]
  // Requires: each must be one of its dimensions; each dimension is named once.
  Func& reorder_storage(const std::vector<Var>& dims);
  template <std::convertible_to<Var>... Rest>
  Func& reorder_storage(const Var& x, const Var& y, Rest&&... rest) {
    return reorder_storage(std::vector<Var>{x, y, Var(std::forward<Rest>(rest))...});
  }
  // Rounds the extent of a dimension in storage up to a multiple of `alignment`, so that every line begins
  // aligned.
  //   align_storage(x, 8):   allocate g[w * h]  =>  allocate g[(w + 7) / 8 * 8 * h]
  // Requires: the dimension must be a pure variable of the first definition; the alignment must be
  // a defined expression; the alignment is an integer; the alignment is at least 1 and fits an
  // int32; the alignment has one value in each call: it is made of parameters and facts about
  // buffers.
  Func& align_storage(const Var& dim, const Expr& alignment) {
    return give(graph::AlignStorage{dim.name(), alignment});
  }
  // Stores only `extent` coordinates of a dimension and takes coordinates modulo `extent`. The compiler
  // checks that no more are alive at once. fold_storage(y, 2):   g[x, y]  =>  g[x, y % 2]
  // fold_forward: whether the coordinate grows from iteration to iteration; otherwise it falls.
  // Requires: the extent is at least 1 and fits an int32; the extent has one value in each call: it
  // is made of parameters and facts about buffers; storage that the compiler lays out can be folded
  // or bounded.
  Func& fold_storage(const Var& dim, const Expr& extent, bool fold_forward = true) {
    return give(graph::FoldStorage{dim.name(), extent, fold_forward});
  }
  // Allocates `bound` coordinates of a dimension whatever bounds inference says; a call that needs more
  // fails.
  //   allocate g[n']   =>   assert(n' <= bound); allocate g[bound]
  // Requires: the bound is at least 1 and fits an int32; storage that the compiler lays out can be
  // folded or bounded.
  Func& bound_storage(const Var& dim, const Expr& bound) {
    return give(graph::BoundStorage{dim.name(), bound});
  }
  // Keeps results in the runtime's cache, keyed by the values of all parameters that this Func depends on.
  //   produce g   =>   if not in cache: produce g, put it in
  // Requires: an eviction key is an integer or a pointer; a Func has one eviction key; what an
  // image holds is no part of a memoized Func's key; the key must be made of Params and constants;
  // an output is computed by every call; a memoized Func must be computed whole, where its storage
  // begins.
  Func& memoize(const EvictionKey& eviction_key = EvictionKey()) {
    return give(graph::Memoize{eviction_key.key()});
  }
  // Computes this Func on a thread of its own, ahead of its consumers as far as storage allows.
  //   produce g; consume g   =>   fork { produce g, signal } and { wait, consume g }
  // Requires: what an async Func and its consumer both read is stored no further out than the async
  // Func, or computed outside of the loops that they share; the loops between storage and
  // computation of an async Func are serial and always run (Unsupported).
  Func& async() { return give(graph::Async{}); }

  // ---- bounds and estimates ----

  // Promises that exactly [min, min + extent) is computed. A call that needs more fails.
  //   for x in [x0, x0 + n): ...   =>   assert(range is within [min, min + extent))
  //                                     for x in [min, min + extent): ...
  // Requires: the variable must be a pure variable of the first definition; the extent must be a
  // defined expression; bounds are integers; an extent is not negative; a bound has one value in
  // each call: it is made of parameters and facts about buffers.
  Func& bound(const Var& var, Expr min, Expr extent) {
    return give(graph::BoundDimension{var.name(), std::move(min), std::move(extent)});
  }
  // Promises the extent only, so loops have this constant extent.
  Func& bound_extent(const Var& var, Expr extent) { return bound(var, {}, std::move(extent)); }
  // Enlarges the computed region so that min % modulus == remainder and the extent is a multiple of modulus.
  //   for x in [x0, x1): ...   =>   for x in [x0 rounded down, x1 rounded up): ...
  // Requires: the modulus is at least 1 and fits an int32; the remainder is an integer; the extent
  // is a multiple of the modulus; min % modulus is the remainder.
  Func& align_bounds(const Var& var, Expr modulus, Expr remainder = 0) {
    return give(graph::AlignBounds{var.name(), std::move(modulus), std::move(remainder)});
  }
  // Enlarges the computed region so that its extent is a multiple of modulus; the min stays.
  Func& align_extent(const Var& var, Expr modulus) {
    return align_bounds(var, std::move(modulus), {});
  }
  // States a likely range of one dimension of the output, for schedulers.
  Func& set_estimate(const Var& var, const Expr& min, const Expr& extent) {
    return give(graph::Estimate{var.name(), min, extent});
  }
  // States a likely (min, extent) of every dimension, for schedulers.
  // Requires: there is one for each dimension.
  Func& set_estimates(const Region& estimates);

  // ---- tracing ----

  // Reports each load of a value to the trace handler.
  Func& trace_loads() { return give(graph::TraceLoads{}); }
  // Reports each store of a value to the trace handler.
  Func& trace_stores() { return give(graph::TraceStores{}); }
  // Reports to the trace handler when production and consumption of this Func begin and end.
  Func& trace_realizations() { return give(graph::TraceRealizations{}); }
  // Adds a tag that trace events of this Func carry.
  Func& add_trace_tag(const std::string& tag) { return give(graph::AddTraceTag{tag}); }
  // Writes the computed values to a file: .npy for NumPy's format, .tmp for raw data.
  // Requires: the file has a name; a file holds one value of each point (Unsupported); the name's
  // end says in which format (Unsupported); its format has the type of the elements (Unsupported).
  void debug_to_file(const std::string& filename) { give(graph::DebugToFile{filename}); }

  // ---- loops: LoopDirectives schedule the first definition; update(i) returns the stage of an update ----

  // Update definition `index`, to be scheduled.
  Stage update(int index = 0);
  // Definition `index`, to be scheduled; 0 is the pure definition.
  Stage stage(int index) { return index == 0 ? Stage(*this) : update(index - 1); }
  // The pure definition, to be scheduled.
  operator Stage() const { return Stage(loops().f, 0); }

 private:
  graph::FuncPtr func_;
  Pipeline pipeline_;

  friend class LoopDirectives<Func>;
  friend class Runnable<Func>;
  graph::SchedulePlace loops() const;  // of the first definition
  template <typename D>
  Func& give(D directive) {
    graph::give_directive({func_}, std::move(directive));
    return *this;
  }
  void check_defined(const std::string& asked) const;
  void check_has_outputs(const std::string& asked) const;
  const graph::Definition& checked_update(int index, const char* asked) const;
  Func wrap(const std::vector<Func>& users, const std::string& name, bool clone) const;
  Func copied(const std::shared_ptr<graph::ParameterContents>& image) const;
  Pipeline& pipeline_to(const char* asked);
};

// Inlines the given Funcs into this stage; defined here because it needs the complete Func.
template <class Self>
Self& LoopDirectives<Self>::eager_inline(const std::vector<Func>& funcs) {
  std::vector<graph::FuncPtr> inlined;
  for (const Func& f : funcs) inlined.push_back(f.function());
  graph::inline_into(place(), inlined);
  return self();
}

}  // namespace retrograde
