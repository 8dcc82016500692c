// The ordered list of passes.
#include <algorithm>
#include <chrono>

#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "diagnostics/pass_observer.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/validate.h"
#include "ir/vector_bytes.h"
#include "lower/checks/argument_checks.h"
#include "lower/checks/refuse_unsupported.h"
#include "lower/definitions/inline_functions.h"
#include "lower/definitions/resolve_undef.h"
#include "lower/definitions/share_parameters.h"
#include "lower/device/make_kernels.h"
#include "lower/instrumentation/check_accesses.h"
#include "lower/instrumentation/inject_profiling.h"
#include "lower/instrumentation/inject_tracing.h"
#include "lower/instrumentation/loop_nest_text.h"
#include "lower/instrumentation/write_debug_files.h"
#include "lower/loops/flatten_storage.h"
#include "lower/loops/fork_async.h"
#include "lower/loops/insert_prefetches.h"
#include "lower/loops/keep_accumulators.h"
#include "lower/loops/memoize.h"
#include "lower/loops/ring_buffers.h"
#include "lower/loops/skip_stages.h"
#include "lower/lower.h"
#include "lower/nests/build_loop_nests.h"
#include "lower/nests/copy_statement.h"
#include "lower/nests/make_names_unique.h"
#include "lower/statement_passes.h"
#include "lower/vectors/vectorize_inner_loops.h"
#include "simplify/simplify.h"

