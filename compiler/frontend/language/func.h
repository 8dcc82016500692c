// func.h -- a function from integer coordinates to values: what pipelines are made of.
//
// Func blur; Var x; blur(x) = (in(x - 1) + in(x) + in(x + 1)) / 3;   // a pure definition
// Func hist; RDom r(in); hist(x) = 0; hist(in(r)) += 1;              // and an update definition
// A Func is a handle: copies are the same function. Schedule directives return the Func, so that
// they chain.
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

// memoize: what callers name to drop results from the cache; an expression over parameters.
class EvictionKey {
 public:
  explicit EvictionKey(Expr key = {}) : key_(std::move(key)) {}
  const Expr& key() const { return key_; }

 private:
  Expr key_;
};

class Func : public LoopDirectives<Func>, public Runnable<Func> {
 public:
  Func(std::source_location where = std::source_location::current());
  // Requires: a name is text.
  explicit Func(const std::string& name,
                std::source_location where = std::source_location::current());
  template <frontend::TextPointer T>
  explicit Func(const T& name, std::source_location where = std::source_location::current())
      : Func(frontend::name_from(name, "a Func"), where) {}
  explicit Func(std::nullptr_t) = delete;  // and of a literal 0: Func(Expr(0)) is a constant
  // Definitions must have these types and dimensions.
  // Requires: dimensions are not negative; a definition has the dimensions that the Func was
  // declared with; all definitions of a Func have the same types.
  Func(Type required_type, int required_dimensions, const std::string& name = "");
  Func(const std::vector<Type>& required_types, int required_dimensions,
       const std::string& name = "");
  explicit Func(const Expr& e);  // f(_) = e
  explicit Func(graph::FuncPtr contents) : func_(std::move(contents)) {}
  explicit Func(const internal::Function& function) : func_(function) { function.name(); }
  template <typename T, int Dims>
  explicit Func(const Buffer<T, Dims>& image) : Func() {
    (*this)(_) = image(_);
  }

  template <std::convertible_to<Expr>... Args>
  FuncRef operator()(Args&&... args) const {
    return FuncRef(func_, {Expr(std::forward<Args>(args))...});
  }
  // Requires: a coordinate must be a defined expression; coordinates are integers; an access gives
  // one coordinate for each dimension; sizes and coordinates are of 32 bits.
  FuncRef operator()(const std::vector<Expr>& args) const { return FuncRef(func_, args); }
  // Not of braces, whose elements are Exprs: {x, 0}.
  template <std::same_as<Var> V>
  FuncRef operator()(const std::vector<V>& args) const {
    return FuncRef(func_, std::vector<Expr>(args.begin(), args.end()));
  }

  // ---- what it is ----
  // The name given, made unique, or a fresh one.
  const std::string& name() const { return func_->name; }
  bool defined() const { return func_->is_defined(); }  // whether it has a first definition
  // How many coordinates it takes; before its definition as declared, or 0.
  int dimensions() const {
    return defined() ? func_->dimensions() : std::max(func_->required_dimensions, 0);
  }
  std::vector<Var> args() const;  // the Vars of its first definition
  // Requires: the Func needs a definition first; its values are expressions; it has one value only
  // if it is no Tuple.
  Expr value() const;    // what its first definition stores
  Tuple values() const;  // the same of a Func of any number of values
  const std::vector<Type>& output_types() const { return types(); }  // of its values
  // The types of its values; before its definition those that were declared, or none.
  const std::vector<Type>& types() const {
    return defined() ? func_->types : func_->required_types;
  }
  const Type& type() const;                                         // of its one value
  int outputs() const { return static_cast<int>(types().size()); }  // how many values it has
  bool has_update_definition() const { return !func_->updates.empty(); }
  int num_update_definitions() const { return static_cast<int>(func_->updates.size()); }
  // Requires: updates are numbered from 0.
  std::vector<Expr> update_args(int index = 0) const;    // where an update stores
  Expr update_value(int index = 0) const;                // what an update stores
  Tuple update_values(int index = 0) const;              // the same of any number of values
  std::vector<RVar> rvars(int index = 0) const;          // the reduction variables of an update
  bool is_extern() const { return func_->is_extern(); }  // whether a C function computes it
  // Requires: a Func that define_extern defines has one.
  const std::string& extern_function_name() const;
  std::string source_location() const;  // of its declaration: "blur.cpp:12"
  internal::Function function() const { return internal::Function(func_); }
  // One function, two handles.
  bool same_as(const Func& other) const { return func_ == other.func_; }

