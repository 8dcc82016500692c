// func.h -- a function from integer coordinates to values: what pipelines are made of.
//
// Func blur; Var x; blur(x) = (in(x - 1) + in(x) + in(x + 1)) / 3;   // a pure definition
// Func hist; RDom r(in); hist(x) = 0; hist(in(r)) += 1;              // and an update definition
// A Func is a handle: copies are the same function. Schedule directives return the Func, so that
// they chain.
#pragma once

#include <string>
#include <type_traits>
#include <vector>

#include "frontend/func_ref.h"
#include "frontend/image_param.h"
#include "frontend/pipeline.h"
#include "frontend/stage.h"

namespace retrograde {

// A loop of a Func, or root, or inline: where another Func is computed or stored.
class LoopLevel {
 public:
  LoopLevel() = default;  // inlined
  LoopLevel(const Func& f, const VarOrRVar& var, int stage_index = -1);
  static LoopLevel inlined() { return {}; }
  static LoopLevel root();
  std::string to_string() const;
  const ir::LoopLevel& contents() const { return level_; }

 private:
  ir::LoopLevel level_;
};

class Func {
 public:
  Func();
  explicit Func(const std::string& name);
  explicit Func(const char* name) : Func(std::string(name)) {}
  // Definitions must have these types and dimensions.
  Func(Type required_type, int required_dimensions, const std::string& name = "");
  Func(const std::vector<Type>& required_types, int required_dimensions,
       const std::string& name = "");
  explicit Func(const Expr& e);  // f(_) = e
  explicit Func(ir::FuncPtr contents) : func_(std::move(contents)) {}
  template <typename T, int Dims>
  explicit Func(const Buffer<T, Dims>& image) : Func() {
    (*this)(_) = image(_);
  }

  template <typename... Args>
  requires((std::is_convertible_v<Args, Expr> && ...)) FuncRef operator()(Args&&... args) const {
    return FuncRef(func_, {Expr(std::forward<Args>(args))...});
  }
  FuncRef operator()(const std::vector<Expr>& args) const { return FuncRef(func_, args); }
  FuncRef operator()(const std::vector<Var>& args) const {
    return FuncRef(func_, std::vector<Expr>(args.begin(), args.end()));
  }

  // ---- what it is ----
  const std::string& name() const { return func_->name; }
  bool defined() const { return func_->is_defined(); }
  int dimensions() const { return func_->dimensions(); }
  std::vector<Var> args() const;
  Expr value() const;
  Tuple values() const;
  const std::vector<Type>& output_types() const { return func_->types; }
  const std::vector<Type>& types() const { return func_->types; }
  const Type& type() const;
  int outputs() const { return static_cast<int>(func_->types.size()); }
  bool has_update_definition() const { return !func_->updates.empty(); }
  int num_update_definitions() const { return static_cast<int>(func_->updates.size()); }
  std::vector<Expr> update_args(int index = 0) const;
  Expr update_value(int index = 0) const;
  Tuple update_values(int index = 0) const;
  std::vector<RVar> rvars(int index = 0) const;
  bool is_extern() const { return false; }
  const ir::FuncPtr& function() const { return func_; }
  bool same_as(const Func& other) const { return func_ == other.func_; }

  // ---- running it ----
  Realization realize(const std::vector<int32_t>& sizes = {}, const Target& target = Target());
  void realize(Pipeline::RealizationArg outputs, const Target& target = Target());
  void infer_input_bounds(const std::vector<int32_t>& sizes, const Target& target = Target());
  void infer_input_bounds(Pipeline::RealizationArg outputs, const Target& target = Target());
  void compile_jit(const Target& target = Target());
  std::string loop_nest(const Target& target = Target());
  void print_loop_nest();
  std::vector<Argument> infer_arguments() const;
  JITHandlers& jit_handlers();
  void set_custom_print(void (*handler)(void*, const char*));
  // Promises about the buffer that this Func is realized into.
  OutputImageParam output_buffer() const;
  std::vector<OutputImageParam> output_buffers() const;

