// The ordered list of passes.
#include <algorithm>
#include <chrono>

#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "diagnostics/pass_observer.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/validate.h"
#include "lower/instrumentation/debug_features.h"
#include "lower/instrumentation/inject_profiling.h"
#include "lower/instrumentation/inject_tracing.h"
#include "lower/instrumentation/loop_nest_text.h"
#include "lower/instrumentation/write_debug_files.h"
#include "lower/loops/drop_checks.h"
#include "lower/loops/drop_guarded_clamps.h"
#include "lower/loops/flatten_storage.h"
#include "lower/loops/fork_async.h"
#include "lower/loops/free_early.h"
#include "lower/loops/insert_prefetches.h"
#include "lower/loops/join_indices.h"
#include "lower/loops/keep_accumulators.h"
#include "lower/loops/lower_atomics.h"
#include "lower/loops/memoize.h"
#include "lower/loops/partition_loops.h"
#include "lower/loops/trim_loops.h"
#include "lower/loops/unroll_loops.h"
#include "lower/lower.h"
#include "lower/nests/argument_checks.h"
#include "lower/nests/build_loop_nests.h"
#include "lower/nests/copy_statement.h"
#include "lower/nests/inline_functions.h"
#include "lower/nests/make_names_unique.h"
#include "lower/nests/share_parameters.h"
#include "lower/vectors/accumulate_vectors.h"
#include "lower/vectors/blend_masked_stores.h"
#include "lower/vectors/deinterleave_loads.h"
#include "lower/vectors/interleave_vectors.h"
#include "lower/vectors/transpose_loads.h"
#include "lower/vectors/vectorize_inner_loops.h"
#include "lower/vectors/vectorize_loops.h"
#include "simplify/simplify.h"

