// pipeline.cpp -- compiling on demand and calling compiled code: finding its arguments, checking
// them, reporting errors.
#include "frontend/pipeline.h"

#include <cstdio>
#include <cstring>
#include <iostream>
#include <mutex>
#include <unordered_set>

#include "frontend/func.h"
#include "frontend/wrappers.h"

namespace retrograde {

namespace {

using ParameterPtr = std::shared_ptr<ir::ParameterContents>;

// What compiled code was made from. Equal stamps: nothing that it depends on has changed.
struct Stamp {
  std::vector<std::pair<ir::FuncPtr, uint64_t>> funcs;
  std::vector<std::pair<ParameterPtr, uint64_t>> parameters;

  static Stamp of(const std::vector<ir::FuncPtr>& outputs) {
    Stamp result;
    for (const ir::FuncPtr& f : ir::functions_of(outputs))
      result.funcs.emplace_back(f, f->version);
    for (const ParameterPtr& p : ir::parameters_of(outputs))
      result.parameters.emplace_back(p, p->version);
    for (const ir::FuncPtr& f : outputs) {
      for (const ParameterPtr& p : f->outputs) result.parameters.emplace_back(p, p->version);
    }
    return result;
  }
  bool is_current() const {
    for (const auto& [f, version] : funcs) {
      if (f->version != version) return false;
    }
    for (const auto& [p, version] : parameters) {
      if (p->version != version) return false;
    }
    return true;
  }
};

std::string names_of(const std::vector<ir::FuncPtr>& outputs) {
  std::string out;
  for (const ir::FuncPtr& f : outputs) out += (out.empty() ? "" : ", ") + quoted(f->name);
  return out;
}

// The bytes of a scalar as generated code reads them.
uint64_t scalar_bits(const ir::Scalar& value) {
  if (!value.type.is_float()) return value.u;
  return ir::eval_reinterpret(UInt(value.type.bits()), value).u;
}

void check_parameter_limits(const ir::ParameterContents& parameter, const std::string& asked) {
  const auto limit = [&](const Expr& e) { return e.defined() ? ir::as_scalar(e) : std::nullopt; };
  const auto minimum = limit(parameter.min_value), maximum = limit(parameter.max_value);
  const auto less = [](const ir::Scalar& a, const ir::Scalar& b) {
    return ir::eval_binary(ir::Kind::LT, a, b).as_bool();
  };
  const bool too_small = minimum && less(*parameter.value, *minimum);
  const bool too_large = maximum && less(*maximum, *parameter.value);
  if (!too_small && !too_large) return;
  call_error(
      asked, text("the Param ", quoted(parameter.name), " must keep its limits"),
      text("its value is ", parameter.value->as_double(), " and its ",
           too_small ? "minimum " : "maximum ", (too_small ? *minimum : *maximum).as_double()),
      "Set a value inside the limits");
}

// Checks that do not depend on the code: null, type, dimensions, extents.
void check_buffer(const halide_buffer_t* buffer, const std::string& name, Type type, int dimensions,
                  bool with_memory, const std::string& asked) {
  const std::string what = "the buffer for " + quoted(name);
  if (!buffer)
    call_error(asked, what + " must not be null", "a null halide_buffer_t* was given",
               "Give a buffer");
  const Type actual = from_halide_type(buffer->type);
  if (actual != type) {
    call_error(asked, what + " must have the right element type",
               text("it holds ", to_string(actual), ", ", to_string(type), " is needed"),
               "Give a buffer of that type");
  }
  if (buffer->dimensions != dimensions) {
    call_error(asked, what + " must have the right number of dimensions",
               text("it has ", buffer->dimensions, ", ", dimensions, " are needed"),
               "Give a buffer of that many dimensions");
  }
  for (int d = 0; d < dimensions; d++) {
    if (buffer->dim[d].extent >= 0) continue;
    call_error(asked, what + " must not have negative extents",
               text("dimension ", d, " has extent ", buffer->dim[d].extent),
               "Give extents of at least 0");
  }
  if (with_memory && !buffer->host && !buffer->device) {
    call_error(asked, what + " must have memory", "it has only a shape",
               "Call allocate() on it first");
  }
}

bool same_shape(const halide_buffer_t& a, const std::vector<halide_dimension_t>& shape) {
  for (int d = 0; d < a.dimensions; d++) {
    if (a.dim[d].min != shape[d].min || a.dim[d].extent != shape[d].extent ||
        a.dim[d].stride != shape[d].stride) {
      return false;
    }
  }
  return true;
}

// Beside what the program itself prints.
void default_print(const char* message) {
  std::fputs(message, stdout);
  std::fflush(stdout);
}

}  // namespace

struct Pipeline::Contents {
  std::vector<ir::FuncPtr> outputs;
  JITHandlers handlers;
  std::map<std::string, JITExtern> externs;
  std::mutex mutex;
  // The latest compilation.
  std::shared_ptr<CompiledPipeline> compiled;
  Target target;
  Stamp stamp;
};

// ---- arguments for outputs ----

Pipeline::RealizationArg::RealizationArg(Realization& realization) {
  for (size_t i = 0; i < realization.size(); i++) owners_.push_back(realization[i]);
  for (Buffer<>& buffer : owners_) raw_.push_back(buffer.raw_buffer());
}

Pipeline::RealizationArg::RealizationArg(std::vector<Buffer<>> buffers)
    : owners_(std::move(buffers)) {
  for (Buffer<>& buffer : owners_) raw_.push_back(buffer.defined() ? buffer.raw_buffer() : nullptr);
}

// ---- construction ----

Pipeline::Pipeline(const Func& output) : Pipeline(std::vector<Func>{output}) {}

Pipeline::Pipeline(const std::vector<Func>& outputs) : contents_(std::make_shared<Contents>()) {
  if (outputs.empty())
    user_error("make a Pipeline", "it has at least one output", "it was given none");
  std::unordered_set<const ir::FuncContents*> seen;
  for (const Func& f : outputs) {
    if (!f.defined()) {
      user_error("make a Pipeline of " + quoted(f.name()), "an output needs a definition",
                 "it has none", "Define it: f(x, y) = ...");
    }
    if (!seen.insert(f.function().get()).second) {
      user_error("make a Pipeline", "its outputs are different Funcs",
                 quoted(f.name()) + " is given twice");
    }
    contents_->outputs.push_back(f.function());
  }
}

Pipeline::Contents& Pipeline::checked() const {
  if (!contents_)
    user_error("use a Pipeline", "it needs outputs", "it was constructed without any");
  return *contents_;
}

PipelineSpec Pipeline::spec() const {
  PipelineSpec result{checked().outputs[0]->name, contents_->outputs};
  for (const auto& [name, function] : contents_->externs)
    result.externs[name] = function.extern_c_function().address();
  return result;
}

std::vector<Func> Pipeline::outputs() const {
  std::vector<Func> result;
  for (const ir::FuncPtr& f : checked().outputs) result.push_back(Func(f));
  return result;
}

Func Pipeline::get_func(size_t index) const {
  const std::vector<ir::FuncPtr> order = ir::topological_order(checked().outputs);
  if (index >= order.size()) {
    user_error(text("take Func ", index, " of a Pipeline"),
               text("it has ", order.size(), " Funcs"));
  }
  return Func(order[index]);
}

JITHandlers& Pipeline::jit_handlers() { return checked().handlers; }

void Pipeline::set_jit_externs(const std::map<std::string, JITExtern>& externs) {
  std::lock_guard lock(checked().mutex);
  contents_->externs = externs;
  contents_->compiled.reset();
}

const std::map<std::string, JITExtern>& Pipeline::get_jit_externs() { return checked().externs; }

std::vector<Argument> Pipeline::infer_arguments() const {
  std::vector<Argument> result;
  for (const ParameterPtr& p : ir::parameters_of(checked().outputs)) {
    if (p->is_literal) continue;  // part of the program, not of its interface
    result.push_back(ir::argument_of(*p));
  }
  return result;
}

// ---- compiling ----

std::shared_ptr<CompiledPipeline> Pipeline::compiled(const Target& wanted) const {
  Contents& contents = checked();
  std::lock_guard lock(contents.mutex);
  Target target = wanted;
  if (target.has_unknowns())
    target = contents.compiled ? contents.target : get_jit_target_from_environment();
  if (!contents.compiled || !(contents.target == target) || !contents.stamp.is_current()) {
    contents.compiled.reset();
    contents.stamp = Stamp::of(contents.outputs);
    contents.compiled = default_compiler().compile(spec(), target);
    contents.target = target;
  }
  return contents.compiled;
}

void Pipeline::compile_jit(const Target& target) { compiled(target); }

void Pipeline::invalidate_cache() {
  std::lock_guard lock(checked().mutex);
  contents_->compiled.reset();
}

std::string Pipeline::loop_nest(const Target& target) const {
  const PipelineSpec pipeline = spec();
  return default_compiler().loop_nest(
      pipeline, target.has_unknowns() ? get_jit_target_from_environment() : target);
}

void Pipeline::print_loop_nest() const { std::cerr << loop_nest(); }

// ---- outputs of a call ----

std::vector<Buffer<>> Pipeline::make_outputs(const std::vector<int32_t>& sizes,
                                             bool with_memory) const {
  const std::string asked = "realize " + names_of(checked().outputs);
  std::vector<Buffer<>> result;
  for (const ir::FuncPtr& f : contents_->outputs) {
    if (static_cast<int>(sizes.size()) != f->dimensions()) {
      call_error(asked, "it takes one size for each dimension",
                 text(quoted(f->name), " has ", f->dimensions(), " dimensions and was given ",
                      sizes.size(), " sizes"),
                 "Give that many sizes, or buffers");
    }
    for (size_t d = 0; d < sizes.size(); d++) {
      if (sizes[d] > 0) continue;
      call_error(asked, "sizes are positive", text("the size of dimension ", d, " is ", sizes[d]),
                 "Give sizes of at least 1");
    }
    for (const Type& type : f->types) {
      ir::check_sizes(to_halide_type(type), sizes, asked);
      Runtime::Buffer<> buffer(to_halide_type(type), nullptr, sizes);
      if (with_memory) ir::allocate_host(buffer);
      result.push_back(Buffer<>(buffer));
    }
  }
  return result;
}

std::vector<halide_buffer_t*> Pipeline::checked_outputs(const RealizationArg& given,
                                                        bool with_memory) const {
  const std::string asked = "realize " + names_of(checked().outputs);
  const std::vector<halide_buffer_t*>& buffers = given.buffers();
  size_t count = 0;
  for (const ir::FuncPtr& f : contents_->outputs) count += f->types.size();
  if (buffers.size() != count) {
    call_error(asked, "it takes one buffer for each value of each output",
               text("there are ", count, " and ", buffers.size(), " were given"),
               "Give that many buffers");
  }
  size_t i = 0;
  for (const ir::FuncPtr& f : contents_->outputs) {
    for (const ParameterPtr& value : f->outputs) {
      check_buffer(buffers[i++], value->name, value->type, f->dimensions(), with_memory, asked);
    }
  }
  return buffers;
}

// ---- calling ----

namespace {

// The arguments of one call. Scalars and query buffers live here while it runs.
class Arguments {
 public:
  Arguments(const CompiledPipeline& code, std::vector<halide_buffer_t*> outputs, bool is_query,
            std::string asked)
      : asked_(std::move(asked)), outputs_(std::move(outputs)) {
    scalars_.reserve(code.arguments().size());
    queries_.reserve(code.arguments().size());
    for (const ir::LoweredArgument& arg : code.arguments()) argv_.push_back(bind(arg, is_query));
    RETROGRADE_ASSERT(next_output_ == outputs_.size(),
                      "compiled code has another number of outputs");
  }
  void* const* argv() const { return argv_.data(); }