  // ---- running it, and compiling it ahead of time: see runnable.h ----
  std::string loop_nest(const Target& target = Target());  // its loops as text, after scheduling
  void print_loop_nest();                                  // the same to the standard error stream
  std::vector<Argument> infer_arguments() const;           // Params and ImageParams that it uses
  JITHandlers& jit_handlers();
  // Promises about the buffer that this Func is realized into.
  // Requires: it has one only if it is no Tuple.
  OutputImageParam output_buffer() const;
  std::vector<OutputImageParam> output_buffers() const;

  // ---- computed outside ----

  // The values come from the C function `function_name`, which is called as
  //   int function_name(args..., halide_buffer_t* outputs...)
  // first with buffers whose host is null, to ask how large it makes the outputs, which it may
  // enlarge, and which regions of its inputs it needs for them, and then to compute. Outputs of the
  // pipeline keep the size that they are given. Funcs and images are passed as halide_buffer_t*,
  // Exprs as scalars; it returns 0 or an error code. What it reads and writes is stored where it is
  // computed, whatever store_at says. One call computes all that is needed, unless serial, parallel
  // or unroll makes a loop of one of the variables, or of a part of it after a split: then there is a
  // call on a slice in each iteration. Where the stage is computed in a loop, the function asks for no
  // more for a part of its output than for the whole, or the call fails.
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
  operator ExternFuncArgument() const { return ExternFuncArgument(func_); }

  // ---- wrappers ----

  // A new Func between this one and its users, to be scheduled on its own: g.in(f) for f alone,
  // g.in({f, h}) one for both, g.in() for all that have none of their own.
  //   g(x) = ...                        g(x) = ...
  //   f(x) = g(x) + g(x + 1)      =>    g_in_f(x) = g(x)
  //                                     f(x) = g_in_f(x) + g_in_f(x + 1)
  // Asked for again it is the same Func. It is inlined like any other Func unless scheduled, and
  // has wrappers itself: g.in(f).in(f). Compiling applies them; f's definition stays as it is.
  // Requires: a Func is wrapped in the Funcs that read it; a user needs a definition first; Funcs
  // that share a wrapper share it in every request; a user has either a wrapper or a clone; at
  // least one user is named.
  Func in(const Func& f);
  Func in(const std::vector<Func>& fs);
  Func in();
  // The same with a copy of this Func instead of one that reads it: it starts with the schedule
  // given so far, and its values are computed again for those users.
  //   g(x) = e(x)                       g(x) = e(x)
  //   f(x) = g(x)                 =>    g_clone_in_f(x) = e(x)
  //   h(x) = g(x)                       f(x) = g_clone_in_f(x);  h(x) = g(x)
  Func clone_in(const Func& f);
  Func clone_in(const std::vector<Func>& fs);
  // What this Func reads of an image, an ImageParam or a Buffer that the program names, in a Func of
  // its own: a copy that can be laid out and computed like any other Func. For this reader alone;
  // others, and other programs that read the image, do not see it. A Buffer has no in(f).
  //   f(x) = image(3 * x)         =>    image_in_f(x) = image(x)
  //                                     f(x) = image_in_f(3 * x)
  // Asked for again it is the same Func.
  // Requires: an input is copied for a Func that reads it; an input has a type and dimensions.
  Func copy_input(const ImageParam& image);
  Func copy_input(const Buffer<>& image);
  // Requires: storage lies in the memory of the CPU (Unsupported).
  Func copy_to_device(DeviceAPI device = DeviceAPI::Default_GPU);
  // This Func, which does nothing but read another one, is computed by the host: g.in().copy_to_host().
  // Requires: a copy is the same values at the same coordinates.
  Func copy_to_host();

  // ---- where it is computed and stored ----

