// The ordered list of passes.
#include <algorithm>
#include <chrono>

#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"
#include "diagnostics/pass_observer.h"
#include "ir/buffer_metadata.h"
#include "ir/build.h"
#include "ir/print.h"
#include "ir/validate.h"
#include "ir/vector_bytes.h"
#include "lower/bind_symbols.h"
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
#include "lower/loops/carry_elements.h"
#include "lower/loops/equal_nests.h"
#include "lower/loops/flatten_storage.h"
#include "lower/loops/fold_steps.h"
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

// The data that passes have besides the statement. Only program passes change it.
struct Lowering {
  const std::string& name;  // of the function
  const std::vector<FuncPtr>& outputs;
  const std::vector<LoweredArgument>& args;
  const Target& target;
  Program program = {};
};

// A pass over the program, before there are loops.
struct ProgramPass {
  const char* name;
  void (*run)(Lowering&);
};
struct Pass {
  const char* name;
  Phase phase;  // of the statement after it
  Stmt (*run)(const Lowering&, const Stmt&);
};

Stmt run_simplify(const Lowering&, const Stmt& s) { return simplify(s); }

template <Stmt (*pass)(const Stmt&)>
Stmt alone(const Lowering&, const Stmt& s) {
  return pass(s);
}
template <Target::Feature feature, Stmt (*pass)(const Stmt&)>
Stmt wanted(const Lowering& lowering, const Stmt& s) {
  return lowering.target.has_feature(feature) ? pass(s) : s;
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

// ---- passes with parameters ----

Stmt run_vectorize_inner_loops(const Lowering& lowering, const Stmt& s) {
  if (lowering.target.has_feature(Target::DisableLLVMLoopOpt)) return s;
  return vectorize_inner_loops(s, {ir::vector_bytes(lowering.target), [&](const For& loop) {
                                     return is_pure_loop(lowering.program, loop.name);
                                   }});
}

Stmt run_skip_stages(const Lowering& lowering, const Stmt& s) {
  return skip_stages(s, [&](const std::string& name) {
    const LoopedFunc* f = lowering.program.find(name);
    return !f || !f->schedule.async;
  });
}

Stmt run_fold_steps(const Lowering& lowering, const Stmt& s) {
  const auto may_fold = [&](const std::string& name) {
    const LoopedFunc* f = lowering.program.find(name);
    return f && !f->schedule.async && !f->schedule.memoized;
  };
  return fold_steps(
      s, {may_fold, [&](const For& loop) { return is_pure_loop(lowering.program, loop.name); }});
}

Stmt run_keep_accumulators(const Lowering& lowering, const Stmt& s) {
  return keep_accumulators(
      s, [&](const For& loop) { return is_pure_loop(lowering.program, loop.name); });
}

Stmt run_carry_elements(const Lowering& lowering, const Stmt& s) {
  return carry_elements(s,
                        [&](const For& loop) { return is_pure_loop(lowering.program, loop.name); });
}

Stmt run_add_argument_checks(const Lowering& lowering, const Stmt& s) {
  return add_argument_checks(s, lowering.args, lowering.program,
                             lowering.target.has_feature(Target::CUDA));
}

Stmt run_inject_profiling(const Lowering& lowering, const Stmt& s) {
  if (!lowering.target.has_feature(Target::Profile)) return s;
  return inject_profiling(s, lowering.program, lowering.name);
}

Stmt run_check_accesses(const Lowering& lowering, const Stmt& s) {
  const bool wanted = lowering.target.has_feature(Target::CheckedAccesses) ||
                      lowering.target.has_feature(Target::ASAN);
  return wanted ? check_accesses(s, lowering.args) : s;
}

// A pass that reads the program of the lowering, too.
template <Stmt (*pass)(const Stmt&, const Program&)>
Stmt with_program(const Lowering& lowering, const Stmt& s) {
  return pass(s, lowering.program);
}

constexpr ProgramPass program_passes[] = {
    {"inline_functions",
     [](Lowering& lowering) { lowering.program = inline_functions(lowering.outputs); }},
    {"check_devices", [](Lowering& lowering) { check_devices(lowering.program, lowering.target); }},
    {"share_parameters", [](Lowering& lowering) { share_parameters(lowering.program); }},
};

constexpr Pass passes[] = {
    {"build_loop_nests", Phase::Nests,
     [](const Lowering& lowering, const Stmt&) { return build_loop_nests(lowering.program); }},
    {"inject_tracing", Phase::Nests,
     [](const Lowering& lowering, const Stmt& s) {
       return inject_tracing(s, lowering.program, lowering.name, lowering.target);
     }},
    {"add_argument_checks", Phase::Nests, run_add_argument_checks},
    {"make_names_unique", Phase::Loops,
     [](const Lowering& lowering, const Stmt& s) {
       return make_names_unique(s, mapped(lowering.args, &LoweredArgument::name));
     }},
    {"drop_bounds_query", Phase::Loops, wanted<Target::NoBoundsQuery, drop_bounds_query>},
    {"check_promises", Phase::Loops, wanted<Target::CheckUnsafePromises, check_promises>},
    {"write_debug_files", Phase::Loops, with_program<write_debug_files>},
    {"skip_stages", Phase::Loops, run_skip_stages},
    {"fold_steps", Phase::Loops, run_fold_steps},
    {"insert_prefetches", Phase::Loops, with_program<insert_prefetches>},
    {"lower_prefetches", Phase::Loops, with_program<lower_prefetches>},
    {"fork_async", Phase::Loops, with_program<fork_async>},
    {"memoize", Phase::Loops,
     [](const Lowering& lowering, const Stmt& s) {
       return memoize(s, lowering.program, lowering.name, lowering.target);
     }},
    {"keep_accumulators", Phase::Loops, run_keep_accumulators},
    {"ring_buffers", Phase::Loops, with_program<ring_buffers>},
    {"flatten_storage", Phase::FlatStorage, alone<flatten_storage>},
    {"simplify_storage", Phase::FlatStorage, run_simplify},
    {"share_equal_nests", Phase::FlatStorage, alone<share_equal_nests>},
    {"lower_atomics", Phase::FlatStorage, alone<lower_atomics>},
    {"skip_empty_tiles", Phase::FlatStorage, alone<skip_empty_tiles>},
    {"partition_loops", Phase::FlatStorage, alone<partition_loops>},
    {"drop_guarded_clamps", Phase::FlatStorage, alone<drop_guarded_clamps>},
    {"trim_loops", Phase::FlatStorage, alone<trim_loops>},
    {"merge_equal_loops", Phase::FlatStorage, alone<merge_equal_loops>},
    {"carry_elements", Phase::FlatStorage, run_carry_elements},
    {"unroll_loops", Phase::FlatStorage, alone<unroll_loops>},
    {"join_indices", Phase::FlatStorage, alone<join_indices>},
    {"hoist_calls", Phase::FlatStorage, alone<hoist_calls>},
    {"vectorize_inner_loops", Phase::FlatStorage, run_vectorize_inner_loops},
    {"vectorize_loops", Phase::Vector, alone<vectorize_loops>},
    {"accumulate_vectors", Phase::Vector, alone<accumulate_vectors>},
    {"interleave_vectors", Phase::Vector, alone<interleave_vectors>},
    {"transpose_loads", Phase::Vector, alone<transpose_loads>},
    {"deinterleave_loads", Phase::Vector, alone<deinterleave_loads>},
    {"share_lets", Phase::Vector, alone<share_lets>},
    {"simplify_vectors", Phase::Vector, run_simplify},
    {"mask_guarded_loads", Phase::Vector, alone<mask_guarded_loads>},
    {"try_plain_products", Phase::Vector, alone<try_plain_products>},
    {"expand_equal_nests", Phase::Vector, alone<expand_equal_nests>},
    {"blend_masked_stores", Phase::Vector, alone<blend_masked_stores>},
    {"fuzz_float_stores", Phase::Vector, wanted<Target::FuzzFloatStores, fuzz_float_stores>},
    {"make_kernels", Phase::Vector,
     [](const Lowering& lowering, const Stmt& s) {
       return make_kernels(s, lowering.target, given_buffers(lowering));
     }},
    {"inject_profiling", Phase::Vector, run_inject_profiling},
    {"free_early", Phase::Vector, alone<free_early>},
    {"drop_asserts", Phase::Vector, wanted<Target::NoAsserts, drop_asserts>},
    {"check_accesses", Phase::Vector, run_check_accesses},
    // Last: accesses are checked against what was asked for.
    {"bound_allocations", Phase::Vector, alone<bound_allocations>},
};

// The names that the caller binds. Before make_names_unique, those of the buffers' metadata belong to them:
// add_argument_checks binds these.
std::vector<std::string> names_of(const std::vector<LoweredArgument>& args, Phase phase) {
  std::vector<std::string> names;
  for (const LoweredArgument& arg : args) {
    names.push_back(arg.is_buffer() ? arg.name + ".buffer" : arg.name);
    if (phase == Phase::Nests)
      append(names, metadata_names(arg.name, static_cast<size_t>(arg.dimensions)));
  }
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

// Runs a pass, checks and reports its result.
template <class Run>
Stmt timed(const char* pass, const Lowering& lowering, const LowerOptions& options, Run run) {
  const auto start = std::chrono::steady_clock::now();
  const Stmt after = run();
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  if (options.observe) options.observe(pass, seconds.count(), after);
  tell_pass_observers({lowering.name, pass, seconds.count(),
                       [&] { return after.defined() ? print(after) : to_text(lowering.program); }});
  return after;
}

// Whether lowering stops after one of these passes.
bool run_program_passes(Lowering& lowering, const LowerOptions& options) {
  for (const ProgramPass& pass : program_passes) {
    timed(pass.name, lowering, options, [&] {
      pass.run(lowering);
      return Stmt();
    });
    if (options.stop_after == pass.name) return true;
  }
  return false;
}

Stmt run_pass(const Pass& pass, const Lowering& lowering, const Stmt& before,
              const LowerOptions& options) {
  const Stmt after =
      timed(pass.name, lowering, options, [&] { return pass.run(lowering, before); });
  if (options.validate)
    validate(after, pass.phase, pass.name, names_of(lowering.args, pass.phase), before);
  return after;
}

Stmt run_passes(Lowering& lowering, const LowerOptions& options) {
  Stmt stmt;
  if (run_program_passes(lowering, options)) return stmt;
  for (const Pass& pass : passes) {
    stmt = run_pass(pass, lowering, stmt, options);
    if (options.stop_after == pass.name) break;
  }
  return stmt;
}

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
    Lowering lowering{name, outputs, function.args, options.target};
    function.body = run_passes(lowering, options);
    function.loop_nest = [program = std::move(lowering.program)] {
      return loop_nest_text(program);
    };
  });
  return function;
}

std::string run_pass_alone(const std::string& name, const std::vector<FuncPtr>& outputs,
                           const Stmt& s, const Target& target) {
  check_stop(name);
  std::vector<LoweredArgument> args = infer_arguments(outputs);
  append_outputs(outputs, args);
  const std::string function = "function";
  Lowering lowering{function, outputs, args, target};
  const LowerOptions options{target, true, {}, name};
  std::string result;
  run_on_large_stack([&] {
    if (run_program_passes(lowering, options)) {
      result = to_text(lowering.program);
      return;
    }
    const Stmt before = bind_symbols(s, lowering.program, parameters_of(outputs));
    const auto* pass = std::ranges::find_if(passes, [&](const Pass& p) { return p.name == name; });
    const Stmt after = pass->run(lowering, before);
    // The text need not hold the argument checks, which bind the metadata of buffers.
    validate(after, pass->phase, name, names_of(args, Phase::Nests), before);
    result = print(after);
  });
  return result;
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
  for (const ProgramPass& pass : program_passes) names.push_back(pass.name);
  for (const Pass& pass : passes) names.push_back(pass.name);
  return names;
}

}  // namespace retrograde::lower