  struct Query {
    ParameterPtr parameter;
    Runtime::Buffer<> buffer;
  };
  std::vector<Query>& queries() { return queries_; }

 private:
  std::string asked_;
  std::vector<halide_buffer_t*> outputs_;
  size_t next_output_ = 0;
  std::vector<uint64_t> scalars_;
  std::vector<Query> queries_;
  std::vector<void*> argv_;

  void* bind(const ir::LoweredArgument& arg, bool is_query) {
    if (arg.kind == ir::LoweredArgument::Kind::OutputBuffer) {
      RETROGRADE_ASSERT(next_output_ < outputs_.size(),
                        "compiled code has another number of outputs");
      return outputs_[next_output_++];
    }
    auto parameter = std::dynamic_pointer_cast<ir::ParameterContents>(arg.symbol.lock());
    RETROGRADE_ASSERT(parameter != nullptr, "the argument ", quoted(arg.name),
                      " of compiled code stands for nothing");
    return arg.is_buffer() ? bind_buffer(parameter, is_query) : bind_scalar(*parameter);
  }

  void* bind_scalar(const ir::ParameterContents& parameter) {
    if (!parameter.value) {
      call_error(asked_, text("the Param ", quoted(parameter.name), " needs a value"),
                 "none was set", "Call set() on it first");
    }
    check_parameter_limits(parameter, asked_);
    scalars_.push_back(scalar_bits(*parameter.value));
    return &scalars_.back();
  }