  // ---- ahead of time: see pipeline.h. An empty function name stands for the Func's own ----
  Module compile_to_module(const std::vector<Argument>& args, const std::string& function_name = "",
                           const Target& target = get_target_from_environment());
  void compile_to(const std::map<OutputFileType, std::string>& output_files,
                  const std::vector<Argument>& args, const std::string& function_name,
                  const Target& target = get_target_from_environment());
  void compile_to_object(const std::string& filename, const std::vector<Argument>& args,
                         const std::string& function_name,
                         const Target& target = get_target_from_environment());
  void compile_to_object(const std::string& filename, const std::vector<Argument>& args,
                         const Target& target = get_target_from_environment());
  void compile_to_bitcode(const std::string& filename, const std::vector<Argument>& args,
                          const std::string& function_name,
                          const Target& target = get_target_from_environment());
  void compile_to_bitcode(const std::string& filename, const std::vector<Argument>& args,
                          const Target& target = get_target_from_environment());
  void compile_to_llvm_assembly(const std::string& filename, const std::vector<Argument>& args,
                                const std::string& function_name,
                                const Target& target = get_target_from_environment());
  void compile_to_llvm_assembly(const std::string& filename, const std::vector<Argument>& args,
                                const Target& target = get_target_from_environment());
  void compile_to_assembly(const std::string& filename, const std::vector<Argument>& args,
                           const std::string& function_name,
                           const Target& target = get_target_from_environment());
  void compile_to_assembly(const std::string& filename, const std::vector<Argument>& args,
                           const Target& target = get_target_from_environment());
  void compile_to_header(const std::string& filename, const std::vector<Argument>& args,
                         const std::string& function_name = "",
                         const Target& target = get_target_from_environment());
  void compile_to_c(const std::string& filename, const std::vector<Argument>& args,
                    const std::string& function_name = "",
                    const Target& target = get_target_from_environment());
  void compile_to_lowered_stmt(const std::string& filename, const std::vector<Argument>& args,
                               StmtOutputFormat format = Text,
                               const Target& target = get_target_from_environment());
  void compile_to_file(const std::string& filename_prefix, const std::vector<Argument>& args,
                       const std::string& function_name = "",
                       const Target& target = get_target_from_environment());
  void compile_to_static_library(const std::string& filename_prefix,
                                 const std::vector<Argument>& args,
                                 const std::string& function_name = "",
                                 const Target& target = get_target_from_environment());
  void compile_to_multitarget_static_library(const std::string& filename_prefix,
                                             const std::vector<Argument>& args,
                                             const std::vector<Target>& targets);
  void compile_to_multitarget_object_files(const std::string& filename_prefix,
                                           const std::vector<Argument>& args,
                                           const std::vector<Target>& targets,
                                           const std::vector<std::string>& suffixes);

  // ---- where it is computed and stored ----
  // Substituted into its users (the default). Of a Func with updates: computed in the innermost
  // loop of each user.
  Func& compute_inline();
  // All of it, before anything that uses it.
  Func& compute_root();
  // What one iteration of the loop `var` of `f` needs of it, inside that loop.
  Func& compute_at(const Func& f, const Var& var) { return compute_at(LoopLevel(f, var)); }
  Func& compute_at(const Func& f, const RVar& var) { return compute_at(LoopLevel(f, var)); }
  Func& compute_at(const LoopLevel& level);
  // Its storage lives for the whole of that loop; what is there is not computed again.
  Func& store_root();
  Func& store_at(const Func& f, const Var& var) { return store_at(LoopLevel(f, var)); }
  Func& store_at(const Func& f, const RVar& var) { return store_at(LoopLevel(f, var)); }
  Func& store_at(const LoopLevel& level);
  Func& store_in(MemoryType memory);
  // Dimensions innermost in memory first.
  Func& reorder_storage(const std::vector<Var>& dims);
  template <typename... Rest>
  requires((std::is_convertible_v<Rest, Var> &&
            ...)) Func& reorder_storage(const Var& x, const Var& y, Rest&&... rest) {
    return reorder_storage(std::vector<Var>{x, y, Var(std::forward<Rest>(rest))...});
  }

  // ---- what is known of its size ----
  Func& bound(const Var& var, Expr min, Expr extent);  // a promise: exactly this is computed
  Func& bound_extent(const Var& var, Expr extent);     // a promise about the extent only
  Func& set_estimate(const Var& var, const Expr& min,
                     const Expr& extent);  // a guess, for schedulers
  Func& set_estimates(const Region& estimates);