  // Substituted into its users: the default, but for Funcs whose copies would make the bodies of
  // their users explode. Of a Func with updates: computed in the innermost loop of each user.
  //   for x: f(x) = g(x) + 1    =>    for x: f(x) = (x * x) + 1
  // Requires: what is inlined makes an expression that a code generator finishes.
  Func& compute_inline() { return compute_at(LoopLevel::inlined()); }
  // All of it, before anything that uses it.
  //   for x: f(x) = g(x) + g(x + 1)    =>    for x in [0, n + 1): g(x) = ...
  //                                          for x in [0, n): f(x) = g(x) + g(x + 1)
  Func& compute_root() { return compute_at(LoopLevel::root()); }
  // What one iteration of the loop `var` of `f` needs of it, inside that loop. g.compute_at(f, y):
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
  // Its storage lives for the whole of that loop, which is around the compute level; what is there
  // already is not computed again, and storage is folded where that suffices.
  // g.store_root().compute_at(f, y), with f(x, y) = g(x, y) + g(x, y + 1):
  //   realize g over all rows (folded: two rows)
  //     for y:
  //       for x: g(x, y + 1) = ...     (and row 0 when y == 0)
  //       for x: f(x, y) = g(x, y) + g(x, y + 1)
  Func& store_root() { return store_at(LoopLevel::root()); }
  Func& store_at(const Func& f, const Var& var) { return store_at(LoopLevel(f, var)); }
  Func& store_at(const Func& f, const RVar& var) { return store_at(LoopLevel(f, var)); }
  // Requires: only what is computed somewhere has storage of its own; iterations of a parallel loop
  // must not share the storage of what each of them computes.
  Func& store_at(const LoopLevel& level) { return give(graph::StoreAt{{{}, level.contents()}}); }
  // Where its memory is allocated: at this level, around the store level, once for all iterations
  // in between. What is computed does not change.
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
  Func& hoist_storage_root() { return hoist_storage(LoopLevel::root()); }
  // That many copies of hoisted storage, which the iterations of the loops between use in turn: what
  // one iteration stores is there until as many more have begun. An async Func computes that far
  // ahead of its users.
  //   allocate g                 allocate g[copies]
  //   for y:                =>   for y:
  //     g(...) = ...               g[y % copies](...) = ...
  // Requires: the number of copies must be a defined expression; the number of copies is an integer;
  // the number of copies is at least 1 and fits an int32; the number of copies has one value in each
  // call: it is made of parameters and facts about buffers; a ring buffer lies in storage that is
  // hoisted over serial loops; an async Func has a constant number of copies; an async Func in a ring
  // buffer is computed where it is stored, at one place, in loops of fixed extent (Unsupported).
  Func& ring_buffer(const Expr& copies);
  // In which memory.
  // Requires: storage lies in memory that a CPU or a CUDA device has (Unsupported); shared memory is that
  // of the threads of a block; a block has at most as many bytes of it as the target says; a thread
  // reads of its registers what it stored itself.
  Func& store_in(MemoryType memory) { return give(graph::StoreIn{memory}); }
  // Dimensions innermost in memory first. reorder_storage(c, x, y):
  //   g[x + w * y + w * h * c]    =>    g[c + 3 * x + 3 * w * y]
  // Requires: each must be one of its dimensions; each dimension is named once.
  Func& reorder_storage(const std::vector<Var>& dims);
  template <std::convertible_to<Var>... Rest>
  Func& reorder_storage(const Var& x, const Var& y, Rest&&... rest) {
    return reorder_storage(std::vector<Var>{x, y, Var(std::forward<Rest>(rest))...});
  }
  // The extent of this dimension in storage grows to a multiple of `alignment`, so that every line
  // begins aligned.  align_storage(x, 8):   allocate g[w * h]  =>  allocate g[(w + 7) / 8 * 8 * h]
  // Requires: the dimension must be a pure variable of the first definition; the alignment must be
  // a defined expression; the alignment is an integer; the alignment is at least 1 and fits an
  // int32; the alignment has one value in each call: it is made of parameters and facts about
  // buffers.
  Func& align_storage(const Var& dim, const Expr& alignment) {
    return give(graph::AlignStorage{dim.name(), alignment});
  }
  // Storage of this extent, coordinates taken modulo it: right when no more is alive at a time,
  // which is checked. fold_storage(y, 2):   g[x, y]  =>  g[x, y % 2]
  // `fold_forward`: the coordinate grows from iteration to iteration; false: it falls.
  // Requires: the extent is at least 1 and fits an int32; the extent has one value in each call: it
  // is made of parameters and facts about buffers; storage that the compiler lays out can be folded
  // or bounded.
  Func& fold_storage(const Var& dim, const Expr& extent, bool fold_forward = true) {
    return give(graph::FoldStorage{dim.name(), extent, fold_forward});
  }
  // Storage of this extent whatever the bounds say; a call that needs more fails.
  //   allocate g[n']   =>   assert(n' <= bound); allocate g[bound]
  // Requires: the bound is at least 1 and fits an int32; storage that the compiler lays out can be
  // folded or bounded.
  Func& bound_storage(const Var& dim, const Expr& bound) {
    return give(graph::BoundStorage{dim.name(), bound});
  }
  // Keeps results in the runtime's cache, under the values of all parameters it depends on.
  //   produce g   =>   if not in cache: produce g, put it in
  // Requires: an eviction key is an integer or a pointer; a Func has one eviction key; what an
  // image holds is no part of a memoized Func's key; the key must be made of Params and constants;
  // an output is computed by every call; a memoized Func must be computed whole, where its storage
  // begins.
  Func& memoize(const EvictionKey& eviction_key = EvictionKey()) {
    return give(graph::Memoize{eviction_key.key()});
  }
  // Computed by a thread of its own, at most as far ahead of its users as storage allows.
  //   produce g; consume g   =>   fork { produce g, signal } and { wait, consume g }
  // Requires: what an async Func and its consumer both read is stored no further out than the async
  // Func, or computed outside of the loops that they share; the loops between storage and
  // computation of an async Func are serial and always run (Unsupported).
  Func& async() { return give(graph::Async{}); }