namespace retrograde::ir {
namespace {

struct Lowering {
  const std::vector<FuncPtr>& outputs;
  const std::vector<LoweredArgument>& args;
  Program program;
  std::map<std::string, std::string> renamed_funcs;  // new name -> name in the program
  std::map<std::string, std::vector<Expr>> folds;    // see LoopNests
  AsyncRoom async_room;
  const std::string& name;
  const LowerOptions& options;
};

struct Pass {
  const char* name;
  Phase phase;  // of what it gives
  Stmt (*run)(Lowering&, const Stmt&);
};

StorageLayouts storage_layouts(const Lowering& lowering) {
  StorageLayouts layouts;
  for (const LoopedFunc& f : lowering.program.funcs) {
    StorageLayout& layout = layouts[f.name()];
    if (auto it = lowering.folds.find(f.name()); it != lowering.folds.end())
      layout.folds = it->second;
    for (const std::string& var : f.schedule.storage_dims)
      layout.order.push_back(static_cast<int>(
          std::find(f.func->args.begin(), f.func->args.end(), var) - f.func->args.begin()));
    if (!is_hoisted(f)) continue;
    layout.lies_in = place_name(f.name());
    layouts[layout.lies_in].is_place = layout.lies_in;
  }
  for (const auto& [name, original] : lowering.renamed_funcs) layouts[name] = layouts[original];
  return layouts;
}

Stmt nest_loops(Lowering& lowering, const Stmt&) {
  lowering.program = inline_functions(lowering.outputs);
  const auto shared = share_parameters(lowering.program);
  LoopNests nests = build_loop_nests(lowering.program);
  nests.bounds.insert(nests.bounds.begin(), shared.begin(), shared.end());
  lowering.folds = nests.folds;
  lowering.async_room = nests.async_room;
  inject_tracing(nests, lowering.program, lowering.name, lowering.options.target);
  UniqueNames unique =
      make_names_unique(add_argument_checks(nests, lowering.args, lowering.program));
  lowering.renamed_funcs = std::move(unique.original);
  return unique.stmt;
}

// Whether a schedule has `var` as a loop, and as one over pure variables wherever it has it.
struct LoopKinds {
  bool is_pure = false, is_reduction = false;
};
void find_kinds(const StageLoops& schedule, const std::string& var, LoopKinds& kinds) {
  for (const Dim& dim : schedule.dims) {
    if (dim.var == var) (dim.is_reduction ? kinds.is_reduction : kinds.is_pure) = true;
  }
  for (const StageLoops& other : schedule.specializations) find_kinds(other, var, kinds);
}

// Iterations of a loop over a pure variable touch elements of their own (define.cpp sees to it).
bool is_pure_loop(const Lowering& lowering, const For& loop) {
  const LoopName name = decode_loop_name(loop.name);
  const auto renamed = lowering.renamed_funcs.find(name.func);
  const LoopedFunc* func =
      lowering.program.find(renamed == lowering.renamed_funcs.end() ? name.func : renamed->second);
  if (!func) return false;
  const auto stage = static_cast<size_t>(std::stoi(name.stage));
  LoopKinds kinds;
  if (stage < func->stages.size()) find_kinds(func->stages[stage].schedule, name.var, kinds);
  return kinds.is_pure && !kinds.is_reduction;
}

Stmt vectorize_unscheduled(const Lowering& lowering, const Stmt& s) {
  const Target& target = lowering.options.target;
  if (target.has_feature(Target::DisableLLVMLoopOpt)) return s;
  return vectorize_inner_loops(s, {target.natural_vector_size(UInt(8)),
                                   [&](const For& loop) { return is_pure_loop(lowering, loop); }});
}

Stmt run_simplify(Lowering&, const Stmt& s) { return simplify(s); }

constexpr Pass passes[] = {
    {"build_loop_nests", Phase::Loops, nest_loops},
    {"drop_bounds_query", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       const bool drops = lowering.options.target.has_feature(Target::NoBoundsQuery);
       return drops ? drop_bounds_query(s) : s;
     }},
    {"check_promises", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       const bool checks = lowering.options.target.has_feature(Target::CheckUnsafePromises);
       return checks ? check_promises(s) : s;
     }},
    {"write_debug_files", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       return write_debug_files(s, lowering.program, lowering.renamed_funcs);
     }},
    {"insert_prefetches", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       return insert_prefetches(s, lowering.program, lowering.renamed_funcs);
     }},
    {"lower_prefetches", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       return lower_prefetches(s, lowering.program, lowering.renamed_funcs);
     }},
    {"fork_async", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       return fork_async(s, lowering.program, lowering.renamed_funcs, lowering.async_room);
     }},
    {"memoize", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       return memoize(s, lowering.program, lowering.renamed_funcs, lowering.name,
                      lowering.options.target, lowering.folds);
     }},
    {"keep_accumulators", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       return keep_accumulators(s, [&](const For& loop) { return is_pure_loop(lowering, loop); });
     }},
    {"flatten_storage", Phase::FlatStorage,
     [](Lowering& lowering, const Stmt& s) {
       return flatten_storage(s, storage_layouts(lowering));
     }},
    {"simplify_storage", Phase::FlatStorage, run_simplify},
    {"lower_atomics", Phase::FlatStorage,
     [](Lowering&, const Stmt& s) { return lower_atomics(s); }},
    {"partition_loops", Phase::FlatStorage,
     [](Lowering&, const Stmt& s) { return partition_loops(s); }},
    {"drop_guarded_clamps", Phase::FlatStorage,
     [](Lowering&, const Stmt& s) { return drop_guarded_clamps(s); }},
    {"trim_loops", Phase::FlatStorage, [](Lowering&, const Stmt& s) { return trim_loops(s); }},
    {"unroll_loops", Phase::FlatStorage, [](Lowering&, const Stmt& s) { return unroll_loops(s); }},
    {"join_indices", Phase::FlatStorage, [](Lowering&, const Stmt& s) { return join_indices(s); }},
    {"vectorize_inner_loops", Phase::FlatStorage,
     [](Lowering& lowering, const Stmt& s) { return vectorize_unscheduled(lowering, s); }},
    {"vectorize_loops", Phase::Vector, [](Lowering&, const Stmt& s) { return vectorize_loops(s); }},
    {"accumulate_vectors", Phase::Vector,
     [](Lowering&, const Stmt& s) { return accumulate_vectors(s); }},
    {"interleave_vectors", Phase::Vector,
     [](Lowering&, const Stmt& s) { return interleave_vectors(s); }},
    {"transpose_loads", Phase::Vector, [](Lowering&, const Stmt& s) { return transpose_loads(s); }},
    {"deinterleave_loads", Phase::Vector,
     [](Lowering&, const Stmt& s) { return deinterleave_loads(s); }},
    {"simplify_vectors", Phase::Vector, run_simplify},
    {"blend_masked_stores", Phase::Vector,
     [](Lowering&, const Stmt& s) { return blend_masked_stores(s); }},
    {"fuzz_float_stores", Phase::Vector,
     [](Lowering& lowering, const Stmt& s) {
       const bool fuzzes = lowering.options.target.has_feature(Target::FuzzFloatStores);
       return fuzzes ? fuzz_float_stores(s) : s;
     }},
    {"inject_profiling", Phase::Vector,
     [](Lowering& lowering, const Stmt& s) {
       if (!lowering.options.target.has_feature(Target::Profile)) return s;
       return inject_profiling(s, lowering.program, lowering.renamed_funcs, lowering.name);
     }},
    {"free_early", Phase::Vector, [](Lowering&, const Stmt& s) { return free_early(s); }},
    {"drop_asserts", Phase::Vector,
     [](Lowering& lowering, const Stmt& s) {
       const bool drops = lowering.options.target.has_feature(Target::NoAsserts);
       return drops ? drop_asserts(s) : s;
     }},
};

