// realize.cpp -- calls of pipelines: allocates and checks output buffers, runs bounds queries.
#include <algorithm>
#include <optional>

#include "frontend/run/call.h"
#include "frontend/run/pipeline_contents.h"

namespace retrograde {

namespace {

using ParameterPtr = std::shared_ptr<graph::ParameterContents>;

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

// ---- arguments for outputs ----

RealizationArg::RealizationArg(Realization& realization) {
  for (size_t i = 0; i < realization.size(); i++) owners_.push_back(realization[i]);
  for (Buffer<>& buffer : owners_) raw_.push_back(buffer.raw_buffer());
}

RealizationArg::RealizationArg(std::vector<Buffer<>> buffers) : owners_(std::move(buffers)) {
  for (Buffer<>& buffer : owners_) raw_.push_back(buffer.defined() ? buffer.raw_buffer() : nullptr);
}

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

// ---- calls ----

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