  // ---- loops: of the first definition here, of updates through update(i); see stage.h ----
  Stage update(int index = 0);
  Stage stage(int index) { return index == 0 ? pure_stage() : update(index - 1); }
  operator Stage() const { return pure_stage(); }
  Func& split(const VarOrRVar& old, const VarOrRVar& outer, const VarOrRVar& inner,
              const Expr& factor, TailStrategy tail = TailStrategy::Auto) {
    return with(pure_stage().split(old, outer, inner, factor, tail));
  }
  Func& fuse(const VarOrRVar& inner, const VarOrRVar& outer, const VarOrRVar& fused) {
    return with(pure_stage().fuse(inner, outer, fused));
  }
  Func& rename(const VarOrRVar& old_name, const VarOrRVar& new_name) {
    return with(pure_stage().rename(old_name, new_name));
  }
  Func& reorder(const std::vector<VarOrRVar>& vars) { return with(pure_stage().reorder(vars)); }
  template <typename... Rest>
  requires((std::is_convertible_v<Rest, VarOrRVar> &&
            ...)) Func& reorder(const VarOrRVar& x, const VarOrRVar& y, Rest&&... rest) {
    return reorder(std::vector<VarOrRVar>{x, y, VarOrRVar(std::forward<Rest>(rest))...});
  }
  Func& serial(const VarOrRVar& var) { return with(pure_stage().serial(var)); }
  Func& parallel(const VarOrRVar& var) { return with(pure_stage().parallel(var)); }
  Func& vectorize(const VarOrRVar& var) { return with(pure_stage().vectorize(var)); }
  Func& unroll(const VarOrRVar& var) { return with(pure_stage().unroll(var)); }
  Func& parallel(const VarOrRVar& var, const Expr& task_size,
                 TailStrategy tail = TailStrategy::Auto) {
    return with(pure_stage().parallel(var, task_size, tail));
  }
  Func& vectorize(const VarOrRVar& var, const Expr& factor,
                  TailStrategy tail = TailStrategy::Auto) {
    return with(pure_stage().vectorize(var, factor, tail));
  }
  Func& unroll(const VarOrRVar& var, const Expr& factor, TailStrategy tail = TailStrategy::Auto) {
    return with(pure_stage().unroll(var, factor, tail));
  }
  Func& tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& xo, const VarOrRVar& yo,
             const VarOrRVar& xi, const VarOrRVar& yi, const Expr& xfactor, const Expr& yfactor,
             TailStrategy tail = TailStrategy::Auto) {
    return with(pure_stage().tile(x, y, xo, yo, xi, yi, xfactor, yfactor, tail));
  }
  Func& tile(const VarOrRVar& x, const VarOrRVar& y, const VarOrRVar& xi, const VarOrRVar& yi,
             const Expr& xfactor, const Expr& yfactor, TailStrategy tail = TailStrategy::Auto) {
    return with(pure_stage().tile(x, y, xi, yi, xfactor, yfactor, tail));
  }
  Func& tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& outers,
             const std::vector<VarOrRVar>& inners, const std::vector<Expr>& factors,
             const std::vector<TailStrategy>& tails) {
    return with(pure_stage().tile(previous, outers, inners, factors, tails));
  }
  Func& tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& outers,
             const std::vector<VarOrRVar>& inners, const std::vector<Expr>& factors,
             TailStrategy tail = TailStrategy::Auto) {
    return with(pure_stage().tile(previous, outers, inners, factors, tail));
  }
  Func& tile(const std::vector<VarOrRVar>& previous, const std::vector<VarOrRVar>& inners,
             const std::vector<Expr>& factors, TailStrategy tail = TailStrategy::Auto) {
    return with(pure_stage().tile(previous, inners, factors, tail));
  }
  const ir::StageSchedule& get_schedule() const { return pure_stage().get_schedule(); }

 private:
  ir::FuncPtr func_;
  Pipeline pipeline_;

  Stage pure_stage() const;
  Func& with(const Stage&) { return *this; }
  ir::FuncSchedule& touch();
  void check_defined(const std::string& asked) const;
  const ir::Definition& checked_update(int index, const char* asked) const;
  void add_bound(std::vector<ir::Bound>& bounds, const std::string& asked, const Var& var, Expr min,
                 Expr extent);
  Pipeline& pipeline();
};

}  // namespace retrograde