std::vector<std::string> names_of(const std::vector<LoweredArgument>& args) {
  std::vector<std::string> names;
  for (const LoweredArgument& arg : args)
    names.push_back(arg.is_buffer() ? arg.name + ".buffer" : arg.name);
  return names;
}

void append_outputs(const std::vector<FuncPtr>& outputs, std::vector<LoweredArgument>& args) {
  for (const FuncPtr& f : outputs) {
    for (size_t i = 0; i < f->types.size(); i++) {
      LoweredArgument arg;
      arg.name = value_buffer_name(*f, static_cast<int>(i));
      arg.kind = LoweredArgument::Kind::OutputBuffer;
      arg.type = f->types[i];
      arg.dimensions = f->dimensions();
      if (i < f->outputs.size()) arg.symbol = SymbolRef(f->outputs[i]);
      args.push_back(std::move(arg));
    }
  }
}

Stmt run_passes(Lowering& lowering, const LowerOptions& options) {
  Stmt stmt;
  for (const Pass& pass : passes) {
    auto start = std::chrono::steady_clock::now();
    const Stmt before = stmt;
    stmt = pass.run(lowering, before);
    std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    if (options.validate) validate(stmt, pass.phase, pass.name, names_of(lowering.args), before);
    if (options.observe) options.observe(pass.name, seconds.count(), stmt);
    tell_pass_observers({lowering.name, pass.name, seconds.count(), [&] { return print(stmt); }});
    if (options.stop_after == pass.name) break;
  }
  return stmt;
}

}  // namespace

namespace {

void check_stop(const std::string& stop_after) {
  const std::vector<std::string> names = pass_names();
  if (stop_after.empty() || std::find(names.begin(), names.end(), stop_after) != names.end())
    return;
  std::string known;
  for (const std::string& pass : names) known += (known.empty() ? "" : ", ") + pass;
  user_error("stop lowering after " + quoted(stop_after), "lowering stops after one of its passes",
             "they are " + known, "Name one of them, or none to run them all");
}

}  // namespace

LoweredFunction lower(const std::string& name, const std::vector<FuncPtr>& outputs,
                      const std::vector<LoweredArgument>& inputs, const LowerOptions& options) {
  check_stop(options.stop_after);
  LoweredFunction function{name, inputs, {}, {}};
  run_on_large_stack([&] {
    append_outputs(outputs, function.args);
    Lowering lowering{outputs, function.args, {}, {}, {}, {}, name, options};
    function.body = run_passes(lowering, options);
    function.loop_nest = [program = std::move(lowering.program)] {
      return loop_nest_text(program);
    };
  });
  return function;
}

std::vector<LoweredArgument> infer_arguments(const std::vector<FuncPtr>& outputs) {
  std::vector<LoweredArgument> args;
  for (const std::shared_ptr<ParameterContents>& param : parameters_of(outputs)) {
    LoweredArgument arg;
    arg.name = param->name;
    arg.kind =
        param->is_buffer ? LoweredArgument::Kind::InputBuffer : LoweredArgument::Kind::Scalar;
    arg.type = param->type;
    arg.dimensions = param->dimensions;
    arg.symbol = SymbolRef(param);
    args.push_back(std::move(arg));
  }
  return args;
}

std::vector<std::string> pass_names() {
  std::vector<std::string> names;
  for (const Pass& pass : passes) names.push_back(pass.name);
  return names;
}

}  // namespace retrograde::ir