  void* bind_buffer(const ParameterPtr& parameter, bool is_query) {
    if (parameter->buffer) {
      check_buffer(parameter->buffer, parameter->name, parameter->type, parameter->dimensions, true,
                   asked_);
      return parameter->buffer;
    }
    if (!is_query) {
      call_error(asked_, text("the ImageParam ", quoted(parameter->name), " needs a buffer"),
                 "none was set", "Call set() on it first, or infer_input_bounds()");
    }
    std::vector<int> nothing(parameter->dimensions, 0);
    queries_.push_back(
        {parameter, Runtime::Buffer<>(to_halide_type(parameter->type), nullptr, nothing)});
    return queries_.back().buffer.raw_buffer();
  }
};

// The Pipeline's handlers with those of the call's context in front.
JITHandlers merged(JITHandlers handlers, const JITUserContext* context) {
  if (!context) return handlers;
  const JITHandlers& first = context->handlers;
  const auto take = [](auto& to, const auto& from) {
    if (from) to = from;
  };
  take(handlers.custom_print, first.custom_print);
  take(handlers.custom_malloc, first.custom_malloc);
  take(handlers.custom_free, first.custom_free);
  take(handlers.custom_do_task, first.custom_do_task);
  take(handlers.custom_do_par_for, first.custom_do_par_for);
  take(handlers.custom_error, first.custom_error);
  take(handlers.custom_trace, first.custom_trace);
  take(handlers.print, first.print);
  if (first.thread_limit > 0) handlers.thread_limit = first.thread_limit;
  return handlers;
}

void check_handlers(const JITHandlers& handlers, const std::string& asked) {
  if (!handlers.custom_malloc != !handlers.custom_free) {
    user_error(asked, "custom_malloc and custom_free come together",
               handlers.custom_malloc ? "only custom_malloc is set" : "only custom_free is set",
               "Set both, or neither");
  }
}

void call(const CompiledPipeline& code, const JITHandlers& own, void* const* argv,
          const std::string& asked, JITUserContext* user = nullptr) {
  JITUserContext nobody;
  CallContext context;
  context.handlers = merged(own, user);
  context.user_context = user ? user : &nobody;
  check_handlers(context.handlers, asked);
  context.print = context.handlers.print ? context.handlers.print : default_print;
  if (const auto custom = context.handlers.custom_print) {
    context.print = [custom, to = context.user_context](const char* text) { custom(to, text); };
  }
  context.thread_limit = context.handlers.thread_limit;
  const int code_returned = code.run(argv, context);
  if (code_returned == 0) return;
  if (const auto custom = context.handlers.custom_error) {
    const std::string unnamed = text("cannot ", asked, ": error code ", code_returned);
    custom(context.user_context, context.error.empty() ? unnamed.c_str() : context.error.c_str());
    return;
  }
  if (!context.error.empty()) throw RuntimeError(context.error, code_returned);
  call_error(asked, "the compiled code must succeed",
             text("it returned the error code ", code_returned), "", code_returned);
}

}  // namespace

void Pipeline::run(const std::vector<halide_buffer_t*>& outputs, const Target& target,
                   JITUserContext* context) const {
  const auto code = compiled(target);
  const std::string asked = "realize " + names_of(contents_->outputs);
  Arguments arguments(*code, outputs, false, asked);
  call(*code, contents_->handlers, arguments.argv(), asked, context);
}

Realization Pipeline::realize(const std::vector<int32_t>& sizes, const Target& target) {
  return realize(nullptr, sizes, target);
}

void Pipeline::realize(RealizationArg outputs, const Target& target) {
  realize(nullptr, std::move(outputs), target);
}

Realization Pipeline::realize(JITUserContext* context, const std::vector<int32_t>& sizes,
                              const Target& target) {
  std::vector<Buffer<>> buffers = make_outputs(sizes, true);
  RealizationArg outputs(buffers);
  run(outputs.buffers(), target, context);
  return Realization(std::move(buffers));
}

void Pipeline::realize(JITUserContext* context, RealizationArg outputs, const Target& target) {
  run(checked_outputs(outputs, true), target, context);
}

// Asks the code for the regions again until they agree: a region may depend on the shape of another
// buffer.
void Pipeline::infer(const std::vector<halide_buffer_t*>& outputs, const Target& target) const {
  constexpr int max_rounds = 16;
  const auto code = compiled(target);
  const std::string asked = "infer the input bounds of " + names_of(contents_->outputs);
  Arguments arguments(*code, outputs, true, asked);
  if (arguments.queries().empty()) return;
  for (int round = 0;; round++) {
    std::vector<std::vector<halide_dimension_t>> before;
    for (auto& [parameter, buffer] : arguments.queries()) {
      before.emplace_back(buffer.raw_buffer()->dim, buffer.raw_buffer()->dim + buffer.dimensions());
    }
    call(*code, contents_->handlers, arguments.argv(), asked);
    bool settled = true;
    for (size_t i = 0; i < before.size(); i++) {
      settled = settled && same_shape(*arguments.queries()[i].buffer.raw_buffer(), before[i]);
    }
    if (settled) break;
    if (round == max_rounds) {
      call_error(asked, "the regions of the inputs must settle",
                 text("they still changed after ", max_rounds, " rounds"),
                 "Set the inputs by hand");
    }
  }
  for (auto& [parameter, buffer] : arguments.queries()) {
    check_buffer(buffer.raw_buffer(), parameter->name, parameter->type, parameter->dimensions,
                 false, asked);
    std::vector<int> extents;
    for (int d = 0; d < buffer.dimensions(); d++) extents.push_back(buffer.dim(d).extent());
    ir::check_sizes(buffer.type(), extents, asked);
    ir::allocate_host(buffer);
    ImageParam(parameter).set(Buffer<>(buffer));
  }
}

void Pipeline::infer_input_bounds(const std::vector<int32_t>& sizes, const Target& target) {
  std::vector<Buffer<>> buffers = make_outputs(sizes, false);
  RealizationArg outputs(buffers);
  infer(outputs.buffers(), target);
}

void Pipeline::infer_input_bounds(RealizationArg outputs, const Target& target) {
  infer(checked_outputs(outputs, false), target);
}

}  // namespace retrograde
