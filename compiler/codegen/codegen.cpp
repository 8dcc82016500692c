// Drives LLVM through its three steps: generate, optimize, emit. For machine code, the module is split after the first
// step and its parts are compiled in parallel; text output keeps one module throughout. No step looks from one function
// into another, so both ways give the same code.
#include "codegen/codegen.h"

#include <llvm/IR/Verifier.h>
#include <llvm/Support/raw_ostream.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <system_error>
#include <thread>
#include <utility>

#include "codegen/cpu/make_exports.h"
#include "codegen/device/kernels.h"
#include "codegen/function_generator.h"
#include "codegen/llvm/archive.h"
#include "codegen/llvm/cut_loops.h"
#include "codegen/llvm/split_module.h"
#include "codegen/llvm/stopwatch.h"
#include "codegen/llvm/unit.h"
#include "diagnostics/error.h"
#include "diagnostics/large_stack.h"

namespace retrograde::codegen {
namespace {

void verify(const llvm::Module& module) {
  std::string problem;
  llvm::raw_string_ostream out(problem);
  if (!llvm::verifyModule(module, &out)) return;
  throw InternalError("LLVM rejects the generated code: " + problem, "codegen", text_of(module));
}

// Makes the exported entry points. The function itself is only called through its export, so its argv form is erased.
// Its kernel image becomes private: functions of other files may have the same name.
void add_exports(Emitter& emitter, const Program& program) {
  for (const Export& e : program.exports) {
    const std::string& name = program.functions[e.function].name;
    emitter.module.getFunction(name + "_argv")->eraseFromParent();
    if (llvm::GlobalVariable* image = emitter.module.getNamedGlobal(kernel_image_name(name)))
      image->setLinkage(llvm::GlobalValue::InternalLinkage);
    make_export(emitter, e, emitter.module.getFunction(name));
  }
  for (const Dispatch& dispatch : program.dispatches) make_dispatch(emitter, dispatch);
}

void generate(const Program& program, const Machine& machine, Unit& unit) {
  Stopwatch watch;
  Emitter emitter(unit.module(), machine);
  for (const ir::LoweredFunction& function : program.functions)
    FunctionGenerator(emitter, function).generate();
  add_exports(emitter, program);
  keep_sums_as_they_are(unit.module());
  cut_loops(unit.module());
  verify(unit.module());
  unit.times.generate_seconds = watch.lap();
}

// Generates code on a large stack, passes it to `use` there, and returns the result of `use`.
template <typename Use>
auto with_generated(const Program& program, const Options& options, bool keep_names,
                    const Use& use) {
  decltype(use(std::declval<Unit&>(), std::declval<const Machine&>())) result;
  run_on_large_stack([&] {
    Machine machine = machine_for(options.target, options.tune_for_host);
    machine.wants_executor = options.kernels_for_executor;
    const bool is_empty = program.functions.empty();
    Unit unit(machine, is_empty ? "retrograde" : program.functions[0].name, keep_names);
    generate(program, machine, unit);
    unit.note_length();
    result = use(unit, machine);
  });
  return result;
}

template <typename Use>
auto with_optimized(const Program& program, const Options& options, const Use& use) {
  return with_generated(program, options, /*keep_names=*/true, [&](Unit& unit, const Machine&) {
    if (options.optimization_level > 0) unit.optimize();
    return use(unit);
  });
}

// ---- compiling the parts of a program in parallel ----

struct Part {
  std::string object;
  Times times;
  std::exception_ptr problem;
};

void finish(Unit& unit, const Options& options, Part& part) {
  if (options.optimization_level > 0) unit.optimize();
  part.object = unit.emit_last(llvm::CodeGenFileType::ObjectFile);
  part.times = unit.times;
}

void compile_part(const std::string& name, const std::string& bitcode, const Machine& machine,
                  const Options& options, Part& part) {
  try {
    run_on_large_stack([&] {
      Unit unit(machine, name, bitcode);
      finish(unit, options, part);
    });
  } catch (...) {
    part.problem = std::current_exception();
  }
}

// Starts to compile each part while the next one is being split off.
std::vector<Part> compile_at_once(Unit& unit, unsigned count, const Machine& machine,
                                  const Options& options) {
  const std::string& name = unit.module().getModuleIdentifier();
  std::vector<Part> parts(count);
  {
    std::vector<std::jthread> threads;  // joined at the end of the block
    threads.reserve(count);
    split_into_bitcode(unit.module(), count, [&](unsigned part, std::string bitcode) {
      const auto run = [&, part, bitcode = std::move(bitcode)] {
        compile_part(name, bitcode, machine, options, parts[part]);
      };
      if (part + 1 == count) return run();
      try {
        threads.emplace_back(run);
      } catch (const std::system_error&) {  // no more threads available
        run();
      }
    });
  }
  for (const Part& part : parts) {
    if (part.problem) std::rethrow_exception(part.problem);
  }
  return parts;
}

std::string archive_of(const std::vector<Part>& parts) {
  std::vector<Member> members;
  for (const Part& part : parts) members.push_back({"part.o", part.object});
  return archive(members);
}

// The parts run in parallel, so the reported time of a step is that of the slowest part.
void join_times(const std::vector<Part>& parts, Times& times) {
  for (const Part& part : parts) {
    times.optimize_seconds = std::max(times.optimize_seconds, part.times.optimize_seconds);
    times.emit_seconds = std::max(times.emit_seconds, part.times.emit_seconds);
  }
}

// Compiles in options.parts parts if the options name a count, else in at most `most`.
std::vector<Part> compile_unit(Unit& unit, const Machine& machine, const Options& options,
                               unsigned most) {
  const unsigned count = options.parts ? possible_parts(unit.module(), options.parts)
                                       : worthwhile_parts(unit.module(), most);
  std::vector<Part> parts(1);
  if (count == 1) {
    finish(unit, options, parts[0]);
    return parts;
  }
  return compile_at_once(unit, count, machine, options);
}

Module compile_for_here(Unit& unit, const Machine& machine, const Options& options) {
  Module result;
  result.externals = unit.externals();
  std::vector<Part> parts =
      compile_unit(unit, machine, options, std::thread::hardware_concurrency());
  result.times = unit.times;
  const std::string bytes = parts.size() == 1 ? std::move(parts[0].object) : archive_of(parts);
  result.object.assign(bytes.begin(), bytes.end());
  join_times(parts, result.times);
  return result;
}

}  // namespace

bool is_gpu_simulated() {
  const char* driver = std::getenv("RETROGRADE_GPU");
  return driver && std::string(driver) == "simulated";
}

Module compile_object(const ir::LoweredFunction& function, const Options& options) {
  return with_generated(
      {{function}, {}, {}}, options, /*keep_names=*/false,
      [&](Unit& unit, const Machine& machine) { return compile_for_here(unit, machine, options); });
}

std::vector<std::string> compile_parts(const Program& program, const Options& options) {
  constexpr unsigned most = 8;
  return with_generated(program, options, /*keep_names=*/false,
                        [&](Unit& unit, const Machine& machine) {
                          std::vector<std::string> objects;
                          for (Part& part : compile_unit(unit, machine, options, most))
                            objects.push_back(std::move(part.object));
                          return objects;
                        });
}

std::map<Format, std::string> compile_texts(const Program& program, const Options& options,
                                            const std::vector<Format>& formats) {
  return with_optimized(program, options, [&](Unit& unit) {
    std::map<Format, std::string> result;
    for (Format format : formats) result[format] = unit.emit(format);
    return result;
  });
}

std::string compile_llvm_ir(const ir::LoweredFunction& function, const Options& options) {
  return compile_texts({{function}, {}, {}}, options, {Format::LlvmIr})[Format::LlvmIr];
}

std::string compile_assembly(const ir::LoweredFunction& function, const Options& options) {
  return with_optimized({{function}, {}, {}}, options, [](Unit& unit) {
    return unit.emit_last(llvm::CodeGenFileType::AssemblyFile);
  });
}

}  // namespace retrograde::codegen
