// pipeline.cpp -- compiles pipelines on demand, allocates output buffers, and runs bounds queries.
#include "frontend/run/pipeline.h"

#include <algorithm>
#include <iostream>
#include <mutex>
#include <optional>
#include <unordered_set>

#include "frontend/language/func.h"
#include "frontend/run/call.h"
#include "frontend/run/warnings.h"
#include "graph/directives/give_directive.h"
#include "graph/directives/wrappers.h"

namespace retrograde {

namespace {

using ParameterPtr = std::shared_ptr<graph::ParameterContents>;

// The versions of everything that compiled code depends on. Code is up to date if its stamp is equal.
struct Stamp {
  std::vector<std::pair<graph::FuncPtr, uint64_t>> funcs;
  std::vector<std::pair<ParameterPtr, uint64_t>> parameters;

  static Stamp of(const PipelineSpec& pipeline) {
    Stamp result;
    result.add(pipeline);
    return result;
  }
  void add(const PipelineSpec& pipeline) {
    for (const graph::FuncPtr& f : graph::functions_of(pipeline.outputs))
      funcs.emplace_back(f, f->version);
    for (const ParameterPtr& p : graph::parameters_of(pipeline.outputs))
      parameters.emplace_back(p, p->version);
    for (const graph::FuncPtr& f : pipeline.outputs) {
      for (const ParameterPtr& p : f->outputs) parameters.emplace_back(p, p->version);
    }
    for (const auto& [name, called] : pipeline.pipelines) add(*called);
  }
  bool is_current() const {
    const auto is_same = [](const auto& seen) { return seen.first->version == seen.second; };
    return std::ranges::all_of(funcs, is_same) && std::ranges::all_of(parameters, is_same);
  }
};

std::string names_of(const std::vector<graph::FuncPtr>& outputs) {
  return listed(outputs, [](const graph::FuncPtr& f) { return quoted(f->name); });
}

// Mins, extents and strides of all buffers, concatenated.
std::vector<int32_t> shapes_of(const std::vector<halide_buffer_t*>& buffers) {
  std::vector<int32_t> result;
  for (const halide_buffer_t* buffer : buffers) {
    for (int d = 0; d < buffer->dimensions; d++) {
      const halide_dimension_t& dim = buffer->dim[d];
      result.insert(result.end(), {dim.min, dim.extent, dim.stride});
    }
  }
  return result;
}

// Repeats a bounds query until no buffer changes its shape, since a region may depend on the shape of another buffer or
// on its own. Returns false if a call fails.
template <class Call>
bool ask_until_settled(const std::vector<halide_buffer_t*>& buffers, const std::string& asked,
                       const Call& call) {
  constexpr int max_rounds = 64;  // as the message says
  for (int round = 0; round < max_rounds; round++) {
    const std::vector<int32_t> before = shapes_of(buffers);
    if (!call()) return false;
    if (shapes_of(buffers) == before) return true;
  }
  call_error(asked, "the regions of buffers settle within 64 bounds queries",
             "they still changed in the last one",
             "Set buffers by hand, or give bounds that stay the same once they are met");
}

// Enlarges the result of a query to at least [0, size) in each dimension; if that is wrong, the call reports it. The
// strides stay unless the buffer grows, or elements would share addresses.
void enlarge_to(Runtime::Buffer<>& buffer, const std::vector<int32_t>& sizes,
                const std::string& asked) {
  std::vector<int> extents;
  bool is_answer = true;
  for (size_t d = 0; d < sizes.size(); d++) {
    halide_dimension_t& dim = buffer.raw_buffer()->dim[d];
    const int32_t min = std::min(dim.min, 0), end = std::max(dim.min + dim.extent, sizes[d]);
    is_answer = is_answer && min == dim.min && end == dim.min + dim.extent &&
                (dim.stride != 0 || dim.extent <= 1);
    dim.min = min;
    dim.extent = end - min;
    extents.push_back(dim.extent);
  }
  frontend::check_sizes(buffer.type(), extents, asked);
  int32_t stride = 1;
  for (size_t d = 0; d < sizes.size() && !is_answer; d++) {
    buffer.raw_buffer()->dim[d].stride = stride;
    stride *= buffer.raw_buffer()->dim[d].extent;
  }
}

void crop_to(Runtime::Buffer<>& buffer, const std::vector<int32_t>& sizes) {
  for (size_t d = 0; d < sizes.size(); d++) buffer.crop(static_cast<int>(d), 0, sizes[d]);
}

}  // namespace

struct Pipeline::Contents {
  std::vector<graph::FuncPtr> outputs;
  JITHandlers handlers;
  std::map<std::string, JITExtern> externs;
  bool is_traced = false;
  AutoscheduleOptions autoschedule;
  std::mutex mutex;
  // The latest compilation.
  std::shared_ptr<CompiledPipeline> compiled;
  Target target;
  Stamp stamp;
};

// ---- arguments for outputs ----

RealizationArg::RealizationArg(Realization& realization) {
  for (size_t i = 0; i < realization.size(); i++) owners_.push_back(realization[i]);
  for (Buffer<>& buffer : owners_) raw_.push_back(buffer.raw_buffer());
}

RealizationArg::RealizationArg(std::vector<Buffer<>> buffers) : owners_(std::move(buffers)) {
  for (Buffer<>& buffer : owners_) raw_.push_back(buffer.defined() ? buffer.raw_buffer() : nullptr);
}

// ---- construction ----

Pipeline::Pipeline(const Func& output) : Pipeline(std::vector<Func>{output}) {}

Pipeline::Pipeline(const std::vector<Func>& outputs) : contents_(std::make_shared<Contents>()) {
  if (outputs.empty())
    user_error("make a Pipeline", "a Pipeline has at least one output", "it was given none",
               "Give the Funcs that are wanted");
  std::unordered_set<const graph::FuncContents*> seen;
  for (const Func& f : outputs) {
    if (!f.defined()) {
      user_error("make a Pipeline of " + quoted(f.name()), "an output needs a definition",
                 "it has none", "Define it: f(x, y) = ...");
    }
    if (!seen.insert(f.function().get()).second) {
      user_error("make a Pipeline", "its outputs are different Funcs",
                 quoted(f.name()) + " is given twice", "Name each output once");
    }
    contents_->outputs.push_back(f.function());
  }
}

Pipeline::Contents& Pipeline::checked() const {
  if (!contents_)
    user_error("use a Pipeline", "it needs outputs", "it was constructed without any",
               "Construct it: Pipeline p(f)");
  return *contents_;
}

void Pipeline::unscheduled() {
  for (const graph::FuncPtr& f : graph::topological_order(checked().outputs)) {
    if (graph::has_directives(*f)) continue;
    for (int s = 0; s < std::max(f->stage_count(), 1); ++s)
      graph::give_directive({f, s}, graph::Unscheduled{});
  }
}

ScheduleLog Pipeline::schedule_log() const { return graph::schedule_log(checked().outputs); }
void Pipeline::apply_schedule(const ScheduleLog& log) { graph::apply_log(log, checked().outputs); }

PipelineSpec Pipeline::spec() const {
  PipelineSpec result{checked().outputs[0]->name, contents_->outputs};
  for (const auto& [name, called] : contents_->externs) {
    if (called.pipeline().defined())
      result.pipelines[name] = std::make_shared<PipelineSpec>(called.pipeline().spec());
    else
      result.externs[name] = called.extern_c_function().address();
  }
  result.is_traced = contents_->is_traced;
  result.autoschedule = contents_->autoschedule;
  return result;
}

std::vector<Func> Pipeline::outputs() const {
  return ir::mapped(checked().outputs, [&](const graph::FuncPtr& f) { return Func(f); });
}

Func Pipeline::get_func(size_t index) const {
  const std::vector<graph::FuncPtr> order = graph::topological_order(checked().outputs);
  if (index >= order.size()) {
    user_error(text("take Func ", index, " of a Pipeline"), "Funcs are numbered from 0",
               text("it has ", order.size(), " Funcs"), "Give a smaller number");
  }
  return Func(order[index]);
}

JITHandlers& Pipeline::jit_handlers() { return checked().handlers; }

void Pipeline::set_externs(const std::map<std::string, JITExtern>& externs) {
  std::lock_guard lock(checked().mutex);
  contents_->externs = externs;
  contents_->compiled.reset();
}

void Pipeline::set_autoschedule_options(const AutoscheduleOptions& options) {
  std::lock_guard lock(checked().mutex);
  contents_->autoschedule = options;
  contents_->compiled.reset();
}

const std::map<std::string, JITExtern>& Pipeline::externs() const { return checked().externs; }

std::vector<Argument> Pipeline::infer_arguments() const {
  std::vector<Argument> result;
  for (const ParameterPtr& p : graph::parameters_of(checked().outputs)) {
    if (p->is_literal) continue;  // part of the program, not of its interface
    result.push_back(frontend::argument_of(*p));
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
    const PipelineSpec pipeline = spec();
    contents.stamp = Stamp::of(pipeline);
    contents.compiled = default_compiler().compile(pipeline, target);
    contents.target = target;
    frontend::tell_warnings(contents.outputs, target);
  }
  return contents.compiled;
}

void Pipeline::invalidate_cache() {
  std::lock_guard lock(checked().mutex);
  contents_->compiled.reset();
}

void Pipeline::trace_pipeline() {
  invalidate_cache();
  contents_->is_traced = true;
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
  for (const graph::FuncPtr& f : contents_->outputs) {
    if (static_cast<int>(sizes.size()) != f->dimensions()) {
      call_error(asked, "it takes one size for each dimension",
                 text(quoted(f->name), " has ", f->dimensions(), " dimensions and was given ",
                      sizes.size(), " sizes"),
                 "Give that many sizes, or buffers");
    }
    for (size_t d = 0; d < sizes.size(); d++) {
      if (sizes[d] >= 0) continue;
      call_error(asked, "sizes are not negative",
                 text("the size of dimension ", d, " is ", sizes[d]), "Give sizes of at least 0");
    }
    for (const Type& type : f->types) {
      frontend::check_sizes(to_halide_type(type), sizes, asked);
      Runtime::Buffer<> buffer(to_halide_type(type), nullptr, sizes);
      if (with_memory) frontend::allocate_host(buffer);
      result.push_back(Buffer<>(buffer));
    }
  }
  return result;
}

// The values of a Tuple are computed together at each point, so their buffers have one shape.
static void check_one_shape(const halide_buffer_t& first, const halide_buffer_t& other,
                            const graph::FuncContents& f, const std::string& asked) {
  for (int d = 0; d < f.dimensions(); d++) {
    const halide_dimension_t &a = first.dim[d], &b = other.dim[d];
    if (a.min == b.min && a.extent == b.extent) continue;
    const auto range = [](const halide_dimension_t& dim) {
      return text("[", dim.min, ", ", dim.min + dim.extent - 1, "]");
    };
    call_error(asked, "the buffers of one Func cover one region",
               text("in dimension ", d, " of ", quoted(f.name), " one covers ", range(a),
                    " and another ", range(b)),
               "Give buffers of one shape");
  }
}

std::vector<halide_buffer_t*> Pipeline::checked_outputs(const RealizationArg& requested,
                                                        bool with_memory) const {
  const std::string asked = "realize " + names_of(checked().outputs);
  const std::vector<halide_buffer_t*>& buffers = requested.buffers();
  size_t count = 0;
  for (const graph::FuncPtr& f : contents_->outputs) count += f->types.size();
  if (buffers.size() != count) {
    call_error(asked, "it takes one buffer for each value of each output",
               text("there are ", count, " and ", buffers.size(), " were given"),
               "Give that many buffers");
  }
  size_t i = 0;
  for (const graph::FuncPtr& f : contents_->outputs) {
    const halide_buffer_t* first = buffers[i];
    for (const ParameterPtr& value : f->outputs) {
      frontend::check_buffer(buffers[i], value->name, value->type, f->dimensions(), with_memory,
                             asked);
      check_one_shape(*first, *buffers[i++], *f, asked);
    }
  }
  return buffers;
}

// ---- the cost of a schedule ----

ScheduleReport Pipeline::explain_schedule(const Target& target, const std::vector<int32_t>& sizes,
                                          const ExplainOptions& options) const {
  std::vector<Buffer<>> buffers;
  if (!sizes.empty()) buffers = make_outputs(sizes, options.measure);
  const RealizationArg outputs(buffers);
  return retrograde::explain_schedule(
      spec(), outputs.buffers(), target.has_unknowns() ? get_jit_target_from_environment() : target,
      options, contents_->handlers);
}

ScheduleReport Pipeline::explain_schedule(const RealizationArg& outputs, const Target& target,
                                          const ExplainOptions& options) const {
  return retrograde::explain_schedule(
      spec(), checked_outputs(outputs, options.measure),
      target.has_unknowns() ? get_jit_target_from_environment() : target, options,
      contents_->handlers);
}

// ---- calling ----

void Pipeline::run(JITUserContext* context, const RealizationArg& requested, const Target& target,
                   const ParamMap& map) const {
  const JITHandlers& handlers = checked().handlers;
  std::vector<halide_buffer_t*> outputs;
  const auto check = [&] { outputs = checked_outputs(requested, true); };
  if (frontend::prepared(handlers, context, check) != 0) return;
  const auto code = compiled(target);
  const std::string asked = "realize " + names_of(contents_->outputs);
  std::optional<frontend::Arguments> arguments;
  const auto bind = [&] { arguments.emplace(*code, outputs, false, asked, map); };
  if (frontend::prepared(handlers, context, bind) != 0) return;
  frontend::call(*code, handlers, arguments->argv(), asked, context);
}

Realization Pipeline::run(JITUserContext* context, const std::vector<int32_t>& sizes,
                          const Target& target, const ParamMap& map) const {
  std::vector<Buffer<>> buffers = make_outputs(sizes, false);
  RealizationArg outputs(buffers);
  const auto code = compiled(target);
  const std::string asked = "realize " + names_of(contents_->outputs);
  const JITHandlers& handlers = contents_->handlers;
  std::optional<frontend::Arguments> arguments;
  const auto bind = [&] { arguments.emplace(*code, outputs.buffers(), false, asked, map); };
  const auto call = [&] {
    return frontend::call(*code, handlers, arguments->argv(), asked, context) == 0;
  };
  // With outputs that have no memory, the call is a query of their shape. Empty outputs need no query.
  const bool needs_no_query = std::find(sizes.begin(), sizes.end(), 0) != sizes.end() ||
                              contents_->target.has_feature(Target::NoBoundsQuery);
  const bool succeeds = frontend::prepared(handlers, context, bind) == 0 &&
                        (needs_no_query || ask_until_settled(outputs.buffers(), asked, call));
  for (Buffer<>& buffer : buffers) {
    enlarge_to(*buffer.get(), sizes, asked);
    frontend::allocate_host(*buffer.get());
  }
  if (succeeds) call();
  for (Buffer<>& buffer : buffers) buffer.copy_to_host();
  for (Buffer<>& buffer : buffers) crop_to(*buffer.get(), sizes);
  return Realization(std::move(buffers));
}

// The query also covers outputs without memory.
void Pipeline::infer(JITUserContext* context, const std::vector<halide_buffer_t*>& outputs,
                     const Target& target, const ParamMap& map) const {
  const auto code = compiled(target);
  const std::string asked = "infer the input bounds of " + names_of(contents_->outputs);
  std::optional<frontend::Arguments> bound;
  const auto bind = [&] { bound.emplace(*code, outputs, true, asked, map); };
  if (frontend::prepared(contents_->handlers, context, bind) != 0) return;
  frontend::Arguments& arguments = *bound;
  if (arguments.queries().empty()) return;
  std::vector<halide_buffer_t*> buffers = outputs;
  for (auto& query : arguments.queries()) buffers.push_back(query.buffer.raw_buffer());
  const bool succeeds = ask_until_settled(buffers, asked, [&] {
    return frontend::call(*code, contents_->handlers, arguments.argv(), asked, context) == 0;
  });
  if (!succeeds) return;
  for (auto& [parameter, buffer] : arguments.queries()) {
    frontend::check_buffer(buffer.raw_buffer(), parameter->name, parameter->type,
                           parameter->dimensions, false, asked);
    std::vector<int> extents;
    for (int d = 0; d < buffer.dimensions(); d++) extents.push_back(buffer.dim(d).extent());
    frontend::check_sizes(buffer.type(), extents, asked);
    frontend::allocate_host(buffer);
    if (const ParamMap::Entry* entry = map.find(parameter))
      entry->receive(Buffer<>(buffer));
    else
      ImageParam(parameter).set(Buffer<>(buffer));
  }
}

void Pipeline::infer(JITUserContext* context, const std::vector<int32_t>& sizes,
                     const Target& target, const ParamMap& map) const {
  std::vector<Buffer<>> buffers = make_outputs(sizes, false);
  infer(context, RealizationArg(buffers).buffers(), target, map);
}

void Pipeline::infer(JITUserContext* context, const RealizationArg& outputs, const Target& target,
                     const ParamMap& map) const {
  std::vector<halide_buffer_t*> shapes;
  const auto check = [&] { shapes = checked_outputs(outputs, false); };
  if (frontend::prepared(checked().handlers, context, check) == 0)
    infer(context, shapes, target, map);
}

}  // namespace retrograde