  // ---- what is known of its size ----

  // A promise: exactly this is computed. A call that needs more fails.
  //   for x in [x0, x0 + n): ...   =>   assert(range is within [min, min + extent))
  //                                     for x in [min, min + extent): ...
  // Requires: the variable must be a pure variable of the first definition; the extent must be a
  // defined expression; bounds are integers; an extent is not negative; a bound has one value in
  // each call: it is made of parameters and facts about buffers.
  Func& bound(const Var& var, Expr min, Expr extent) {
    return give(graph::BoundDimension{var.name(), std::move(min), std::move(extent)});
  }
  // A promise about the extent only: loops are of this constant extent.
  Func& bound_extent(const Var& var, Expr extent) { return bound(var, {}, std::move(extent)); }
  // Computes more than is needed, so that min % modulus == remainder and the extent is a multiple.
  //   for x in [x0, x1): ...   =>   for x in [x0 rounded down, x1 rounded up): ...
  // Requires: the modulus is at least 1 and fits an int32; the remainder is an integer; the extent
  // is a multiple of the modulus; min % modulus is the remainder.
  Func& align_bounds(const Var& var, Expr modulus, Expr remainder = 0) {
    return give(graph::AlignBounds{var.name(), std::move(modulus), std::move(remainder)});
  }
  // The same for the extent only: the min stays.
  Func& align_extent(const Var& var, Expr modulus) {
    return align_bounds(var, std::move(modulus), {});
  }
  // A guess, for schedulers.
  Func& set_estimate(const Var& var, const Expr& min, const Expr& extent) {
    return give(graph::Estimate{var.name(), min, extent});
  }
  // Requires: there is one for each dimension.
  Func& set_estimates(const Region& estimates);

  // ---- watching it ----

  // Reports to the trace handler: each load of a value, each store, and when it begins and ends to
  // be produced and consumed. Tags come with each report.
  Func& trace_loads() { return give(graph::TraceLoads{}); }
  Func& trace_stores() { return give(graph::TraceStores{}); }
  Func& trace_realizations() { return give(graph::TraceRealizations{}); }
  Func& add_trace_tag(const std::string& tag) { return give(graph::AddTraceTag{tag}); }
  // Writes what was computed to a file, in NumPy's format (.npy) or raw (.tmp).
  // Requires: the file has a name; a file holds one value of each point (Unsupported); the name's
  // end says in which format (Unsupported); its format has the type of the elements (Unsupported).
  void debug_to_file(const std::string& filename) { give(graph::DebugToFile{filename}); }

  // ---- loops: of the first definition here, of updates through update(i); see loop_directives.h ----
  Stage update(int index = 0);
  Stage stage(int index) { return index == 0 ? Stage(*this) : update(index - 1); }
  operator Stage() const { return Stage(loops().f, 0); }

 private:
  graph::FuncPtr func_;
  Pipeline pipeline_;

  friend class LoopDirectives<Func>;
  friend class Runnable<Func>;
  graph::SchedulePlace loops() const;  // of the first definition
  Func& give(graph::Directive directive) {
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

template <class Self>
Self& LoopDirectives<Self>::eager_inline(const std::vector<Func>& funcs) {
  std::vector<graph::FuncPtr> inlined;
  for (const Func& f : funcs) inlined.push_back(f.function());
  graph::inline_into(place(), inlined);
  return self();
}

}  // namespace retrograde