namespace retrograde::lower {
namespace {

struct Lowering {
  const std::vector<FuncPtr>& outputs;
  const std::vector<LoweredArgument>& args;
  Program program;
  std::map<std::string, std::vector<Expr>> folds;  // see LoopNests
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
    layout.is_in_ring = f.schedule.ring.defined();
    layouts[layout.lies_in].is_place = layout.lies_in;
    layouts[layout.lies_in].folds = layout.folds;
  }
  for (const auto& [name, original] : lowering.program.renamed) layouts[name] = layouts[original];
  return layouts;
}

Stmt nest_loops(Lowering& lowering, const Stmt&) {
  lowering.program = inline_functions(lowering.outputs);
  check_devices(lowering.program, lowering.options.target);
  const auto shared = share_parameters(lowering.program);
  LoopNests nests = build_loop_nests(lowering.program);
  nests.bounds.insert(nests.bounds.begin(), shared.begin(), shared.end());
  lowering.folds = nests.folds;
  lowering.async_room = nests.async_room;
  inject_tracing(nests, lowering.program, lowering.name, lowering.options.target);
  UniqueNames unique =
      make_names_unique(add_argument_checks(nests, lowering.args, lowering.program,
                                            lowering.options.target.has_feature(Target::CUDA)),
                        mapped(lowering.args, &LoweredArgument::name));
  lowering.program.renamed = std::move(unique.original);
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
  const LoopedFunc* func = lowering.program.find(name.func);
  if (!func) return false;
  const auto stage = static_cast<size_t>(std::stoi(name.stage));
  LoopKinds kinds;
  if (stage < func->stages.size()) find_kinds(func->stages[stage].schedule, name.var, kinds);
  return kinds.is_pure && !kinds.is_reduction;
}

Stmt vectorize_unscheduled(const Lowering& lowering, const Stmt& s) {
  const Target& target = lowering.options.target;
  if (target.has_feature(Target::DisableLLVMLoopOpt)) return s;
  return vectorize_inner_loops(
      s, {ir::vector_bytes(target), [&](const For& loop) { return is_pure_loop(lowering, loop); }});
}

Stmt run_simplify(Lowering&, const Stmt& s) { return simplify(s); }

template <Stmt (*pass)(const Stmt&)>
Stmt alone(Lowering&, const Stmt& s) {
  return pass(s);
}
template <Target::Feature feature, Stmt (*pass)(const Stmt&)>
Stmt wanted(Lowering& lowering, const Stmt& s) {
  return lowering.options.target.has_feature(feature) ? pass(s) : s;
}

std::vector<std::string> buffer_names(const std::vector<LoweredArgument>& args) {
  std::vector<std::string> names;
  for (const LoweredArgument& arg : args) {
    if (arg.is_buffer()) names.push_back(arg.name);
  }
  return names;
}

bool stores_every_element(const LoopedFunc& f) {
  return !f.func->extern_definition && std::ranges::none_of(f.stages[0].values, mentions_undef);
}

GivenBuffers given_buffers(const Lowering& lowering) {
  GivenBuffers given;
  given.names = buffer_names(lowering.args);
  for (const LoopedFunc& f : lowering.program.funcs) {
    if (!f.is_output || !stores_every_element(f)) continue;
    std::vector<std::string>& values = given.overwritten[f.name()];
    for (size_t i = 0; i < f.func->types.size(); ++i)
      values.push_back(value_buffer_name(*f.func, static_cast<int>(i)));
  }
  return given;
}

constexpr Pass passes[] = {
    {"build_loop_nests", Phase::Loops, nest_loops},
    {"drop_bounds_query", Phase::Loops, wanted<Target::NoBoundsQuery, drop_bounds_query>},
    {"check_promises", Phase::Loops, wanted<Target::CheckUnsafePromises, check_promises>},
    {"write_debug_files", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) { return write_debug_files(s, lowering.program); }},
    {"skip_stages", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       return skip_stages(s, [&](const std::string& name) {
         const LoopedFunc* f = lowering.program.find(name);
         return !f || !f->schedule.async;
       });
     }},
    {"insert_prefetches", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) { return insert_prefetches(s, lowering.program); }},
    {"lower_prefetches", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) { return lower_prefetches(s, lowering.program); }},
    {"fork_async", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       return fork_async(s, lowering.program, lowering.async_room);
     }},
    {"memoize", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       return memoize(s, lowering.program, lowering.name, lowering.options.target, lowering.folds);
     }},
    {"keep_accumulators", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) {
       return keep_accumulators(s, [&](const For& loop) { return is_pure_loop(lowering, loop); });
     }},
    {"ring_buffers", Phase::Loops,
     [](Lowering& lowering, const Stmt& s) { return ring_buffers(s, lowering.program); }},
    {"flatten_storage", Phase::FlatStorage,
     [](Lowering& lowering, const Stmt& s) {
       return flatten_storage(s, storage_layouts(lowering));
     }},
    {"simplify_storage", Phase::FlatStorage, run_simplify},
    {"lower_atomics", Phase::FlatStorage, alone<lower_atomics>},
    {"skip_empty_tiles", Phase::FlatStorage, alone<skip_empty_tiles>},
    {"partition_loops", Phase::FlatStorage, alone<partition_loops>},
    {"drop_guarded_clamps", Phase::FlatStorage, alone<drop_guarded_clamps>},
    {"trim_loops", Phase::FlatStorage, alone<trim_loops>},
    {"unroll_loops", Phase::FlatStorage, alone<unroll_loops>},
    {"join_indices", Phase::FlatStorage, alone<join_indices>},
    {"hoist_calls", Phase::FlatStorage, alone<hoist_calls>},
    {"vectorize_inner_loops", Phase::FlatStorage,
     [](Lowering& lowering, const Stmt& s) { return vectorize_unscheduled(lowering, s); }},
    {"vectorize_loops", Phase::Vector, alone<vectorize_loops>},
    {"accumulate_vectors", Phase::Vector, alone<accumulate_vectors>},
    {"interleave_vectors", Phase::Vector, alone<interleave_vectors>},
    {"transpose_loads", Phase::Vector, alone<transpose_loads>},
    {"deinterleave_loads", Phase::Vector, alone<deinterleave_loads>},
    {"simplify_vectors", Phase::Vector, run_simplify},
    {"mask_guarded_loads", Phase::Vector, alone<mask_guarded_loads>},
    {"try_plain_products", Phase::Vector, alone<try_plain_products>},
    {"blend_masked_stores", Phase::Vector, alone<blend_masked_stores>},
    {"fuzz_float_stores", Phase::Vector, wanted<Target::FuzzFloatStores, fuzz_float_stores>},
    {"make_kernels", Phase::Vector,
     [](Lowering& lowering, const Stmt& s) {
       return make_kernels(s, lowering.options.target, given_buffers(lowering));
     }},
    {"inject_profiling", Phase::Vector,
     [](Lowering& lowering, const Stmt& s) {
       if (!lowering.options.target.has_feature(Target::Profile)) return s;
       return inject_profiling(s, lowering.program, lowering.name);
     }},
    {"free_early", Phase::Vector, alone<free_early>},
    {"drop_asserts", Phase::Vector, wanted<Target::NoAsserts, drop_asserts>},
    {"check_accesses", Phase::Vector,
     [](Lowering& lowering, const Stmt& s) {
       const Target& target = lowering.options.target;
       const bool wanted =
           target.has_feature(Target::CheckedAccesses) || target.has_feature(Target::ASAN);
       return wanted ? check_accesses(s, lowering.args) : s;
     }},
    // Last: accesses are checked against what was asked for.
    {"bound_allocations", Phase::Vector, alone<bound_allocations>},
};

std::vector<std::string> names_of(const std::vector<LoweredArgument>& args) {
  return mapped(args, [&](const LoweredArgument& arg) {
    return arg.is_buffer() ? arg.name + ".buffer" : arg.name;
  });
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
  if (stop_after.empty() || std::ranges::find(names, stop_after) != names.end()) return;
  const std::string known = listed(names);
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
    Lowering lowering{outputs, function.args, {}, {}, {}, name, options};
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

}  // namespace retrograde::lower
